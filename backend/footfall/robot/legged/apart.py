"""How far apart the bodies of a legged robot are, pair by pair.

First by balls around them, then by capsules, by convex hulls of their shapes, last by their meshes: what comes before
the meshes never says more than the distance is, so what it calls free is free.
"""

from itertools import combinations

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.legged.apart_kernel import bounds
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.meshes.bvh import bvh
from footfall.robot.meshes.hulls import hulls_around

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
        self._hulls = [[hull for mesh in shapes for hull in hulls_around(mesh)] for shapes in robot.shapes]
        self._meshes = [[bvh(mesh) for mesh in shapes] for shapes in robot.shapes]
        self._balls = np.array([_ball(shapes) for shapes in robot.shapes])
        self._capsules = np.array([_capsule(mesh) for shapes in robot.shapes for mesh in shapes]).reshape(-1, 7)
        self._starts = np.cumsum([0, *(len(shapes) for shapes in robot.shapes)])

    def at_ease(self, Ts_base_body: Array) -> None:
        """Lower the clearance of pairs that are built nearer: see LEAST_SHARE. Body poses: (bodies, 4, 4)."""
        self.least = np.minimum(self.least, LEAST_SHARE * np.maximum(self.distances(Ts_base_body), 0.0))

    def distances(self, Ts_base_body: Array) -> Array:
        """A lower bound of each pair's distance (n,) [m], exact where it is below the pair's clearance; 0: touching."""
        found, _ = self._bounds(Ts_base_body)
        placed: dict[int, coal.Transform3s] = {}
        for row in np.flatnonzero(found < self.least):
            found[row] = self._between(int(row), Ts_base_body, placed)
        return found

    def nearest(self, Ts_base_body: Array) -> tuple[float, int]:
        """The least of distance less clearance over all pairs [m], with :meth:`distances`, and the number of that pair.

        Pairs are asked for their distance only while their capsules leave it open whether theirs is the least.
        """
        found, least_by_capsules = self._bounds(Ts_base_body)
        spare = found - self.least
        at = np.where(spare < 0, np.inf, spare)
        nearest, row = float(at.min()), int(np.argmin(at))
        placed: dict[int, coal.Transform3s] = {}
        open_yet = np.flatnonzero(spare < 0)
        at_least = least_by_capsules[open_yet] - self.least[open_yet]
        for one in np.argsort(at_least, kind="stable"):
            if at_least[one] > nearest:
                break
            here = int(open_yet[one])
            size = self._between(here, Ts_base_body, placed) - float(self.least[here])
            if size < nearest:
                nearest, row = size, here
        return nearest, row

    def _bounds(self, Ts_base_body: Array) -> tuple[Array, Array]:
        return bounds(Ts_base_body, self._balls, self._capsules, self._starts, self.pairs)

    def _between(self, row: int, Ts_base_body: Array, placed: dict[int, coal.Transform3s]) -> float:
        """A pair's distance by hulls, and by meshes where those are nearer than its clearance [m]; 0: touching."""
        one, other = (int(body) for body in self.pairs[row])
        for body in (one, other):
            if body not in placed:
                placed[body] = coal.Transform3s(Ts_base_body[body, :3, :3], Ts_base_body[body, :3, 3])
        found = _between(self._hulls, one, other, placed)
        return found if found >= self.least[row] else max(_between(self._meshes, one, other, placed), 0.0)

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


def _ball(shapes: tuple[Mesh, ...]) -> Array:
    """Centre and radius of a ball around shapes, (4,) [m]; nothing for none."""
    if not shapes:
        return np.zeros(4)
    points = np.concatenate([mesh.vertices for mesh in shapes])
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(center, np.linalg.norm(points - center, axis=1).max())


def _capsule(mesh: Mesh) -> Array:
    """Both ends and the radius of a capsule around a shape, (7,) [m]."""
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    points = mesh.vertices - middle
    axis = np.linalg.svd(points, full_matrices=False)[2][0]
    along = points @ axis
    aside = np.linalg.norm(points - along[:, None] * axis, axis=1)
    cap = np.sqrt(aside.max() ** 2 - aside**2)
    # as short as holds every point; nothing is left of what is no longer than it is wide
    first, last = (along + cap).min(), (along - cap).max()
    first, last = (first, last) if first < last else ((first + last) / 2,) * 2
    return np.concatenate([middle + first * axis, middle + last * axis, [aside.max()]])
