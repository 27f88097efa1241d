from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.io.calibration_files import read_calibration
from footfall.io.image_files import LEVEL_FORWARD
from footfall.io.pair_files import read_calibrated_pair
from footfall.io.plain_yaml import parse_yaml

OWN = """\
format: footfall-calibration
version: 1
pairs:
  front:                    # by the door
    left:
      image_size: [640, 480]
      intrinsics: [554.3, 554.1, 319.2, 240.7]
      model: plumb_bob
      distortion: [-0.25, 0.08, 0.001,
                   -0.0008, 0.0]
      T_base_camera: [[0, 0, 1, 1.25], [-1, 0, 0, 0.1], [0, -1, 0, -0.15], [0, 0, 0, 1]]
    right:
      image_size: [640, 480]
      intrinsics: [555, 554.8, 318, 239.9]
      model: plumb_bob
      distortion: [-0.24, 0.07, 0, 0]
      T_left_camera: [[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_own_format(tmp_path):
    (pair,) = read_calibration(write(tmp_path, "cal.yaml", OWN))
    assert pair.name == "front"
    assert (pair.left.width, pair.left.height, pair.left.cy, pair.right.fx) == (640, 480, 240.7, 555.0)
    assert pair.left.distortion.tolist() == [-0.25, 0.08, 0.001, -0.0008, 0.0]
    assert np.allclose(pair.left.T_base_camera[:3, 3], [1.25, 0.1, -0.15])
    assert np.allclose(pair.right.T_base_camera[:3, 3], [1.25, -0.1, -0.15])
    assert np.allclose(pair.T_left_right[:3, 3], [0.2, 0, 0])


def test_the_documented_example_can_be_read(tmp_path):
    page = (Path(__file__).resolve().parents[2] / "docs" / "calibration.md").read_text()
    (pair,) = read_calibration(write(tmp_path, "cal.yaml", page.split("```yaml\n")[1].split("```")[0]))
    assert pair.left.model == "plumb_bob"


def test_without_a_pose_the_left_camera_looks_ahead(tmp_path):
    text = "\n".join(line for line in OWN.splitlines() if "T_base_camera" not in line)
    (pair,) = read_calibration(write(tmp_path, "cal.yaml", text))
    assert np.array_equal(pair.left.T_base_camera, LEVEL_FORWARD)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("version: 1", "version: 9", "version: 1"),
        ("format: footfall-calibration", "kind: x", "format"),
        ("model: plumb_bob", "model: pinhole7", "pair front, left.*pinhole7"),
        ("image_size: [640, 480]", "image_size: [640]", "left.*image_size"),
        ("image_size: [640, 480]", "image_size: [320, 240]", "pair front: the cameras have different sizes"),
        ("image_size: [640, 480]", "image_size: [640, -480]", "whole number above zero"),
        ("554.3, 554.1", ".nan, 554.1", "intrinsics.*not finite"),
        ("554.3, 554.1", "-554.3, 554.1", "focal lengths above zero"),
        ("554.3, 554.1,", "554.3,", "needs 4 numbers, not 3"),
        ("distortion: [-0.24, 0.07, 0, 0]", "distortion: [1, 2, 3]", "right.*4 or 5 coefficients"),
        ("distortion: [-0.24, 0.07, 0, 0]", "distortion: [a, 2, 3, 4]", "list of numbers"),
        ("[1, 0, 0, 0.2]", "[1, 0, 0, 0.0]", "front.*baseline"),
        ("[1, 0, 0, 0.2]", "[1, 0, 0, -0.2]", "front.*baseline"),
        ("[1, 0, 0, 0.2]", "[1, 0, 0, 200]", r"front, right: T_left_camera .*200 m.*millimetres \(0.2 m\)"),
        ("[1, 0, 0, 0.2]", "[2, 0, 0, 0.2]", "right: T_left_camera is no rotation"),
        ("[0, 0, 1, 0], [0, 0, 0, 1]]", "[0, 0, 1, 0], [0, 0, 1, 1]]", "last row"),
        ("T_left_camera", "T_camera", "T_camera is unknown"),
        ("    right:", "    rigth:", "rigth is unknown"),
        ("intrinsics: [555", "intrinsic: [555", "intrinsic is unknown"),
    ],
)
def test_wrong_files_are_refused_by_name(tmp_path, old, new, says):
    assert old in OWN
    with pytest.raises(InvalidImages, match=says) as caught:
        read_calibration(write(tmp_path, "cal.yaml", OWN.replace(old, new, 1)))
    assert "cal.yaml" in str(caught.value) or "front" in str(caught.value)


def test_a_missing_camera_is_named(tmp_path):
    with pytest.raises(InvalidImages, match="pair front: the calibration of the right camera is missing"):
        read_calibration(write(tmp_path, "cal.yaml", OWN.split("    right:")[0]))


def test_unreadable_files(tmp_path):
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x01")
    for name, says in (("none.yaml", "no calibration file"), ("binary.yaml", "no text file")):
        with pytest.raises(InvalidImages, match=says):
            read_calibration(tmp_path / name)
    with pytest.raises(InvalidImages, match="larger than 1 MiB"):
        read_calibration(write(tmp_path, "large.yaml", "#" * (1 << 21)))


@pytest.mark.parametrize(
    ("members", "says"),
    [
        ('"baseline": 193.0', r"pair.json: baseline makes the baseline 193 m.*millimetres \(0.193 m\)"),
        ('"baseline": 0.193, "baseline": 0.2', "'baseline' is given twice"),
    ],
)
def test_a_json_calibration_is_in_metres_and_says_things_once(tmp_path, members, says):
    text = '{"focal_length": 900, "cx": 310, "cy": 250, ' + members + "}"
    with pytest.raises(InvalidImages, match=says):
        read_calibrated_pair("l.png", "r.png", write(tmp_path, "pair.json", text))


# --- the part of YAML that is read


def test_plain_yaml():
    text = """\
a: 1
b:
  c: [1, [2.5, -3e-2], "x, y", z w]  # no
  "d e": '# yes'
  f:
  - 1
  - two
g: true
h:
i: -.inf
"""
    assert parse_yaml(text) == {
        "a": 1,
        "b": {"c": [1, [2.5, -0.03], "x, y", "z w"], "d e": "# yes", "f": [1, "two"]},
        "g": True,
        "h": None,
        "i": float("-inf"),
    }


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a: &x 1", 1),
        ("a: {b: 1}", 1),
        ("a: !!tag 1", 1),
        ("a: |\n  text", 1),
        ("a: 1\na: 2", 2),
        ("a: 1\n   b: 2", 2),
        ("a:\n  b: 1\n c: 2", 3),
        ("a: [1, 2", 1),
        ("a: [1, 2]]", 1),
        ("a:\n\tb: 1", 2),
        ("a:\n  - b: 1", 2),
        ("just text", 1),
        ("a: 1\n---\nb: 2", 2),
        ('a: "x', 1),
        ("a: [1] 2", 1),
    ],
)
def test_other_yaml_is_refused_with_its_line(text, line):
    with pytest.raises(InvalidInput) as caught:
        parse_yaml(text)
    assert caught.value.details["line"] == line


def test_empty_text_is_refused():
    with pytest.raises(InvalidInput, match="empty"):
        parse_yaml("# nothing\n---\n")


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text):
    with suppress(InvalidInput):
        assert isinstance(parse_yaml(text), dict)


@given(
    st.dictionaries(
        st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True),
        st.one_of(st.integers(), st.floats(allow_nan=False, allow_infinity=False), st.booleans()),
        min_size=1,
    )
)
def test_numbers_come_back(mapping):
    text = "\n".join(f"{k}: {str(v).lower()}" for k, v in mapping.items())
    assert parse_yaml(text) == mapping
