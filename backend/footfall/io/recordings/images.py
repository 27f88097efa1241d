"""The binary frame of images on the rover link (:mod:`footfall.io.link_images`), taken apart and put together."""

import json
import struct

from footfall.core.errors import InvalidInput

_LENGTH = struct.Struct(">I")


def split_images(frame: bytes) -> tuple[bytes, list[bytes]]:
    """Header and PNG files, left and right of each pair in order, of a frame that ``encode_images`` made."""
    (length,) = _LENGTH.unpack_from(frame)
    at = _LENGTH.size + length
    header = frame[_LENGTH.size : at]
    files: list[bytes] = []
    for size in _sizes(header):
        files.append(frame[at : at + size])
        at += size
    return header, files


def join_images(header: bytes, files: list[bytes]) -> bytes:
    """Inverse of :func:`split_images`. Raises InvalidInput where the files are not those of the header."""
    if _sizes(header) != [len(file) for file in files]:
        raise InvalidInput("recorded images do not fit their header", files=len(files))
    return b"".join([_LENGTH.pack(len(header)), header, *files])


def _sizes(header: bytes) -> list[int]:
    pairs = json.loads(header)["pairs"]
    return [pair[side] for pair in pairs for side in ("left_bytes", "right_bytes")]
