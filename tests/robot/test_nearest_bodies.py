"""Which bodies of a legged robot are nearest to each other: capsules first, held against every pair's distance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from footfall.io.any_robot import load_legged
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.apart import BodyPairs
from footfall.robot.legged.apart_kernel import segment_distance
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from tests.support.urdf import written
from tests.support.walkers import ring


def drawn(robot: LeggedRobot, count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(robot.lower, robot.upper, (count, len(robot.lower)))


def ring_of(folder, legs: int) -> LeggedRobot:
    return LeggedRobot(legged_model(read_urdf(written(folder, ring(legs)))))


@pytest.mark.parametrize("least", [0.1, 0.4])
@pytest.mark.parametrize("name", ["ambler", 3, 6])
def test_the_nearest_pair_is_that_of_all_distances(name, least, tmp_path):
    robot = load_legged(name) if isinstance(name, str) else ring_of(tmp_path, name)
    apart = BodyPairs(robot)
    apart.least = np.full(len(apart.pairs), least)
    below = 0
    for q in drawn(robot, 40):
        Ts = placed(robot, q).Ts_base_body
        spare = apart.distances(Ts) - apart.least
        size, row = apart.nearest(Ts)
        assert size == spare.min()
        assert spare[row] == size
        below += size < 0
    assert below > 1


def test_capsules_hold_their_shapes_and_are_never_too_far_apart():
    robot = load_legged("ambler")
    apart = BodyPairs(robot)
    meshes = [mesh for shapes in robot.shapes for mesh in shapes]
    for mesh, capsule in zip(meshes, apart._capsules, strict=True):
        first, last, radius = capsule[:3], capsule[3:6], capsule[6]
        for point in mesh.vertices:
            assert segment_distance(first, last, point, point) <= radius + 1e-9
    for q in drawn(robot, 10):
        Ts = placed(robot, q).Ts_base_body
        by_balls, by_capsules = apart._bounds(Ts)
        apart.least = np.full(len(apart.pairs), np.inf)  # every distance is exact
        distances = apart.distances(Ts)
        assert (by_balls <= distances + 1e-9).all()
        assert (by_capsules <= distances).all()
        assert (by_capsules > by_balls).mean() > 0.5


@settings(max_examples=200, deadline=None, derandomize=True)
@given(ends=arrays(float, (4, 3), elements=st.floats(-3, 3)), alike=st.sampled_from(["", "pq", "rs", "pr", "parallel"]))
def test_the_distance_of_segments_is_the_least_of_their_points(ends, alike):
    p, q, r, s = ends
    q, s = (p if alike == "pq" else q), (r if alike == "rs" else s)
    r = p if alike == "pr" else r
    s = r + 0.7 * (q - p) if alike == "parallel" else s
    found = segment_distance(p, q, r, s)
    shares = np.linspace(0, 1, 41)
    one, other = p + shares[:, None] * (q - p), r + shares[:, None] * (s - r)
    sampled = np.linalg.norm(one[:, None] - other, axis=2).min()
    step = (np.linalg.norm(q - p) + np.linalg.norm(s - r)) / 80
    assert sampled - step - 1e-6 <= found <= sampled + 1e-6
