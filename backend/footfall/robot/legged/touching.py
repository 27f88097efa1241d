"""Which rigid bodies of a robot touch each other in every sampled posture, and which in none."""

from collections.abc import Mapping
from itertools import combinations

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.core.mesh import Mesh
from footfall.core.value import Value, value
from footfall.robot.legged.tree import RobotTree, TreeJoint
from footfall.robot.meshes.bvh import bvh


@value
class Touching(Value):
    """Pairs of bodies by the names of their first links, over ``samples`` postures drawn with ``seed``.

    always: touched in every posture: how they are built, not a collision. sometimes: pair as "a|b" → share of the
    postures. never: touched in none. What was seen in none of n samples has a share below 3/n with 95 % confidence.
    """

    samples: int
    seed: int
    always: tuple[tuple[str, str], ...]
    sometimes: Mapping[str, float]
    never: tuple[tuple[str, str], ...]


def touching(tree: RobotTree, samples: int = 200, seed: int = 0) -> Touching:
    """Sample postures evenly within the limits and ask coal which bodies' meshes touch."""
    bodies = {body: mesh for body in dict.fromkeys(tree.bodies().values()) if (mesh := body_mesh(tree, body))}
    models = {body: bvh(mesh) for body, mesh in bodies.items()}
    reaches = {body: _around(mesh) for body, mesh in bodies.items()}
    pairs = list(combinations(models, 2))
    counts = dict.fromkeys(pairs, 0)
    rng = np.random.default_rng(seed)
    request = coal.CollisionRequest()
    for _ in range(samples):
        poses = tree.poses(sampled(tree, rng))
        centers = {body: apply(poses[body], center) for body, (center, _) in reaches.items()}
        placed = {body: coal.Transform3s(poses[body][:3, :3], poses[body][:3, 3]) for body in models}
        for a, b in pairs:
            if np.linalg.norm(centers[a] - centers[b]) > reaches[a][1] + reaches[b][1]:
                continue
            counts[a, b] += (
                coal.collide(models[a], placed[a], models[b], placed[b], request, coal.CollisionResult()) > 0
            )
    return Touching(
        samples,
        seed,
        tuple(pair for pair in pairs if counts[pair] == samples),
        {"|".join(pair): counts[pair] / samples for pair in pairs if 0 < counts[pair] < samples},
        tuple(pair for pair in pairs if counts[pair] == 0),
    )


def sampled(tree: RobotTree, rng: np.random.Generator) -> dict[str, float]:
    """A posture drawn evenly within the limits; a whole turn where a joint has none."""
    return {joint.name: float(rng.uniform(*_range(joint))) for joint in tree.free()}


def body_mesh(tree: RobotTree, body: str) -> Mesh | None:
    """The collision shapes of a rigid body as one mesh in the frame of its first link; None where it has none."""
    Ts_root_link = tree.poses({})
    T_body_root = np.linalg.inv(Ts_root_link[body])
    vertices, triangles, count = [], [], 0
    for link in tree.members(body):
        for shape in link.shapes:
            vertices.append(apply(T_body_root @ Ts_root_link[link.name], shape.points))
            triangles.append(shape.mesh.triangles + count)
            count += len(shape.mesh.vertices)
    if not vertices:
        return None
    return Mesh(np.concatenate(vertices), np.concatenate(triangles).astype(np.int32))


def _around(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    """Centre and radius of a ball around a mesh [m]."""
    center = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return center, float(np.linalg.norm(mesh.vertices - center, axis=1).max())


def _range(joint: TreeJoint) -> tuple[float, float]:
    if joint.kind == "continuous" or not np.isfinite([joint.lower, joint.upper]).all():
        return (0.0, 0.0) if joint.kind == "prismatic" else (-np.pi, np.pi)
    return min(joint.lower, joint.upper), max(joint.lower, joint.upper)
