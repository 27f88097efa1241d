"""How far apart the bodies of a legged robot are, pair by pair.

First by balls around them, then by convex hulls of their shapes, last by their meshes: the first two never say more
than the distance is, so what they call free is free.
"""

from itertools import combinations

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.meshes.bvh import bvh

LEAST_SHARE = 0.5
"""Of the distance at ease: bodies that are built nearer than their clearance may not come nearer than that."""


class BodyPairs:
    """Pairs of bodies that are to keep apart: all but those that a joint joins or that touch as they are built.

    pairs: (n, 2) bodies. least: (n,) [m], the clearance of each pair; see :meth:`at_ease`.
    """

    def __init__(self, robot: LeggedRobot) -> None:
        self._robot = robot
        shaped = [body for body, shapes in enumerate(robot.shapes) if shapes]
        joined = robot.touching | {(parent, body) for body, parent in enumerate(robot.parents) if parent >= 0}
        pairs = [pair for pair in combinations(shaped, 2) if pair not in joined]
        self.pairs = np.array(pairs, np.int64).reshape(-1, 2)
        self.least = np.array([robot.clearances[_kind(robot, *pair)] for pair in pairs])
        self._hulls = [[_hull(mesh) for mesh in shapes] for shapes in robot.shapes]
        self._meshes = [[bvh(mesh) for mesh in shapes] for shapes in robot.shapes]
        balls = [_ball(shapes) for shapes in robot.shapes]
        self._centers, self._radii = np.array([c for c, _ in balls]), np.array([r for _, r in balls])

    def at_ease(self, Ts_base_body: Array) -> None:
        """Lower the clearance of pairs that are built nearer: see LEAST_SHARE. Body poses: (bodies, 4, 4)."""
        self.least = np.minimum(self.least, LEAST_SHARE * np.maximum(self.distances(Ts_base_body), 0.0))

    def distances(self, Ts_base_body: Array) -> Array:
        """A lower bound of each pair's distance (n,) [m], exact where it is below the pair's clearance; 0: touching."""
        centers = np.einsum("bij,bj->bi", Ts_base_body[:, :3, :3], self._centers) + Ts_base_body[:, :3, 3]
        a, b = self.pairs.T
        found = np.linalg.norm(centers[a] - centers[b], axis=1) - self._radii[a] - self._radii[b]
        placed: dict[int, coal.Transform3s] = {}
        for row in np.flatnonzero(found < self.least):
            one, other = int(a[row]), int(b[row])
            for body in (one, other):
                if body not in placed:
                    placed[body] = coal.Transform3s(Ts_base_body[body, :3, :3], Ts_base_body[body, :3, 3])
            found[row] = _between(self._hulls, one, other, placed)
            if found[row] < self.least[row]:
                found[row] = max(_between(self._meshes, one, other, placed), 0.0)
        return found

    def pair_names(self, row: int) -> str:
        """The names of a pair."""
        return " and ".join(self._robot.body_names[int(body)] for body in self.pairs[row])


def _kind(robot: LeggedRobot, a: int, b: int) -> str:
    """Which clearance a pair of bodies keeps."""
    if a == 0:
        return "base"
    return "own_leg" if _leg(robot, a) == _leg(robot, b) else "other_leg"


def _leg(robot: LeggedRobot, body: int) -> int:
    return next(leg for leg in robot.legs if robot.slices[leg].start <= body - 1 < robot.slices[leg].stop)


def _between(shapes: list[list], a: int, b: int, placed: dict[int, coal.Transform3s]) -> float:
    """Least distance between the shapes of two bodies [m]; at most 0 where they touch."""
    request = coal.DistanceRequest()
    return min(
        float(coal.distance(one, placed[a], other, placed[b], request, coal.DistanceResult()))
        for one in shapes[a]
        for other in shapes[b]
    )


def _hull(mesh: Mesh) -> coal.ConvexBase:
    corners = coal.StdVec_Vec3s()
    for vertex in mesh.vertices:
        corners.append(np.array(vertex))
    return coal.ConvexBase.convexHull(corners, True, "Qt")


def _ball(shapes: tuple[Mesh, ...]) -> tuple[Array, float]:
    """Centre and radius of a ball around shapes [m]; nothing for none."""
    if not shapes:
        return np.zeros(3), 0.0
    points = np.concatenate([mesh.vertices for mesh in shapes])
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    return center, float(np.linalg.norm(points - center, axis=1).max())
