"""Feasible traversability: where the rover can be at all, at which headings, and what a metre costs it there.

The body stays level, at the least height over the highest ground below it and its sweeping legs. From there the legs
must find footfalls within their vertical and horizontal reach, at least five of them such that they support
conservatively. Where relief stays under the legs' stroke all do, and nothing is searched.

Source: D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot" (IEEE Int. Conf. on
Systems Engineering, 1990).
"""

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance, Value, value
from footfall.maps.layers import GROUND, LayerInfo
from footfall.planning.route import feasible_kernel as kernel
from footfall.planning.route.cost import blocks, coarse_geometry, marked_off
from footfall.planning.route.leg_places import LEGS, leg_places
from footfall.planning.route.problem import CostGrid, RouteSettings
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

LAYER = LayerInfo(
    "",
    "Cost of travel, feasible traversability",
    "a metre's cost: 1 on flat ground that is known, 2 where relief is the legs' whole stroke, more on unknown or old "
    "ground and on five legs; infinite where forbidden (Ambler)",
    GROUND,
)
MARKED_OFF = kernel.UNSUPPORTED + 1
FORBIDDEN: Mapping[int, str] = {
    kernel.UNKNOWN: "ground that is too little known",
    kernel.NO_FOOTING: "ground without any place for a wheel: all too steep or unknown",
    kernel.TOO_HIGH: "ground with something so high that no leg reaches down from above it",
    kernel.TOO_FEW: "ground where fewer than five legs find footfalls",
    kernel.UNSUPPORTED: "ground where five legs find footfalls, but none that support conservatively",
    MARKED_OFF: "ground that is marked as no-go, or beside the corridors",
}
"""What forbids a cell at every heading, by code; FREE is 0."""
RELIEF = 1.0
"""What a metre costs more where relief is the legs' whole stroke."""
KNOWN = 255
"""Trust in a cell that was just seen; half as much in one seen ``fades`` earlier, 0 in an unknown one."""
_TILE = 64
"""Side of the parts of a map that are computed anew [cells]."""


@value
class FeasibleGround(Value):
    """What the rover can do over each cell of a map; layers are (rows, cols), see LAYER and FORBIDDEN.

    relief: highest less lowest known ground below body and sweeping legs [m]. height: least one of the base there [m],
    site; both NaN where nothing is known. trust: mean trust in that ground, 0…1.
    legs: (headings / 2, rows, cols) uint8, for how many legs there are footfalls that support, 0 where forbidden; the
    other half turn has the same, its legs standing where the opposite ones do.
    forbidden: uint8, what forbids a cell at every heading, 0 where nothing does. stroke: of the legs [m].
    ground [m], trusted (0…KNOWN): what all is computed from, the highest of each cell.
    """

    relief: NDArray[np.float32]
    height: NDArray[np.float32]
    trust: NDArray[np.float32]
    legs: NDArray[np.uint8]
    forbidden: NDArray[np.uint8]
    stroke: float
    ground: NDArray[np.float32]
    trusted: NDArray[np.uint8]
    geometry: GridGeometry
    provenance: Provenance

    @property
    def headings(self) -> int:
        """How many are told apart; number k is 2 π k / headings from east [rad]."""
        return 2 * len(self.legs)

    def may(self, heading: int) -> NDArray[np.bool_]:
        """Where the rover can be at a heading, by its number."""
        return (self.legs[heading % len(self.legs)] > 0) & (self.forbidden == kernel.FREE)

    def costs(self, heading: int | None = None) -> Array:
        """Of a metre at a heading, by its number, or at the cheapest of each cell; infinite where forbidden."""
        legs = self.legs.max(axis=0) if heading is None else self.legs[heading % len(self.legs)]
        free = (legs > 0) & (self.forbidden == kernel.FREE)
        costs = np.full(legs.shape, math.inf)
        climb = 1.0 + RELIEF * self.relief[free].astype(np.float64) / self.stroke
        costs[free] = climb * LEGS / legs[free] / self.trust[free]
        return costs


class LookForFootfalls(Protocol):
    """What makes feasible traversability of a map: ``feasible_ground``, or what knows that of an earlier one."""

    def __call__(self, robot: Robot, dem: Dem, settings: RouteSettings, progress: Progress, /) -> FeasibleGround:
        """As :func:`feasible_ground`."""
        ...


def feasible_ground(
    robot: Robot, dem: Dem, settings: RouteSettings | None = None, progress: Progress = no_progress
) -> FeasibleGround:
    """Feasible traversability of a map for a robot of six legs. progress: may raise Cancelled.

    Raises InvalidInput for other robots, and cells too coarse for the footfalls.
    """
    settings = settings or RouteSettings()
    geometry, ground, trusted = _seen(dem, settings)
    places = leg_places(robot, geometry.resolution, settings.headings)
    layers = _layers(places, ground, _footings(robot, geometry, ground, settings), trusted, settings)
    progress(1.0, "footfalls looked for")
    return _as_layers(layers, places, geometry, ground, trusted, dem, robot, settings)


def updated(robot: Robot, dem: Dem, before: FeasibleGround, progress: Progress = no_progress) -> FeasibleGround:
    """The same of a newer map with the same settings: only what changed, and what the rover covers from there.

    It is what ``feasible_ground`` would say of that map, which is asked where the cells lie elsewhere. Raises
    InvalidInput where ``before`` is of another robot.
    """
    settings = before.provenance.settings
    if not isinstance(settings, RouteSettings) or before.provenance.parents["robot"] != robot.digest:
        raise InvalidInput("feasible traversability is brought up to date for the robot that it was computed for")
    geometry, ground, trusted = _seen(dem, settings)
    if geometry.digest != before.geometry.digest:
        return feasible_ground(robot, dem, settings, progress)
    places = leg_places(robot, geometry.resolution, settings.headings)
    changed = (trusted != before.trusted) | ~((ground == before.ground) | (np.isnan(ground) & np.isnan(before.ground)))
    halo = places.radius + _beside(robot, geometry)
    strips = _strips(changed, halo)
    if sum((north - south + 2 * halo) * (east - west + 2 * halo) for south, north, west, east in strips) > ground.size:
        return feasible_ground(robot, dem, settings, progress)
    layers = tuple(
        layer.copy() for layer in (before.relief, before.height, before.trust, before.legs, before.forbidden)
    )
    for done, (south, north, west, east) in enumerate(strips, start=1):
        low, left = max(south - halo, 0), max(west - halo, 0)
        around = np.s_[low : north + halo, left : east + halo]
        part_ground, part_trusted = np.ascontiguousarray(ground[around]), np.ascontiguousarray(trusted[around])
        feet = _footings(robot, geometry, part_ground, settings)
        anew = _layers(places, part_ground, feet, part_trusted, settings)
        here = np.s_[..., south - low : north - low, west - left : east - left]
        for layer, part in zip(layers, anew, strict=True):
            layer[..., south:north, west:east] = part[here]
        progress(done / len(strips), "footfalls looked for again")
    return _as_layers(layers, places, geometry, ground, trusted, dem, robot, settings)


def feasible_cost_grid(found: FeasibleGround) -> CostGrid:
    """What a metre costs at the cheapest heading of each cell: the rover walks sideways and turns on the spot."""
    return CostGrid(np.maximum(found.costs(), 1.0), found.geometry, found.provenance)


def _seen(dem: Dem, settings: RouteSettings) -> tuple[GridGeometry, NDArray[np.float32], NDArray[np.uint8]]:
    """Cells of about the routes' resolution: the highest ground of each, and the trust in it."""
    geometry, size = coarse_geometry(dem.geometry, settings.resolution)
    known = np.isfinite(dem.heights)
    share = known.astype(np.float64)
    if dem.time is not None and known.any():
        share[known] = 0.5 ** ((dem.time[known].max() - dem.time[known]) / settings.fades)
    heights = blocks(np.where(known, dem.heights, -math.inf), size, -math.inf).max(axis=(1, 3))
    ground = np.where(np.isfinite(heights), heights, math.nan).astype(np.float32)
    return geometry, ground, np.floor(KNOWN * blocks(share, size, 0.0).mean(axis=(1, 3))).astype(np.uint8)


def _beside(robot: Robot, geometry: GridGeometry) -> int:
    """How many cells beside its middle a wheel's rim is, at least one."""
    return max(1, round(robot.wheel_radius / geometry.resolution))


def _footings(
    robot: Robot, geometry: GridGeometry, ground: NDArray[np.float32], settings: RouteSettings
) -> NDArray[np.float32]:
    """The ground where a wheel may stand on it, −inf elsewhere."""
    feet = np.empty(ground.shape, np.float32)
    steepest = math.tan(settings.maps.slope_limit) * geometry.resolution
    kernel.footings(ground, _beside(robot, geometry), steepest, feet)
    return feet


def _layers(
    places: kernel.LegPlaces,
    ground: NDArray[np.float32],
    feet: NDArray[np.float32],
    trusted: NDArray[np.uint8],
    settings: RouteSettings,
    search_all: bool = False,
) -> tuple[NDArray[np.generic], ...]:
    """relief, height, trust, legs and what forbids, before what is marked; search_all: also where nothing need be."""
    shape, radius = ground.shape, places.radius
    halves = np.array([math.isqrt(radius**2 - k**2) for k in range(-radius, radius + 1)], np.int32)
    all_cells = int((2 * halves + 1).sum())
    highest, lowest, best = (np.empty(shape, np.float32) for _ in range(3))
    trusted_under, footed = (np.empty(shape, np.int32) for _ in range(2))
    under = kernel.UnderRover(highest, lowest, best, trusted_under, footed)
    kernel.look_under_rover(ground, feet, trusted, halves, under)
    legs, why = np.empty((len(places.count), *shape), np.uint8), np.empty(shape, np.uint8)
    kernel.find_footfalls(
        np.pad(feet, radius, constant_values=-math.inf),
        under,
        places,
        settings.worst * KNOWN * all_cells,
        all_cells,
        places.stroke,
        search_all,
        legs,
        why,
    )
    known = np.isfinite(highest)
    relief, height = (np.full(shape, math.nan, np.float32) for _ in range(2))
    relief[known], height[known] = highest[known] - lowest[known], highest[known] + np.float32(places.room)
    return relief, height, (trusted_under / (KNOWN * all_cells)).astype(np.float32), legs, why


def _as_layers(
    layers: tuple[NDArray[np.generic], ...],
    places: kernel.LegPlaces,
    geometry: GridGeometry,
    ground: NDArray[np.float32],
    trusted: NDArray[np.uint8],
    dem: Dem,
    robot: Robot,
    settings: RouteSettings,
) -> FeasibleGround:
    relief, height, trust, legs, forbidden = layers
    forbidden[marked_off(geometry, settings)] = MARKED_OFF
    provenance = Provenance({"dem": dem.digest, "robot": robot.digest}, settings)
    for layer in (relief, height, trust, legs, forbidden, ground, trusted):
        # nothing else holds them, so the value need not copy them
        layer.setflags(write=False)
    return FeasibleGround(relief, height, trust, legs, forbidden, places.stroke, ground, trusted, geometry, provenance)  # type: ignore[arg-type]


def _strips(changed: NDArray[np.bool_], halo: int) -> list[tuple[int, int, int, int]]:
    """South, north, west, east of runs of tiles that together hold all within ``halo`` cells of what changed."""
    rows, cols = changed.shape
    strips = []
    for south in range(0, rows, _TILE):
        near = np.any(changed[max(south - halo, 0) : south + _TILE + halo], axis=0, keepdims=True)[0]
        wanted = [near[max(west - halo, 0) : west + _TILE + halo].any() for west in range(0, cols, _TILE)]
        edges = np.flatnonzero(np.diff([0, *map(int, wanted), 0]))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            strips.append((south, min(south + _TILE, rows), int(first) * _TILE, min(int(last) * _TILE, cols)))
    return strips
