"""The whole rover's distances over many postures: the same answers as one pair and one posture at a time."""

import numpy as np
import pytest

import footfall
from footfall.planning.scene.ground import Nearby, nearby
from footfall.planning.scene.whole_body import GROUND_FAR, WholeBody
from footfall.robot.meshes.collision import posture_collisions
from tests.support.chassis_ground import wavy


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy([(0.6, 0.3, 0.5, 0.5)])
    ground = nearby(dem, np.zeros(2), 3.5, np.zeros((0, 3)))
    assert isinstance(ground, Nearby)
    return footfall.stand(athlete, dem), ground, WholeBody(athlete, ground)


def postures(robot, state, rng, count, spread):
    return np.clip(state.posture + rng.normal(0, spread, (count, 36)), robot.lower, robot.upper)


def test_too_near_is_what_the_pairwise_check_calls_a_collision(athlete, scene, rng):
    state, _, body = scene
    seen = []
    for q in postures(athlete, state, rng, 40, 0.7):
        near = body.own_gap(body.poses(q[None])).gap
        hits = posture_collisions(athlete, q, state.T_site_base)
        assert (near.spare < 0) == bool(hits), near
        if hits:
            worst = min(hit.distance - hit.required for hit in hits)
            assert near.spare == pytest.approx(worst, abs=1e-6)
        seen.append(bool(hits))
    assert 5 < sum(seen) < 35


def test_the_ground_is_what_the_pairwise_check_calls_a_collision(athlete, scene, rng):
    state, ground, body = scene
    seen = []
    for _ in range(30):
        q = postures(athlete, state, rng, 1, 0.25)[0]
        T = np.array(state.T_site_base)
        T[2, 3] += rng.uniform(-0.4, 0.7)
        near = body.ground_gap(T @ body.poses(q[None]), body.links, touching=athlete.legs).gap
        hits = [hit for hit in posture_collisions(athlete, q, T, ground.mesh) if hit.link_b == "terrain"]
        assert (near.spare < 0) == bool(hits), (near, hits)
        seen.append(bool(hits))
    assert 5 < sum(seen) < 25


def test_a_path_is_as_near_as_its_nearest_posture(athlete, scene, rng):
    state, _, body = scene
    a, b = postures(athlete, state, rng, 2, 0.3)
    path = a + np.linspace(0, 1, 40)[:, None] * (b - a)
    Ts = body.poses(path)
    own = [body.own_gap(one[None]).gap.spare for one in Ts]
    found = body.own_gap(Ts)
    assert found.gap.spare == pytest.approx(min(own), abs=1e-9)
    assert own[found.at] == pytest.approx(min(own), abs=1e-9)
    T = np.array(state.T_site_base)
    T[2, 3] -= 0.6
    links = [link for link in body.links if "wheel" not in link and "ankle_roll" not in link]
    ground = [body.ground_gap(T @ one[None], links).gap.spare for one in Ts]
    assert body.ground_gap(T @ Ts, links).gap.spare == pytest.approx(min(min(ground), GROUND_FAR), abs=1e-9)


def test_raised_ground_is_nearer_by_as_much(athlete, scene):
    state, _, body = scene
    T = np.array(state.T_site_base)
    T[2, 3] -= 0.95
    Ts = T @ body.poses(np.asarray(state.posture)[None])
    plain, raised = (body.ground_gap(Ts, ["base"], up).gap.spare for up in (0.0, 0.02))
    # the chassis is level and the highest ground is under it
    assert plain - raised == pytest.approx(0.02, abs=1e-3)


def test_a_body_wholly_under_the_ground_is_too_near(athlete, scene):
    state, _, body = scene
    T = np.array(state.T_site_base)
    T[2, 3] -= 4.0
    near = body.ground_gap(T @ body.poses(np.asarray(state.posture)[None]), ["base"]).gap
    assert near.spare < -1.0
