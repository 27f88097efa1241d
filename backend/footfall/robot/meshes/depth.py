"""By how much one thing is in another: for reports, after a collision was found.

A mesh is a surface, and an exact check of surfaces says only that they cut each other. How deep is told of their convex
hulls, by the expanding polytope algorithm of coal (van den Bergh, *Proximity queries and penetration depth computation
on 3D game objects*, GDC 2001).
"""

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot


def overlap(robot: Robot, posture: Array, link_a: str, link_b: str) -> float:
    """Length of the shortest shift that parts the hulls of two links, or of a link and the payload.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        link_a: name of the one.
        link_b: name of the other.

    Returns:
        At least what parts the meshes [m]; 0 where the hulls are apart.
    """
    (hull_a, pose_a), (hull_b, pose_b) = (_placed_hull(robot, posture, link) for link in (link_a, link_b))
    found = coal.distance(hull_a, pose_a, hull_b, pose_b, coal.DistanceRequest(), coal.DistanceResult())
    return max(-float(found), 0.0)


def _placed_hull(robot: Robot, posture: Array, link: str) -> tuple[coal.ConvexBase, coal.Transform3s]:
    if link == PAYLOAD:
        return _hull(robot_meshes(robot.description)[PAYLOAD]), coal.Transform3s()
    T_base_link = link_poses(robot, posture)[link]
    return _hull(robot.description.meshes[link]), coal.Transform3s(T_base_link[:3, :3], T_base_link[:3, 3])


def _hull(mesh: Mesh) -> coal.ConvexBase:
    corners = coal.StdVec_Vec3s()
    for vertex in mesh.vertices:
        corners.append(np.array(vertex))
    return coal.ConvexBase.convexHull(corners, True, "Qt")
