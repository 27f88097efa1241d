"""How a rigid wheel sits on the ground: lowered along the normal of a contact until something touches it.

The planner puts the wheel's lowest rim point onto the contact, a plane fitted to the ground. A rigid wheel stands on
the ground's highest places: its *seat* is how far above the contact. *Support* is the share of the footprint that is
then close enough to the wheel to carry, where the footprint is the part of the tread that would be as close on even
ground: 1 on a plane, little on the tip of a stone.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

_SAMPLES_PER_RADIUS = 12
"""The ground is looked at at its cells, or where these are farther apart, this often along a wheel's radius.

Cells closer than _FINEST are not all looked at. Between samples s apart ground can touch a wheel of radius r up to
s²/8r sooner than is seen (0.2 mm at 2 cm), and under the edges of its tread up to s times the slope there."""

_FINEST = 0.01
"""Samples are at least about this far apart [m], and something narrower may be missed."""


class Lattice(NamedTuple):
    """Where the ground is looked at: ``parts`` places along the edge of a cell, and of these at every so many.

    heights: (rows, cols) [m]; x0, y0: of cell (0, 0) in site; resolution: edge of a cell [m].
    """

    heights: NDArray[np.float32]
    x0: float
    y0: float
    resolution: float
    parts: int
    every: int


class Tread(NamedTuple):
    """Of a wheel, and how far ground may be from it and still carry [m]."""

    radius: float
    half_width: float
    tolerance: float


def wheel_seat(
    robot: Robot, dem: Dem, contacts: Array, normals: Array, axles: Array, tolerance: float | None = None
) -> tuple[Array, Array]:
    """How high wheels come to sit on the ground at contacts, and how much of them is carried.

    Unknown ground neither lifts the wheel nor carries it. On a contact that lies on the ground no seat is below 0;
    above a hollow it is the height, negative, to which the wheel comes down.

    Args:
        robot: the rover.
        dem: the ground, in site.
        contacts: (n, 3) in site [m].
        normals: (n, 3) unit, in site.
        axles: (n, 3) unit, perpendicular to the normals.
        tolerance: how far ground may be from the wheel and still carry [m]; None: what a wheel may sink in
            (``clearances.wheel_sink``).

    Returns:
        Seats (n,) [m] and supports (n,) 0…1; NaN where an input is, or no ground is known under the wheel.

    Raises:
        InvalidInput: arrays of other shapes, or a tolerance that is not above zero or not below the wheel's radius.
    """
    arrays = [np.ascontiguousarray(a, float) for a in (contacts, normals, axles)]
    if any(a.ndim != 2 or a.shape != (len(arrays[0]), 3) for a in arrays):
        raise InvalidInput("contacts, normals and axles need the shape (n, 3)", shapes=[list(a.shape) for a in arrays])
    radius = robot.wheel_radius
    tolerance = robot.description.clearances.wheel_sink if tolerance is None else tolerance
    if not 0 < tolerance < radius:
        raise InvalidInput("the tolerance must be above zero and below the wheel's radius [m]", tolerance=tolerance)
    grid = dem.geometry
    parts = max(1, math.ceil(grid.resolution * _SAMPLES_PER_RADIUS / radius - 1e-9))
    every = max(1, int(_FINEST / grid.resolution + 1e-9))
    seat, support = np.empty(len(arrays[0])), np.empty(len(arrays[0]))
    lattice = Lattice(dem.heights, grid.x0, grid.y0, grid.resolution, parts, every)
    tread = Tread(radius, robot.description.wheel_width / 2, tolerance)
    _sit(lattice, arrays[0], arrays[1], arrays[2], tread, seat, support)
    return seat, support


@njit(parallel=True)
def _sit(
    lattice: Lattice, contacts: Array, normals: Array, axles: Array, tread: Tread, seat: Array, support: Array
) -> None:
    """Write seats and supports (n,). Samples are points of the surface's triangles."""
    heights, x0, y0, parts, every = lattice.heights, lattice.x0, lattice.y0, lattice.parts, lattice.every
    radius, half_width, tolerance = tread.radius, tread.half_width, tread.tolerance
    rows, cols = heights.shape
    spacing = lattice.resolution / parts
    patch = math.sqrt(2 * radius * tolerance - tolerance * tolerance)
    around = math.hypot(radius, half_width)
    # how many samples the footprint may span from its middle
    span = math.ceil(around / (spacing * every)) + 1
    for index in prange(len(contacts)):
        i = np.int64(index)
        px, py, pz = contacts[i]
        nx, ny, nz = normals[i]
        ax, ay, az = axles[i]
        seat[i] = support[i] = np.nan
        if math.isnan(px + py + pz + nx + ny + nz + ax + ay + az):
            continue
        # the rolling direction completes axle and normal
        fx, fy, fz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
        middle_u, middle_v = round((px - x0) / spacing), round((py - y0) / spacing)
        gaps = np.empty((2 * span + 1, 2 * span + 1))
        inside = 0
        least = np.inf
        for b in range(2 * span + 1):
            v = middle_v + (b - span) * every
            row = v // parts
            for a in range(2 * span + 1):
                u = middle_u + (a - span) * every
                gaps[b, a] = np.nan
                if u < 0 or v < 0 or u > (cols - 1) * parts or v > (rows - 1) * parts:
                    z = np.nan
                elif parts == 1:
                    z = float(heights[v, u])
                else:
                    col = u // parts
                    z = _sample(heights, row, col, (u - col * parts) / parts, (v - row * parts) / parts)
                dx, dy = x0 + u * spacing - px, y0 + v * spacing - py
                # unknown ground counts as part of the footprint where the tangent plane is
                level = -(nx * dx + ny * dy) / nz if math.isnan(z) else z - pz
                across = dx * ax + dy * ay + level * az
                along = dx * fx + dy * fy + level * fz
                if abs(across) > half_width or abs(along) >= radius:
                    continue
                counted = abs(along) <= patch
                inside += counted
                if math.isnan(z):
                    continue
                gap = radius - math.sqrt(radius * radius - along * along) - (dx * nx + dy * ny + level * nz)
                least = min(least, gap)
                if counted:
                    gaps[b, a] = gap
        if least == np.inf:
            continue
        seat[i] = -least
        close = 0
        for b in range(2 * span + 1):
            for a in range(2 * span + 1):
                close += gaps[b, a] - least <= tolerance + 1e-9
        if inside > 0:
            support[i] = close / inside


@njit()
def _sample(heights: NDArray[np.float32], row: int, col: int, east: float, north: float) -> float:
    """Height in a block at fractions of its edges, as terrain.surface has it; a vertex needs no block."""
    if east == 0 and north == 0:
        return float(heights[row, col])
    sw = float(heights[row, col])
    if north == 0:
        return sw + east * (float(heights[row, col + 1]) - sw)
    if east == 0:
        return sw + north * (float(heights[row + 1, col]) - sw)
    ne = float(heights[row + 1, col + 1])
    if east >= north:
        se = float(heights[row, col + 1])
        return sw + east * (se - sw) + north * (ne - se)
    nw = float(heights[row + 1, col])
    return sw + north * (nw - sw) + east * (ne - nw)
