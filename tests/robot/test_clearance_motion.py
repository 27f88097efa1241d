"""Motion bounds and the adaptive check of a path: what is called clear as a whole is clear everywhere on it."""

import itertools

import numpy as np
import pytest

from benchmarks.clearance import clear_span
from footfall.core.frames import apply
from footfall.planning.scene.solids import part_poses
from footfall.robot.description import PARTS, with_payload
from footfall.robot.meshes.bvh import robot_meshes
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import MODES, LegClearance, clearance_ground
from footfall.robot.proof.leg_clearance_kernel import _motion, leg_is_clear, leg_stays_clear, path_is_clear, place_leg
from footfall.robot.proof.leg_span_kernel import UNSURE, _speed, _twists, line_bends
from footfall.robot.proof.shells import CENTER
from footfall.terrain.generate import fractal
from footfall.terrain.ground.triangulate import triangulate

RAISED = 0.15


def scene(robot, leg, seed, clearance=0.0):
    rng = np.random.default_rng(seed)
    dem = fractal(size=6.0, resolution=0.05, roughness=0.1, hurst=0.8, seed=seed)
    posture, T_site_base = robot.posture("stand"), np.eye(4)
    T_site_base[2, 3] = 1.3 + rng.uniform(0, 0.3)
    ground = clearance_ground(robot, dem.heights, dem.geometry, clearance)
    arguments = (robot, posture, leg, T_site_base)
    compiled = LegClearance(*arguments, ground, clearance, RAISED)
    return rng, posture, compiled, CollisionScene(*arguments, triangulate(dem), clearance, RAISED)


def lifted(robot, posture, leg, rng, count):
    own = slice(6 * leg, 6 * leg + 6)
    q = posture[own] - (0, 0.35, 0, 0, 0, 0) + 0.3 * rng.normal(size=(count, 6))
    return np.clip(q, robot.lower[own], robot.upper[own])


@pytest.mark.parametrize("size", [0.001, 0.05, 0.5])
def test_no_point_of_a_link_moves_farther_than_its_bound(athlete, size):
    rng = np.random.default_rng(int(1000 * size))
    _, posture, compiled, _ = scene(athlete, 1, 3)
    tables, meshes = compiled.tables, robot_meshes(athlete.description)
    tightest = np.inf
    for q in lifted(athlete, posture, 1, rng, 20):
        turns = rng.uniform(0, size, 6) * rng.integers(0, 2, 6)
        poses, moved = np.empty((7, 3, 4)), np.empty((7, 7))
        place_leg(q, tables.T_site_hip, tables.lengths, poses)
        _motion(turns, poses, tables.shells, tables.reach, moved)
        others = q + turns * rng.choice([-1.0, 1.0, 0.3], (40, 6))
        before, after = part_poses(athlete, 1, q[None]), part_poses(athlete, 1, others)
        for i, part in enumerate(PARTS):
            points = meshes[part].vertices
            start = apply(before[part][0], points)
            travel = max(np.linalg.norm(apply(T, points) - start, axis=1).max() for T in after[part])
            assert travel <= moved[i, 0] + 1e-12
            # as seen from each part nearer to the hip
            for near in range(min(i, 5)):
                seen = [
                    np.linalg.norm(
                        apply(np.linalg.inv(T_near) @ T, points)
                        - apply(np.linalg.inv(before[PARTS[near]][0]) @ before[part][0], points),
                        axis=1,
                    ).max()
                    for T_near, T in zip(after[PARTS[near]], after[part], strict=True)
                ]
                assert max(seen) <= moved[i, near + 1] + 1e-12
            if travel > 0:
                tightest = min(tightest, moved[i, 0] / travel)
    # a bound that is never near to what happens would be of no use
    assert tightest < 2


@pytest.mark.parametrize(("leg", "payload", "clearance"), [(0, 0.0, 0.0), (4, 200.0, 0.02)])
@pytest.mark.parametrize("mode", ["none", "true", "raised"])
def test_where_a_leg_stays_clear_no_angle_within_collides(athlete, leg, payload, clearance, mode):
    robot = Robot(with_payload(athlete.description, payload))
    rng, posture, compiled, exact = scene(robot, leg, 5, clearance)
    yes = 0
    for q in lifted(robot, posture, leg, rng, 250):
        turns = rng.uniform(0, rng.choice([0.005, 0.03, 0.1]), 6)
        if leg_stays_clear(q, turns, compiled.tables, MODES[mode]):
            yes += 1
            assert leg_is_clear(q, compiled.tables, MODES[mode])
            corners = q + turns * rng.choice([-1.0, 1.0], (8, 6))
            for other in np.concatenate([corners, q + turns * rng.uniform(-1, 1, (8, 6))]):
                assert not exact.collides(other, mode), (q.tolist(), turns.tolist())
    assert yes > 20


def test_a_leg_that_does_not_turn_is_as_clear_as_ever(athlete):
    rng, posture, compiled, _ = scene(athlete, 2, 7)
    for q in lifted(athlete, posture, 2, rng, 200):
        for mode in MODES.values():
            assert leg_stays_clear(q, np.zeros(6), compiled.tables, mode) == leg_is_clear(q, compiled.tables, mode)
    assert not leg_stays_clear(np.full(6, np.nan), np.zeros(6), compiled.tables, MODES["none"])


@pytest.mark.parametrize("mode", ["none", "true", "raised"])
def test_samples_called_clear_on_a_path_are_free_and_none_is_missed(athlete, mode):
    rng, posture, compiled, exact = scene(athlete, 3, 11)
    checked = 0
    for _ in range(6):
        ends = lifted(athlete, posture, 3, rng, 3)
        qs = np.concatenate([a + np.linspace(0, 1, 90)[:, None] * (b - a) for a, b in itertools.pairwise(ends)])
        found = path_is_clear(qs, compiled.tables, MODES[mode])
        alone = compiled.certified(qs, mode)
        assert (found | ~alone).all()
        for q in qs[found][::3]:
            checked += 1
            assert not exact.collides(q, mode)
    assert checked > 30
    assert path_is_clear(np.empty((0, 6)), compiled.tables, MODES[mode]).shape == (0,)
    assert path_is_clear(qs[:1], compiled.tables, MODES[mode]).tolist() == alone[:1].tolist()


def placed(q, tables):
    poses = np.empty((7, 3, 4))
    place_leg(q, tables.T_site_hip, tables.lengths, poses)
    return poses


@pytest.mark.parametrize("size", [0.001, 0.1, 1.0])
def test_no_point_of_a_link_moves_farther_along_a_line_than_its_bounds(athlete, size):
    rng = np.random.default_rng(int(1000 * size))
    _, posture, compiled, _ = scene(athlete, 1, 3)
    tables, meshes = compiled.tables, robot_meshes(athlete.description)
    tightest = np.inf
    for q in lifted(athlete, posture, 1, rng, 30):
        d, s = rng.normal(size=6) * rng.integers(0, 2, 6), size * rng.uniform(0.2, 1.0)
        poses, twists = placed(q, tables), np.empty((7, 6))
        bends, rates = line_bends(d, tables)
        _twists(d, poses, twists)
        before, after = part_poses(athlete, 1, q[None]), part_poses(athlete, 1, np.array([q + s * d, q - s * d]))
        for i, part in enumerate(PARTS):
            points = meshes[part].vertices
            for near in range(-1, min(i, 5)):

                def seen(poses, at, part=part, near=near, points=points):
                    T = poses[part][at]
                    return apply(T if near < 0 else np.linalg.inv(poses[PARTS[near]][at]) @ T, points)

                travel = max(np.linalg.norm(seen(after, at) - seen(before, 0), axis=1).max() for at in range(2))
                v = _speed(twists, poses, tables.shells, tables.reach, i, near)
                assert travel <= v * s + bends[i, near + 1] * s * s + 1e-12
                assert travel <= rates[i, near + 1] * s + 1e-12
                if travel > 0 and near < 0:
                    tightest = min(tightest, (v * s + bends[i, 0] * s * s) / travel)
    # a bound that is never near to what happens would be of no use
    assert tightest < (1.5 if size < 0.01 else 4)


@pytest.mark.parametrize(("leg", "payload", "clearance"), [(0, 0.0, 0.0), (4, 200.0, 0.02)])
@pytest.mark.parametrize("mode", ["none", "true", "raised"])
def test_within_a_clear_span_no_posture_collides(athlete, leg, payload, clearance, mode):
    robot = Robot(with_payload(athlete.description, payload))
    rng, posture, compiled, exact = scene(robot, leg, 5, clearance)
    spans, whole = [], 0
    for q in lifted(robot, posture, leg, rng, 250):
        d = rng.normal(size=6)
        most = float(rng.choice([0.02, 0.1, 0.5]))
        found = clear_span(q, d, most, compiled.tables, mode)
        alone = leg_is_clear(q, compiled.tables, MODES[mode])
        assert (found >= 0.0) == alone
        assert found <= most
        if found > 0.0:
            spans.append(found)
            whole += found == most
            for s in (-found, found, *rng.uniform(-found, found, 10)):
                assert not exact.collides(q + s * d, mode), (q.tolist(), d.tolist(), s)
    assert len(spans) > 20
    assert 0 < whole < len(spans)
    assert clear_span(q, np.zeros(6), 1.0, compiled.tables, mode) in (UNSURE, 1.0)


def test_the_reach_holds_every_ball_of_the_cover(athlete):
    _, _, compiled, _ = scene(athlete, 0, 1)
    tables = compiled.tables
    for mode in (0, 1):
        for part in range(7):
            first, last = tables.trees[mode, part]
            middles = tables.balls[first:last, :3] - tables.shells[part, CENTER : CENTER + 3]
            assert np.linalg.norm(middles, axis=1).max() <= tables.reach[part] + 1e-12
