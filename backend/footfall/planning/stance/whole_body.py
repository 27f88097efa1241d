"""How near the parts of a moving rover come to each other and to the ground, over many postures at once.

The least distance over n postures and many pairs is found best first: every pair in every posture has a lower
bound, at first from bounding spheres or from the highest ground beneath; the lowest bound is replaced by the exact
distance, and since no point of a body moves farther from one posture to another than its outermost vertex does, this
distance also bounds those of the same pair in all other postures (Mirtich, "Timewarp rigid body simulation", 2000,
uses the same bound in time). The search ends when the lowest bound is exact.
"""

import itertools
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply, inverse, transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.planning.step.ground import Nearby
from footfall.planning.step.solids import FAR, Gap, part_poses
from footfall.robot.bvh import PAYLOAD, TOUCHING_WHEEL, bvh, robot_meshes
from footfall.robot.description import PARTS, link_name
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate

Array = NDArray[np.float64]

GROUND_FAR = 0.2
"""Distances to the ground above this, beyond δ, are not measured [m]."""
PIECE = 0.25
"""Pieces of ground begin and end on multiples of this [m]."""
NOTHING = "nothing is nearer"
_CUT = 1e-9


@dataclass(frozen=True)
class Nearest:
    """The least spare distance of a path and the number of the posture that has it."""

    gap: Gap
    at: int


@dataclass(frozen=True)
class _Body:
    """corners: (8, 3), of the box around the vertices; radius: of the ball about the middle of that box."""

    vertices: Array
    corners: Array
    shape: coal.BVHModelOBBRSS
    middle: Array
    radius: float


class WholeBody:
    """All links of a robot with the clearances that they must keep, over some ground.

    clearance: added to every δ [m]. Use it from one thread at a time.
    """

    def __init__(self, robot: Robot, ground: Nearby, clearance: float = 0.0) -> None:
        self.robot, self.ground, self.clearance = robot, ground, clearance
        self._surfaces: dict[tuple[int, int, int, int], coal.BVHModelOBBRSS] = {}
        deltas = robot.description.clearances
        meshes = robot_meshes(robot.description)
        bodies = {part: _body(np.asarray(mesh.vertices), bvh(mesh)) for part, mesh in meshes.items()}
        chassis = ["base", PAYLOAD] if PAYLOAD in meshes else ["base"]
        self.links = (*chassis, *(link_name(leg, part) for leg in robot.legs for part in PARTS))
        self._number = {link: i for i, link in enumerate(self.links)}
        self._bodies = [bodies[part] for part in (*chassis, *(part for _ in robot.legs for part in PARTS))]
        self._touching = bodies[TOUCHING_WHEEL]
        self._ground_delta = dict.fromkeys(chassis, deltas.chassis_terrain)
        self._ground_delta |= {link_name(leg, part): d for leg in robot.legs for part, d in deltas.terrain.items()}
        self._pairs = self._own_pairs(chassis)

    def poses(self, postures: Array) -> Array:
        """T_base_link, (n, links, 4, 4), for postures (n, legs × 6)."""
        count = len(postures)
        Ts = np.tile(np.eye(4), (count, len(self.links), 1, 1))
        for leg in self.robot.legs:
            own = part_poses(self.robot, leg, postures[:, 6 * leg : 6 * leg + 6])
            for part, Ts_base_link in own.items():
                Ts[:, self._number[link_name(leg, part)]] = Ts_base_link
        return Ts

    def own_gap(self, Ts_base_link: Array, moving: Collection[str] | None = None) -> Nearest:
        """Least spare distance between two parts of the rover over n postures, exact below ``FAR``.

        moving: only pairs with one of these links.
        """
        pairs = [p for p in self._pairs if moving is None or p[0] in moving or p[1] in moving]
        a = np.array([self._number[p[0]] for p in pairs])
        b = np.array([self._number[p[1]] for p in pairs])
        deltas = np.array([p[2] for p in pairs])
        middles = np.einsum("nlij,lj->nli", Ts_base_link[:, :, :3, :3], np.array([x.middle for x in self._bodies]))
        middles += Ts_base_link[:, :, :3, 3]
        radii = np.array([x.radius for x in self._bodies])
        bounds = np.linalg.norm(middles[:, a] - middles[:, b], axis=2) - radii[a] - radii[b] - deltas
        near = np.flatnonzero(bounds.min(axis=0) < FAR)

        def exact(at: int, column: int) -> float:
            p = near[column]
            first, second = Ts_base_link[at, a[p]], Ts_base_link[at, b[p]]
            distance = _distance(self._bodies[a[p]].shape, first, self._bodies[b[p]].shape, second)
            delta = float(deltas[p])
            return distance - delta if distance > 0 else -max(delta, _CUT)

        def moved(at: int, column: int) -> Array:
            p = near[column]
            return _farthest(inverse(Ts_base_link[:, a[p]]) @ Ts_base_link[:, b[p]], self._bodies[b[p]].corners, at)

        spare, at, column = _least(bounds[:, near], exact, moved, FAR)
        if column < 0:
            return Nearest(Gap(spare, NOTHING), 0)
        return Nearest(Gap(spare, f"{pairs[near[column]][0]} and {pairs[near[column]][1]}"), at)

    def ground_gap(
        self,
        Ts_site_link: Array,
        links: Sequence[str],
        raised: float = 0.0,
        touching: Collection[int] = (),
    ) -> Nearest:
        """Least spare distance of some links to the ground raised by so much [m] over n postures.

        Exact below ``GROUND_FAR``. touching: legs whose wheels may touch, and sink in by ``wheel_sink``. What is under
        the ground is negative by its depth.
        """
        bodies = [self._on_ground(link, touching) for link in links]
        numbers = [self._number[link] for link in links]
        beside = GROUND_FAR + max(delta for _, delta in bodies)
        above = [
            _above(self.ground.dem, body.vertices, Ts_site_link[:, number], raised, beside)
            for (body, _), number in zip(bodies, numbers, strict=True)
        ]
        deltas = np.array([delta for _, delta in bodies])
        bounds = np.array([bound for bound, _ in above]).T - deltas
        boxes = np.array([box for (_, box), least in zip(above, bounds.min(axis=0), strict=True) if least < GROUND_FAR])
        if not len(boxes):
            return Nearest(Gap(GROUND_FAR, NOTHING), 0)
        surface = self._surface(boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0))
        T_ground = transform(translation=(0.0, 0.0, raised))

        def exact(at: int, column: int) -> float:
            (body, delta), T = bodies[column], Ts_site_link[at, numbers[column]]
            depth = _depth(self.ground.dem, body.vertices, T, raised)
            if depth > 0:
                return -depth
            distance = _distance(body.shape, T, surface, T_ground)
            return distance - delta if distance > 0 else -max(delta, _CUT)

        def moved(at: int, column: int) -> Array:
            return _farthest(Ts_site_link[:, numbers[column]], bodies[column][0].corners, at)

        spare, at, column = _least(bounds, exact, moved, GROUND_FAR)
        if column < 0:
            return Nearest(Gap(spare, NOTHING), 0)
        return Nearest(Gap(spare, f"{links[column]} and the terrain"), at)

    def _surface(self, low: Array, high: Array) -> coal.BVHModelOBBRSS:
        """The ground in a box, (2,) each, or a little more of it; those already built serve again."""
        dem = self.ground.dem
        # on a coarse lattice, so that postures near each other ask for the same piece
        rows, cols = _window(dem.geometry, PIECE * np.floor(low / PIECE), PIECE * np.ceil(high / PIECE))
        key = rows.start, rows.stop, cols.start, cols.stop
        if key not in self._surfaces:
            grid, heights = dem.geometry, dem.heights[rows, cols]
            x0, y0 = grid.x0 + cols.start * grid.resolution, grid.y0 + rows.start * grid.resolution
            geometry = GridGeometry(x0, y0, grid.resolution, *heights.shape)
            self._surfaces[key] = bvh(triangulate(Dem(heights, geometry, dem.name, Provenance({}))))
        return self._surfaces[key]

    def _on_ground(self, link: str, touching: Collection[int]) -> tuple[_Body, float]:
        for leg in touching:
            if link == link_name(leg, "wheel"):
                return self._touching, 0.0
        return self._bodies[self._number[link]], self._ground_delta[link] + self.clearance

    def _own_pairs(self, chassis: Sequence[str]) -> list[tuple[str, str, float]]:
        """(link, link, δ): what collision.py checks, one by one."""
        deltas, legs = self.robot.description.clearances, self.robot.legs
        pairs: list[tuple[str, str, float]] = []
        for leg in legs:
            pairs += [("base", link_name(leg, part), delta) for part, delta in deltas.chassis.items()]
            if PAYLOAD in chassis:
                pairs += [(PAYLOAD, link_name(leg, part), deltas.payload) for part in PARTS]
            pairs += [(link_name(leg, p.part_a), link_name(leg, p.part_b), p.distance) for p in deltas.own_leg]
        for one, other in itertools.combinations(legs, 2):
            pairs += [(link_name(one, a), link_name(other, b), deltas.other_leg) for a in PARTS for b in PARTS]
        return [(a, b, delta + self.clearance) for a, b, delta in pairs]


def _least(
    bounds: Array, exact: Callable[[int, int], float], moved: Callable[[int, int], Array], far: float
) -> tuple[float, int, int]:
    """Least exact value, its row and column; (far, 0, −1) where all are at least far. See the module docstring.

    bounds: (n, k), lower; exact, moved: of a row and a column; moved: (n,) from that row to every other.
    """
    bounds = bounds.copy()
    known = np.zeros(bounds.shape, bool)
    while bounds.size:
        at, column = (int(i) for i in np.unravel_index(int(np.argmin(bounds)), bounds.shape))
        if bounds[at, column] >= far:
            break
        if known[at, column]:
            return float(bounds[at, column]), at, column
        value = exact(at, column)
        raised = np.maximum(bounds[:, column], value - moved(at, column))
        bounds[:, column] = np.where(known[:, column], bounds[:, column], raised)
        bounds[at, column] = value
        known[at, column] = True
    return far, 0, -1


def _body(vertices: Array, shape: coal.BVHModelOBBRSS) -> _Body:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    middle = 0.5 * (low + high)
    return _Body(vertices, corners, shape, middle, float(np.linalg.norm(vertices - middle, axis=1).max()))


def _farthest(Ts: Array, corners: Array, at: int) -> Array:
    """How far the corner that moves most is from where it is at one of n poses, (n,) [m]."""
    moved = (Ts[:, :3] - Ts[at, :3]) @ np.column_stack([corners, np.ones(len(corners))]).T
    return np.sqrt(np.square(moved).sum(axis=1).max(axis=1))


def _above(dem: Dem, vertices: Array, Ts_site_link: Array, raised: float, beside: float) -> tuple[Array, Array]:
    """Lower bounds (n,) on a convex body's distance to the ground, and the box (2, 2) of ground that they look at.

    The body is at least as far from the ground as its lowest vertex is above the highest ground within ``beside`` of
    the box around its whole way; ground farther off is at least ``beside`` away.
    """
    points = Ts_site_link[:, :3] @ np.column_stack([vertices, np.ones(len(vertices))]).T
    box = np.array([points[:, :2].min(axis=(0, 2)) - beside, points[:, :2].max(axis=(0, 2)) + beside])
    heights = dem.heights[_window(dem.geometry, *box)]
    highest = float(heights.max()) + raised if heights.size else -np.inf
    # 1 mm: heights are stored as float32
    return np.minimum(points[:, 2].min(axis=1) - highest - 0.001, beside), box


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
