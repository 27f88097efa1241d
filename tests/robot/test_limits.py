"""Room to the limits of joints, against limits looked at one joint at a time."""

import math

import numpy as np
import pytest

from footfall.robot.limits import farthest_past, room_to_limits


def one_by_one(robot, joint: int, angle: float) -> float:
    """How far an angle is past the limits of a joint [rad]; 0 inside."""
    if angle > robot.upper[joint]:
        return angle - float(robot.upper[joint])
    return max(float(robot.lower[joint]) - angle, 0.0)


def test_the_joint_that_is_farthest_past(athlete):
    rng = np.random.default_rng(3)
    middle, width = 0.5 * (athlete.lower + athlete.upper), athlete.upper - athlete.lower
    past = 0
    for _ in range(200):
        posture = middle + rng.uniform(-0.6, 0.6, len(middle)) * width
        excesses = [one_by_one(athlete, joint, float(angle)) for joint, angle in enumerate(posture)]
        worst = farthest_past(athlete, posture)
        past += max(excesses) > 0
        assert max(worst.excess, 0.0) == pytest.approx(max(excesses), abs=1e-15)
        assert worst.name == athlete.joint_names[worst.joint]
        if max(excesses) > 0:
            assert excesses[worst.joint] == max(excesses)
    assert past > 100


def test_joints_of_one_leg_are_named_as_those_of_the_rover(athlete):
    own = slice(18, 24)
    angles = 0.5 * (athlete.lower[own] + athlete.upper[own])
    angles[2] = athlete.upper[20] + 0.25
    worst = farthest_past(athlete, angles, own)
    assert (worst.joint, worst.name) == (20, athlete.joint_names[20])
    assert worst.excess == pytest.approx(0.25)
    many = room_to_limits(athlete, np.stack([angles, angles - 0.5]), own)
    assert many.shape == (2, 6)
    assert many[0, 2] == pytest.approx(-0.25)
    assert many[1, 2] == pytest.approx(0.25)


def test_inside_is_told_as_room_and_nonsense_as_no_number(athlete):
    middle = 0.5 * (athlete.lower + athlete.upper)
    inside = farthest_past(athlete, middle)
    assert inside.excess == pytest.approx(-0.5 * float((athlete.upper - athlete.lower).min()))
    middle[7] = np.nan
    assert math.isnan(farthest_past(athlete, middle).excess)
