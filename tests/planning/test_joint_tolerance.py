"""A joint measured past its limit by what a measurement may be off is at it: planned from, and led back inside."""

import re
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.planning.answers import Status
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.planning.body.find_shift import find_shift
from footfall.planning.body.shift import shifted_state
from footfall.planning.body.stand import stand
from footfall.planning.step.plan import plan_step
from footfall.robot.ik import contact_point
from footfall.robot.model import Robot
from footfall.robot.tolerance import JOINT_TOLERANCE, digits_apart, inside
from footfall.sequence.make import make_sequence
from footfall.terrain.generate import plane

LEG = 2
TOLD = re.compile(r"outside its limits, at (\S+) rad \((\S+)…(\S+) rad\); turn it (up|down) to (\S+) rad")


@lru_cache(maxsize=1)
def _ground():
    return plane(8.0, 0.1)


@pytest.fixture(scope="module")
def standing(athlete):
    return stand(athlete, _ground())


def limited(athlete, standing, joint, side, excess):
    """The same rover in the same stance, with a limit that this joint is past by ``excess`` [rad]."""
    lower, upper = np.array(athlete.lower), np.array(athlete.upper)
    (upper if side > 0 else lower)[joint] = standing.posture[joint] - side * excess
    robot = Robot(replace(athlete.description, lower=lower, upper=upper, postures={}))
    return robot, standing


def near(robot, state):
    x, y, _ = contact_point(robot, state.posture, LEG, state.T_site_base)
    return float(x) + 0.1, float(y) + 0.1


def all_inside(robot, waypoints):
    return bool(((waypoints >= robot.lower) & (waypoints <= robot.upper)).all())


JOINTS, SIDES = st.integers(0, 35), st.sampled_from([-1, 1])


@settings(max_examples=8)
@given(JOINTS, SIDES, st.floats(1e-12, 0.99 * JOINT_TOLERANCE))
def test_within_the_tolerance_no_door_names_the_limit_and_every_plan_is_inside(athlete, standing, joint, side, excess):
    robot, state = limited(athlete, standing, joint, side, excess)
    step = plan_step(robot, _ground(), state, LEG, near(robot, state))
    assert step.status is not Status.START_INVALID, step.reason
    if step.plan is not None:
        assert all_inside(robot, step.plan.waypoints)
        assert np.abs(step.plan.waypoints[0] - state.posture).max() <= JOINT_TOLERANCE
        assert step.provenance.parents["state"] == state.digest
        sequence = make_sequence(step.plan, robot, _ground())
        limits = [one for one in sequence.rules if one.rule == "joint-limits"]
        assert limits
        assert all(one.holds for one in limits)
    move = plan_body_move(robot, _ground(), state, BodyShift())
    assert move.plan is not None, move.reason
    assert all_inside(robot, move.plan.waypoints)
    shifted = shifted_state(robot, _ground(), state, BodyShift())
    assert isinstance(shifted, PredictedState)
    assert all_inside(robot, shifted.posture)
    assert shifted.provenance.parents["state"] == state.digest


@settings(max_examples=6)
@given(JOINTS, SIDES, st.floats(1.01 * JOINT_TOLERANCE, 0.02))
def test_beyond_the_tolerance_every_door_refuses_and_the_two_numbers_differ(athlete, standing, joint, side, excess):
    robot, state = limited(athlete, standing, joint, side, excess)
    dem, there = _ground(), near(robot, state)
    answers = [
        plan_step(robot, dem, state, LEG, there),
        plan_body_move(robot, dem, state, BodyShift(dz=-0.05)),
        find_shift(robot, dem, state, LEG, there),
    ]
    for answer in answers:
        assert answer.status is Status.START_INVALID
        assert robot.joint_names[joint] in answer.reason
        told = TOLD.search(answer.reason)
        assert told is not None, answer.reason
        at, lower, upper, way, end = told.groups()
        assert way == ("down" if side > 0 else "up")
        assert end == (upper if side > 0 else lower) != at
        assert float(at) == pytest.approx(state.posture[joint], abs=1e-3)


@pytest.mark.parametrize("excess", [1e-9, 9e-4])
def test_a_rover_past_its_limit_by_rounding_steps_and_moves(athlete, standing, excess):
    """The joint of a standing leg, and one of the leg that moves; each lets the plan leave its limit."""
    for joint, side in ((6 * 4 + 1, 1), (6 * LEG + 5, 1)):
        robot, state = limited(athlete, standing, joint, side, excess)
        step = plan_step(robot, _ground(), state, LEG, near(robot, state))
        assert step.plan is not None, step.reason
        assert step.plan.waypoints[0, joint] == robot.upper[joint] < state.posture[joint]


@given(st.floats(-7.0, 7.0), st.floats(-3 * JOINT_TOLERANCE, 3 * JOINT_TOLERANCE))
def test_what_is_inside_or_far_outside_is_left_as_it_was_measured(athlete, q, past):
    posture = np.full(36, q)
    found = inside(athlete, posture)
    nearest = np.clip(posture, athlete.lower, athlete.upper)
    near_enough = np.abs(posture - nearest) <= JOINT_TOLERANCE
    np.testing.assert_array_equal(found, np.where(near_enough, nearest, posture))
    np.testing.assert_array_equal(inside(athlete, found), found)
    at_limit = inside(athlete, athlete.upper + past)
    kept = athlete.upper + past if past <= 0 or past > 1.0000001 * JOINT_TOLERANCE else athlete.upper
    assert abs(past) == pytest.approx(JOINT_TOLERANCE, rel=1e-6) or np.array_equal(at_limit, kept)


@given(st.floats(-10.0, 10.0), st.floats(1e-14, 1.0))
def test_two_numbers_are_told_with_as_many_digits_as_tell_them_apart(number, apart):
    digits = digits_apart(number, number + apart)
    assert digits >= 3
    assert number == number + apart or f"{number:z.{digits}f}" != f"{number + apart:z.{digits}f}"
    assert digits == 3 or f"{number:z.{digits - 1}f}" == f"{number + apart:z.{digits - 1}f}"
