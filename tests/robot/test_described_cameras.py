"""The stereo cameras of a robot.toml: where they look, and what is refused by name."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply, inverse
from footfall.io.any_robot import load_legged
from footfall.io.artifacts import decode, encode
from footfall.robot.legged.legged_model import DescribedRobot
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.telemetry.projection import in_image
from tests.support.command_line import run
from tests.support.urdf import replaced, written
from tests.support.walkers import ring

PAIR = """
[[cameras]]
name = "front"
link = "base"
position = [0.2, 0.0, 0.05]
rpy = [0.0, 0.5, 0.0]
width = 64
height = 48
fov_deg = 90.0
baseline = 0.08
"""
MAST = """
<link name="mast"/><joint name="pan" type="revolute"><parent link="base"/><child link="mast"/>
<origin xyz="0.1 0 0.3" rpy="0 0 1.57079632679"/><axis xyz="0 0 1"/>
<limit lower="0.2" upper="0.6" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture(scope="module")
def proposed(tmp_path_factory):
    """The folder of a robot with four legs and a mast that turns, and the text that is proposed for it."""
    folder = tmp_path_factory.mktemp("ring")
    text = replaced("</robot>", MAST)(ring(4))
    run("robot", "init", written(folder, text), "--samples", 5)
    return folder, (folder / "robot.toml").read_text(encoding="utf-8")


def loaded(proposed, more: str) -> LeggedRobot:
    folder, text = proposed
    path = folder / "edited.toml"
    path.write_text(text + more, encoding="utf-8")
    return load_legged(path)


def seen(camera, point) -> np.ndarray:
    """Column, row and depth of a point of the base."""
    x, y, depth = apply(inverse(camera.T_base_camera), np.asarray(point, float))
    return np.array([camera.fx * x / depth + camera.cx, camera.fy * y / depth + camera.cy, depth])


def test_what_is_proposed_has_none_and_shows_how_to_write_them(proposed):
    _, text = proposed
    assert loaded(proposed, "").description.cameras == ()
    example = "".join(line.removeprefix("# ") + "\n" for line in text[text.index("# [[cameras]]") :].splitlines()[:10])
    pair = loaded(proposed, "\n" + example.replace("…", "base")).description.cameras[0]
    assert pair.name == "front"
    assert pair.camera_left.width == 640


def test_a_pair_looks_where_it_says(proposed):
    (pair,) = loaded(proposed, PAIR).description.cameras
    left, right = pair.camera_left, pair.camera_right
    middle = np.array([0.2, 0.0, 0.05])
    aside = np.array([0.0, 0.04, 0.0])
    np.testing.assert_allclose(left.T_base_camera[:3, 3], middle + aside, atol=1e-12)
    np.testing.assert_allclose(right.T_base_camera[:3, 3], middle - aside, atol=1e-12)
    straight = middle + 3.0 * np.array([np.cos(0.5), 0.0, -np.sin(0.5)])
    u, v, depth = seen(left, straight + aside)
    assert (u, v, depth) == pytest.approx((31.5, 23.5, 3.0), abs=1e-9)
    # up in the image is up, and left is left
    assert seen(left, straight + np.array([0.0, 0.0, 0.5]))[1] < v
    assert seen(left, straight + np.array([0.0, 0.5, 0.0]))[0] < seen(left, straight)[0]
    # a right camera sees everything farther to the left, by focal length · baseline / depth
    shift = seen(left, straight)[0] - seen(right, straight)[0]
    assert shift == pytest.approx(32.0 * 0.08 / 3.0)
    edge = middle + aside + np.array([np.cos(0.5), np.tan(np.deg2rad(44.0)), -np.sin(0.5)])
    assert in_image(left, seen(left, edge)[:2])


@settings(max_examples=30)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_any_turn_leaves_the_right_camera_to_the_right(proposed, rpy, place):
    text = PAIR.replace("[0.0, 0.5, 0.0]", str([*rpy])).replace("[0.2, 0.0, 0.05]", str([*place]))
    (pair,) = loaded(proposed, text).description.cameras
    left, right = pair.camera_left.T_base_camera, pair.camera_right.T_base_camera
    np.testing.assert_allclose(right[:3, 3] - left[:3, 3], 0.08 * left[:3, 0], atol=1e-9)
    np.testing.assert_allclose(0.5 * (left + right)[:3, 3], place, atol=1e-9)
    np.testing.assert_allclose(left[:3, :3] @ left[:3, :3].T, np.eye(3), atol=1e-9)


def test_place_and_turn_may_be_those_of_a_link_and_what_is_no_leg_is_held_in_the_middle(proposed):
    bare = PAIR.replace("position = [0.2, 0.0, 0.05]\n", "").replace("rpy = [0.0, 0.5, 0.0]\n", "")
    (pair,) = loaded(proposed, bare.replace('"base"', '"mast"')).description.cameras
    middle = 0.5 * (pair.camera_left.T_base_camera + pair.camera_right.T_base_camera)[:3, 3]
    np.testing.assert_allclose(middle, [0.1, 0.0, 0.3], atol=1e-9)
    turn = np.pi / 2 + 0.4
    np.testing.assert_allclose(pair.camera_left.T_base_camera[:3, 2], [np.cos(turn), np.sin(turn), 0.0], atol=1e-9)


def test_they_are_part_of_the_description_and_robots_without_keep_their_names(proposed):
    bare, robot = loaded(proposed, ""), loaded(proposed, PAIR)
    assert bare.digest != robot.digest
    stored = decode(encode(robot.description))
    assert isinstance(stored, DescribedRobot)
    assert stored.digest == robot.digest
    assert LeggedRobot.of(stored).description.cameras[0].digest == robot.description.cameras[0].digest
    without = LeggedRobot(*robot.__reduce__()[1][:-1])
    assert without.digest == bare.digest


def test_a_lens_inside_of_a_shape_is_doubtful(proposed):
    folder, _ = proposed

    def told(more: str) -> list[str]:
        loaded(proposed, more)
        lines = run("robot", "check", folder / "edited.toml").stdout.splitlines()
        return [line for line in lines if "cameras" in line]

    assert told("") == []
    (line,) = told(PAIR)
    assert line.startswith("● good")
    assert line.endswith("every lens is outside of all shapes: front")
    # the drum reaches 0.15 m out and 0.04 m up
    left, right = told(PAIR.replace("[0.2, 0.0, 0.05]", "[0.0, 0.0, 0.025]"))
    assert left.startswith("▲ doubtful")
    assert "front" in left
    assert "its left lens lies 15 mm inside the hull of base" in left
    assert "its right lens" in right


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (PAIR.replace('"base"', '"roof"'), "camera pair front: the URDF has no link 'roof'"),
        (PAIR.replace('"base"', '"l2_shank"'), "camera pair front sits on l2_shank, which leg 2 moves"),
        (PAIR + PAIR, "two camera pairs are called front"),
        (PAIR.replace("0.08", "0.0"), "camera pair front: baseline must be above zero [m]"),
        (PAIR.replace("90.0", "180.0"), "camera pair front: fov_deg must be above 0 and below 180"),
        (PAIR.replace("width = 64", "width = 0"), "camera pair front: width must be 1 to 8192 pixels"),
        (PAIR.replace("height = 48", "height = 9000"), "camera pair front: height must be 1 to 8192 pixels"),
        (PAIR.replace("height = 48", "height = 4.5"), "cameras[0].height must be a whole number"),
        (PAIR.replace("position", "place"), "cameras[0] has no entry 'place'"),
        (PAIR.replace("[0.0, 0.5, 0.0]", "[0.0, nan, 0.0]"), "cameras[0].rpy"),
        (PAIR.replace('"front"', f'"{"f" * 65}"'), "has a name of more than 64 characters"),
        ("\n[cameras]\nfront = 1\n", "cameras must be a list of tables"),
    ],
)
def test_what_cannot_be_is_refused_by_name(proposed, more, why):
    with pytest.raises(InvalidRobot) as refused:
        loaded(proposed, more)
    assert why in refused.value.message
