"""How far a wheel, seen as a drum, is proven to be above the ground: compiled. The proof is in clearance.py."""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.proof.ground_tables import COLUMNS, PER_METRE, ROWS, START, X, Y

CENTER, RADIUS, HALF, REQUIRED, MOST = 0, 3, 4, 5, 6
"""Columns of ``LegTables.drums``, a row for each ground mode.

CENTER: three columns, the middle in the wheel's frame; its axle is along y. RADIUS: 0 where the drum is not to be asked
about. HALF: half its width. REQUIRED: its least distance to the ground. MOST: how far beyond that the ground that is
known reaches [m].
"""

NONE = -1.0
"""Answer where it is not proven."""

_TRIES = 8
"""Directions tried of a triangle."""


@njit()
def drum_above(
    poses: Array,
    part: int,
    drums: Array,
    mode: int,
    least: float,
    enough: float,
    lift: float,
    ground: Array,
    ground_layout: Array,
) -> float:
    """A lower bound of the distance of the drum to the ground under it, ``enough`` at most; NONE below ``least`` [m].

    least: REQUIRED or more; enough: no more than MOST beyond REQUIRED. lift: by which the ground is raised.
    """
    surface = ground_layout[ground_layout.shape[0] - 1]
    corner_x, corner_y, per_metre = surface[X], surface[Y], surface[PER_METRE]
    rows, columns, start = int(surface[ROWS]), int(surface[COLUMNS]), int(surface[START])
    cx, cy, cz = drums[mode, CENTER], drums[mode, CENTER + 1], drums[mode, CENTER + 2]
    radius, width = drums[mode, RADIUS], drums[mode, HALF]
    mx = poses[part, 0, 0] * cx + poses[part, 0, 1] * cy + poses[part, 0, 2] * cz + poses[part, 0, 3]
    my = poses[part, 1, 0] * cx + poses[part, 1, 1] * cy + poses[part, 1, 2] * cz + poses[part, 1, 3]
    mz = poses[part, 2, 0] * cx + poses[part, 2, 1] * cy + poses[part, 2, 2] * cz + poses[part, 2, 3] - lift
    ax, ay, az = poses[part, 0, 1], poses[part, 1, 1], poses[part, 2, 1]
    far_x = _extent(radius, width, ax) + enough
    far_y = _extent(radius, width, ay) + enough
    low = mz - _extent(radius, width, az) - enough
    # what is not clear mostly is in the ground below the middle
    row, column = math.floor((my - corner_y) * per_metre), math.floor((mx - corner_x) * per_metre)
    if 0 <= row < rows - 1 and 0 <= column < columns - 1:
        at = start + row * columns + column
        if min(ground[at], ground[at + 1], ground[at + columns], ground[at + columns + 1]) > mz - radius:
            return NONE
    south = max(math.floor((my - far_y - corner_y) * per_metre), 0)
    north = min(math.floor((my + far_y - corner_y) * per_metre), rows - 2)
    west = max(math.floor((mx - far_x - corner_x) * per_metre), 0)
    east = min(math.floor((mx + far_x - corner_x) * per_metre), columns - 2)
    half, bound = 0.5 / per_metre, enough
    for row in range(south, north + 1):
        y = corner_y + (row + 0.5) / per_metre - my
        for column in range(west, east + 1):
            at = start + row * columns + column
            sw, se, nw, ne = ground[at], ground[at + 1], ground[at + columns], ground[at + columns + 1]
            top, total = max(max(sw, se), max(nw, ne)), sw + se + nw + ne
            if top < low or not math.isfinite(total):
                continue  # far below, or a hole
            x, z = corner_x + (column + 0.5) / per_metre - mx, 0.25 * total
            nx, ny, nz, reach = _toward(x, y, z - mz, ax, ay, az, radius, width)
            east_more, north_more = nx * half, ny * half
            gap = (
                nx * x
                + ny * y
                - nz * mz
                - reach
                + min(
                    min(nz * sw - east_more - north_more, nz * se + east_more - north_more),
                    min(nz * nw - east_more + north_more, nz * ne + east_more + north_more),
                )
            )
            if not gap >= least:
                # each of the two triangles by directions of its own
                a, b, c = (x - half, y - half, sw - mz), (x + half, y - half, se - mz), (x + half, y + half, ne - mz)
                gap = _triangle_gap(a, b, c, ax, ay, az, radius, width, least)
                if gap >= least:
                    b = (x - half, y + half, nw - mz)
                    gap = min(gap, _triangle_gap(a, b, c, ax, ay, az, radius, width, least))
                if not gap >= least:
                    return NONE
            bound = min(bound, gap)
    return bound


@njit(inline="always")
def _extent(radius: float, width: float, along: float) -> float:
    """How far the drum reaches from its middle along an axis on which its axle has the component ``along``."""
    return radius * math.sqrt(max(1.0 - along * along, 0.0)) + width * abs(along)


@njit(inline="always")
def _toward(
    x: float, y: float, z: float, ax: float, ay: float, az: float, radius: float, width: float
) -> tuple[float, float, float, float]:
    """The unit direction to a point, seen from the drum's middle, from the drum's nearest point, never upward.

    And how far the drum reaches that way from its middle: ∞ where there is no such direction.
    """
    along = x * ax + y * ay + z * az
    px, py, pz = x - along * ax, y - along * ay, z - along * az
    away = math.sqrt(px * px + py * py + pz * pz)
    out, beside = max(away - radius, 0.0), max(abs(along) - width, 0.0)
    radial, axial = (out / away if out > 0.0 else 0.0), math.copysign(beside, along)
    nx, ny, nz = radial * px + axial * ax, radial * py + axial * ay, min(radial * pz + axial * az, 0.0)
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not size > 0.0:
        return 0.0, 0.0, 0.0, np.inf
    nx, ny, nz = nx / size, ny / size, nz / size
    return nx, ny, nz, _extent(radius, width, nx * ax + ny * ay + nz * az)


@njit()
def _triangle_gap(
    a: tuple[float, float, float],
    b: tuple[float, float, float],
    c: tuple[float, float, float],
    ax: float,
    ay: float,
    az: float,
    radius: float,
    width: float,
    least: float,
) -> float:
    """A lower bound of the distance of a triangle, seen from the drum's middle, or NONE where none is ``least``.

    The direction is that to a point of the triangle, which moves on toward the corner that is nearest along it (M.
    Frank, P. Wolfe, "An algorithm for quadratic programming", Naval Research Logistics Quarterly 3, 1956).
    """
    x, y, z = (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0
    for k in range(_TRIES):
        nx, ny, nz, reach = _toward(x, y, z, ax, ay, az, radius, width)
        if not nx * x + ny * y + nz * z - reach >= least:
            return NONE
        at_a = nx * a[0] + ny * a[1] + nz * a[2]
        at_b = nx * b[0] + ny * b[1] + nz * b[2]
        at_c = nx * c[0] + ny * c[1] + nz * c[2]
        nearest = min(at_a, min(at_b, at_c))
        if nearest - reach >= least:
            return nearest - reach
        to = a if nearest == at_a else (b if nearest == at_b else c)
        share = 2.0 / (k + 3.0)
        x, y, z = x + share * (to[0] - x), y + share * (to[1] - y), z + share * (to[2] - z)
    return NONE
