"""Problems that are proven to have no solution have none, and planning says so."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from benchmarks.steps.families import OUT_OF_REACH, problem
from benchmarks.steps.known import known
from benchmarks.steps.problem import build
from benchmarks.steps.quality import planned
from benchmarks.steps.search import Posed, pose
from benchmarks.steps.unsolvable import farthest, out_of_reach, shut_in
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.shut_in import shut_in as barred
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.meshes.collision import CollisionScene

PLATE = "past a hanging plate"


@pytest.fixture(scope="module")
def opened():
    """A problem past a plate, and what is known of it."""
    return _posed(next(row for row in known() if row.problem.family == PLATE and row.solvable))


@pytest.fixture(scope="module", params=["link is", "two links are"])
def shut(request):
    """Where the plate begins at the leg's first link; where it leaves the second no room at any angle."""
    rows = [row for row in known() if row.problem.family == PLATE and row.unsolvable]
    return _posed(next(row for row in rows if f"the first {request.param} blocked" in row.by))


def _posed(row):
    scene = build(row.problem)
    posed = pose(row.problem, scene)
    assert isinstance(posed, Posed)
    return row, scene, posed


def test_only_the_shut_ones_are_proven_to_have_no_solution(opened, shut):
    assert shut_in(opened[2]) is None
    assert shut_in(shut[2]) == shut[0].by


def test_no_posture_is_free_where_the_first_links_are_blocked(shut, rng):
    row, scene, posed = shut
    start, goals = float(posed.up[-1][0]), [float(down[-1][0]) for down in posed.downs]
    angle = float(row.by.split("blocked, at ")[1].split()[0])
    assert all(min(start, goal) < angle < max(start, goal) for goal in goals)
    meshes = CollisionScene(scene.robot, scene.state.posture, posed.leg, scene.state.T_site_base, None, 0.0)
    lower, upper = posed.situation.lower, posed.situation.upper
    for q in rng.uniform(lower, upper, (200, 6)):
        q[0] = angle
        assert meshes.collides(q, "none")
    # whatever the other joints do: it is the upper links that are in the way, at every angle of the second joint
    links = {f"leg{posed.leg}_hip_yaw", f"leg{posed.leg}_hip_pitch"}
    q = posed.up[-1].copy()
    q[0] = angle
    for q[1] in np.linspace(lower[1], upper[1], 500):
        assert any(hit.link_a in links for hit in posed.situation.fixed_contacts(q))


def test_planning_finds_a_way_past_the_open_one(opened):
    row, scene, _ = opened
    assert planned(row.problem, scene, "auto", 20.0).found


def test_planning_says_what_bars_the_shut_one_and_begins_no_long_search(shut):
    row, scene, posed = shut
    settings = StepSettings(planner="auto", seed=1, time_limit=20.0)
    told = footfall.plan_step(
        scene.robot, scene.dem, scene.state, posed.leg, row.problem.target, settings=settings, explain=True
    )
    assert told.status is Status.NO_PATH
    by = "hip_yaw can't turn past payload: at" if "link is" in row.by else "hip_pitch can't pass payload: with"
    assert f"leg{posed.leg}_{by}" in told.reason
    assert told.reason.endswith("choose a footfall on this side of it")
    tried = " ".join(decision.text for decision in told.decisions)
    assert "line did not lead" in tried
    assert "fast did not lead" in tried
    assert "astar" not in tried
    assert "sbl did" not in tried


def test_what_bars_one_goal_bars_the_others_only_if_they_lie_past_it(opened, shut):
    posed = shut[2]
    start, goals = posed.up[-1], [down[-1] for down in posed.downs[:3]]
    assert barred(posed.situation, start, goals)
    here = start + np.array([0.05, 0.1, 0.0, 0.0, 0.0, 0.0])
    assert not barred(posed.situation, start, [*goals, here])
    posed = opened[2]
    assert not barred(posed.situation, posed.up[-1], [down[-1] for down in posed.downs[:3]])


def test_no_leg_is_longer_than_what_proves_a_footfall_out_of_reach(rng):
    asked = problem(OUT_OF_REACH, 0)
    scene = build(asked)
    robot, leg = scene.robot, asked.leg
    assert str(out_of_reach(asked, scene)).startswith("proof")
    own = slice(6 * leg, 6 * leg + 6)
    hip, wheel = robot.description.legs[leg].T_base_hip[:3, 3], robot.description.meshes[f"leg{leg}_wheel"].vertices
    far = max(
        np.linalg.norm(apply(leg_wheel_pose(robot, q, leg), wheel) - hip, axis=1).max()
        for q in rng.uniform(robot.lower[own], robot.upper[own], (2000, 6))
    )
    assert 0.9 * farthest(scene, leg) < far <= farthest(scene, leg)
    answer = planned(asked, scene, "auto", 20.0).result
    assert answer.status is Status.GOAL_INVALID
    assert "farther than" in answer.reason
    within = replace(asked, target=tuple(np.add(asked.place[:2], 0.6 * np.subtract(asked.target, asked.place[:2]))))
    assert out_of_reach(within, scene) is None
