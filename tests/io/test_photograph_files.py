"""Folders of photographed pairs: what is read, what is left out by its name, what is refused."""

from pathlib import Path

import numpy as np
import pytest

from footfall.core.errors import InvalidImages
from footfall.io.artifacts import decode, encode
from footfall.io.image_files import write_png
from footfall.io.photograph_files import MAX_PAIRS, pair_and_side, read_photographs
from footfall.telemetry.photographs import Photographs

CAMERA = """\
      image_size: [32, 24]
      intrinsics: [30, 30, 15.5, 11.5]
      model: none
"""
RIGHT = CAMERA + "      T_left_camera: [[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"


def rig(*names: str, right: str = RIGHT) -> str:
    blocks = "".join(f"  {name}:\n    left:\n{CAMERA}    right:\n{right}" for name in names)
    return f"format: footfall-calibration\nversion: 1\npairs:\n{blocks}"


@pytest.fixture
def folder(tmp_path, rng) -> Path:
    (tmp_path / "images").mkdir()
    for name in ("front", "rear"):
        for side in ("left", "right"):
            write_png(rng.integers(0, 255, (24, 32), np.uint8), tmp_path / "images" / f"{name}_{side}.png")
    (tmp_path / "cal.yaml").write_text(rig("front", "rear"))
    (tmp_path / "images" / "notes.txt").write_text("not an image")
    (tmp_path / "images" / "panorama.png").write_bytes(b"not of a pair")
    return tmp_path


def about(folder: Path, body: str) -> None:
    text = f"format: footfall-pairs\nversion: 1\npairs:\n{body}"
    (folder / "images" / "pairs.yaml").write_text(text)


def read(folder: Path, **more) -> Photographs:
    return read_photographs(folder / "images", [folder / "cal.yaml"], **more)


def test_pairs_are_read_with_their_calibrations(folder):
    found = read(folder)
    assert [pair.name for pair in found.pairs] == ["front", "rear"]
    assert not found.left_out
    assert [pair.calibration.name for pair in found.pairs] == ["front", "rear"]
    assert np.array_equal(found.pairs[0].T_site_base, np.eye(4))
    assert decode(encode(found)).digest == found.digest
    assert [pair.name for pair in read(folder, names=["rear"]).pairs] == ["rear"]


def test_pairs_yaml_says_when_and_where(folder):
    about(
        folder,
        "  front:\n    time: 12.5\n    time_right: 12.51\n"
        "    T_site_base: [[0, -1, 0, 2], [1, 0, 0, 3], [0, 0, 1, 0.5], [0, 0, 0, 1]]\n"
        "  rear:\n    calibration: front\n",
    )
    front, rear = read(folder).pairs
    assert (front.time, front.time_right) == (12.5, 12.51)
    assert np.allclose(front.T_site_base[:3, 3], [2, 3, 0.5])
    assert (rear.time, rear.time_right, rear.calibration.name) == (0.0, None, "front")


def test_one_calibration_serves_all_pairs_that_say_where_they_are(folder):
    (folder / "cal.yaml").write_text(rig("rig"))
    with pytest.raises(InvalidImages, match=r"front and rear were taken by the same cameras, rig: say in pairs\.yaml"):
        read(folder)
    about(folder, "  rear:\n    T_site_base: [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n")
    assert [pair.calibration.name for pair in read(folder).pairs] == ["rig", "rig"]


def lose_right(folder: Path) -> None:
    (folder / "images" / "rear_right.png").unlink()


def double_left(folder: Path) -> None:
    (folder / "images" / "rear_left.jpg").write_bytes(b"")


def damage(folder: Path) -> None:
    path = folder / "images" / "rear_left.png"
    path.write_bytes(path.read_bytes()[:60])


def only_the_other_calibration(folder: Path) -> None:
    (folder / "cal.yaml").write_text(rig("front"))


def of_a_kind_that_is_not_read(folder: Path) -> None:
    path = folder / "images" / "rear_left.png"
    path.rename(path.with_suffix(".bmp"))


def no_calibration(folder: Path) -> None:
    (folder / "cal.yaml").write_text(rig("front", "side"))


def bad_calibration(folder: Path) -> None:
    text = rig("front", "rear")
    (folder / "cal.yaml").write_text(text[: text.rindex("0.2")] + ".nan" + text[text.rindex("0.2") + 3 :])


def behind(folder: Path) -> None:
    text = rig("front", "rear")
    (folder / "cal.yaml").write_text(text[: text.rindex("0.2")] + "-0.2" + text[text.rindex("0.2") + 3 :])


def nan_pose(folder: Path) -> None:
    about(folder, "  rear:\n    T_site_base: [[1, 0, 0, nan], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n")


def nan_time(folder: Path) -> None:
    about(folder, "  rear:\n    time: nan\n")


def wrong_rig(folder: Path) -> None:
    about(folder, "  rear:\n    calibration: rear2\n")


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lose_right, "the right image is missing (rear_right.png)"),
        (double_left, "the left image is there twice (rear_left.jpg, rear_left.png)"),
        (damage, "rear_left.png is damaged"),
        (of_a_kind_that_is_not_read, "rear_left.bmp is no image file that FootFall reads (.png"),
        (only_the_other_calibration, "there is no calibration rear, and pairs.yaml does not say where"),
        (no_calibration, "there is no calibration rear; there are front, side"),
        (bad_calibration, "cal.yaml, pair rear, right: T_left_camera has a number that is not finite"),
        (behind, "baseline must be above zero"),
        (nan_pose, "pairs.yaml: T_site_base has a number that is not finite"),
        (nan_time, "pairs.yaml: time has a number that is not finite"),
        (wrong_rig, "there is no calibration rear2"),
    ],
)
def test_one_bad_pair_is_left_out_by_its_name(folder, spoil, says):
    spoil(folder)
    found = read(folder)
    assert [pair.name for pair in found.pairs] == ["front"]
    assert list(found.left_out) == ["rear"]
    assert found.left_out["rear"].startswith("pair rear: ")
    assert says in found.left_out["rear"]


def test_what_can_not_be_read_at_all_is_refused(folder, tmp_path):
    with pytest.raises(InvalidImages, match="there is no folder"):
        read_photographs(tmp_path / "none", [folder / "cal.yaml"])
    with pytest.raises(InvalidImages, match="no calibration file"):
        read_photographs(folder / "images", [folder / "none.yaml"])
    with pytest.raises(InvalidImages, match="needs one calibration file"):
        read_photographs(folder / "images", [])
    with pytest.raises(InvalidImages, match="there is no pair side in images; there are front, rear"):
        read(folder, names=["side"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidImages, match=r"NAME_left\.png"):
        read_photographs(tmp_path / "empty", [folder / "cal.yaml"])
    lose_right(folder)
    with pytest.raises(InvalidImages, match="no image pair can be used: pair rear: the right image is missing"):
        read(folder, names=["rear"])
    for name in range(MAX_PAIRS + 1):
        (folder / "images" / f"n{name}_left.png").write_bytes(b"")
    with pytest.raises(InvalidImages, match="more than 64"):
        read(folder)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("version: 1\npairs:\n  front:\n    time: 1\n", "format: footfall-pairs"),
        ("format: footfall-pairs\nversion: 1\npairs: [1]\n", "pairs"),
        ("format: footfall-pairs\nversion: 1\nwhere: 3\npairs:\n  front:\n    time: 1\n", "where is unknown"),
        ("{", "pairs.yaml"),
    ],
)
def test_a_pairs_file_that_makes_no_sense_is_refused(folder, text, says):
    (folder / "images" / "pairs.yaml").write_text(text)
    with pytest.raises(InvalidImages, match=says):
        read(folder)


def test_names_of_files():
    assert pair_and_side("front_left.png") == ("front", "left")
    assert pair_and_side("a_b_right.JPG") == ("a_b", "right")
    assert pair_and_side("IMG 1_LEFT.PNG") == ("IMG 1", "left")
    assert pair_and_side("火星_Right.png") == ("火星", "right")
    for name in ("left.png", "_left.png", "front_top.png", "front_left.txt", "front_left", ""):
        assert pair_and_side(name) is None
