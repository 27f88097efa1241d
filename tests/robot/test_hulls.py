"""Hulls of meshes for coal: they hold every triangle, also of discs with many sides and of flat meshes."""

import coal
import numpy as np
import pytest
import trimesh

from footfall.core.mesh import Mesh
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.at_ease import at_ease
from footfall.robot.legged.apart import BodyPairs
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.meshes.bvh import bvh
from footfall.robot.meshes.hulls import FEW, hulls_around
from tests.support.urdf import replaced, written
from tests.support.walkers import ring

DISC = trimesh.creation.cylinder(radius=0.15, height=0.08, sections=600)
PLATE = trimesh.Trimesh([(0, -0.1, 0), (0.3, -0.1, 0), (0.3, 0.1, 0), (0, 0.1, 0)], [(0, 1, 2), (0, 2, 3)])


def mesh_of(made: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(made.vertices, np.float64), np.array(made.faces, np.int32))


@pytest.mark.parametrize(
    ("made", "whole"),
    [(trimesh.creation.box((0.3, 0.2, 0.1)), True), (DISC, False), (PLATE, True), (PLATE.subdivide_loop(4), False)],
    ids=["box", "disc", "plate", "fine plate"],
)
def test_a_ball_is_no_farther_from_the_hulls_than_from_the_mesh(made, whole):
    mesh = mesh_of(made)
    hulls, exact = hulls_around(mesh), bvh(mesh)
    ball, drawn = coal.Sphere(0.01), np.random.default_rng(7)
    near = 0
    for _ in range(300):
        T = coal.Transform3s(np.eye(3), drawn.uniform(-0.4, 0.4, 3))
        by_hulls, by_mesh = (
            min(
                coal.distance(one, coal.Transform3s(), ball, T, coal.DistanceRequest(), coal.DistanceResult())
                for one in shapes
            )
            for shapes in (hulls, [exact])
        )
        assert by_hulls <= by_mesh + 1e-5  # coal stops when it is about as near
        near += abs(by_hulls - by_mesh) < 1e-5
    # they are convex themselves
    assert near > 270
    assert (len(hulls) == 1) == whole
    assert len(hulls) <= 1 + len(mesh.triangles) // (FEW // 2)


def test_a_robot_of_such_shapes_stands(tmp_path):
    DISC.export(tmp_path / "disc.stl")
    PLATE.export(tmp_path / "plate.stl")
    change = replaced('<cylinder radius="0.15" length="0.08"/>', '<mesh filename="disc.stl"/>')
    urdf = replaced('<box size="0.1540 0.03 0.03"/>', '<mesh filename="plate.stl"/>')(change(ring(4)))
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, urdf))))
    assert at_ease(robot).stroke > 0.02
    flat = robot.body_names.index("l0_thigh")
    assert np.ptp(robot.corners[flat], axis=0).min() == 0.0
    whole = BodyPairs(robot)
    whole.least = np.full(len(whole.pairs), 0.05)
    for q in np.random.default_rng(5).uniform(robot.lower, robot.upper, (20, len(robot.lower))):
        assert np.isfinite(whole.distances(placed(robot, q).Ts_base_body)).all()
