"""What a person edited in a robot.toml counts, or is refused by name."""

import re

import numpy as np
import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.any_robot import load_legged
from footfall.io.urdf.examine import examine
from tests.support.proposed import edited, proposed
from tests.support.walkers import ring


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
