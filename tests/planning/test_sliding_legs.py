"""Robots whose legs slide stand and walk as others do; what is left of their limits is told in metres."""

import numpy as np
import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.scripting import make_sequence
from footfall.io.urdf.read import read_urdf
from footfall.planning.any_robot import plan_walk, stand
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.problem import LeggedSettings
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.generate import fractal
from tests.support.legged_recheck import Recheck, faults
from tests.support.sliders import GANTRY, TELESCOPE, sliders
from tests.support.urdf import written

UNHURRIED = LeggedSettings(time_limit=1e6)
EVERY = 30


@pytest.mark.parametrize("joints", [GANTRY, TELESCOPE], ids=["three slides", "one slide"])
def test_legs_that_slide_stand_and_walk_before_judges_of_their_own(joints, tmp_path):
    path = written(tmp_path, sliders(joints))
    robot = LeggedRobot(legged_model(read_urdf(path)))
    ease = at_ease(robot)
    way = robot.upper - robot.lower
    slides = np.array([name in robot.layout.sliding for name in robot.joint_names])
    assert (np.minimum(ease.q - robot.lower, robot.upper - ease.q)[slides] >= 0.1 * way[slides] - 1e-9).all()
    dem = fractal(3.0, 0.02, roughness=0.005, seed=1)
    result = plan_walk(robot, dem, stand(robot, dem), (0.2, 0.0), UNHURRIED)
    assert result.plan is not None, result.reason
    assert faults(Recheck(path, robot, []).walk(dem, result.plan, EVERY)) == []


def test_limits_of_a_joint_that_slides_are_told_in_metres(tmp_path):
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, sliders(GANTRY)))))
    dem = fractal(3.0, 0.02, roughness=0.005, seed=1)
    result = plan_walk(robot, dem, stand(robot, dem), (0.1, 0.0), UNHURRIED)
    assert result.plan is not None, result.reason
    assert [check.unit for check in result.checks if check.name == "limits"] == ["m"]
    rules = make_sequence(result.plan, robot, dem).rules
    assert {rule.unit for rule in rules if rule.rule == "joint-limits"} == {"m"}


def test_legs_that_slide_too_little_are_refused_with_what_is_missing(tmp_path):
    short = tuple((*joint[:4], (0.0, 0.03)) for joint in GANTRY)
    with pytest.raises(InvalidRobot, match=r"no stance was found from which every foot gets 0\.024 m to all sides"):
        at_ease(LeggedRobot(legged_model(read_urdf(written(tmp_path, sliders(short))))))
