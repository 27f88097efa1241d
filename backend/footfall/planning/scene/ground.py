"""The ground as a step sees it: where the wheel may touch, and what the leg may hit.

Where nothing was seen the map has holes. A footfall on unknown ground is refused. For collision the holes near the
leg are filled (terrain.unseen). A plan whose leg passes over filled cells says so in its checks.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.beside import roughly
from footfall.core.mesh import Mesh
from footfall.planning.answers import No, Status
from footfall.planning.scene.ground_tiles import GroundTiles
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.extent import outside, spans
from footfall.terrain.ground.surface import height_at, normal_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.ground.unseen import without_holes


@dataclass(frozen=True)
class Contact:
    """Where the wheel is to touch: point and upward unit normal, site frame, (3,) each [m]."""

    point: Array
    normal: Array


@dataclass(frozen=True, eq=False)
class Nearby:
    """The ground around one leg without holes.

    dem: crop with every cell filled. filled: (rows, cols), the cells that were unknown. mesh, tiles: its triangles, as
    a whole and in pieces, made when they are first asked for.
    """

    dem: Dem
    filled: NDArray[np.bool_]

    @cached_property
    def mesh(self) -> Mesh:
        """Its triangles."""
        return triangulate(self.dem)

    @cached_property
    def tiles(self) -> GroundTiles:
        """Its triangles in tiles, for exact distances."""
        return GroundTiles(self.dem)


def footfall_contact(robot: Robot, dem: Dem, x: float, y: float) -> Contact | No:
    """The contact at a place, if all the ground in a disc of a wheel's radius is known.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, in site [m].
        y: north, in site [m].

    Returns:
        The contact, or why there is no footfall.
    """
    off = outside(dem.geometry, x, y)
    if not off <= 0:
        off_map = f"the footfall ({x:.6g}, {y:.6g}) lies {roughly(off, 3)} m off the map"
        return No(Status.OFF_MAP, f"{off_map}; {spans(dem.geometry)}; choose a place inside")
    unknown = _unknown_in_disc(dem, x, y, robot.wheel_radius)
    height = float(height_at(dem, x, y))
    normal = normal_at(dem, x, y, robot.wheel_radius)
    if unknown or not (np.isfinite(height) and np.isfinite(normal).all()):
        share = f"{unknown:.0%}" if unknown >= 0.01 else "less than 1%"
        where = f"{share} of the ground within a wheel's radius" if unknown else "the ground"
        reason = (
            f"{where} ({robot.wheel_radius:z.2f} m) of the footfall ({x:z.2f}, {y:z.2f}) is unknown; "
            "take images that show it, or choose a place farther from the holes and the map's edge"
        )
        return No(Status.UNKNOWN_GROUND, reason)
    return Contact(np.array([x, y, height]), np.asarray(normal))


def _unknown_in_disc(dem: Dem, x: float, y: float, radius: float) -> float:
    """Share of unknown places in a disc, looked at on a lattice as fine as the grid or a quarter of the radius."""
    grid = dem.geometry
    middle = np.array([(y - grid.y0), (x - grid.x0)]) / grid.resolution
    first, last = np.floor(middle - radius / grid.resolution), np.ceil(middle + radius / grid.resolution)
    if (first >= 0).all() and (last < grid.shape).all():
        rows, cols = (slice(int(begin), int(end) + 1) for begin, end in zip(first, last, strict=True))
        if np.isfinite(dem.heights[rows, cols]).all():
            return 0.0
    steps = math.ceil(radius / min(dem.geometry.resolution, radius / 4))
    offsets = np.linspace(-radius, radius, 2 * steps + 1)
    dx, dy = np.meshgrid(offsets, offsets)
    inside = np.hypot(dx, dy) <= radius
    return float(np.isnan(height_at(dem, x + dx[inside], y + dy[inside])).mean())


def touch_radius(robot: Robot) -> float:
    """Radius about the base within which terrain can be touched [m]: every leg stretched out, and its wheel."""
    return max(
        float(np.linalg.norm(leg.T_base_hip[:3, 3]) + np.linalg.norm(leg.hip_offset))
        + leg.thigh
        + leg.shank
        + leg.foot
        + float(np.hypot(robot.wheel_radius, robot.description.wheel_width))
        for leg in robot.description.legs
    )


def nearby(dem: Dem, center_xy: Array, radius: float, contacts: Array) -> Nearby | No:
    """The ground around a place, holes filled as terrain.unseen says.

    Args:
        dem: the ground, in site.
        center_xy: (2,) in site [m].
        radius: how far around [m].
        contacts: where wheels stand, (k, 3) in site [m].

    Returns:
        That ground, or why there is none.
    """
    whole = without_holes(dem, center_xy, radius, contacts)
    if whole is None:
        return No(Status.UNKNOWN_GROUND, "no ground at all is known around this leg; load or build a terrain")
    return Nearby(whole.dem, whole.filled)
