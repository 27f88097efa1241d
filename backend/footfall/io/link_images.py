"""Images on the rover link: one binary frame, which is a header and the PNG files it announces.

::

    4 bytes   length of the header, big-endian
    header    UTF-8 JSON: {"type": "images", "id", "state", "pairs": [{"name", "time", "T_site_base",
              "camera_left", "camera_right", "left_bytes", "right_bytes"}]}
    PNGs      left and right of each pair in order, grey, 8 bit
"""

import io
import json
import struct
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from footfall.core.errors import InvalidImages, InvalidInput, InvalidTelemetry
from footfall.telemetry.fields import Fields, parse_object
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.link import MAX_BINARY_FRAME, camera_from, camera_object, state_from, state_object

MAX_HEADER = 1 << 20
"""Longest header [bytes]."""

_LENGTH = struct.Struct(">I")


def encode_images(request_id: str, snapshot: Snapshot) -> bytes:
    """One binary frame. request_id: of the image request that it answers."""
    files: list[bytes] = []
    pairs: list[dict[str, Any]] = []
    for pair in snapshot.pairs:
        left, right = _png(pair.left), _png(pair.right)
        files += [left, right]
        pairs.append(
            {
                "name": pair.name,
                "time": pair.time,
                "T_site_base": pair.T_site_base.tolist(),
                "camera_left": camera_object(pair.camera_left),
                "camera_right": camera_object(pair.camera_right),
                "left_bytes": len(left),
                "right_bytes": len(right),
            }
        )
    body = {"type": "images", "id": request_id, "state": state_object(snapshot.state), "pairs": pairs}
    header = json.dumps(body, allow_nan=False).encode()
    return b"".join([_LENGTH.pack(len(header)), header, *files])


def decode_images(frame: bytes, legs: int | None = None) -> tuple[str, Snapshot]:
    """Request id and snapshot of a binary frame. Raises InvalidTelemetry or InvalidImages saying what is wrong."""
    if len(frame) > MAX_BINARY_FRAME:
        raise InvalidTelemetry(f"a binary frame has at most {MAX_BINARY_FRAME} bytes", bytes=len(frame))
    if len(frame) < _LENGTH.size:
        raise InvalidTelemetry("a binary frame begins with the length of its header in 4 bytes", bytes=len(frame))
    (length,) = _LENGTH.unpack_from(frame)
    if length > min(MAX_HEADER, len(frame) - _LENGTH.size):
        raise InvalidTelemetry("the header is longer than its frame, or than 1 MiB", header=length, bytes=len(frame))
    start = _LENGTH.size + length
    fields = Fields(parse_object(frame[_LENGTH.size : start]), "images")
    fields.choice("type", ("images",))
    request_id = fields.identifier()
    state = state_from(fields.object("state"), legs)
    bodies = fields.objects("pairs")
    fields.end()
    pairs = []
    for body in bodies:
        pair, start = _pair(Fields(body, "image pair"), frame, start)
        pairs.append(pair)
    if start != len(frame):
        raise InvalidTelemetry(f"{len(frame) - start} bytes follow the last image of the frame")
    return request_id, Snapshot(state, tuple(pairs))


def _pair(fields: Fields, frame: bytes, start: int) -> tuple[ImagePair, int]:
    name = fields.text("name", longest=64)
    camera_left, camera_right = camera_from(fields.object("camera_left")), camera_from(fields.object("camera_right"))
    time, T_site_base = fields.number("time"), fields.array("T_site_base", (4, 4))
    middle = start + fields.whole("left_bytes", least=1)
    end = middle + fields.whole("right_bytes", least=1)
    fields.end()
    if end > len(frame):
        raise InvalidTelemetry(f"the images of pair {name} are cut short", announced=end, bytes=len(frame))
    try:
        return ImagePair(
            name=name,
            time=time,
            left=_pixels(frame[start:middle], camera_left),
            right=_pixels(frame[middle:end], camera_right),
            camera_left=camera_left,
            camera_right=camera_right,
            T_site_base=T_site_base,
        ), end
    except InvalidImages:
        raise
    except InvalidInput as err:
        raise InvalidImages(f"pair {name}: {err.message}", **err.details) from err


def _png(image: NDArray[np.uint8]) -> bytes:
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", compress_level=1)
    return out.getvalue()


def _pixels(png: bytes, camera: Camera) -> NDArray[np.uint8]:
    try:
        # the size is looked at before any pixel is unpacked, so a bomb stays packed
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(png), formats=("PNG",))
        if image.mode != "L" or image.size != (camera.width, camera.height):
            raise InvalidImages(
                f"{camera.name}: the image is {image.mode} {image.size}, "
                f"its camera wants 8-bit grey {(camera.width, camera.height)}"
            )
        return np.asarray(image)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombWarning, Image.DecompressionBombError) as err:
        raise InvalidImages(f"{camera.name}: this is no readable PNG image: {err}", bytes=len(png)) from err
