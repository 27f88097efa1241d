"""Moves of the chassis leave the legs a reserve, say what they cost, and do without only when asked to."""

import json
from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.value import flatten
from footfall.planning.answers import Status
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.find_shift import find_shift
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.body.shift import shifted_state
from footfall.robot.ik import contact_point
from footfall.robot.reserve import joint_reserves, reach_reserves
from tests.support.chassis_ground import wavy

NONE = BodyMoveSettings(reach_reserve=0.0, joint_reserve=0.0)
ASKED = BodyMoveSettings()
FAR = BodyShift(dx=0.05)
"""From the height at which the rover stands, about as far as its legs reach."""


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy([(1.0, 1.2, 0.3, 0.2)])
    return dem, footfall.stand(athlete, dem)


def plan_in(result):
    """The result's plan; the test fails with the reason where there is none."""
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    return result.plan


def reserve_checks(result):
    return {check.name: check for check in result.checks if "reserve" in check.name}


def test_a_shift_that_would_end_straight_is_refused_with_the_leg_and_what_to_do(athlete, scene):
    dem, state = scene
    bare = plan_body_move(athlete, dem, state, FAR, NONE)
    assert not reserve_checks(bare)
    reserves = reach_reserves(athlete, plan_in(bare).waypoints[-1])
    assert reserves.min() < 0.01
    # which is the trap: from there a tenth of a metre is refused
    there = shifted_state(athlete, dem, state, FAR)
    assert isinstance(there, PredictedState)
    assert plan_body_move(athlete, dem, there, BodyShift(dx=0.1), NONE).status is Status.GOAL_INVALID

    result = plan_body_move(athlete, dem, state, FAR)
    assert result.status is Status.GOAL_INVALID
    check = reserve_checks(result)["reach reserve"]
    assert not check.holds
    leg = int(np.argmin(reserves))
    assert check.margin == pytest.approx(reserves[leg] - ASKED.reach_reserve, abs=1e-6)
    assert f"leg {leg} ends {reserves[leg]:.3f} m from straight" in result.reason
    assert "reach_reserve 0" in result.reason
    assert "lower the chassis" in result.reason


def test_lowering_the_chassis_with_the_shift_is_accepted_as_the_refusal_says(athlete, scene):
    dem, state = scene
    result = plan_body_move(athlete, dem, state, replace(FAR, dz=-0.1))
    goal, checks = plan_in(result).waypoints[-1], reserve_checks(result)
    spare = reach_reserves(athlete, goal).min() - ASKED.reach_reserve
    assert checks["reach reserve"].margin == pytest.approx(spare, abs=1e-9)
    joints = joint_reserves(athlete, goal).min() - ASKED.joint_reserve
    assert checks["joint reserve"].margin == pytest.approx(joints, abs=1e-9)
    # what it costs: what there was before, too
    at = int(np.argmin(reach_reserves(athlete, goal)))
    before = reach_reserves(athlete, state.posture)[at]
    assert f"leg {at} ends" in checks["reach reserve"].where
    assert f"{before:.3f} before" in checks["reach reserve"].where


@pytest.mark.parametrize("wanted", [0.0, 0.01, 0.02, 0.03])
def test_no_accepted_move_leaves_less_than_was_asked_or_was_there(athlete, scene, rng, wanted):
    dem, state = scene
    settings = replace(ASKED, reach_reserve=wanted)
    had = reach_reserves(athlete, state.posture)
    accepted = 0
    for _ in range(12):
        shift = BodyShift(*(float(one) for one in rng.uniform(-0.05, 0.05, 3)))
        result = plan_body_move(athlete, dem, state, shift, settings)
        if result.plan is not None:
            has = reach_reserves(athlete, result.plan.waypoints[-1])
            assert (has >= np.minimum(had, wanted) - 2e-6).all()
            accepted += 1
    assert accepted


def test_what_has_little_already_may_stay_as_it_is_and_move_away(athlete, scene):
    dem, state = scene
    there = shifted_state(athlete, dem, state, FAR)
    assert isinstance(there, PredictedState)
    assert plan_body_move(athlete, dem, there, BodyShift()).status is Status.FOUND
    assert plan_body_move(athlete, dem, there, BodyShift(dx=-0.03, dz=-0.02)).status is Status.FOUND
    assert plan_body_move(athlete, dem, there, BodyShift(dx=0.005)).status is not Status.FOUND


def test_a_joint_near_its_limit_is_named(athlete, scene):
    dem, state = scene
    down = BodyShift(dz=-0.4)
    had, has = joint_reserves(athlete, plan_in(plan_body_move(athlete, dem, state, down, NONE)).waypoints[[0, -1]])
    settings = replace(ASKED, joint_reserve=float(had[int(np.argmax(had - has))]))
    result = plan_body_move(athlete, dem, state, down, settings)
    assert result.status is Status.GOAL_INVALID
    check = reserve_checks(result)["joint reserve"]
    assert not check.holds
    name = check.where.split(" ends ")[0]
    assert name in athlete.joint_names
    assert name in result.reason


def test_a_search_prefers_a_shift_with_reserve_and_says_where_there_is_none(athlete, scene):
    dem, state = scene
    x, y, _ = contact_point(athlete, state.posture, 2, state.T_site_base)
    seen = set()
    for dx, dy in ((-0.5, 0.4), (-0.1, 0.3), (-0.3, 0.3)):
        result = find_shift(athlete, dem, state, 2, (float(x) + dx, float(y) + dy))
        if result.plan is None:
            continue
        had, has = reach_reserves(athlete, result.plan.waypoints[[0, -1]])
        kept = bool((has >= np.minimum(had, ASKED.reach_reserve) - 2e-6).all())
        assert kept == ("keeps a reserve" not in result.reason), result.reason
        settings = result.plan.provenance.settings
        assert result.shift is not None
        assert isinstance(settings, BodyMoveSettings)
        again = plan_body_move(athlete, dem, state, result.shift, settings)
        assert plan_in(again).digest == result.plan.digest
        seen.add(kept)
    assert seen


def test_settings_without_reserve_are_those_of_old_records():
    assert NONE.digest == "7b4c6d7279bf09d45aaa6407360da176"
    assert FindShiftSettings(reach_reserve=0.0, joint_reserve=0.0).digest == "cf5cfc8bea93b4d642eca7c76b417b7b"
    assert "reserve" not in json.dumps(flatten(NONE)[0])
    assert ASKED.digest != NONE.digest
