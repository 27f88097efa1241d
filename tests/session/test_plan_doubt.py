"""A step that leaves its leg little in reserve says so, with how much is left by forward kinematics."""

import re

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.planning.body.move import REACH_RESERVE
from footfall.planning.step.problem import PlanResult
from footfall.robot.kinematics import link_poses, wheel_centers

LEG = 2


def left_to_straight(athlete, posture) -> float:
    """How much farther the ankle of the leg could be from its hip pitch joint [m]."""
    poses, spec = link_poses(athlete, posture), athlete.description.legs[LEG]
    ankle = np.linalg.norm(poses[f"leg{LEG}_ankle_pitch"][:3, 3] - poses[f"leg{LEG}_hip_pitch"][:3, 3])
    return float(spec.thigh + spec.shank - ankle)


def test_little_reserve_is_told_where_there_is_less_than_a_move_leaves_and_nowhere_else(live, athlete, standing):
    wheel = apply(standing.T_site_base, wheel_centers(athlete, standing.posture))[LEG, :2]
    out = (wheel - standing.T_site_base[:2, 3]) / np.linalg.norm(wheel - standing.T_site_base[:2, 3])
    told = []
    for metres in (-0.3, *np.arange(0.0, 0.09, 0.01)):
        x, y = wheel + metres * out
        result = live.typed(PlanResult, live.plans.step(LEG, (float(x), float(y))).finish())
        doubt = live.summary()["plan"]["doubt"]
        if result.plan is None:
            assert doubt == ""
            continue
        left = left_to_straight(athlete, result.plan.waypoints[-1])
        assert bool(doubt) == (left < REACH_RESERVE), (metres, left, doubt)
        if doubt:
            [figure] = re.findall(rf"leg {LEG} ends ([0-9.]+) m from straight or folded", doubt)
            told.append(float(figure))
            assert told[-1] == pytest.approx(left, abs=6e-4)
            assert "a footfall nearer to the chassis leaves more" in doubt
    assert told
    assert live.plans.step(LEG, tuple(wheel - 0.3 * out)).finish()
    assert live.summary()["plan"]["doubt"] == ""
