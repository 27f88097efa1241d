"""What an operator decides of a step: branch, points to pass, going on from its end; ways out of a bad start."""

import itertools
import re
import time
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.body.after import state_after
from footfall.planning.body.stand import stand
from footfall.planning.joint_path import length
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.lift import branch_of, vertical
from footfall.planning.step import escape as escape_module
from footfall.planning.step.alternatives import CLEARER, HIGHER, KINDS, asked_otherwise
from footfall.planning.step.escape import FINEST, LIFTS, find_escape
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import PlanResult, StepPlan, StepSettings
from footfall.planning.step.situation import Situation
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_pose
from footfall.robot.meshes.collision import CollisionScene
from tests.support.chassis_ground import wavy, with_posture

TARGET = (1.95, 0.55)
ROCK = (2.15, 0.33, 0.12, 0.4)


@pytest.fixture(scope="module")
def rocky(athlete):
    dem = wavy([ROCK], half=4.0, resolution=0.05)
    return dem, stand(athlete, dem)


@pytest.fixture(scope="module")
def explained(athlete, rocky):
    return plan_step(athlete, rocky[0], rocky[1], 0, TARGET, seed=1, explain=True)


def found(result: PlanResult) -> StepPlan:
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    return result.plan


def turned(state, joint, by):
    posture = np.array(state.posture)
    posture[joint] += by
    return with_posture(state, posture)


# --- why this plan --------------------------------------------------------------------------------------------------


def test_what_was_tried_and_taken_is_told(athlete, rocky, explained):
    taken = [one for one in explained.decisions if one.taken]
    assert [one.about for one in taken] == ["goal", "planner"]
    assert taken[1].text == f"{found(explained).planner} found the swing"
    goal = taken[0].text
    assert f"(branch {found(explained).branch})" in goal
    # the line failed, for the reason that asking for it alone gives too
    refused = [one.text for one in explained.decisions if one.about == "planner" and not one.taken]
    alone = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, "line", seed=1)
    reason = alone.reason.removeprefix("no way to the footfall was found: ").split("; choose")[0]
    assert refused == [f"line did not lead to 3 goal postures: {reason}"]
    for one in explained.decisions:
        if one.about == "goal" and not one.taken:
            assert "is not allowed: " in one.text


def test_saying_why_changes_nothing_else(athlete, rocky, explained):
    silent = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, seed=1)
    assert silent.decisions == ()
    assert found(silent).digest == found(explained).digest


def test_a_plan_that_was_found_in_time_is_not_lost_while_saying_why(athlete, rocky, explained, monkeypatch):
    clock, late = time.monotonic, [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock() + late[0])

    def progress(fraction, text):
        if text == "saying why":
            late[0] = 1e4  # s, far beyond the limit

    result = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, seed=1, explain=True, progress=progress)
    assert late[0]
    assert result.digest == explained.digest


def test_a_step_that_fails_says_what_every_planner_met(athlete, rocky):
    few = StepSettings(milestones=2, cell=1.5, radius=0.05, seed=1)
    result = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, settings=few, explain=True)
    assert result.status is Status.NO_PATH
    assert [one.text.split()[0] for one in result.decisions] == ["line", "fast", "astar", "sbl"]
    for one in result.decisions:
        assert not one.taken
        assert one.text.split(" goal postures: ")[1] in result.reason


# --- branches and alternatives --------------------------------------------------------------------------------------


def test_the_knee_bends_as_asked(athlete, rocky, explained):
    for branch in (0, 2):
        plan = found(plan_step(athlete, rocky[0], rocky[1], 0, TARGET, settings=StepSettings(branch=branch, seed=1)))
        goal = plan.waypoints[-1]
        assert plan.branch // 2 == branch // 2 == branch_of(athlete, 0, goal[:6]) // 2
        assert (goal[2] < 0) == (branch == 2)  # elbow 1 is a knee pitch below zero
        assert np.allclose(contact_point(athlete, goal, 0, plan.T_site_base, plan.normal), plan.contact, atol=1e-6)


def test_a_branch_that_can_not_be_names_those_that_can(athlete, rocky):
    result = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, settings=StepSettings(branch=6))
    assert result.status is Status.GOAL_INVALID
    assert "with reaching back over the hip, the knee down (branch 6)" in result.reason
    assert "only with the knee up (branch 0) or the knee down (branch 2)" in result.reason
    for wrong in (8, -1):
        with pytest.raises(InvalidInput, match="branch is 0"):
            StepSettings(branch=wrong)


def test_alternatives_are_what_they_say(athlete, rocky, explained):
    plan = found(explained)
    own = slice(0, 6)

    def top(one):
        q = one.waypoints[one.phases.index("swing") - 1]
        return (wheel_pose(athlete, q, 0) - wheel_pose(athlete, one.waypoints[0], 0))[2, 3]

    for kind in KINDS:
        settings, text = asked_otherwise(plan, kind)
        other = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, settings=settings)
        assert text
        alternative = found(other)
        if kind == "higher_lift":
            assert top(alternative) == pytest.approx(top(plan) + HIGHER, abs=1e-6)
        if kind == "other_knee":
            assert alternative.waypoints[-1, 2] * plan.waypoints[-1, 2] < 0
        if kind == "more_clearance":
            scene = CollisionScene(athlete, rocky[1].posture, 0, rocky[1].T_site_base, None, CLEARER)
            assert not any(scene.collides(q[own], "none") for q in alternative.waypoints)
            assert settings.clearance == CLEARER
        kept = replace(plan, provenance=replace(plan.provenance, settings=StepSettings(goals="clearance")))
        assert asked_otherwise(kept, kind)[0].goals == "clearance"
    with pytest.raises(InvalidInput, match="higher_lift, other_knee, more_clearance"):
        asked_otherwise(plan, "prettier")


# --- points to pass -------------------------------------------------------------------------------------------------


def passes(robot, state, plan, point):
    """Distance from a point to the nearest waypoint of the swing."""
    own = [q for q, phase in zip(plan.waypoints, plan.phases, strict=True) if phase == "swing"]
    centers = apply(state.T_site_base, np.array([wheel_pose(robot, q, 0)[:3, 3] for q in own]))
    return np.linalg.norm(centers - point, axis=1)


@pytest.mark.parametrize("planner", ["auto", "astar"])
def test_the_wheel_passes_every_point_in_order_and_the_whole_is_checked(athlete, rocky, explained, planner):
    points = [(1.9, 0.1, 0.85), (1.85, 0.4, 1.0)]
    result = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, planner, seed=1, through=points)
    plan = found(result)
    away = [passes(athlete, rocky[1], plan, point) for point in points]
    assert all(one.min() < 1e-9 for one in away)
    assert np.argmin(away[0]) < np.argmin(away[1])
    assert all(check.holds for check in result.checks)
    assert len(result.checks) == len(explained.checks)
    assert result.through == tuple(points)
    assert length(plan.waypoints) > length(found(explained).waypoints)
    assert [name for name, _ in itertools.groupby(plan.phases)] == ["lift", "swing", "lower"]


def test_points_that_can_not_be_are_named(athlete, rocky):
    low = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, through=[(1.9, 0.2, 0.9), (1.9, 0.3, 0.1)])
    assert low.status is Status.NO_PATH
    assert "the wheel can't be at point 2 (1.90, 0.30, 0.10)" in low.reason
    assert "raised by 0.15 m" in low.reason
    far = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, through=[(5.0, 0.0, 1.0)])
    assert "no joint angles inside the limits put the wheel's centre at point 1" in far.reason
    for wrong in ([(1.0, 2.0)], [(1.0, 2.0, np.nan)], [(1.0, 2.0, 0.5)] * 21):
        with pytest.raises(InvalidInput, match="up to 20 points"):
            plan_step(athlete, rocky[0], rocky[1], 0, TARGET, through=wrong)  # type: ignore[arg-type]


# --- ways out of a start that is not allowed ------------------------------------------------------------------------


@pytest.mark.parametrize("by", [0.12, 0.2])
def test_a_sunk_wheel_is_offered_the_smallest_ways_out(athlete, by):
    dem = wavy(half=4.0, resolution=0.05)
    state = turned(stand(athlete, dem), 1, by)
    stance = LegStance(athlete, dem, state, 0)
    near = ground_near(stance)
    assert isinstance(near, Nearby)
    situation = Situation(athlete, dem, state, 0, near, StepSettings())
    q = np.array(state.leg(0))
    out = find_escape(situation, q)
    # judged by the meshes alone
    scene = CollisionScene(athlete, state.posture, 0, state.T_site_base, near.mesh)
    assert scene.collides(q, "true")
    assert out.lift is not None
    for height, blocked in ((out.lift, False), (out.lift - LIFTS, True)):
        up = vertical(athlete, 0, np.asarray(state.T_site_base), q, height)
        assert not isinstance(up, str)
        assert scene.collides(up[-1], "true") == blocked
    assert out.alone is not None
    assert (np.abs(out.alone) > 0).sum() == 1
    for change in (out.alone, out.change):
        if change is not None:
            assert not scene.collides(q + change, "true")
            shorter = change * (1 - 1.5 * FINEST / np.abs(change).max())
            assert scene.collides(q + shorter, "true")
    result = plan_step(athlete, dem, state, 0, (2.05, 0.45))
    assert result.status is Status.START_INVALID
    assert re.search(r"leg0_wheel cuts 0\.\d{3} m into terrain \(0\.030 m is allowed\)", result.reason)
    assert f"lift the wheel straight up by {out.lift:.2f} m" in result.reason
    assert out.in_words(athlete, 0) in result.reason
    # what was offered is a start
    assert found(plan_step(athlete, dem, with_posture(state, situation.posture(q + out.alone)), 0, (2.05, 0.45)))


def test_looking_beside_the_best_way_out_makes_it_shorter(athlete, monkeypatch):
    dem = wavy(half=4.0, resolution=0.05)
    state = turned(stand(athlete, dem), 1, 0.2)
    near = ground_near(LegStance(athlete, dem, state, 0))
    assert isinstance(near, Nearby)
    situation, q = Situation(athlete, dem, state, 0, near, StepSettings()), np.array(state.leg(0))
    found_so = find_escape(situation, q)
    monkeypatch.setattr(escape_module, "ROUNDS", 0)
    drawn_only = find_escape(situation, q)
    assert found_so.change is not None
    assert drawn_only.change is not None
    assert np.abs(found_so.change).max() < np.abs(drawn_only.change).max() - FINEST


def test_nothing_is_offered_against_a_margin_that_no_posture_keeps(athlete, rocky):
    result = plan_step(athlete, rocky[0], rocky[1], 0, TARGET, settings=StepSettings(least_margin=3.0))
    assert result.status is Status.START_INVALID
    assert "way out" not in result.reason


@pytest.mark.parametrize(("joint", "side"), [(2, 1), (8, -1)])
def test_a_joint_beyond_its_limit_is_told_its_way_back(athlete, rocky, joint, side):
    dem, state = rocky
    limit = (athlete.upper if side > 0 else athlete.lower)[joint]
    posture = np.array(state.posture)
    posture[joint] = limit + side * 0.25
    result = plan_step(athlete, dem, with_posture(state, posture), 0, TARGET)
    assert result.status is Status.START_INVALID
    name, way = athlete.joint_names[joint], "down" if side > 0 else "up"
    assert f"{name} is 0.25 rad outside its limits" in result.reason
    assert f"turn it {way} to {limit:.3f} rad" in result.reason


# --- going on -------------------------------------------------------------------------------------------------------


def test_the_next_step_starts_where_this_one_ends(athlete, rocky, explained):
    dem, state = rocky
    plan = found(explained)
    after = state_after(athlete, dem, state, plan.waypoints[-1], plan.T_site_base, explained.digest)
    assert np.array_equal(after.posture, plan.waypoints[-1])
    assert after.provenance.parents["after"] == explained.digest
    # at rest: forces hold the weight, and the moved wheel carries its share
    weight = after.wheel_forces.sum(axis=0)
    assert weight[2] == pytest.approx(athlete.mass * 9.81, rel=1e-3)
    assert np.abs(weight[:2]).max() < 1e-6 * weight[2]
    assert after.wheel_forces[0, 2] > 0
    x, y, _ = contact_point(athlete, after.posture, 3, after.T_site_base)
    again = found(plan_step(athlete, dem, after, 3, (x + 0.1, y + 0.25)))
    assert np.array_equal(again.waypoints[0], plan.waypoints[-1])
    assert again.parents["state"] == after.digest
