"""By how much one thing is in another: for reports, after a collision was found.

A mesh is a surface, and an exact check of surfaces says only that they cut each other. How deep is told of their convex
hulls, by the expanding polytope algorithm of coal (van den Bergh, *Proximity queries and penetration depth computation
on 3D game objects*, GDC 2001).
"""

import coal

from footfall.core.arrays import Array
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.meshes.hulls import hulls_around
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
    (hulls_a, pose_a), (hulls_b, pose_b) = (_placed_hulls(robot, posture, link) for link in (link_a, link_b))
    found = (
        coal.distance(one, pose_a, other, pose_b, coal.DistanceRequest(), coal.DistanceResult())
        for one in hulls_a
        for other in hulls_b
    )
    return max(-float(min(found)), 0.0)


def _placed_hulls(robot: Robot, posture: Array, link: str) -> tuple[list[coal.CollisionGeometry], coal.Transform3s]:
    if link == PAYLOAD:
        return hulls_around(robot_meshes(robot.description)[PAYLOAD]), coal.Transform3s()
    T_base_link = link_poses(robot, posture)[link]
    return hulls_around(robot.description.meshes[link]), coal.Transform3s(T_base_link[:3, :3], T_base_link[:3, 3])
