"""Collision by other means than the planner's scene, for the recheck of a finished path.

Own kinematics, vectorised over the path; link by link, nothing merged. A pair is passed over only where its
bounding spheres are farther apart than the clearance. The ground is looked at twice: triangles against triangles, and
every vertex of a link against the height of the ground there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import coal
import numpy as np

from footfall.core.frames import apply, inverse, rotation, transform
from footfall.core.mesh import Mesh
from footfall.planning.step.edges import Array
from footfall.planning.step.ground import Nearby
from footfall.robot.bvh import bvh
from footfall.robot.description import JOINTS, PARTS, RobotDescription, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.robot.shapes import box
from footfall.terrain.surface import height_at

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


class _Solid:
    def __init__(self, name: str, mesh: Mesh) -> None:
        self.name, self.vertices, self.shape = name, np.asarray(mesh.vertices), bvh(mesh)
        self.middle = 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))
        self.radius = float(np.linalg.norm(self.vertices - self.middle, axis=1).max())

    def middles(self, Ts: Array) -> Array:
        return Ts[:, :3, :3] @ self.middle + Ts[:, :3, 3]


class Solids:
    """One leg along a path, everything else frozen."""

    def __init__(
        self, robot: Robot, posture: Array, leg: int, T_site_base: Array, ground: Nearby, clearance: float
    ) -> None:
        description = robot.description
        deltas = description.clearances
        self._robot, self._leg, self._clearance, self._ground = robot, leg, clearance, ground
        self._T_site_base, self._T_base_site = T_site_base, inverse(T_site_base)
        links = {part: link_name(leg, part) for part in PARTS}
        self._moving = {part: _Solid(link, description.meshes[link]) for part, link in links.items()}
        self._touching = _Solid(links["wheel"], _sunk_wheel(description, leg))
        self._terrain = bvh(ground.mesh)
        self._highest = float(ground.dem.heights.max())
        poses = link_poses(robot, posture)
        frozen = [(_Solid("base", description.meshes["base"]), poses["base"], dict(deltas.chassis))]
        for other, part in product(robot.legs, PARTS):
            if other != leg:
                link = link_name(other, part)
                frozen.append(
                    (_Solid(link, description.meshes[link]), poses[link], dict.fromkeys(PARTS, deltas.other_leg))
                )
        if description.payload is not None:
            solid = _Solid("payload", box(description.payload.size, description.payload.position))
            frozen.append((solid, np.eye(4), dict.fromkeys(PARTS, deltas.payload)))
        self._frozen = [(solid, T) for solid, T, _ in frozen]
        self._middles = np.array([apply(T, solid.middle) for solid, T in self._frozen])
        self._radii = np.array([solid.radius for solid, _ in self._frozen])
        # NaN: this pair is never checked
        self._delta = {part: np.array([d.get(part, np.nan) for _, _, d in frozen]) + clearance for part in PARTS}

    def own_collision(self, qs: Array) -> tuple[int, str] | None:
        """The first of n postures (n, 6) in which two parts of the rover are too close, and which."""
        for at, a, T_a, b, T_b, delta in self._own_pairs(qs, 0.0):
            if _touch(a.shape, T_a, b.shape, T_b, delta):
                return at, f"{a.name} and {b.name}"
        return None

    def own_gap(self, qs: Array, below: float = FAR) -> tuple[int, Gap]:
        """The least spare distance between parts of the rover over n postures, exact below ``FAR`` and ``below``."""
        worst, least = 0, Gap(min(FAR, below), "nothing is nearer")
        for at, a, T_a, b, T_b, delta in self._own_pairs(qs, FAR):
            spare = _distance(a.shape, T_a, b.shape, T_b, least.spare + delta) - delta
            if spare < least.spare:
                worst, least = at, Gap(spare, f"{a.name} and {b.name}")
        return worst, least

    def _own_pairs(self, qs: Array, within: float) -> Iterator[tuple[int, _Solid, Array, _Solid, Array, float]]:
        poses = part_poses(self._robot, self._leg, qs)
        near = {}
        for part, solid in self._moving.items():
            away = np.linalg.norm(self._middles - solid.middles(poses[part])[:, None], axis=2)
            near[part] = away - self._radii - solid.radius <= self._delta[part] + within
        for at in range(len(qs)):
            for part, solid in self._moving.items():
                for i in np.flatnonzero(near[part][at]):
                    other, T_other = self._frozen[i]
                    yield at, solid, poses[part][at], other, T_other, float(self._delta[part][i])
            for pair in self._robot.description.clearances.own_leg:
                a, b = pair.part_a, pair.part_b
                delta = pair.distance + self._clearance
                yield at, self._moving[a], poses[a][at], self._moving[b], poses[b][at], delta

    def terrain_collision(self, qs: Array, raise_terrain: float, touching: bool) -> tuple[int, str] | None:
        """The first of n postures in which a link is too close to the ground raised by so much [m], and which."""
        T_ground = self._T_base_site @ transform(translation=(0.0, 0.0, raise_terrain))
        first: tuple[int, str] | None = None
        for solid, Ts, delta in self._links(qs, touching):
            lowest = apply(self._T_site_base, solid.middles(Ts))[:, 2] - solid.radius
            for at in np.flatnonzero(lowest <= self._highest + raise_terrain + delta):
                if first is not None and at >= first[0]:
                    break
                if _touch(solid.shape, Ts[at], self._terrain, T_ground, delta):
                    first = int(at), f"{solid.name} is too close to the terrain"
            depth = self._depth(solid, Ts, raise_terrain)
            under = np.flatnonzero(depth > 0)
            if len(under) and (first is None or under[0] < first[0]):
                first = int(under[0]), f"{solid.name} is {depth[under[0]]:.3f} m under the terrain"
        return first

    def terrain_gap(self, qs: Array, raise_terrain: float, touching: bool, below: float = np.inf) -> tuple[int, Gap]:
        """The least spare distance of a link to the ground, exact under ``below``; the touching wheel is left out."""
        T_ground = self._T_base_site @ transform(translation=(0.0, 0.0, raise_terrain))
        worst, least = 0, Gap(below, "")
        for solid, Ts, delta in self._links(qs, touching):
            if solid is self._touching:
                continue
            lowest = apply(self._T_site_base, solid.middles(Ts))[:, 2] - solid.radius
            for at in np.argsort(lowest, kind="stable"):
                if lowest[at] - self._highest - raise_terrain - delta >= least.spare:
                    break
                spare = _distance(solid.shape, Ts[at], self._terrain, T_ground, least.spare + delta) - delta
                if spare < least.spare:
                    worst, least = int(at), Gap(spare, f"{solid.name} and the terrain")
        return worst, least

    def _depth(self, solid: _Solid, Ts: Array, raise_terrain: float) -> Array:
        """How far the deepest vertex is under the raised ground, (n,) [m]; +inf where no ground was prepared."""
        Ts_site = self._T_site_base @ Ts
        points = np.einsum("nij,vj->nvi", Ts_site[:, :3, :3], solid.vertices) + Ts_site[:, None, :3, 3]
        ground = height_at(self._ground.dem, points[..., 0], points[..., 1]) + raise_terrain
        return np.nan_to_num(ground - points[..., 2], nan=np.inf).max(axis=1)

    def _links(self, qs: Array, touching: bool) -> Iterator[tuple[_Solid, Array, float]]:
        poses = part_poses(self._robot, self._leg, qs)
        deltas = self._robot.description.clearances.terrain
        for part in PARTS:
            if touching and part == "wheel":
                yield self._touching, poses[part], 0.0
            else:
                yield self._moving[part], poses[part], deltas[part] + self._clearance


def _sunk_wheel(description: RobotDescription, leg: int) -> Mesh:
    """The wheel's mesh smaller by the allowed sinkage all round (axle along y)."""
    mesh, sink = description.meshes[link_name(leg, "wheel")], description.clearances.wheel_sink
    radial = 1.0 - sink / description.wheel_radius
    return Mesh(mesh.vertices * (radial, 1.0 - 2.0 * sink / description.wheel_width, radial), mesh.triangles)


def _pose(T: Array) -> coal.Transform3s:
    return coal.Transform3s(T[:3, :3], T[:3, 3])


def _touch(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, margin: float) -> bool:
    request = coal.CollisionRequest()
    request.security_margin = margin
    return coal.collide(a, _pose(T_a), b, _pose(T_b), request, coal.CollisionResult()) > 0


def _distance(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array, below: float) -> float:
    """Distance of two solids where it is less than ``below`` [m]; else some number not less than that."""
    known = coal.DistanceResult()
    known.min_distance = max(below, 0.0)
    found = coal.distance(a, _pose(T_a), b, _pose(T_b), coal.DistanceRequest(), known)
    return max(float(found), 0.0)
