"""Collision geometry: FootFall meshes as coal bounding-volume hierarchies."""

import coal
import numpy as np

from footfall.core.mesh import Mesh
from footfall.robot.description import PARTS, RobotDescription, link_name
from footfall.robot.meshes import shapes

TOUCHING_WHEEL = "touching_wheel"
"""Shape name of the wheel made smaller by ``clearances.wheel_sink``, for wheels that touch the ground."""

PAYLOAD = "payload"
"""Shape name, and name in reports, of the payload's box."""


def bvh(mesh: Mesh) -> coal.BVHModelOBBRSS:
    """The hierarchy of a mesh. It is a surface: a body inside a closed mesh does not touch it."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.triangles), len(mesh.vertices))
    model.addVertices(np.array(mesh.vertices))
    model.addTriangles(np.array(mesh.triangles))
    model.endModel()
    model.computeLocalAABB()
    return model


def mesh_reach(description: RobotDescription) -> float:
    """How far from its hip-yaw joint any point of a leg may get [m]."""
    meshes = robot_meshes(description)
    sizes = [np.linalg.norm(meshes[part].vertices, axis=1).max() for part in PARTS]
    return float(max(description.legs[0].reaches + sizes))


def robot_meshes(description: RobotDescription) -> dict[str, Mesh]:
    """Collision meshes by part (all legs have the same), with "base", TOUCHING_WHEEL and, if carried, PAYLOAD."""
    meshes = {part: description.meshes[link_name(0, part)] for part in PARTS} | {"base": description.meshes["base"]}
    sink = description.clearances.wheel_sink
    meshes[TOUCHING_WHEEL] = shapes.cylinder_y(
        description.wheel_radius - sink, description.wheel_width - 2 * sink, description.wheel_sides
    )
    if description.payload is not None:
        meshes[PAYLOAD] = shapes.box(description.payload.size, description.payload.position)
    return meshes
