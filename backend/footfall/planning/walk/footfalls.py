"""Places where a foot may be put: a jittered lattice over the ground, less what is unknown, steep, rough or forbidden.

Every cell of the lattice has its one place, drawn from the seed and the cell's number alone. So the places do not
depend on how much of the ground is looked at.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from footfall.core.arrays import Array
from footfall.maps.wheel_seat import wheel_seat
from footfall.planning.walk.problem import Place, WalkSettings
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

LEAST_SUPPORT = 0.2
"""Share of a wheel's footprint that carries, at least."""
_JITTER = 0.4
"""How far from the middle of its cell a place is at most, as a share of the cell."""


@dataclass(frozen=True, eq=False)
class Footfalls:
    """contacts: (n, 3) site [m]; normals: (n, 3) unit; pinned: (n,) which of the pinned places each is, or −1.

    costs: (n,) what each costs by its ground, in foot moves (ground_cost.py); nothing until that was asked.
    seen: (n, 2) where they are seen from above, in site [m]; None: as contacts say, which are in another frame on a
    slope.
    """

    contacts: Array
    normals: Array
    pinned: NDArray[np.int64]
    costs: Array
    tree: KDTree
    seen: Array | None = None


def footfalls(robot: Robot, dem: Dem, low: Array, high: Array, settings: WalkSettings) -> Footfalls:
    """The places between two corners where a wheel may stand upright.

    Args:
        robot: the rover.
        dem: the ground, in site.
        low: south-west corner, (2,) in site [m].
        high: north-east corner, (2,) in site [m].
        settings: how far apart places are, and how steep they may be.

    Returns:
        Contacts and normals of the places.
    """
    spacing = settings.spacing
    first, last = np.floor(low / spacing).astype(int), np.ceil(high / spacing).astype(int)
    columns, rows = np.meshgrid(np.arange(first[0], last[0]), np.arange(first[1], last[1]))
    cells = np.column_stack([columns.ravel(), rows.ravel()])
    jitter = _JITTER * (2.0 * _drawn(cells, settings.seed) - 1.0)
    xy = (cells + 0.5 + jitter) * spacing
    pins = np.array([(place.x, place.y) for place in settings.pinned], float).reshape(-1, 2)
    pinned = np.concatenate([np.arange(len(pins)), np.full(len(xy), -1)])
    xy = np.concatenate([pins, xy])
    contacts, normals, rows = standable(robot, dem, xy, settings)
    return Footfalls(contacts, normals, pinned[rows], np.zeros(len(contacts)), KDTree(contacts[:, :2]))


def standable(robot: Robot, dem: Dem, xy: Array, settings: WalkSettings) -> tuple[Array, Array, NDArray[np.int64]]:
    """Those of some places where a wheel may stand upright.

    Args:
        robot: the rover.
        dem: the ground, in site.
        xy: places (n, 2) in site [m].
        settings: how steep they may be.

    Returns:
        Contacts and normals (k, 3) in site [m], and their rows (k,) among the places.
    """
    rows = np.flatnonzero((unknown_away(dem, xy) > robot.wheel_radius) & ~forbidden_to(None, xy, settings.forbidden))
    xy = xy[rows]
    contacts = np.column_stack([xy, height_at(dem, xy[:, 0], xy[:, 1])])
    normals = normal_at(dem, xy[:, 0], xy[:, 1], robot.wheel_radius)
    good = np.isfinite(contacts[:, 2]) & np.isfinite(normals).all(axis=1)
    good &= normals[:, 2] >= math.cos(settings.steepest)
    contacts, normals, rows = contacts[good], normals[good], rows[good]
    good = _seated(robot, dem, contacts, normals)
    return contacts[good], normals[good], rows[good]


def _drawn(cells: NDArray[np.int64], seed: int) -> Array:
    """Two numbers 0…1 for each cell (n, 2), of nothing but the cell and the seed.

    They are mixed as in SplitMix64 (Steele, Lea & Flood, "Fast splittable pseudorandom number generators", 2014).
    """
    out = np.empty(cells.shape)
    with np.errstate(over="ignore"):
        for axis in range(2):
            z = cells[:, 0].astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
            z += cells[:, 1].astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F)
            z += np.uint64(2 * seed + axis + 1) * np.uint64(0x165667B19E3779F9)
            z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            out[:, axis] = ((z ^ (z >> np.uint64(31))) >> np.uint64(11)).astype(float) / 2.0**53
    return out


def unknown_away(dem: Dem, xy: Array) -> Array:
    """How far the nearest unknown cell is from places (n, 2), at least, (n,) [m]; 0 off the map."""
    grid = dem.geometry
    # beyond the map all is unknown
    known = np.pad(np.isfinite(dem.heights), 1)
    away = np.asarray(distance_transform_edt(known))[1:-1, 1:-1] * grid.resolution
    columns = np.rint((xy[:, 0] - grid.x0) / grid.resolution).astype(int)
    rows = np.rint((xy[:, 1] - grid.y0) / grid.resolution).astype(int)
    inside = (rows >= 0) & (rows < grid.rows) & (columns >= 0) & (columns < grid.cols)
    out = np.zeros(len(xy))
    # the place is up to half a cell's diagonal from its cell's middle
    out[inside] = away[rows[inside], columns[inside]] - math.sqrt(0.5) * grid.resolution
    return np.maximum(out, 0.0)


def forbidden_to(leg: int | None, xy: Array, places: tuple[Place, ...]) -> NDArray[np.bool_]:
    """Whether places are forbidden to a leg alone.

    Args:
        leg: number of the leg, from 0; None: to every leg.
        xy: places (n, 2) in site [m].
        places: what the operator forbids.

    Returns:
        (n,).
    """
    out = np.zeros(len(xy), bool)
    for place in places:
        if place.leg == leg:
            out |= np.hypot(xy[:, 0] - place.x, xy[:, 1] - place.y) <= place.radius
    return out


def barred_to(leg: int, places: Footfalls, settings: WalkSettings) -> NDArray[np.bool_]:
    """Which places a leg alone must not stand on: those that are forbidden to it, and those pinned for another.

    Args:
        leg: number of the leg, from 0.
        places: where feet may be put.
        settings: what the operator forbids and pins.

    Returns:
        (n,).
    """
    xy = places.contacts[:, :2] if places.seen is None else places.seen
    others = [pin for pin, place in enumerate(settings.pinned) if place.leg not in (None, leg)]
    return forbidden_to(leg, xy, settings.forbidden) | np.isin(places.pinned, others)


def _seated(robot: Robot, dem: Dem, contacts: Array, normals: Array) -> NDArray[np.bool_]:
    """Whether a wheel that stands upright on contacts (n, 3) cuts no deeper than it may, rolling one way or across."""
    good = np.zeros(len(contacts), bool)
    sink = robot.description.clearances.wheel_sink
    for across in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        axles = np.cross(normals, across)
        axles /= np.linalg.norm(axles, axis=1, keepdims=True)
        seat, support = wheel_seat(robot, dem, contacts, normals, axles)
        with np.errstate(invalid="ignore"):
            good |= (np.abs(seat) <= sink) & (support >= LEAST_SUPPORT)
    return good
