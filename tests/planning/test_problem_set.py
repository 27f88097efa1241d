"""The problem set of the step benchmark: the same everywhere, every problem a problem, and what is known of it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.steps import recheck as recheck_of_paths
from benchmarks.steps.families import COUNTS, HARD, MAKERS, OUT_OF_REACH, problem
from benchmarks.steps.figures import chosen
from benchmarks.steps.known import Known, fingerprint, known
from benchmarks.steps.problem import Ground, build, is_here, wheel_radius_of
from benchmarks.steps.quality import planned, swing, turning
from benchmarks.steps.recheck import Tally, recheck, rechecked, tallies
from benchmarks.steps.search import pose, situation_of
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.joint_path import samples
from footfall.robot.kinematics import leg_link_poses
from footfall.robot.meshes.collision import CollisionScene

ROWS = known()


def first(family: str) -> Known:
    return next(row for row in ROWS if row.problem.family == family)


def test_there_are_enough_of_each_family_and_no_two_alike():
    counts = {family: sum(row.problem.family == family for row in ROWS) for family in MAKERS}
    assert counts == COUNTS
    assert sum(counts.values()) >= 200
    assert len({row.problem.name for row in ROWS}) == len({row.ground for row in ROWS}) == len(ROWS)


def test_what_is_known_says_by_what_and_the_hard_ones_are_not_straight():
    assert {row.known for row in ROWS} <= {"solvable", "unknown", "unsolvable"}
    assert all(row.by.startswith(("rrtconnect", "kpiece")) == row.solvable for row in ROWS)
    assert all(row.by.startswith("proof") == row.unsolvable for row in ROWS)
    assert all(row.seconds >= 0 for row in ROWS)
    assert all((row.goals >= 1) == (row.problem.family != OUT_OF_REACH) for row in ROWS)
    assert not any(row.straight for row in ROWS if row.problem.family in HARD)
    assert sum(row.straight for row in ROWS) < len(ROWS) / 2


@pytest.mark.parametrize("family", MAKERS)
def test_a_problem_is_made_the_same_again_and_as_the_file_says(family):
    row = first(family)
    if not is_here(row.problem):
        pytest.skip("its ground (../shared/data) is not on this machine")
    again = problem(family, row.problem.seed)
    assert again == row.problem
    scene = build(again)
    assert fingerprint(again, scene) == row.ground
    # where no leg gets to there is nothing to search
    assert isinstance(pose(again, scene), str) == (family == OUT_OF_REACH)


def test_the_fingerprint_tells_problems_apart():
    one = problem("open ground", 0)
    scene = build(one)
    moved = replace(one, target=(one.target[0] + 1e-3, one.target[1]))
    assert fingerprint(moved, scene) != fingerprint(one, scene)
    other = replace(scene, dem=Ground("plane", rocks=((3.0, 3.0, 0.2, 0.1),)).make())
    assert fingerprint(one, other) != fingerprint(one, scene)


def test_every_target_is_near_its_leg_and_rocks_stand_beside_the_wheels():
    for row in ROWS:
        one = row.problem
        assert 0 <= one.leg < 6
        far = np.hypot(one.target[0] - one.place[0], one.target[1] - one.place[1])
        assert far < (4.0 if one.family == OUT_OF_REACH else 3.0)
        for _, _, diameter, height in one.ground.rocks:
            assert 0.0 < height <= 1.0
            assert diameter >= 0.2
    assert 0.5 < wheel_radius_of("stand") < 1.5


def test_problems_on_ground_that_is_not_here_are_left_out_and_it_is_said(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("benchmarks.steps.problem.REAL_GROUND", tmp_path)
    rows = chosen(None)
    assert len(rows) == len(ROWS) - COUNTS["lunar picture"] - COUNTS["fractal mesh"]
    assert "fractal mesh left out" in capsys.readouterr().err


def test_a_solvable_problem_is_planned_and_measured():
    row = first("over a rock")
    assert row.solvable
    scene = build(row.problem)
    line = planned(row.problem, scene, "line", 10.0)
    assert not line.found
    assert line.result.status is Status.NO_PATH
    outcome = planned(row.problem, scene, "auto", 10.0)
    assert outcome.found
    plan = outcome.result.plan
    assert plan is not None
    path = swing(plan)
    assert np.array_equal(path[0], plan.waypoints[plan.phases.index("swing") - 1, 6 * plan.leg : 6 * plan.leg + 6])
    assert len(path) == plan.phases.count("swing") + 1
    assert outcome.length >= np.linalg.norm(path[-1] - path[0]) - 1e-12
    assert outcome.clearance >= 0


def test_the_recheck_passes_a_good_path_and_fails_a_dragged_one():
    row = first("over a rock")
    scene, leg = build(row.problem), row.problem.leg
    plan = planned(row.problem, scene, "auto", 10.0).result.plan
    assert plan is not None
    situation = situation_of(row.problem, scene)
    meshes = CollisionScene(
        scene.robot, scene.state.posture, leg, scene.state.T_site_base, situation.ground.mesh, 0.0, 0.15
    )
    good = rechecked(row.problem, scene, plan, meshes)
    assert good.bad == ""
    own = slice(6 * leg, 6 * leg + 6)
    pieces = range(1, len(plan.phases))
    changes = [np.abs(plan.waypoints[i, own] - plan.waypoints[i - 1, own]).max() for i in pieces]
    assert good.postures >= sum(changes) / 0.002
    begin, end = plan.phases.index("swing") - 1, plan.phases.index("lower") - 1
    straight = replace(
        plan,
        waypoints=np.concatenate([plan.waypoints[: begin + 1], plan.waypoints[end:]]),
        phases=(*plan.phases[: begin + 1], "swing", *plan.phases[end + 1 :]),
    )
    assert "terrain" in rechecked(row.problem, scene, straight, meshes).bad


def test_what_comes_too_near_between_two_samples_is_not_accepted():
    # on this straight swing the wheel passes a ridge of ground 23 µm too near; no sample 0.005 rad apart shows it
    asked = replace(problem("steep fractal", 10048), target=(-1.275133177905105, -1.1223247104631486))
    scene = build(asked)
    situation = situation_of(asked, scene)
    straight = planned(asked, scene, "line", 30.0).result
    assert straight.plan is None
    assert "terrain collision in swing" in straight.reason
    plan = planned(asked, scene, "auto", 30.0).result.plan
    assert plan is not None
    meshes = CollisionScene(
        scene.robot,
        scene.state.posture,
        asked.leg,
        scene.state.T_site_base,
        situation.ground.mesh,
        0.0,
        situation.settings.raise_terrain,
    )
    assert rechecked(asked, scene, plan, meshes).bad == ""


def test_a_recheck_that_was_stopped_goes_on_where_it_was(monkeypatch, tmp_path):
    state, asked = tmp_path / "state.jsonl", []

    def scene(number, seed, most):
        asked.append(number)
        return Tally(number % 3, 100 * number + seed, 0.5, (f"scene {number}",) if number == 4 else ())

    monkeypatch.setattr(recheck_of_paths, "recheck", scene)
    *_, whole = tallies(8, 1, tmp_path / "other.jsonl")
    assert whole == Tally(9, 100 * sum(range(9)) + 9, 4.5, ("scene 4",))
    *_, some = tallies(4, 1, state)
    assert (some.paths, asked[-1]) == (4, 4)
    # stopped in the middle of a line: that scene is done again
    state.write_text(state.read_text()[:-5])
    asked.clear()
    begun, *_, last = tallies(8, 1, state)
    assert begun.paths == 3
    assert asked == [4, 5, 6, 7, 8]
    assert last == whole
    with pytest.raises(InvalidInput, match="another seed"):
        next(tallies(8, 2, state))


def test_one_scene_is_rechecked_the_same_again():
    first, again = (recheck(1, most=1) for _ in range(2))
    assert first.paths == 1
    assert first.postures > 100
    assert first.bad == ()
    assert replace(first, seconds=0.0) == replace(again, seconds=0.0)


def test_turning_is_the_sum_of_angles():
    assert turning(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0]])) == pytest.approx(np.pi)
    assert turning(np.array([[0.0, 0.0], [1.0, 2.0]])) == 0.0


def test_klampt_sees_the_same_leg_and_the_same_obstacles(rng):
    pytest.importorskip("klampt", reason="the peer klampt (extra `peers`) is not installed")
    from benchmarks.steps.klampt_peer import KlamptLeg

    row = first("payload under the chassis")
    scene, leg = build(row.problem), row.problem.leg
    posed = pose(row.problem, scene)
    assert not isinstance(posed, str)
    ground = posed.situation.ground.mesh
    theirs = KlamptLeg(scene.robot, scene.state, leg, ground)
    ours = CollisionScene(scene.robot, scene.state.posture, leg, scene.state.T_site_base, ground, 0.0, 0.15)
    q0 = posed.up[-1]
    blocked = differ = 0
    for q in np.clip(q0 + rng.normal(0.0, 0.5, (200, 6)), theirs.lower, theirs.upper):
        for part, T in theirs.poses(q).items():
            assert np.allclose(T, leg_link_poses(scene.robot, q, leg)[f"leg{leg}_{part}"], atol=1e-9)
        hit = ours.collides(q, "raised")
        blocked += hit
        differ += hit == theirs.free(q)
    assert 20 < blocked < 180
    # ours also refuses a link that is wholly below the ground
    assert differ <= 2
    seconds, path = theirs.search(q0, posed.downs[0][-1], 1, 30.0, perturbationRadius=0.4)
    assert path is not None
    assert 0 < seconds < 30.0
    # its ε is that of the Euclidean norm, so corners may be cut by less than our δ between its samples
    hits = [
        ours.collides(q, "raised")
        for a, b in itertools.pairwise(np.array(path))
        for _, q in samples(a, b, theirs.settings.epsilon)
    ]
    assert np.mean(hits) < 0.05
