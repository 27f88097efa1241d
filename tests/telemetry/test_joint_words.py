"""Joints as persons call them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.robot.description import athlete_layout
from footfall.telemetry.joint_layout import joint_in_words


def test_joints_of_athletes_build_are_called_by_leg_and_joint():
    names = athlete_layout(12).joint_names
    told = [joint_in_words(name) for name in names]
    assert told[:2] == ["leg 0 hip yaw", "leg 0 hip pitch"]
    assert told[-1] == "leg 11 ankle roll"
    assert len(set(told)) == len(names)
    assert not any("_" in one for one in told)


@pytest.mark.parametrize(
    "name", ["LF_HAA", "leg_joint", "leg2_joint", "left_knee_joint", "leg2_knee", "xleg2_knee_joint", ""]
)
def test_joints_that_others_named_keep_their_names(name):
    assert joint_in_words(name) == name


@given(st.text())
def test_no_two_joints_are_called_alike_unless_one_is_called_so_already(name):
    told = joint_in_words(name)
    assert told == name or told.replace("leg ", "leg", 1).replace(" ", "_") + "_joint" == name
