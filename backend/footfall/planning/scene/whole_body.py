"""How near the parts of a moving rover come to each other and to the ground, over many postures at once.

The least distance over n postures and many pairs is found best first (least.py): every pair in every posture has a
lower bound from bounding spheres or from the highest ground beneath, and a finer one that is compiled
(nearest_kernel.py); the lowest bound is replaced by the exact distance of the meshes, and no point of a body moves
farther from one posture to another than its outermost vertex does. Mostly one or two distances are asked for.
"""

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse, transform
from footfall.core.grid import GridGeometry
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.ground_nearness_kernel import RaisedGround
from footfall.planning.scene.ground_piece import GroundPiece
from footfall.planning.scene.least import EQUAL, least
from footfall.planning.scene.leg_over_ground import with_ground
from footfall.planning.scene.nearest_kernel import ground_bounds, near_triangles, own_bounds
from footfall.planning.scene.solids import FAR, Gap, part_poses
from footfall.robot.description import PARTS, link_name
from footfall.robot.meshes.bvh import PAYLOAD, TOUCHING_WHEEL, bvh, robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

GROUND_FAR = 0.2
"""Distances to the ground above this, beyond δ, are not measured [m]."""
PIECE = 0.25
"""Pieces of ground begin and end on multiples of this [m]."""
NOTHING = "nothing is nearer"
_CUT = 1e-9
_ON_GROUND = (-2, -1)
"""Rows of the table of hulls that stand for ground, and of the touching wheel."""
_SUNK = -3


@dataclass(frozen=True)
class NearestGap:
    """The least spare distance of a path and the number of the posture that has it."""

    gap: Gap
    at: int


@dataclass(frozen=True)
class _Body:
    """corners: (8, 3), of the box around the vertices; hull: its row of the table of hulls."""

    vertices: Array
    corners: Array
    shape: coal.BVHModelOBBRSS
    hull: int


class WholeBody:
    """All links of a robot with the clearances that they must keep, over some ground.

    clearance: added to every δ [m]. Use it from one thread at a time.
    """

    def __init__(self, robot: Robot, ground: Nearby, clearance: float = 0.0) -> None:
        self.robot, self.ground, self.clearance = robot, ground, clearance
        self._pieces: dict[tuple[int, int, int, int], GroundPiece] = {}
        deltas = robot.description.clearances
        meshes = robot_meshes(robot.description)
        chassis = ["base", PAYLOAD] if PAYLOAD in meshes else ["base"]
        shapes = [*chassis, *PARTS, TOUCHING_WHEEL]
        self._hulls, self._points = with_ground([meshes[name] for name in shapes])
        bodies = {
            name: _body(np.asarray(meshes[name].vertices), bvh(meshes[name]), hull) for hull, name in enumerate(shapes)
        }
        self.links = (*chassis, *(link_name(leg, part) for leg in robot.legs for part in PARTS))
        self._number = {link: i for i, link in enumerate(self.links)}
        self._bodies = [bodies[part] for part in (*chassis, *(part for _ in robot.legs for part in PARTS))]
        self._touching = bodies[TOUCHING_WHEEL]
        self._ground_delta = dict.fromkeys(chassis, deltas.chassis_terrain)
        self._ground_delta |= {link_name(leg, part): d for leg in robot.legs for part, d in deltas.terrain.items()}
        self._pairs, self._deltas = self._own_pairs(chassis)
        grid = ground.dem.geometry
        heights = np.array(ground.dem.heights, np.float32, order="C")
        self._ground = RaisedGround(heights, np.array([grid.x0, grid.y0]), grid.resolution, 0.0)

    def poses(self, postures: Array) -> Array:
        """T_base_link, (n, links, 4, 4), for postures (n, legs × 6)."""
        count = len(postures)
        Ts = np.tile(np.eye(4), (count, len(self.links), 1, 1))
        for leg in self.robot.legs:
            own = part_poses(self.robot, leg, postures[:, 6 * leg : 6 * leg + 6])
            for part, Ts_base_link in own.items():
                Ts[:, self._number[link_name(leg, part)]] = Ts_base_link
        return Ts

    def own_gap(self, Ts_base_link: Array, moving: Collection[str] | None = None) -> NearestGap:
        """Least spare distance between two parts of the rover over n postures [m], exact below ``FAR``.

        Ts_base_link: (n, links, 4, 4) of :meth:`poses`.
        moving: only pairs with one of these links.
        """
        Ts, pairs, deltas, bounds, finer = self._own_bounds(Ts_base_link, moving)

        def exact(at: int, column: int) -> float:
            a, b = pairs[column]
            distance = _distance(self._bodies[a].shape, Ts[at, a], self._bodies[b].shape, Ts[at, b])
            return _spare(distance, float(deltas[column]))

        def moved(at: int, column: int) -> Array:
            a, b = pairs[column]
            return _farthest(inverse(Ts[:, a]) @ Ts[:, b], self._bodies[b].corners, at)

        spare, at, column = least(bounds, finer, exact, moved, FAR)
        if column < 0:
            return NearestGap(Gap(spare, NOTHING), 0)
        a, b = pairs[column]
        return NearestGap(Gap(spare, f"{self.links[a]} and {self.links[b]}"), at)

    def ground_gap(
        self,
        Ts_site_link: Array,
        links: Sequence[str],
        raised: float = 0.0,
        touching: Collection[int] = (),
    ) -> NearestGap:
        """Least spare distance of some links to the ground raised by so much [m] over n postures.

        Ts_site_link: (n, links, 4, 4) of all links.
        Exact below ``GROUND_FAR``. touching: legs whose wheels may touch, and sink in by ``wheel_sink``. What is under
        the ground is negative by its depth.
        """
        bodies, Ts, hulls, bounds, finer, boxes = self._ground_bounds(Ts_site_link, links, raised, touching)
        T_ground = transform(translation=(0.0, 0.0, raised))
        boxes = boxes[bounds.min(axis=0) < GROUND_FAR]
        if not len(boxes):
            return NearestGap(Gap(GROUND_FAR, NOTHING), 0)
        piece = self._piece(boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0))

        def exact(at: int, column: int) -> float:
            (body, delta), T = bodies[column], Ts[at, column]
            within = finer[at, column] + delta + EQUAL
            if within > -np.inf:
                # all of it is above the ground, and mostly as near as its bound says
                own = hulls[[column, *_ON_GROUND]]
                few = near_triangles(own, self._points, T[None], within, self._ground._replace(lift=raised))
                if len(few) and 0 < (distance := _distance(body.shape, T, piece.few(few), T_ground)) < within:
                    return _spare(distance, delta)
            depth = _depth(self.ground.dem, body.vertices, T, raised)
            return -depth if depth > 0 else _spare(_distance(body.shape, T, piece.shape, T_ground), delta)

        def moved(at: int, column: int) -> Array:
            return _farthest(Ts[:, column], bodies[column][0].corners, at)

        spare, at, column = least(bounds, finer, exact, moved, GROUND_FAR)
        if column < 0:
            return NearestGap(Gap(spare, NOTHING), 0)
        return NearestGap(Gap(spare, f"{links[column]} and the terrain"), at)

    def own_at_least(self, Ts_base_link: Array) -> NearestGap:
        """As :meth:`own_gap`, but proven without meshes: less by what hulls are larger than these."""
        _, pairs, _, _, finer = self._own_bounds(Ts_base_link, None)
        at, column = (int(i) for i in np.unravel_index(int(np.argmin(finer)), finer.shape))
        a, b = pairs[column]
        return NearestGap(Gap(float(finer[at, column]), f"{self.links[a]} and {self.links[b]}"), at)

    def ground_at_least(self, Ts_site_link: Array, links: Sequence[str]) -> NearestGap:
        """As :meth:`ground_gap`, but proven without meshes; −inf where a link is not proven to be over the ground."""
        *_, finer, _ = self._ground_bounds(Ts_site_link, links, 0.0, ())
        at, column = (int(i) for i in np.unravel_index(int(np.argmin(finer)), finer.shape))
        return NearestGap(Gap(float(finer[at, column]), f"{links[column]} and the terrain"), at)

    def _own_bounds(
        self, Ts_base_link: Array, moving: Collection[str] | None
    ) -> tuple[Array, NDArray[np.int64], Array, Array, Array]:
        """The poses as kernels take them, pairs and their δ, coarse and finer bounds (n, pairs)."""
        Ts, pairs, deltas = np.ascontiguousarray(Ts_base_link), self._pairs, self._deltas
        if moving is not None:
            chosen = np.isin(pairs, [self._number[link] for link in moving]).any(axis=1)
            pairs, deltas = pairs[chosen], deltas[chosen]
        hulls = self._hulls[[body.hull for body in self._bodies]]
        return Ts, pairs, deltas, *own_bounds(hulls, self._points, Ts, pairs, deltas, FAR)

    def _ground_bounds(
        self, Ts_site_link: Array, links: Sequence[str], raised: float, touching: Collection[int]
    ) -> tuple[list[tuple[_Body, float]], Array, Array, Array, Array, Array]:
        """Bodies with their δ, their poses (n, k, 4, 4), hulls, coarse and finer bounds (n, k), boxes of their ways."""
        bodies = [self._on_ground(link, touching) for link in links]
        Ts = np.ascontiguousarray(Ts_site_link[:, [self._number[link] for link in links]])
        hulls = self._hulls[[*(body.hull for body, _ in bodies), *_ON_GROUND]]
        deltas = np.array([delta for _, delta in bodies])
        beside = GROUND_FAR + float(deltas.max())
        found = ground_bounds(hulls, self._points, Ts, deltas, self._ground._replace(lift=raised), beside, GROUND_FAR)
        return bodies, Ts, hulls, *found

    def _piece(self, low: Array, high: Array) -> GroundPiece:
        """The ground in a box, (2,) each, or a little more of it; those already made serve again."""
        # on a coarse lattice, so that postures near each other ask for the same piece
        rows, cols = _window(self.ground.dem.geometry, PIECE * np.floor(low / PIECE), PIECE * np.ceil(high / PIECE))
        key = rows.start, rows.stop, cols.start, cols.stop
        if key not in self._pieces:
            self._pieces[key] = GroundPiece(self.ground.dem, rows, cols)
        return self._pieces[key]

    def _on_ground(self, link: str, touching: Collection[int]) -> tuple[_Body, float]:
        for leg in touching:
            if link == link_name(leg, "wheel"):
                return self._touching, 0.0
        return self._bodies[self._number[link]], self._ground_delta[link] + self.clearance

    def _own_pairs(self, chassis: Sequence[str]) -> tuple[NDArray[np.int64], Array]:
        """Numbers of links (k, 2) and δ (k,): what collision.py checks, one by one."""
        deltas, legs = self.robot.description.clearances, self.robot.legs
        pairs: list[tuple[str, str, float]] = []
        for leg in legs:
            pairs += [("base", link_name(leg, part), delta) for part, delta in deltas.chassis.items()]
            if PAYLOAD in chassis:
                pairs += [(PAYLOAD, link_name(leg, part), deltas.payload) for part in PARTS]
            pairs += [(link_name(leg, p.part_a), link_name(leg, p.part_b), p.distance) for p in deltas.own_leg]
        for one, other in itertools.combinations(legs, 2):
            pairs += [(link_name(one, a), link_name(other, b), deltas.other_leg) for a in PARTS for b in PARTS]
        numbers = np.array([(self._number[a], self._number[b]) for a, b, _ in pairs], np.int64)
        return numbers, np.array([delta + self.clearance for *_, delta in pairs])


def _body(vertices: Array, shape: coal.BVHModelOBBRSS, hull: int) -> _Body:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return _Body(vertices, np.array(list(itertools.product(*zip(low, high, strict=True)))), shape, hull)


def _spare(distance: float, delta: float) -> float:
    """What a distance [m], 0 where surfaces intersect, leaves beyond δ."""
    return distance - delta if distance > 0 else -max(delta, _CUT)


def _farthest(Ts: Array, corners: Array, at: int) -> Array:
    """How far the corner that moves most is from where it is at one of n poses, (n,) [m]."""
    moved = (Ts[:, :3] - Ts[at, :3]) @ np.column_stack([corners, np.ones(len(corners))]).T
    return np.sqrt(np.square(moved).sum(axis=1).max(axis=1))


def _window(grid: GridGeometry, low: Array, high: Array) -> tuple[slice, slice]:
    """Rows and columns of the cells in a box and of their neighbours."""
    first = np.maximum(np.floor((low - (grid.x0, grid.y0)) / grid.resolution).astype(int), 0)
    last = np.maximum(np.ceil((high - (grid.x0, grid.y0)) / grid.resolution).astype(int) + 1, 0)
    return slice(first[1], last[1]), slice(first[0], last[0])


def _depth(dem: Dem, vertices: Array, T_site_link: Array, raised: float) -> float:
    """How far the deepest vertex, or the middle, is under the raised ground [m]; at most 0 where none is."""
    points = apply(T_site_link, np.vstack([vertices, vertices.mean(axis=0)]))
    under = height_at(dem, points[:, 0], points[:, 1]) + raised - points[:, 2]
    return float(np.max(under, initial=0.0, where=np.isfinite(under)))


def _distance(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array) -> float:
    """Distance of two surfaces [m], 0 where they intersect."""
    pose_a, pose_b = coal.Transform3s(T_a[:3, :3], T_a[:3, 3]), coal.Transform3s(T_b[:3, :3], T_b[:3, 3])
    return max(float(coal.distance(a, pose_a, b, pose_b, coal.DistanceRequest(), coal.DistanceResult())), 0.0)
