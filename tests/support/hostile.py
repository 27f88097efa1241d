"""Files made to harm a reader: small ones that claim, or unpack to, far more than they hold."""

import io
import struct
import zipfile
import zlib

import numpy as np

ALIASES = b"a: &a [1, 1]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n"
DEEP = 100_000


def png_that_claims(width: int, height: int, content: bytes = b"") -> bytes:
    """A grey PNG whose header promises width × height pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(content, 9)) + chunk(b"IEND", b"")
    )


def tiff_that_claims(width: int, height: int) -> bytes:
    """A one-band float32 TIFF of a few bytes whose header promises width × height pixels, one metre each."""
    scale, tie = struct.pack("<3d", 1.0, 1.0, 0.0), struct.pack("<6d", 0, 0, 0, 0, 0, 0)
    after = 8 + 2 + 12 * 12 + 4
    tags = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 32),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 8),
        (277, 3, 1, 1),
        (278, 4, 1, height),
        (279, 4, 1, 16),
        (339, 3, 1, 3),
        (33550, 12, 3, after),
        (33922, 12, 6, after + len(scale)),
    ]
    entries = b"".join(struct.pack("<HHII", *tag) for tag in tags)
    return b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(tags)) + entries + bytes(4) + scale + tie


def npz_of_objects() -> bytes:
    """A terrain whose heights are pickled Python objects."""
    out = io.BytesIO()
    np.savez(out, heights=np.array([[object]], dtype=object), resolution=0.1, x0=0.0, y0=0.0, allow_pickle=True)
    return out.getvalue()


def npz_that_claims(rows: int, cols: int) -> bytes:
    """A terrain whose array header promises rows × cols heights."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (rows, cols)})
    return zip_of({"heights.npy": header.getvalue()})


def zip_of(files: dict[str, bytes], compressed: bool = True) -> bytes:
    """A zip of these files."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def zip_with(entries: list[tuple[zipfile.ZipInfo | str, bytes]]) -> bytes:
    """A zip of entries as they are: twice the same name, links."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, content in entries:
            archive.writestr(entry, content)
    return out.getvalue()


def link(name: str) -> zipfile.ZipInfo:
    """An entry that unpacks to a symbolic link."""
    entry = zipfile.ZipInfo(name)
    entry.create_system = 3
    entry.external_attr = 0o120777 << 16
    return entry
