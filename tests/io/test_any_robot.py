"""Robots of others as they are loaded: what can't be used is refused by name."""

import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.any_robot import load_legged
from footfall.io.urdf.examine import examine
from footfall.robot.legged.finding import Grade
from tests.support.proposed import edited, proposed
from tests.support.walkers import ring

TURRET = (
    '<link name="turret"/><joint name="pan" type="revolute"><parent link="base"/><child link="turret"/>'
    '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="-1" velocity="-1"/></joint></robot>'
)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('<mass value="0.5"/>', '<mass value="-0.5"/>', "ring can't be used: l0_thigh: its mass is -0.5 kg; 0 or more"),
        ('effort="60.0"', 'effort="-60"', "ring can't be used: l0_yaw: its effort is -60; above zero"),
        ('velocity="6"', 'velocity="-6"', "ring can't be used: l0_yaw: its velocity is -6; above zero"),
        ('radius="0.15"', 'radius="150"', "ring can't be used: base: cylinder is 150 m large.*in millimetres?"),
    ],
)
def test_what_check_calls_unusable_is_not_planned_with(tmp_path, old, new, why):
    urdf = ring(4)
    assert old in urdf
    path = proposed(tmp_path, urdf.replace(old, new, 1))
    with pytest.raises(InvalidRobot, match=why):
        load_legged(path)


def test_a_robot_that_weighs_something_else_is_not_planned_with(tmp_path):
    path = edited(proposed(tmp_path, ring(4)), r"mass_check = \S+", "mass_check = 13.2")
    load_legged(path)  # doubtful: 4.5 % off
    with pytest.raises(InvalidRobot, match=r"the links weigh 12.600 kg, mass_check says 60.000 kg: 79.0% apart"):
        load_legged(edited(path, r"mass_check = \S+", "mass_check = 60"))


def test_joints_of_no_leg_may_be_what_they_are(tmp_path):
    path = proposed(tmp_path, ring(4).replace("</robot>", TURRET))
    assert {one.where for one in examine(path) if one.grade is Grade.UNUSABLE} == {"pan"}
    assert "pan" not in load_legged(path).joint_names
