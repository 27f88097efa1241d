"""Collision checks: one moving leg against everything else, and the whole robot at one posture.

Exact triangle-to-triangle checks by coal with the clearances δ of the robot description, plus a caller's own
clearance. Frozen legs are one hierarchy each: all their links have one δ, so nothing is lost by merging.
Ground modes:

- ``"none"``: no ground;
- ``"true"``: the ground where it is; the wheel may touch it (it is checked with its mesh smaller by
  ``wheel_sink``), the other links keep their δ;
- ``"raised"``: the ground shifted up by ``raise_terrain``; every link, the wheel too, keeps its δ.

Meshes are surfaces: what is wholly inside another thing does not touch it. The links of a leg overlap from one to
the next and the chain starts outside chassis, payload and other legs, so one link cannot be inside them without
another crossing their surface. What is below the ground collides with it by a second check (see ground.py). Where
the ground is unknown there is nothing to collide with: whether to go there is for the planner to say.
"""

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from footfall.core.bounds import require_distances
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse, require_transform, transform
from footfall.core.mesh import Mesh
from footfall.core.value import Value, value
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import leg_link_poses, link_poses
from footfall.robot.meshes.bvh import PAYLOAD, TOUCHING_WHEEL, bvh, mesh_reach, robot_meshes
from footfall.robot.meshes.depth import overlap
from footfall.robot.meshes.ground import GroundHeights, crop, inner_radius
from footfall.robot.meshes.pairs import Pairs
from footfall.robot.meshes.shapes import merged
from footfall.robot.model import Robot

GROUND_MODES = ("none", "true", "raised")
TERRAIN = "terrain"
_ROUNDING = 1e-6
"""How much nearer two links may be than the balls around them say [m]."""


@value
class Collision(Value):
    """Two things that are closer than they may be.

    link_a, link_b: link names, or "terrain" or "payload". required: δ [m]. distance: what it is [m]; 0 where the
    surfaces intersect; negative: the middle of link_a is that far below the ground.
    """

    link_a: str
    link_b: str
    required: float
    distance: float


class CollisionScene:
    """One leg moves; chassis, payload, the other legs and the ground are frozen.

    posture: (legs × 6,) [rad], used for the frozen legs. T_site_base: (4, 4). terrain_mesh: ground in site, or None.
    clearance: added to every δ [m]. raise_terrain: for the ground mode "raised" [m].
    A scene holds scratch memory: use it from one thread at a time.
    """

    def __init__(
        self,
        robot: Robot,
        posture: ArrayLike,
        leg: int,
        T_site_base: ArrayLike,
        terrain_mesh: Mesh | None = None,
        clearance: float = 0.0,
        raise_terrain: float = 0.0,
    ) -> None:
        require_distances(clearance=clearance, raise_terrain=raise_terrain)
        q = robot.require_posture(posture)
        self.robot, self.leg = robot, robot.require_leg(leg)
        pairs = Pairs(robot.leg_models[self.leg])
        body = _RobotShapes(robot, pairs, clearance)
        moving = body.add_leg(self.leg, first_joint=1)
        body.check_against_chassis(moving)
        self._frozen = {}
        for other in robot.legs:
            if other != self.leg:
                shape = body.add_frozen_leg(other, q[6 * other : 6 * other + 6])
                self._frozen[shape] = other
                for part in PARTS:
                    pairs.check(moving[part], shape, robot.description.clearances.other_leg + clearance)
        hip = apply(require_transform(T_site_base, "T_site_base"), robot.description.legs[self.leg].T_base_hip[:3, 3])
        reach = mesh_reach(robot.description) + body.largest_ground_delta
        self._ground = _Ground(body, T_site_base, terrain_mesh, hip, reach)
        for mode, lift in (("true", 0.0), ("raised", raise_terrain)):
            self._ground.check_leg(moving, mode, lift)
        self._posture = q
        self._pairs, self._body = pairs, body
        self._data = {mode: pairs.data(mode) for mode in GROUND_MODES}
        self._lift = {"none": -np.inf, "true": 0.0, "raised": raise_terrain}

    def collides(self, q_leg: ArrayLike, terrain: str = "raised") -> bool:
        """Whether the leg at joint angles (6,) [rad] is closer to anything than it may be."""
        data = self._placed(q_leg, terrain)
        if terrain != "none" and self._ground.any_below(data, self._lift[terrain]):
            return True
        return self._pairs.any_too_close(data)

    def contacts(self, q_leg: ArrayLike, terrain: str = "raised") -> list[Collision]:
        """Every pair that is too close, with its distance; for reports, slower than :meth:`collides`."""
        data = self._placed(q_leg, terrain)
        found = []
        for a, b, required, distance in self._pairs.too_close(data):
            other = self._frozen.get(b)
            name = self._pairs.label(b) if other is None else self._nearest_link(data, a, other, q_leg)
            found.append(Collision(self._pairs.label(a), name, required, distance))
        if terrain != "none":
            found += self._ground.below(data, self._lift[terrain])
        return found

    def _placed(self, q_leg: ArrayLike, terrain: str) -> pin.GeometryData:
        q = np.asarray(q_leg, float)
        if q.shape != (6,):
            raise InvalidInput("a leg needs six joint angles [rad]", shape=list(q.shape))
        if terrain not in self._data:
            raise InvalidInput(f"terrain is one of {', '.join(GROUND_MODES)}", terrain=terrain)
        self._pairs.place(self._data[terrain], q)
        return self._data[terrain]

    def _nearest_link(self, data: pin.GeometryData, shape: int, other: int, q_leg: ArrayLike) -> str:
        """Of a frozen leg's links the one nearest to a moving shape; of those that it cuts the one it is deepest in."""
        poses = leg_link_poses(self.robot, self._posture[6 * other : 6 * other + 6], other)
        parts = {link_name(other, part): self._body.shapes[part] for part in PARTS}
        away = {link: self._pairs.distance_to(data, shape, parts[link], poses[link]) for link in parts}
        if min(away.values()) > 0:
            return min(away, key=lambda link: away[link])
        posture = self._posture.copy()
        posture[6 * self.leg : 6 * self.leg + 6] = q_leg
        own = self._pairs.label(shape)
        return max((link for link in away if away[link] <= 0), key=lambda link: overlap(self.robot, posture, own, link))


def posture_collisions(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    terrain_mesh: Mesh | None = None,
    clearance: float = 0.0,
) -> list[Collision]:
    """Every pair of the whole robot that is too close at one posture, link by link; the wheels may touch the ground.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        terrain_mesh: the ground, in site [m]; None: there is none.
        clearance: added to what the description asks for [m].

    Returns:
        The pairs, none where all are far enough apart.
    """
    require_distances(clearance=clearance)
    q = robot.require_posture(posture)
    T_site_base = require_transform(T_site_base, "T_site_base")
    pairs = Pairs(robot.model)
    body = _RobotShapes(robot, pairs, clearance)
    legs = [body.add_leg(leg, first_joint=1 + 6 * leg) for leg in robot.legs]
    least = robot.description.clearances.other_leg + clearance
    middles, radii = _balls_around(robot, body.meshes, q)
    for leg, shapes in enumerate(legs):
        body.check_against_chassis(shapes)
        for other in range(leg + 1, len(legs)):
            away = np.linalg.norm(middles[leg, :, None] - middles[other], axis=2) - radii[:, None] - radii
            for a, b in np.argwhere(away <= least + _ROUNDING):
                pairs.check(shapes[PARTS[a]], legs[other][PARTS[b]], least)
    mounts = [float(np.linalg.norm(leg.T_base_hip[:3, 3])) for leg in robot.description.legs]
    reach = max(mounts) + mesh_reach(robot.description) + body.largest_ground_delta
    ground = _Ground(body, T_site_base, terrain_mesh, T_site_base[:3, 3], reach)
    for shapes in legs:
        ground.check_leg(shapes, "true", 0.0)
    ground.check_chassis("true")
    data = pairs.data("true")
    pairs.place(data, q)
    found = [Collision(pairs.label(a), pairs.label(b), required, d) for a, b, required, d in pairs.too_close(data)]
    return found + ground.below(data, 0.0)


def _balls_around(
    robot: Robot, meshes: dict[str, Mesh], posture: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middles (legs, parts, 3) in base and radii (parts,) of balls that hold the legs' links [m]."""
    corners = [meshes[part].vertices for part in PARTS]
    middles = [(points.min(axis=0) + points.max(axis=0)) / 2 for points in corners]
    radii = [np.linalg.norm(points - middle, axis=1).max() for points, middle in zip(corners, middles, strict=True)]
    poses = link_poses(robot, posture)
    placed = [
        [apply(poses[link_name(leg, part)], middle) for part, middle in zip(PARTS, middles, strict=True)]
        for leg in robot.legs
    ]
    return np.array(placed), np.array(radii)


class _RobotShapes:
    """The robot's shapes in a list of pairs, and which of them must keep apart."""

    def __init__(self, robot: Robot, pairs: Pairs, clearance: float) -> None:
        self.robot, self.pairs, self.clearance = robot, pairs, clearance
        self.deltas = robot.description.clearances
        self.meshes = robot_meshes(robot.description)
        self.shapes = {part: bvh(mesh) for part, mesh in self.meshes.items()}
        self.chassis = {
            part: pairs.add(part, 0, np.eye(4), self.shapes[part]) for part in ("base", PAYLOAD) if part in self.shapes
        }
        self.largest_ground_delta = max([*self.deltas.terrain.values(), self.deltas.chassis_terrain]) + clearance

    def add_leg(self, leg: int, first_joint: int) -> dict[str, int]:
        """Add a leg that moves with six joints; its own pairs too. Returns part → shape, with TOUCHING_WHEEL."""
        T_ankle_wheel = transform(translation=(self.robot.description.legs[leg].foot, 0.0, 0.0))
        shapes = {}
        for i, part in enumerate((*PARTS, TOUCHING_WHEEL)):
            label = link_name(leg, "wheel" if part == TOUCHING_WHEEL else part)
            joint, placement = (first_joint + i, np.eye(4)) if i < 6 else (first_joint + 5, T_ankle_wheel)
            shapes[part] = self.pairs.add(label, joint, placement, self.shapes[part])
        for pair in self.deltas.own_leg:
            self.pairs.check(shapes[pair.part_a], shapes[pair.part_b], pair.distance + self.clearance)
        return shapes

    def check_against_chassis(self, leg_shapes: dict[str, int]) -> None:
        for part, delta in self.deltas.chassis.items():
            self.pairs.check(leg_shapes[part], self.chassis["base"], delta + self.clearance)
        if PAYLOAD in self.chassis:
            for part in PARTS:
                self.pairs.check(leg_shapes[part], self.chassis[PAYLOAD], self.deltas.payload + self.clearance)

    def add_frozen_leg(self, leg: int, q_leg: NDArray[np.float64]) -> int:
        """Add a leg that does not move, as one shape in base."""
        poses = leg_link_poses(self.robot, q_leg, leg)
        meshes = [(self.meshes[part], poses[link_name(leg, part)]) for part in PARTS]
        body = merged([Mesh(apply(T_base_link, mesh.vertices), mesh.triangles) for mesh, T_base_link in meshes])
        return self.pairs.add(f"leg{leg}", 0, np.eye(4), bvh(body))


class _Ground:
    """The ground near the robot: as a surface among the pairs, and as heights for what is below it."""

    def __init__(
        self, body: _RobotShapes, T_site_base: ArrayLike, mesh: Mesh | None, center: NDArray[np.float64], radius: float
    ) -> None:
        self._body = body
        self._T_site_base = np.asarray(T_site_base, float)
        self._offsets: dict[int, NDArray[np.float64]] = {}
        near = None if mesh is None else crop(mesh, center[:2], radius)
        self._surface = self._heights = None
        if near is not None and len(near.triangles):
            self._surface = bvh(near)
            self._heights = GroundHeights(near, min(inner_radius(mesh) for mesh in body.meshes.values()))

    def check_leg(self, leg_shapes: dict[str, int], mode: str, lift: float) -> None:
        """Demand δ between a leg's links and the ground lifted by ``lift`` [m]."""
        if self._surface is None:
            return
        ground = self._add(lift)
        for part, delta in self._body.deltas.terrain.items():
            required = delta + self._body.clearance
            if part == "wheel" and mode == "true":
                part, required = TOUCHING_WHEEL, 0.0
            self._body.pairs.check(leg_shapes[part], ground, required, (mode,))
        self._watch({leg_shapes[part]: part for part in PARTS})

    def check_chassis(self, mode: str) -> None:
        if self._surface is None:
            return
        ground = self._add(0.0)
        for shape in self._body.chassis.values():
            required = self._body.deltas.chassis_terrain + self._body.clearance
            self._body.pairs.check(shape, ground, required, (mode,))
        self._watch({shape: part for part, shape in self._body.chassis.items()})

    def any_below(self, data: pin.GeometryData, lift: float) -> bool:
        """Whether the middle of a watched link is below the ground lifted by ``lift``."""
        return bool((self._above(data) < lift).any())

    def below(self, data: pin.GeometryData, lift: float) -> list[Collision]:
        above = self._above(data) - lift
        labels = [self._body.pairs.label(shape) for shape in self._offsets]
        return [Collision(a, TERRAIN, 0.0, float(d)) for a, d in zip(labels, above, strict=False) if d < 0]

    def _above(self, data: pin.GeometryData) -> NDArray[np.float64]:
        if self._heights is None:
            return np.empty(0)
        return self._heights.above(apply(self._T_site_base, self._body.pairs.points(data, self._offsets)))

    def _add(self, lift: float) -> int:
        T_base_ground = inverse(self._T_site_base) @ transform(translation=(0.0, 0.0, lift))
        return self._body.pairs.add(TERRAIN, 0, T_base_ground, self._surface)

    def _watch(self, parts: dict[int, str]) -> None:
        self._offsets |= {shape: self._body.meshes[part].vertices.mean(axis=0) for shape, part in parts.items()}
