"""What a person edited in a robot.toml counts, or is refused by name."""

import re

import numpy as np
import pytest

from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply
from footfall.io.any_robot import load_legged
from footfall.io.urdf.examine import examine
from footfall.robot.legged.finding import Grade
from footfall.robot.legged.posture import center_of_mass
from tests.support.proposed import edited, proposed
from tests.support.urdf import replaced
from tests.support.walkers import ring

ARM = """
<link name="arm"><inertial><origin xyz="0.4 0 0"/><mass value="2"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0.1 0 0.1"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="9" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize(
    ("said", "axis"),
    [
        ("[0, 3, 0]", (0, 1, 0)),
        ("[0, 0.01, 0]", (0, 1, 0)),
        ("[0.707107, 0.707107, 0]", (0.707107, 0.707107, 0)),
    ],
)
def test_an_axle_is_a_direction_of_any_length(tmp_path, said, axis):
    path = edited(proposed(tmp_path, ring(4)), 'sole = "ball"', f'sole = "wheel"\nwidth = 0.02\naxis = {said}')
    np.testing.assert_array_equal(load_legged(path).model.legs[0].sole.axis, axis)


def test_an_axle_without_length_is_refused(tmp_path):
    path = edited(proposed(tmp_path, ring(4)), 'sole = "ball"', 'sole = "wheel"\nwidth = 0.02\naxis = [0, 0, 0]')
    with pytest.raises(InvalidRobot, match=re.escape("legs[0].axis is [0.0, 0.0, 0.0]; a direction would be right")):
        load_legged(path)


def test_the_name_that_a_person_gives_counts(tmp_path):
    path = proposed(tmp_path, ring(4))
    assert load_legged(path).name == "ring"
    assert load_legged(edited(path, 'name = "ring"', 'name = "rover 7"')).name == "rover 7"


def test_legs_share_no_joint(tmp_path):
    path = edited(proposed(tmp_path, ring(4)), '"l1_(foot|yaw|hip|knee)"(?=.*# .URDF)', r'"l0_\1"')
    told = "ring: legs 0 and 1 both have joint l0_yaw"
    with pytest.raises(InvalidRobot, match=told):
        load_legged(path)
    assert [one.text for one in examine(path)] == [told]


def standing(path, shoulder: str) -> str:
    """A posture ``stand`` of all legs' joints, and a line of the arm's."""
    legs = "".join(f"{name} = 0.5\n" for name in load_legged(path).joint_names)
    return f"{path.read_text(encoding='utf-8')}\n[postures.stand]\n{legs}{shoulder}\n"


def test_joints_that_are_no_legs_are_held_where_the_posture_stand_has_them(tmp_path):
    """They were held in the middle, and what a robot.toml said of them was passed over."""
    path = proposed(tmp_path, replaced("</robot>", ARM)(ring(4)))
    bare, q = load_legged(path), np.full(12, 0.5)
    path.write_text(standing(path, "shoulder = -1.2"), encoding="utf-8")
    robot = load_legged(path)
    assert robot.joint_names == bare.joint_names
    tree, hand = robot.model.tree, np.array([0.4, 0.0, 0.0])
    before, after = (apply(tree.poses({"shoulder": angle})["arm"], hand) for angle in (0.0, -1.2))
    moved = center_of_mass(robot, q) - center_of_mass(bare, q)
    np.testing.assert_allclose(moved, 2.0 * (after - before) / robot.mass, atol=1e-12)
    assert {one.grade for one in examine(path) if one.check_name == "posture"} == {Grade.GOOD}


def test_a_posture_stand_that_leaves_an_arm_out_or_turns_it_too_far_is_told(tmp_path):
    path = proposed(tmp_path, replaced("</robot>", ARM)(ring(4)))
    text = standing(path, "")
    path.write_text(text, encoding="utf-8")
    (told,) = [one for one in examine(path) if one.check_name == "posture" and one.grade is Grade.DOUBTFUL]
    assert told.text == "shoulder not said: held in the middle"
    path.write_text(text + "shoulder = 2.5\n", encoding="utf-8")
    with pytest.raises(InvalidRobot, match=r"posture stand: shoulder at 2\.5 is outside its limits -2 … 2"):
        load_legged(path)
