"""The ground as a step sees it: where the wheel may touch, and what the leg may hit.

Where nothing was seen the map has holes. A footfall on unknown ground is refused. For collision the holes near the
leg are filled, each unknown cell as high as its highest known neighbour, ring by ring, and so is everything beyond the
map's edge: unseen ground must not be free. Where a wheel stands the ground is known to be no higher than the wheel.
A plan whose leg passes over filled cells says so in its checks.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.planning.step.problem import Status
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.surface import height_at, normal_at
from footfall.terrain.triangulate import triangulate

Array = NDArray[np.float64]

FOOT_DISC = 0.15
"""Radius around a standing wheel's contact in which unknown cells take the contact's height [m]."""


@dataclass(frozen=True)
class Contact:
    """Where the wheel is to touch: point and upward unit normal, site frame, (3,) each [m]."""

    point: Array
    normal: Array


@dataclass(frozen=True)
class Refused:
    """Why there is no footfall here."""

    status: Status
    reason: str


@dataclass(frozen=True)
class Nearby:
    """The ground around one leg without holes.

    dem: crop with every cell filled. filled: (rows, cols), the cells that were unknown. mesh: its triangles.
    """

    dem: Dem
    filled: NDArray[np.bool_]
    mesh: Mesh


def footfall_contact(robot: Robot, dem: Dem, x: float, y: float) -> Contact | Refused:
    """The contact under (x, y) [m] if all the ground in a disc of a wheel's radius is known."""
    west, south, east, north = dem.geometry.bounds
    spans = f"the map spans x {west:.2f}…{east:.2f} m, y {south:.2f}…{north:.2f} m"
    if not (west <= x <= east and south <= y <= north):
        outside = max(west - x, x - east, south - y, y - north)
        reason = f"the footfall ({x:.2f}, {y:.2f}) lies {outside:.2f} m off the map; {spans}; choose a place inside"
        return Refused(Status.OFF_MAP, reason)
    unknown = _unknown_in_disc(dem, x, y, robot.wheel_radius)
    height = float(height_at(dem, x, y))
    normal = normal_at(dem, x, y, robot.wheel_radius)
    if unknown or not (np.isfinite(height) and np.isfinite(normal).all()):
        share = f"{unknown:.0%}" if unknown >= 0.01 else "less than 1%"
        where = f"{share} of the ground within a wheel's radius" if unknown else "the ground"
        reason = (
            f"{where} ({robot.wheel_radius:.2f} m) of the footfall ({x:.2f}, {y:.2f}) is unknown; "
            "take images that show it, or choose a place farther from the holes and the map's edge"
        )
        return Refused(Status.UNKNOWN_GROUND, reason)
    return Contact(np.array([x, y, height]), np.asarray(normal))


def _unknown_in_disc(dem: Dem, x: float, y: float, radius: float) -> float:
    """Share of unknown places in a disc, looked at on a lattice as fine as the grid or a quarter of the radius."""
    steps = math.ceil(radius / min(dem.geometry.resolution, radius / 4))
    offsets = np.linspace(-radius, radius, 2 * steps + 1)
    dx, dy = np.meshgrid(offsets, offsets)
    inside = np.hypot(dx, dy) <= radius
    return float(np.isnan(height_at(dem, x + dx[inside], y + dy[inside])).mean())


def nearby(dem: Dem, center_xy: Array, radius: float, contacts: Array) -> Nearby | Refused:
    """The ground within ``radius`` [m] of a place, holes filled as the module docstring says.

    contacts: (k, 3) where wheels stand, site [m].
    """
    grid = dem.geometry
    low = np.floor((center_xy - radius - (grid.x0, grid.y0)) / grid.resolution).astype(int)
    high = np.ceil((center_xy + radius - (grid.x0, grid.y0)) / grid.resolution).astype(int) + 1
    heights = np.full((high[1] - low[1], high[0] - low[0]), np.nan, np.float32)
    rows, cols = slice(max(low[1], 0), min(high[1], grid.rows)), slice(max(low[0], 0), min(high[0], grid.cols))
    if rows.start < rows.stop and cols.start < cols.stop:
        heights[rows.start - low[1] : rows.stop - low[1], cols.start - low[0] : cols.stop - low[0]] = dem.heights[
            rows, cols
        ]
    geometry = GridGeometry(
        grid.x0 + float(low[0]) * grid.resolution,
        grid.y0 + float(low[1]) * grid.resolution,
        grid.resolution,
        *heights.shape,
    )
    unknown = np.isnan(heights)
    if unknown.any():
        _put_contacts(heights, unknown, geometry, contacts)
        if np.isnan(heights).all():
            return Refused(Status.UNKNOWN_GROUND, "no ground at all is known around this leg; load or build a terrain")
        _fill(heights)
    whole = Dem(heights, geometry, dem.name, Provenance({}))
    return Nearby(whole, unknown, triangulate(whole))


def _put_contacts(heights: NDArray, unknown: NDArray, geometry: GridGeometry, contacts: Array) -> None:
    centers = geometry.centers()
    for contact in contacts:
        near = np.hypot(*(centers - contact[:2]).transpose(2, 0, 1)) <= FOOT_DISC
        heights[near & unknown] = contact[2]


def _fill(heights: NDArray[np.float32]) -> None:
    """Fill NaN ring by ring with the highest of the eight neighbours known so far, in place."""
    missing = np.isnan(heights)
    while missing.any():
        highest = maximum_filter(np.where(missing, -np.inf, heights), size=3, mode="nearest")
        ring = missing & np.isfinite(highest)
        heights[ring] = highest[ring]
        missing &= ~ring
