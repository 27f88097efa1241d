"""Collision between parts of the rover by other means than the planner's scene, for the recheck of a finished path.

Own kinematics, vectorised over the path; link by link, nothing merged. A pair is passed over only where its
bounding balls or boxes are farther apart than the clearance. The ground is in leg_over_ground.py.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import coal
import numpy as np

from footfall.core.frames import apply, rotation, transform
from footfall.core.mesh import Mesh
from footfall.planning.step.edges import Array
from footfall.robot.bvh import bvh
from footfall.robot.description import JOINTS, PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.robot.shapes import box

FAR = 0.5
"""Distances between parts of the rover above this are not measured [m]."""


def part_poses(robot: Robot, leg: int, qs: Array) -> dict[str, Array]:
    """part → T_base_link (n, 4, 4) of a leg at joint angles (n, 6) [rad]."""
    spec = robot.description.legs[leg]
    along = [(0, 0, 0), spec.hip_offset, (spec.thigh, 0, 0), (0, 0, 0), (spec.shank, 0, 0), (0, 0, 0)]
    T = np.tile(spec.T_base_hip, (len(qs), 1, 1))
    out = {}
    for i, ((part, axis), offset) in enumerate(zip(JOINTS, along, strict=True)):
        turned = np.tile(np.eye(4), (len(qs), 1, 1))
        turned[:, :3, :3] = rotation(axis, qs[:, i])
        T = T @ transform(translation=offset) @ turned
        out[part] = T
    out["wheel"] = T @ transform(translation=(spec.foot, 0, 0))
    return out


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

    def middles(self, Ts: Array) -> Array:
        """The middle at each pose (n, 4, 4), (n, 3)."""
        return Ts[:, :3, :3] @ self.middle + Ts[:, :3, 3]

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


class Solids:
    """One leg along a path, everything else frozen."""

    def __init__(self, robot: Robot, posture: Array, leg: int, clearance: float) -> None:
        description = robot.description
        deltas = description.clearances
        self._robot, self._leg = robot, leg
        self._names = {part: link_name(leg, part) for part in PARTS}
        self._moving = {part: solid(description.meshes[name]) for part, name in self._names.items()}
        poses = link_poses(robot, posture)
        frozen = [("base", solid(description.meshes["base"]), poses["base"], dict(deltas.chassis))]
        for other, part in product(robot.legs, PARTS):
            if other != leg:
                link = link_name(other, part)
                frozen.append(
                    (link, solid(description.meshes[link]), poses[link], dict.fromkeys(PARTS, deltas.other_leg))
                )
        if description.payload is not None:
            body = solid(box(description.payload.size, description.payload.position))
            frozen.append(("payload", body, np.eye(4), dict.fromkeys(PARTS, deltas.payload)))
        self._frozen = [(name, body, T) for name, body, T, _ in frozen]
        self._middles = np.array([apply(T, body.middle) for _, body, T in self._frozen])
        self._radii = np.array([body.radius for _, body, _ in self._frozen])
        self._low, self._high = np.concatenate([body.boxes(T[None]) for _, body, T in self._frozen], axis=1)
        # NaN: this pair is never checked
        self._delta = {part: np.array([d.get(part, np.nan) for *_, d in frozen]) + clearance for part in PARTS}
        self._own = [(pair.part_a, pair.part_b, pair.distance + clearance) for pair in deltas.own_leg]

    def own_collision(self, qs: Array) -> tuple[int, str] | None:
        """The first of n postures (n, 6) in which two parts of the rover are too close, and which."""
        for _, at, a, T_a, b, T_b, delta, between in self._pairs(qs, 0.0, nearest_first=False):
            if touch(a.shape, T_a, b.shape, T_b, delta):
                return at, between
        return None

    def own_gap(self, qs: Array, below: float = FAR) -> tuple[int, Gap]:
        """The least spare distance between parts of the rover over n postures, exact below ``FAR`` and ``below``."""
        worst, least = 0, Gap(min(FAR, below), "nothing is nearer")
        for bound, at, a, T_a, b, T_b, delta, between in self._pairs(qs, least.spare, nearest_first=True):
            if bound >= least.spare:
                break
            spare = distance(a.shape, T_a, b.shape, T_b, least.spare + delta) - delta
            if spare < least.spare:
                worst, least = at, Gap(spare, between)
        return worst, least

    def _pairs(
        self, qs: Array, within: float, nearest_first: bool
    ) -> Iterator[tuple[float, int, Solid, Array, Solid, Array, float, str]]:
        """Pairs whose balls and boxes leave at most ``within`` to spare, which comes first; by posture, or by it."""
        poses = part_poses(self._robot, self._leg, qs)
        middles = {part: body.middles(poses[part]) for part, body in self._moving.items()}
        boxes = {part: body.boxes(poses[part]) for part, body in self._moving.items()}
        spare = np.empty((len(qs), len(PARTS) * len(self._frozen) + len(self._own)))
        for i, (part, body) in enumerate(self._moving.items()):
            balls = np.linalg.norm(self._middles - middles[part][:, None], axis=2) - self._radii - body.radius
            low, high = boxes[part]
            apart = np.maximum(balls, boxes_apart(low[:, None], high[:, None], self._low, self._high))
            spare[:, i * len(self._frozen) : (i + 1) * len(self._frozen)] = apart - self._delta[part]
        for i, (a, b, delta) in enumerate(self._own, len(PARTS) * len(self._frozen)):
            balls = np.linalg.norm(middles[a] - middles[b], axis=1) - self._moving[a].radius - self._moving[b].radius
            spare[:, i] = np.maximum(balls, boxes_apart(*boxes[a], *boxes[b])) - delta
        flat = spare.ravel()
        near = np.flatnonzero(flat <= within)
        for index in near[np.argsort(flat[near], kind="stable")] if nearest_first else near:
            at, pair = divmod(int(index), spare.shape[1])
            part, i = divmod(pair, len(self._frozen))
            if part < len(PARTS):
                a = PARTS[part]
                name, other, T_other = self._frozen[i]
                delta = float(self._delta[a][i])
            else:
                a, b, delta = self._own[pair - len(PARTS) * len(self._frozen)]
                name, other, T_other = self._names[b], self._moving[b], poses[b][at]
            yield (
                float(flat[index]),
                at,
                self._moving[a],
                poses[a][at],
                other,
                T_other,
                delta,
                f"{self._names[a]} and {name}",
            )


def boxes_apart(low_a: Array, high_a: Array, low_b: Array, high_b: Array) -> Array:
    """Distances of boxes with corners (…, 3), broadcast [m]."""
    return np.linalg.norm(np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0), axis=-1)


_DISTANCE = coal.DistanceRequest()


def _pose(T: Array) -> coal.Transform3s:
    return coal.Transform3s(T[:3, :3], T[:3, 3])


def touch(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, margin: float) -> bool:
    """Whether two solids are no farther apart than a margin [m]."""
    request = coal.CollisionRequest()
    request.security_margin = margin
    return coal.collide(a, _pose(T_a), b, _pose(T_b), request, coal.CollisionResult()) > 0


def distance(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, below: float) -> float:
    """Distance of two solids where it is less than ``below`` [m]; else some number not less than that."""
    known = coal.DistanceResult()
    known.min_distance = max(below, 0.0)
    found = coal.distance(a, _pose(T_a), b, _pose(T_b), _DISTANCE, known)
    return max(float(found), 0.0)
