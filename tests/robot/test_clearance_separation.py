"""Convex shells and the proof that two are apart, against coal's distances of the meshes."""

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core.errors import InvalidRobot
from footfall.core.mesh import Mesh
from footfall.robot.meshes import shapes
from footfall.robot.meshes.bvh import bvh
from footfall.robot.proof.separation import SCRATCH, apart, least_apart, support
from footfall.robot.proof.shells import CENTER, DISC, EXTENT, FIRST, LAST, REACH, point_shells, shells

MESHES = [
    shapes.box((0.5, 0.3, 0.15), (0.2, 0.0, 0.0)),
    shapes.box((0.17, 0.33, 0.15)),
    shapes.cylinder_y(0.242, 0.22, 48),
    shapes.prism(6, 2.75, 0.22, (0.0, 0.0, -0.11)),
    shapes.prism(5, 0.7, 0.4, (0.1, 0.0, 0.0)),
]


def random_poses(rng, count, spread):
    poses = np.empty((count, 3, 4))
    poses[:, :, :3] = Rotation.random(count, rng=rng).as_matrix()
    poses[:, :, 3] = rng.uniform(-spread, spread, (count, 3))
    return poses


def distance(mesh_a, pose_a, mesh_b, pose_b):
    a, b = (coal.Transform3s(pose[:, :3].copy(), pose[:, 3].copy()) for pose in (pose_a, pose_b))
    return coal.distance(mesh_a, a, mesh_b, b, coal.DistanceRequest(), coal.DistanceResult())


def test_meshes_are_inside_their_shells(rng):
    table, points = shells(MESHES)
    for i, mesh in enumerate(MESHES):
        local = mesh.vertices - table[i, CENTER : CENTER + 3]
        for direction in rng.normal(size=(200, 3)):
            farthest = np.array(support(table, points, i, *direction))
            assert farthest @ direction >= (local @ direction).max() - 1e-12
            assert np.linalg.norm(farthest) <= table[i, REACH] + 1e-12
            assert (np.abs(farthest) <= table[i, EXTENT : EXTENT + 3] + 1e-12).all()
    # a box is one point, a wheel one point and a disc, the rest their corners
    assert (table[:, LAST] - table[:, FIRST]).tolist() == [1, 1, 1, 12, 10]
    assert (table[:, DISC] > 0).tolist() == [False, False, True, False, False]


@pytest.mark.parametrize("a", range(5))
@pytest.mark.parametrize("b", range(5))
def test_what_is_called_apart_is_apart_and_little_is_missed(rng, a, b):
    table, points = shells(MESHES)
    scratch = np.empty((SCRATCH, 3))
    hierarchies = [bvh(mesh) for mesh in MESHES]
    count = 120
    poses_a = random_poses(rng, count, 0.2 + 0.6 * table[a, REACH])
    poses_b = random_poses(rng, count, 0.2 + 0.6 * table[b, REACH])
    found = missed = 0
    for i in range(count):
        exact = distance(hierarchies[a], poses_a[i], hierarchies[b], poses_b[i])
        ask = (table, points, a, poses_a, i, b, poses_b, i)
        assert not apart(*ask, max(exact, 0.0) + 1e-5, scratch)
        if exact > 0.01:
            # the drum is rounder than its mesh by R (1 − cos(π / 48))
            yes = apart(*ask, exact - 1e-5 - 0.0006 * ((a == 2) + (b == 2)), scratch)
            # one inside the other: coal measures to the surface, the shells are solid
            found += yes
            missed += not yes and not inside(table, a, poses_a[i], b, poses_b[i])
    assert found > 10
    assert missed <= 0.02 * found


def inside(table, a, pose_a, b, pose_b):
    middles = [pose[:, :3] @ table[i, CENTER : CENTER + 3] + pose[:, 3] for i, pose in ((a, pose_a), (b, pose_b))]
    return np.linalg.norm(middles[0] - middles[1]) < max(table[a, REACH], table[b, REACH])


def test_faces_that_lie_flat_on_each_other(rng):
    # the hard case for a search by support points: the nearest points are whole faces
    table, points = shells([shapes.box((0.84, 0.39, 0.19)), shapes.prism(6, 2.75, 0.22)])
    turned = Rotation.from_euler("xyz", (0.3, -0.2, 0.5)).as_matrix()
    for _ in range(200):
        poses = np.empty((2, 3, 4))
        poses[:, :, :3] = turned, turned @ Rotation.from_rotvec((0, 0, rng.uniform(-3, 3))).as_matrix()
        gap = rng.uniform(1e-3, 0.1)
        poses[0, :, 3] = 0.0
        poses[1, :, 3] = turned @ [*rng.uniform(-1, 1, 2), -(0.095 + 0.11 + gap)]
        scratch = np.empty((SCRATCH, 3))
        assert apart(table, points, 0, poses, 0, 1, poses, 1, gap - 1e-9, scratch)


def test_an_open_mesh_is_refused():
    box = shapes.box((1, 1, 1))
    with pytest.raises(InvalidRobot, match="closed"):
        shells([Mesh(box.vertices, box.triangles[:, ::-1].copy())])


@pytest.mark.parametrize("a", range(5))
@pytest.mark.parametrize("b", range(5))
def test_the_least_distance_of_hulls_is_that_of_their_meshes(rng, a, b):
    table, points = point_shells(MESHES)
    scratch = np.empty((SCRATCH, 3))
    hierarchies = [bvh(mesh) for mesh in MESHES]
    poses_a = random_poses(rng, 80, 0.2 + 0.6 * table[a, REACH])
    poses_b = random_poses(rng, 80, 0.2 + 0.6 * table[b, REACH])
    reached = apart_ones = 0
    for i in range(80):
        exact = distance(hierarchies[a], poses_a[i], hierarchies[b], poses_b[i])
        ask = (table, points, a, poses_a, i, b, poses_b, i)
        bound = least_apart(*ask, np.inf, scratch)
        assert bound <= max(exact, 0.0) + 1e-6
        for enough in (0.02, 0.2):
            # what is told early is a bound as well, and enough
            early = least_apart(*ask, enough, scratch)
            assert early <= bound + 1e-9
            assert early >= min(bound, enough) - 1e-9
        if exact > 0.01 and not inside(table, a, poses_a[i], b, poses_b[i]):
            apart_ones += 1
            reached += bound > exact - 1e-6
    assert apart_ones > 10
    assert reached >= 0.98 * apart_ones
