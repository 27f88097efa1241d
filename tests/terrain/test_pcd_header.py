"""PCD files as programs of others write them: their points are those of the file, whatever stands in its header."""

import io

import numpy as np
import pytest
from pypcd4.pypcd4 import Encoding, PointCloud

from footfall.core.errors import InvalidTerrain
from footfall.io.scan_files import read_scan
from footfall.io.scan_terrain import terrain_from_scan

COUNT = 40
POINTS = np.round(np.random.default_rng(5).uniform(1.0, 9.0, (COUNT, 3)), 3)
FAR = POINTS * [1.0, 1.0, 0.001] + [500_000.0, 5_180_000.0, 0.0]


def pcd(fields, kind="binary", points=POINTS, left_out=(), version="0.7"):
    """A PCD with those fields, each one number of 32 bits unless it is "name:size:type:count"."""
    said = [(field.split(":") + ["4", "F", "1"][field.count(":") :])[:4] for field in fields]
    names, sizes, kinds, counts = zip(*said, strict=True)
    formats = {"F": "f", "U": "u", "I": "i"}
    row = np.dtype([(str(i), f"<{formats[k]}{s}", (int(c),)) for i, (_, s, k, c) in enumerate(said)])
    rows = np.zeros(COUNT, row)
    for i, name in enumerate(names):
        rows[str(i)] = points[:, "xyz".index(name)][:, None] if name in ("x", "y", "z") else i
    head = {
        "VERSION": version,
        "FIELDS": " ".join(names),
        "SIZE": " ".join(sizes),
        "TYPE": " ".join(kinds),
        "COUNT": " ".join(counts),
        "WIDTH": str(COUNT),
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(COUNT),
        "DATA": kind,
    }
    header = "".join(f"{key} {said}\n" for key, said in head.items() if key not in left_out).encode()
    if kind == "binary":
        return header + rows.tobytes()
    text = [" ".join(f"{number:.9g}" for field in row for number in field) for row in rows]
    return header + ("\n".join(text) + "\n").encode()


XYZ = ("x", "y", "z")
HEADERS = {
    "what the reader writes": {"fields": XYZ},
    "time first": {"fields": ("t:8", *XYZ)},
    "brackets in a name": {"fields": ("Roughness_(0.25)", *XYZ, "i")},
    "other signs in a name": {"fields": ("C2C[<0.5]", "a/b", "scan:1:U:1".replace(":1:U", "#2:1:U"), *XYZ)},
    "two fields of one name": {"fields": ("i", *XYZ, "i")},
    "padding": {"fields": ("_:1:U:3", "z", "_:1:U:5", "y", "x")},
    "several numbers of a field": {"fields": ("normal:4:F:3", *XYZ)},
    "no COUNT": {"fields": XYZ, "left_out": ("COUNT",)},
    "no POINTS": {"fields": XYZ, "left_out": ("POINTS",)},
    "no VIEWPOINT, version 0.6": {"fields": XYZ, "left_out": ("VIEWPOINT",), "version": ".6"},
}


@pytest.mark.parametrize("kind", ["binary", "ascii"])
@pytest.mark.parametrize("name", HEADERS)
def test_points_are_those_of_the_file_whatever_its_header_says_of_others(name, kind):
    """Names in brackets were cut off there: binary points came out shifted, and were ground."""
    np.testing.assert_allclose(read_scan(pcd(**HEADERS[name], kind=kind), "a.pcd").points, POINTS, atol=1e-6)


def test_points_that_are_packed_are_those_of_the_file_too():
    cloud = PointCloud.from_points(
        [np.arange(COUNT), *POINTS.T], ("i", *XYZ), (np.uint16, np.float32, np.float32, np.float32)
    )
    held = io.BytesIO()
    cloud.save(held, encoding=Encoding.BINARY_COMPRESSED)
    content = held.getvalue().replace(b"FIELDS i x", b"FIELDS Scalar_field_(2) x")
    np.testing.assert_allclose(read_scan(content, "a.pcd").points, POINTS, atol=1e-6)


@pytest.mark.parametrize("blanks", ["\t", "  ", " \r\n"])
def test_text_is_read_however_its_numbers_are_parted(blanks):
    content = pcd(XYZ, kind="ascii")
    head, marker, body = content.partition(b"DATA ascii\n")
    body = body.replace(b"\n", b" \r\n") if "\n" in blanks else body.replace(b" ", blanks.encode())
    np.testing.assert_allclose(read_scan(head + marker + body, "a.pcd").points, POINTS, atol=1e-6)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (pcd(XYZ).replace(b"SIZE 4 4 4", b"SIZE 4 4"), "has 3 FIELDS, 2 SIZE, 3 TYPE and 3 COUNT"),
        (pcd((*XYZ, "x")), "has x more than once"),
        (pcd(("x:4:F:2", "y", "z")), "has x more than once"),
        (pcd(("a", "b", "z")), "has no field x, y; it has a, b, z"),
        (pcd(XYZ).replace(b"DATA binary\n", b"binary\n"), "no line DATA"),
        (pcd(XYZ, left_out=("POINTS", "WIDTH")), "needs a line WIDTH with a whole number"),
    ],
)
def test_headers_that_say_too_little_are_named(content, words):
    with pytest.raises(InvalidTerrain, match=words):
        read_scan(content, "a.pcd")


@pytest.mark.parametrize("fields", [("t:8", *XYZ), ("x", "y", "z", "t:8"), ("t:8:U", "z:8", "y", "x:8")])
def test_numbers_of_32_bit_far_away_are_refused_in_any_order_of_fields(fields):
    """The size of the first field was taken for that of x, y and z."""
    with pytest.raises(InvalidTerrain, match="seven digits"):
        terrain_from_scan(pcd(fields, points=FAR), "a.pcd", unit="m", up="z")
    doubles = pcd([*(f"{axis}:8" for axis in XYZ), "i"], points=FAR)
    assert terrain_from_scan(doubles, "a.pcd", unit="m", up="z").remembers


def test_doubles_behind_a_small_number_are_doubles():
    assert terrain_from_scan(pcd(["i", *(f"{a}:8" for a in XYZ)], points=FAR), "a.pcd", unit="m", up="z").remembers
