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
from footfall.planning.step.problem import Status, StepSettings
from footfall.planning.step.shut_in import shut_in as barred
from footfall.robot.collision import CollisionScene
from footfall.robot.kinematics import leg_wheel_pose

PLATE = "past a hanging plate"


@pytest.fixture(scope="module")
def open_and_shut():
    """A problem past a plate, and one where the plate begins at the leg's first link."""
    rows = [row for row in known() if row.problem.family == PLATE]
    found = []
    for row in (next(row for row in rows if row.solvable), next(row for row in rows if row.unsolvable)):
        scene = build(row.problem)
        posed = pose(row.problem, scene)
        assert isinstance(posed, Posed)
        found.append((row, scene, posed))
    return found


def test_only_the_shut_one_is_proven_to_have_no_solution(open_and_shut):
    (*_, opened), (row, _, shut) = open_and_shut
    assert shut_in(opened) is None
    assert shut_in(shut) == row.by


def test_no_posture_is_free_where_the_first_link_is_blocked(open_and_shut, rng):
    _, scene, shut = open_and_shut[1]
    start, goals = float(shut.up[-1][0]), [float(down[-1][0]) for down in shut.downs]
    meshes = CollisionScene(scene.robot, scene.state.posture, shut.leg, scene.state.T_site_base, None, 0.0)
    proof = str(shut_in(shut))
    angle = float(proof.split("blocked, at ")[1].split()[0])
    assert all(min(start, goal) < angle < max(start, goal) for goal in goals)
    lower, upper = shut.situation.lower, shut.situation.upper
    for q in rng.uniform(lower, upper, (200, 6)):
        q[0] = angle
        assert meshes.collides(q, "none")


def test_planning_finds_a_way_past_the_open_one_and_says_what_bars_the_shut_one(open_and_shut):
    (opened, open_scene, _), (shut, shut_scene, _) = open_and_shut
    assert planned(opened.problem, open_scene, "auto", 20.0).found
    answer = planned(shut.problem, shut_scene, "auto", 20.0).result
    assert answer.status is Status.NO_PATH
    assert f"leg{shut.problem.leg}_hip_yaw can't turn past payload" in answer.reason
    # the searches that take long are not begun
    settings = StepSettings(planner="auto", seed=1, time_limit=20.0)
    told = footfall.plan_step(
        shut_scene.robot,
        shut_scene.dem,
        shut_scene.state,
        shut.problem.leg,
        shut.problem.target,
        settings=settings,
        explain=True,
    )
    tried = " ".join(decision.text for decision in told.decisions)
    assert "line did not lead" in tried
    assert "fast did not lead" in tried
    assert "astar" not in tried
    assert "sbl did" not in tried


def test_what_bars_one_goal_bars_the_others_only_if_they_lie_past_it(open_and_shut):
    shut = open_and_shut[1][2]
    start, goals = shut.up[-1], [down[-1] for down in shut.downs[:3]]
    assert barred(shut.situation, start, goals)
    here = start + np.array([0.05, 0.1, 0.0, 0.0, 0.0, 0.0])
    assert not barred(shut.situation, start, [*goals, here])
    for _, _, posed in open_and_shut[:1]:
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
