"""Collision between parts of the rover by other means than the planner's scene, for the recheck of a finished path.

Own kinematics, vectorised over the path; link by link, nothing merged. A pair is passed over only where it is proven
to be farther apart than asked: by bounding balls and boxes, or by a separating direction (nearness_kernel.py). The
ground is in leg_over_ground.py.
"""

from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.planning.scene.nearness_kernel import pair_bounds
from footfall.robot.chain_kernel import FIXED, chain_poses
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.leg_frames import JOINT_AXES
from footfall.robot.meshes.bvh import bvh
from footfall.robot.meshes.shapes import box
from footfall.robot.model import Robot
from footfall.robot.proof.shells import point_shells

TOLERANCE = 1e-7
"""Least distances are exact to this [m]."""
_NEARLY = 1e-6
FAR = 0.5
"""Distances between parts of the rover above this are not measured [m]."""


def part_poses(robot: Robot, leg: int, qs: Array) -> dict[str, Array]:
    """Poses of a leg's parts, by part.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        qs: postures of the leg, (n, 6) [rad].

    Returns:
        For each part T_base_link, (n, 4, 4).
    """
    poses = leg_poses(robot, leg, qs)
    return {part: poses[:, i] for i, part in enumerate(PARTS)}


def leg_poses(robot: Robot, leg: int, qs: Array) -> Array:
    """Poses of a leg's parts.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        qs: postures of the leg, (n, 6) [rad].

    Returns:
        T_base_link, (n, 7, 4, 4).
    """
    return chain_poses(*leg_chain(robot, leg), np.ascontiguousarray(qs, float))


def leg_chain(robot: Robot, leg: int) -> tuple[Array, NDArray[np.int64]]:
    """A leg's parts as links of a chain, placements (7, 4, 4) in base and axes (7,): see chain_kernel.py."""
    return _placements(robot, leg), _AXES


_AXES = np.array([*JOINT_AXES, FIXED])


@lru_cache(maxsize=24)
def _placements(robot: Robot, leg: int) -> Array:
    """Of a leg's parts on one another at angle 0, the first in base, (7, 4, 4)."""
    spec = robot.description.legs[leg]
    along = [
        (0, 0, 0),
        spec.hip_offset,
        (spec.thigh, 0, 0),
        (0, 0, 0),
        (spec.shank, 0, 0),
        (0, 0, 0),
        (spec.foot, 0, 0),
    ]
    Ts = np.tile(np.eye(4), (len(along), 1, 1))
    Ts[:, :3, 3] = along
    Ts[0] = spec.T_base_hip
    return Ts


@dataclass(frozen=True)
class Gap:
    """How far two things are apart beyond what they must be [m]; negative where the clearance is broken."""

    spare: float
    between: str


@dataclass(frozen=True)
class Solid:
    """A mesh as a hierarchy, with the ball around it: vertices (n, 3), middle (3,) and radius [m]."""

    vertices: Array
    shape: coal.BVHModelOBBRSS
    middle: Array
    radius: float

    def boxes(self, Ts: Array) -> tuple[Array, Array]:
        """Lowest and highest corner of the box around it at each pose (n, 4, 4), (n, 3) each."""
        points = self.vertices @ np.swapaxes(Ts[:, :3, :3], 1, 2) + Ts[:, None, :3, 3]
        return points.min(axis=1), points.max(axis=1)


def solid(mesh: Mesh) -> Solid:
    """Of a mesh; equal meshes, as those of the legs, share one."""
    return _solid(mesh.vertices.tobytes(), mesh.triangles.tobytes())


@lru_cache(maxsize=64)
def _solid(vertices: bytes, triangles: bytes) -> Solid:
    points = np.frombuffer(vertices).reshape(-1, 3)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - middle, axis=1).max())
    return Solid(points, bvh(Mesh(points, np.frombuffer(triangles, np.int32).reshape(-1, 3))), middle, radius)


class LegAlongPath:
    """One leg along a path, everything else frozen."""

    def __init__(self, robot: Robot, posture: Array, leg: int, clearance: float) -> None:
        description = robot.description
        deltas, meshes = description.clearances, description.meshes
        self._robot, self._leg = robot, leg
        self._names = [link_name(leg, part) for part in PARTS]
        shapes = [meshes[name] for name in self._names] + [meshes["base"]]
        poses = link_poses(robot, posture)
        frozen = [("base", len(PARTS), poses["base"], dict(deltas.chassis))]
        for other in robot.legs:
            if other != leg:
                names = [link_name(other, part) for part in PARTS]
                frozen += [(n, i, poses[n], dict.fromkeys(PARTS, deltas.other_leg)) for i, n in enumerate(names)]
        if description.payload is not None:
            frozen.append(("payload", len(shapes), np.eye(4), dict.fromkeys(PARTS, deltas.payload)))
            shapes.append(box(description.payload.size, description.payload.position))
        self._bodies = [solid(mesh) for mesh in shapes]
        self._frozen_names = [name for name, *_ in frozen]
        own = [
            (PARTS.index(pair.part_a), PARTS.index(pair.part_b), pair.distance + clearance) for pair in deltas.own_leg
        ]
        self._shells, self._points = point_shells(shapes)
        self._frozen = np.array([T for _, _, T, _ in frozen]), np.array([body for _, body, _, _ in frozen])
        # NaN: this pair is never checked
        delta = np.array([[d.get(part, np.nan) for *_, d in frozen] for part in PARTS]) + clearance
        self._deltas = delta, np.array(own, float).reshape(-1, 3)

    def own_collision(self, qs: Array, more: float = 0.0) -> tuple[int, str] | None:
        """The first of n postures (n, 6) in which two parts of the rover are too close, and which.

        more: asked beyond every δ [m].
        """
        poses, bounds = self._bounds(qs, more, nearest=False)
        for index in np.flatnonzero(bounds <= more):
            at, a, T_a, b, T_b, delta, between = self._pair(poses, bounds, int(index))
            if touch(a.shape, T_a, b.shape, T_b, delta + more):
                return at, between
        return None

    def own_gap(self, qs: Array, below: float = FAR) -> tuple[int, Gap]:
        """The least spare distance between parts over n postures (n, 6) [m], exact below ``FAR`` and ``below``.

        Exact to ``TOLERANCE``: only pairs that are not proven to be farther apart than the nearest known are measured.
        """
        poses, bounds = self._bounds(qs, min(FAR, below), nearest=True)
        worst, least = 0, Gap(min(FAR, below), "nothing is nearer")
        while bounds.flat[index := int(np.argmin(bounds))] < least.spare - TOLERANCE:
            at, a, T_a, b, T_b, delta, between = self._pair(poses, bounds, index)
            spare = measured(a.shape, T_a, b.shape, T_b, delta, float(bounds.flat[index]), least.spare)
            bounds.flat[index] = np.inf
            if spare < least.spare:
                worst, least = at, Gap(spare, between)
        return worst, least

    def _bounds(self, qs: Array, below: float, nearest: bool) -> tuple[Array, Array]:
        """Poses of the leg's parts (n, 7, 4, 4), and lower bounds of what all pairs leave to spare (n, pairs)."""
        poses = leg_poses(self._robot, self._leg, qs)
        bounds = pair_bounds(self._shells, self._points, poses, *self._frozen, *self._deltas, below, nearest)
        return poses, bounds

    def _pair(self, poses: Array, bounds: Array, index: int) -> tuple[int, Solid, Array, Solid, Array, float, str]:
        """Posture, both things with their poses, required distance and names of a pair, by its place in ``bounds``."""
        at, pair = divmod(index, bounds.shape[1])
        (Ts_frozen, bodies), (deltas, own) = self._frozen, self._deltas
        part, i = divmod(pair, len(bodies))
        if part < len(PARTS):
            a, name, other, T_other, delta = part, self._frozen_names[i], int(bodies[i]), Ts_frozen[i], deltas[part, i]
        else:
            a, other, delta = own[pair - len(PARTS) * len(bodies)]
            a, other = int(a), int(other)
            name, T_other = self._names[other], poses[at, other]
        between = f"{self._names[a]} and {name}"
        return at, self._bodies[a], poses[at, a], self._bodies[other], T_other, float(delta), between


_DISTANCE = coal.DistanceRequest()


def _pose(T: Array) -> coal.Transform3s:
    return coal.Transform3s(T[:3, :3], T[:3, 3])


def touch(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, margin: float) -> bool:
    """Whether two solids are no farther apart than a margin.

    Args:
        a: the one, as the collision library has it.
        T_a: its pose, (4, 4).
        b: the other.
        T_b: its pose, (4, 4).
        margin: how far apart counts [m].

    Returns:
        True where they are not.
    """
    request = coal.CollisionRequest()
    request.security_margin = margin
    return coal.collide(a, _pose(T_a), b, _pose(T_b), request, coal.CollisionResult()) > 0


def distance(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, below: float) -> float:
    """Distance of two solids where it is small.

    Args:
        a: the one, as the collision library has it.
        T_a: its pose, (4, 4).
        b: the other.
        T_b: its pose, (4, 4).
        below: how small counts [m].

    Returns:
        The distance where it is less than that, else one not less than that [m].
    """
    known = coal.DistanceResult()
    known.min_distance = max(below, 0.0)
    found = coal.distance(a, _pose(T_a), b, _pose(T_b), _DISTANCE, known)
    return max(float(found), 0.0)


def measured(
    a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, delta: float, bound: float, below: float
) -> float:
    """Distance of two solids beyond what they must keep, where it is small.

    Args:
        a: the one, as the collision library has it.
        T_a: its pose, (4, 4).
        b: the other.
        T_b: its pose, (4, 4).
        delta: δ, what they must keep [m].
        bound: a lower bound of the answer [m]; of convex solids it is nearly the distance, and little is left to look
            at.
        below: how small counts [m].

    Returns:
        That distance where it is less than ``below``, else one not less than that [m].
    """
    near = min(bound + _NEARLY, below)
    spare = distance(a, T_a, b, T_b, near + delta) - delta
    if spare >= near and near < below:
        return distance(a, T_a, b, T_b, below + delta) - delta
    return spare
