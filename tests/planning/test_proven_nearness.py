"""What is proven not to be the nearest is left out of the search: it finds the same with that and without."""

import numpy as np
import pytest

import footfall
from footfall.core.frames import rotation
from footfall.planning.scene import whole_body
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.ground_piece import GroundPiece
from footfall.planning.scene.least import least
from footfall.planning.scene.nearest_kernel import ground_bounds, near_triangles, own_bounds
from footfall.planning.scene.solids import distance
from footfall.planning.scene.whole_body import WholeBody
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.meshes.bvh import bvh
from footfall.robot.model import Robot
from footfall.terrain.generate import fractal
from footfall.terrain.ground.triangulate import triangulate

ROWS = 6
PATHS = 14


def body_over(robot, dem):
    return WholeBody(robot, Nearby(dem, np.zeros(dem.heights.shape, bool)), 0.01)


@pytest.fixture(scope="module")
def scenes(athlete):
    """An empty rover on rolling ground, and one with a payload that hangs below the deck on steep ground."""
    loaded = Robot(with_payload(athlete.description, 200.0, (0.8, 0.7, 0.5), (0.1, -0.1, -0.35)))
    even, steep = fractal(9.0, 0.05, 0.05, 0.8, 3), fractal(9.0, 0.05, 0.12, 0.8, 5)
    return [(footfall.stand(robot, dem), body_over(robot, dem)) for robot, dem in ((athlete, even), (loaded, steep))]


@pytest.fixture
def paths(scenes, rng):
    """(body, T_site_base, T_base_link of ROWS postures, legs that touch) near the stance and far from it."""
    found = []
    for i in range(PATHS):
        state, body = scenes[i % 2]
        robot, spread = body.robot, (0.01, 0.1, 0.3, 0.8)[i // 2 % 4]
        ends = np.clip(state.posture + rng.normal(0, spread, (2, 36)), robot.lower, robot.upper)
        T = np.array(state.T_site_base)
        T[:3, :3] = T[:3, :3] @ rotation("x", rng.normal(0, 0.1)) @ rotation("z", rng.uniform(-3, 3))
        T[2, 3] += rng.uniform(-0.3, 0.6) if i % 3 else -0.9
        postures = ends[0] + np.linspace(0, 1, ROWS)[:, None] * (ends[1] - ends[0])
        found.append((body, T, body.poses(postures), rng.choice(6, 2, replace=False).tolist()))
    return found


def without_proof(bounds):
    """As a kernel of nearest_kernel.py, with nothing proven beyond its coarse bounds."""

    def coarse_only(*asked):
        coarse, finer, *boxes = bounds(*asked)
        return coarse, np.full_like(finer, -np.inf), *boxes

    return coarse_only


def nearest(paths):
    found = []
    for body, T, Ts, touching in paths:
        feet = {link_name(leg, "wheel") for leg in body.robot.legs} - {link_name(leg, "wheel") for leg in touching}
        above = [link for link in body.links if link not in feet]
        for one in (
            body.own_gap(Ts),
            body.own_gap(Ts, [link_name(touching[0], part) for part in PARTS]),
            body.ground_gap(T @ Ts, body.links, touching=touching),
            body.ground_gap(T @ Ts, above, 0.03),
            body.ground_gap(T @ Ts[2:3], ["base"]),
        ):
            found.append((one.gap.spare, one.gap.between, one.at))
    return found


def test_the_search_finds_the_same_without_what_is_proven(paths, monkeypatch):
    found = nearest(paths)
    for name in ("own_bounds", "ground_bounds"):
        monkeypatch.setattr(whole_body, name, without_proof(getattr(whole_body, name)))
    assert found == nearest(paths)
    too_near = np.array([spare < 0 for spare, *_ in found])
    assert 10 < too_near.sum() < len(found) - 10


def test_fewer_meshes_are_asked_than_without(paths, monkeypatch):
    asked = []
    measured = whole_body._distance
    monkeypatch.setattr(whole_body, "_distance", lambda *bodies: asked.append(1) or measured(*bodies))
    nearest(paths)
    with_proof = len(asked)
    for name in ("own_bounds", "ground_bounds"):
        monkeypatch.setattr(whole_body, name, without_proof(getattr(whole_body, name)))
    nearest(paths)
    assert with_proof < (len(asked) - with_proof) / 3


def test_nothing_is_nearer_than_proven(paths, rng):
    """Against the meshes of single pairs, near and far ones; of ground against all of its triangles."""
    hits = 0
    for body, T, Ts, _ in paths[:8]:
        hulls = body._hulls[[one.hull for one in body._bodies]]
        coarse, finer = own_bounds(hulls, body._points, Ts, body._pairs, body._deltas, np.inf)
        assert (finer >= coarse).all()
        near = np.argsort(finer.min(axis=0))
        for column in np.concatenate([near[:8], rng.choice(near[8:60], 7)]):
            at = int(np.argmin(finer[:, column]))
            (a, b), delta = body._pairs[column], body._deltas[column]
            away = distance(body._bodies[a].shape, Ts[at, a], body._bodies[b].shape, Ts[at, b], np.inf)
            assert finer[at, column] <= away - delta + 1e-9
            hits += away == 0
        Ts_site_link, deltas = T @ Ts, np.zeros(len(body.links))
        on_ground = body._hulls[[*(one.hull for one in body._bodies), -2, -1]]
        coarse, finer, _ = ground_bounds(on_ground, body._points, Ts_site_link, deltas, body._ground, 0.5, 0.5)
        surface = bvh(triangulate(body.ground.dem))
        for at, link in zip(rng.integers(0, ROWS, 6), rng.integers(0, len(body.links), 6), strict=True):
            away = distance(body._bodies[link].shape, Ts_site_link[at, link], surface, np.eye(4), np.inf)
            assert max(coarse[at, link], finer[at, link]) <= away + 1e-9
    assert hits > 0


def test_a_few_triangles_are_as_near_as_all(scenes, rng):
    """The rims of wheels at random above steep ground; the others are farther than was asked for."""
    _, body = scenes[1]
    wheel = body._bodies[-1]
    own = body._hulls[[wheel.hull, -2, -1]]
    dem = body.ground.dem
    rows, cols = (slice(20, size - 20) for size in dem.heights.shape)
    piece = GroundPiece(dem, rows, cols)
    for within in rng.uniform(0.01, 0.3, 30):
        T = np.eye(4)
        T[:3, :3] = rotation("x", rng.uniform(-1, 1)) @ rotation("z", rng.uniform(-3, 3))
        T[:3, 3] = *rng.uniform(-1.5, 1.5, 2), 0.0
        T[2, 3] = rng.uniform(0.2, 0.7) + dem.heights[dem.heights.shape[0] // 2, dem.heights.shape[1] // 2]
        away = distance(wheel.shape, T, piece.shape, np.eye(4), np.inf)
        few = near_triangles(own, body._points, T[None], within, body._ground)
        if away > within:
            assert not len(few)
        else:
            assert distance(wheel.shape, T, piece.few(few), np.eye(4), np.inf) == away


def test_the_least_is_the_least_of_all(rng):
    """Values that differ by no more than their rows are apart, bounds by any amount below."""
    for _ in range(60):
        n, k = rng.integers(1, 12), rng.integers(1, 9)
        place = np.cumsum(rng.uniform(0, 0.2, n))
        values = np.abs(place[:, None] - rng.uniform(-1, 3, k)) - rng.uniform(0, 0.3, k)
        coarse = values - rng.exponential(0.3, (n, k))
        finer = np.maximum(coarse, values - rng.choice([0.0, 0.2], (n, k)))
        apart = np.abs(place[:, None] - place)
        found = least(coarse, finer, lambda *of, values=values: values[of], lambda at, _, apart=apart: apart[at], 0.5)
        if values.min() >= 0.5:
            assert found == (0.5, 0, -1)
        else:
            assert found[0] == values.min() == values[found[1:]]
