"""Refusals of damaged files say what is wrong in our words: none repeats what a library said."""

import json
import tomllib
from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np
import pytest

from footfall.core.errors import FootFallError
from footfall.core.misread import Unreadable, place_of
from footfall.core.strict_json import NotStrict, read_json
from footfall.io import artifacts, bundles
from footfall.io.image_files import decode_image
from footfall.io.imports import from_csv, from_json, from_ros2
from footfall.io.pair_files import read_calibrated_pair
from footfall.io.recordings.reading import Recording
from footfall.io.robot_files import read_description
from footfall.io.terrain_files import decode_terrain, encode_terrain
from footfall.io.urdf.proposed import read_proposed
from footfall.io.urdf.safe_xml import parse
from footfall.terrain.generate import plane
from tests.support.zips import zipped

FLAT = plane(size=2.0, resolution=0.25)


def cut(content: bytes) -> bytes:
    return content[: len(content) * 2 // 3]


def scrambled(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes(255 - byte for byte in content[middle : middle + 40]) + content[middle + 40 :]


def by_path(read: Callable, name: str) -> Callable[[bytes, object], object]:
    def reads(content, folder):
        (folder / name).write_bytes(content)
        return read(folder / name)

    return reads


def terrain(ending: str) -> Callable[[bytes, object], object]:
    return lambda content, _: decode_terrain(content, f"a.{ending}")


TEXTS = (b'{"a": 1,\n "b": }', b"[1, 2", b'"\xff"', b"[" * 300_000)
QUAD = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 three 4\n"
SESSION = {"session.json": b'{"format": ', "events.jsonl": b""}
CUT = ("tif", "npz", "stl", "ply")
LONG = {"session.json": bytes(range(256)) * 9, "events.jsonl": b""}
CASES = {
    **{f"commands as JSON {i}": (lambda c, _: from_json.decode(c), text) for i, text in enumerate(TEXTS)},
    **{f"a pair's calibration {i}": (lambda c, d: pair(c, d), text) for i, text in enumerate(TEXTS)},
    "commands as CSV": (lambda c, _: from_csv.decode(c), b'row,"a"b\n'),
    "commands as nothing": (lambda c, _: from_csv.decode(c), b""),
    "commands as MCAP": (lambda c, _: from_ros2.decode(c), b"\x89MCAP0\r\n" + bytes(100)),
    "a session that is no zip": (lambda c, _: bundles.read_bundle(c), b"PK\x03\x04 no zip"),
    "a session that is no JSON": (lambda c, _: bundles.read_bundle(c), zipped(**SESSION)),
    "a session that is damaged": (lambda c, _: bundles.read_bundle(c), scrambled(zipped(**LONG))),
    "a robot": (by_path(read_description, "a.toml"), b"[a]\nb = = 1\n"),
    "a robot in Latin": (by_path(read_description, "a.toml"), b"a = '\xe4'\n"),
    "a robot of others": (by_path(read_proposed, "robot.toml"), b"[a]\nb = = 1\n"),
    "a URDF": (lambda c, _: parse(c, "a.urdf"), b"<robot><link></robot>"),
    "an artifact": (lambda c, _: artifacts.decode(c), cut(artifacts.encode(FLAT))),
    "a recording": (by_path(Recording, "a.mcap"), b"\x89MCAP0\r\n" + bytes(200)),
    "an image": (lambda c, _: decode_image(c), b"\x89PNG\r\n\x1a\n" + bytes(50)),
    "a mesh with a word": (terrain("obj"), QUAD),
    "a mesh without its end": (terrain("off"), b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 x\n0 1 0\n4 0 1 2 3\n"),
    **{
        f"a cut {kind}": (terrain(kind), cut(encode_terrain(FLAT, f".{kind}"))) for kind in ("tif", "npz", "stl", "ply")
    },
    **{f"a scrambled {kind}": (terrain(kind), scrambled(encode_terrain(FLAT, f".{kind}"))) for kind in ("npz", "off")},
}


def pair(content, folder):
    (folder / "c.json").write_bytes(content)
    return read_calibrated_pair(folder / "l.png", folder / "r.png", folder / "c.json")


@pytest.mark.parametrize("what", CASES)
def test_no_refusal_repeats_a_library(what, tmp_path):
    read, content = CASES[what]
    with pytest.raises(FootFallError) as refused:
        read(content, tmp_path)
    cause = refused.value.__cause__
    while cause is not None:
        if not isinstance(cause, (FootFallError, NotStrict, Unreadable)):
            said = [part for part in (str(cause), *map(str, cause.args)) if len(part) > 3]
            assert not [part for part in said if part in refused.value.message], refused.value.message
            assert type(cause).__name__ not in refused.value.message
        cause = cause.__cause__


@pytest.mark.parametrize(
    ("read", "content", "told"),
    [
        (json.loads, '{"a": 1,\n  "b": }', ", at line 2, column 8"),
        (read_json, '{"a": 1, "a": 2}', ": the member 'a' is given twice"),
        (lambda b: b.decode(), b"ab\xff", ": byte 2, in line 1, is not of UTF-8; save it as UTF-8"),
        (ElementTree.fromstring, b"<a>\n <b></a>", ", at line 2, column 7"),
        (tomllib.loads, "a = 1\nb = = 2\n", ", at line 2, column 5"),
        (lambda t: np.array([float(t)]), "x", ""),
    ],
)
def test_where_it_was_is_told(read, content, told):
    with pytest.raises(ValueError if not told.endswith("7") else SyntaxError) as raised:
        read(content)
    assert place_of(raised.value) == told
