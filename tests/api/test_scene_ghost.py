"""What the ghost plays: one leg of a plan, or the whole rover of a sequence that moves the chassis."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.between_rows import at
from footfall.planning.body.follow import DRIFT
from footfall.planning.walk.problem import WalkSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall_ui.scene.ghost import motion_of
from tests.support.chassis_ground import wavy


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return footfall.stand(athlete, ground)


@pytest.fixture(scope="module")
def moving(athlete, ground, stood):
    plan = footfall.plan_body_move(athlete, ground, stood, footfall.BodyShift(dx=0.05, dz=-0.15, dyaw=0.05)).plan
    assert plan is not None
    return make_sequence(plan, athlete, ground)


def test_the_chassis_moves_and_the_feet_stay(athlete, stood, moving):
    motion = motion_of(moving)
    assert motion is not None
    assert motion.leg is None
    feet = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))
    heights = []
    for moment in np.linspace(0.0, 1.0, 41):
        posture, T_site_base = at(motion, moment)
        away = apply(T_site_base, wheel_centers(athlete, posture)) - feet
        assert np.linalg.norm(away, axis=1).max() < DRIFT
        heights.append(T_site_base[2, 3])
    assert (np.diff(heights) < 0).all()
    for moment, posture, pose in [
        (0.0, moving.start, moving.T_site_base),
        (1.0, moving.predicted[-1], moving.poses[-1]),
    ]:
        shown = at(motion, moment)
        np.testing.assert_allclose(shown[0], posture, atol=1e-12)
        np.testing.assert_allclose(shown[1], pose, atol=1e-9)


def test_of_a_step_one_leg_moves_and_the_chassis_stays(athlete, ground, stood):
    foot = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[2]
    plan = footfall.plan_step(athlete, ground, stood, 2, (float(foot[0] + 0.1), float(foot[1] + 0.1)), seed=1).plan
    assert plan is not None
    motion = motion_of(plan)
    assert motion is not None
    assert motion.leg == 2
    for moment in (0.0, 0.37, 1.0):
        posture, T_site_base = at(motion, moment)
        assert np.array_equal(T_site_base, plan.T_site_base)
        assert np.array_equal(np.delete(posture, np.s_[12:18]), np.delete(stood.posture, np.s_[12:18]))
    np.testing.assert_allclose(at(motion, 1.0)[0], plan.waypoints[-1], atol=1e-12)


def test_of_edited_commands_the_edited_posture_is_shown(athlete, ground, stood):
    foot = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[2]
    plan = footfall.plan_step(athlete, ground, stood, 2, (float(foot[0] + 0.1), float(foot[1] + 0.1)), seed=1).plan
    assert plan is not None
    commands = make_sequence(plan, athlete, ground)
    row = len(commands.commands) // 2
    angle = float(commands.predicted[row, 12]) + 0.2
    edited = apply_edit(athlete, commands, Edit("joint", row, joint=0, number=angle), ground)
    motion = motion_of(edited)
    assert motion is not None
    assert motion.leg == 2
    travel = np.abs(np.diff(motion.waypoints, axis=0)).max(axis=1)
    shown = at(motion, float(travel[: row + 1].sum() / travel.sum()))[0]
    assert shown[12] == pytest.approx(angle, abs=1e-9)
    np.testing.assert_allclose(at(motion, 1.0)[0], edited.predicted[-1], atol=1e-12)


def test_nothing_is_played_of_anything_else(stood):
    assert motion_of(None) is None
    assert motion_of(stood) is None


def test_a_walk_is_played_from_start_to_goal_with_its_standing_feet_where_they_are(athlete, ground, stood):
    # what a busy machine takes is no matter
    settings = WalkSettings(seed=4, time_limit=3600.0)
    result = footfall.plan_walk(athlete, ground, stood, (0.4, 0.1, 0.0), settings=settings)
    plan = result.plan
    assert plan is not None, result.reason
    motion = motion_of(result)
    assert motion is not None
    assert motion.leg is None
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(plan.waypoints, axis=0)).max(axis=1))])
    for moment in np.linspace(0.0, 1.0, 37):
        posture, T_site_base = at(motion, moment)
        before = int(np.searchsorted(travel, moment * travel[-1], side="right")) - 1
        after = min(before + 1, len(travel) - 1)
        number = int(plan.moves[after])
        stance = plan.stances[min(number, plan.foot_moves)]
        lifted = plan.legs[number] if plan.phases[after] != "body" else None
        centers = apply(T_site_base, wheel_centers(athlete, posture))
        for leg in athlete.legs:
            if leg != lifted:
                assert np.linalg.norm(centers[leg] - stance.Ts_site_wheel[leg][:3, 3]) < DRIFT
    np.testing.assert_allclose(at(motion, 1.0)[1], plan.Ts_site_base[-1], atol=1e-9)
    partial = replace(result, status=Status.NO_PATH, plan=None, partial=plan)
    again = motion_of(partial)
    assert again is not None
    np.testing.assert_array_equal(again.waypoints, motion.waypoints)
    assert motion_of(replace(partial, partial=None)) is None
