"""The equilibrium program of a stance, solved direction by direction; compiled, for region.py and region_candidates.py.

Unknowns are the weights of the edges of all friction pyramids, forces in units of the rover's weight. Rows: horizontal
force (two) and moment about the vertical are zero, the vertical force is one, and the normal forces of all contacts
sum to at most MOST_FORCE (with a slack, the last column). The moments about the horizontal axes say where the centre
of mass then is: they are the costs. All lengths are local: from ``center``, in units of ``size``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.balance.simplex import OPTIMAL, improve, start
from footfall.compiled import njit
from footfall.core.arrays import Array

ROWS = 5

MOST_FORCE = 10.0
"""Largest sum of the normal forces, in weights: how hard wheels may be pressed against each other's slopes.

It matters only where a slope and the friction angle together come near 90°: there the friction cone alone would let two
opposite slopes be squeezed with any force, and the region would have no bound."""

MERGED = 1e-6
"""Corners of the inner polygon nearer than this are one, local: the edge between has no certain direction."""

_BEYOND = 1e-9
"""A point becomes a corner of the inner polygon only where it is farther than this outside of it, local."""

_INSIDE = 1e-10
"""A point counts as inside only where it is this far inside every edge, local."""


@njit()
def fill_foot(x, y, z, edges, columns, costs, first):
    """The columns of one contact at local (x, y, z): edges (sides, 3) into columns (ROWS, n) and costs (2, n)."""
    for side in range(edges.shape[0]):
        fx, fy, fz = edges[side, 0], edges[side, 1], edges[side, 2]
        j = first + side
        columns[0, j], columns[1, j], columns[2, j] = fx, fy, fz
        columns[3, j] = x * fy - y * fx
        columns[4, j] = 1.0
        costs[0, j] = x * fz - z * fx
        costs[1, j] = y * fz - z * fy


@njit()
def fill_slack(columns, costs, rhs):
    """The last column, and the right-hand side (ROWS,)."""
    last = columns.shape[1] - 1
    for r in range(ROWS):
        columns[r, last] = 0.0
        rhs[r] = 0.0
    columns[4, last] = 1.0
    costs[0, last] = costs[1, last] = 0.0
    rhs[2], rhs[4] = 1.0, MOST_FORCE


class EquilibriumProgram(NamedTuple):
    """columns: (ROWS, n), rhs: (ROWS,), costs: (2, n), whose sums are the centre of mass."""

    columns: Array
    rhs: Array
    costs: Array


class Tableau(NamedTuple):
    """Where a program was solved to, as :mod:`footfall.balance.simplex` has it."""

    basis: NDArray[np.int64]
    inverse: Array
    values: Array


class Scratch(NamedTuple):
    """cost: (n,); work: (n + 2 · ROWS,)."""

    cost: Array
    work: Array


@njit()
def support(program, dx, dy, tableau, scratch):
    """Farthest centre of mass along (dx, dy): status, x, y. tableau: feasible, and changed."""
    costs, basis, values, cost = program.costs, tableau.basis, tableau.values, scratch.cost
    n = costs.shape[1]
    for j in range(n):
        cost[j] = dx * costs[0, j] + dy * costs[1, j]
    status = improve(program.columns, program.rhs, cost, basis, tableau.inverse, values, scratch.work)
    x = y = 0.0
    for i in range(ROWS):
        if basis[i] < n:
            x += values[i] * costs[0, basis[i]]
            y += values[i] * costs[1, basis[i]]
    return status, x, y


@njit()
def signed_distance(corners, count, x, y):
    """Distance of (x, y) to a convex polygon, positive inside: distance, edge, and the nearest point of it.

    corners: its first ``count`` rows, counter-clockwise; edge i leads from corner i to the next. Never more than the
    true distance, also where the polygon is a segment or a point, or has corners in one place.
    """
    inside = count > 2
    least, edge, near_x, near_y = np.inf, 0, 0.0, 0.0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ax, ay = corners[i, 0], corners[i, 1]
        ex, ey = corners[j, 0] - ax, corners[j, 1] - ay
        length = ex * ex + ey * ey
        share = 0.0
        if length > 0.0:
            share = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / length))
            inside = inside and ex * (y - ay) - ey * (x - ax) > _INSIDE * np.sqrt(length)
        px, py = ax + share * ex, ay + share * ey
        away = np.sqrt((x - px) ** 2 + (y - py) ** 2)
        if away < least:
            least, edge, near_x, near_y = away, i, px, py
    return (least if inside else -least), edge, near_x, near_y


@njit()
def signed_distances(corners, coms):
    """:func:`signed_distance` of many points (n, 2); NaN for NaN, −inf where there are no corners."""
    out = np.empty(coms.shape[0])
    for i in range(coms.shape[0]):
        if np.isnan(coms[i, 0]) or np.isnan(coms[i, 1]):
            out[i] = np.nan
        else:
            out[i] = signed_distance(corners, corners.shape[0], coms[i, 0], coms[i, 1])[0]
    return out


@njit()
def trace(local, edges, tolerance, limit):
    """All round the region of feet at local (k, 3) with pyramids (k, sides, 3).

    Returns a status; the directions solved, counter-clockwise, (q, 2), and how far the region reaches along each, (q,);
    the corners of the inner polygon, (m, 2), and the normal force of each foot there, (m, k); and how far the outer
    polygon reaches beyond the inner one. A direction is added between two neighbours while the corner of
    their outer lines is farther than ``tolerance`` (local) from the inner edge, up to ``limit`` directions.
    """
    feet, sides = edges.shape[0], edges.shape[1]
    n = feet * sides + 1
    columns, costs, rhs = np.empty((ROWS, n)), np.empty((2, n)), np.empty(ROWS)
    for foot in range(feet):
        fill_foot(local[foot, 0], local[foot, 1], local[foot, 2], edges[foot], columns, costs, foot * sides)
    fill_slack(columns, costs, rhs)
    program, scratch = EquilibriumProgram(columns, rhs, costs), Scratch(np.empty(n), np.empty(n + 2 * ROWS))
    directions, points = np.empty((limit, 2)), np.empty((limit, 2))
    bases, weights = np.empty((limit, ROWS), np.int64), np.empty((limit, ROWS))
    inverses = np.empty((limit, ROWS, ROWS))
    following, stack = np.empty(limit, np.int64), np.empty(limit, np.int64)
    count = depth = 0
    status = start(columns, rhs, bases[0], inverses[0], weights[0], scratch.work)
    previous = 0
    while status == OPTIMAL and count < limit:
        new = count
        if count < 4:
            dx, dy = (1.0, 0.0, -1.0, 0.0)[count], (0.0, 1.0, 0.0, -1.0)[count]
            following[new] = (count + 1) % 4
        else:
            previous = stack[depth - 1]
            j = following[previous]
            ex, ey = points[j, 0] - points[previous, 0], points[j, 1] - points[previous, 1]
            length = np.sqrt(ex * ex + ey * ey)
            if length <= tolerance or _gap(directions, previous, j, ex, ey, length) <= tolerance:
                depth -= 1
                if depth == 0:
                    break
                continue
            dx, dy = ey / length, -ex / length
            following[new] = j
            following[previous] = new
        directions[new, 0], directions[new, 1] = dx, dy
        if new > 0:
            for i in range(ROWS):
                bases[new, i], weights[new, i] = bases[previous, i], weights[previous, i]
                for r in range(ROWS):
                    inverses[new, i, r] = inverses[previous, i, r]
        status, points[new, 0], points[new, 1] = support(
            program, dx, dy, Tableau(bases[new], inverses[new], weights[new]), scratch
        )
        previous = new
        stack[depth] = new
        depth += 1
        count += 1
    if status != OPTIMAL:
        count = 0
    around, offsets = np.empty((count, 2)), np.empty(count)
    corners, loads = np.empty((count, 2)), np.zeros((count, feet))
    gap, kept, at = 0.0, 0, 0
    for q in range(count):
        j = following[at]
        dx, dy, x, y = directions[at, 0], directions[at, 1], points[at, 0], points[at, 1]
        around[q, 0], around[q, 1], offsets[q] = dx, dy, dx * x + dy * y
        ex, ey = points[j, 0] - x, points[j, 1] - y
        length = np.sqrt(ex * ex + ey * ey)
        if length > 0.0:
            gap = max(gap, _gap(directions, at, j, ex, ey, length))
        if _is_new(corners, kept, x, y):
            corners[kept, 0], corners[kept, 1] = x, y
            for i in range(ROWS):
                if bases[at, i] < n - 1:
                    loads[kept, bases[at, i] // sides] += weights[at, i]
            kept += 1
        at = j
    return status, around, offsets, corners[:kept], loads[:kept], gap


@njit()
def _is_new(corners, count, x, y):
    """Whether a point is away from the corner before it and from the first."""
    for i in (0, count - 1):
        if 0 <= i < count and max(abs(corners[i, 0] - x), abs(corners[i, 1] - y)) <= MERGED:
            return False
    return True


@njit()
def _gap(directions, i, j, ex, ey, length):
    """How far the corner of the outer lines of two neighbours is from the edge (ex, ey) between their points."""
    ax, ay = directions[i, 0], directions[i, 1]
    bx, by = directions[j, 0], directions[j, 1]
    turn = ax * by - ay * bx
    if turn <= 1e-12:
        return 0.0
    # the corner is at point i + s · (−ay, ax)
    s = (ex * bx + ey * by) / turn
    return abs(s * (ex * ax + ey * ay)) / length


@njit()
def nearest(program, x, y, tolerance, enough, tableau, scratch, corners):
    """Bounds of the signed distance of (x, y) to the region: status, lower, upper, local.

    The distance is the least, over all directions, of support − direction · (x, y): every solved direction bounds it
    from above, and the distance to the inner polygon of the points found bounds it from below. The direction solved
    next is the one in which the inner polygon is nearest, until the bounds are within ``tolerance`` or the lower one
    reaches ``enough``. tableau: feasible, and changed. corners: (limit, 2) scratch.
    """
    upper = np.inf
    count = 0
    for i in range(4):
        dx, dy = (1.0, 0.0, -1.0, 0.0)[i], (0.0, 1.0, 0.0, -1.0)[i]
        status, px, py = support(program, dx, dy, tableau, scratch)
        if status != OPTIMAL:
            return status, -np.inf, np.inf
        upper = min(upper, dx * (px - x) + dy * (py - y))
        if _is_new(corners, count, px, py):
            corners[count, 0], corners[count, 1] = px, py
            count += 1
    while True:
        lower, edge, near_x, near_y = signed_distance(corners, count, x, y)
        if upper - lower <= tolerance or lower >= enough or count == corners.shape[0]:
            return OPTIMAL, lower, upper
        if lower > 0.0:
            dx, dy = near_x - x, near_y - y
        else:
            dx, dy = x - near_x, y - near_y
        length = np.sqrt(dx * dx + dy * dy)
        if length <= 1e-9:  # on the boundary of the inner polygon: its edge has the direction
            j = edge + 1 if edge + 1 < count else 0
            dx, dy = corners[j, 1] - corners[edge, 1], corners[edge, 0] - corners[j, 0]
            length = np.sqrt(dx * dx + dy * dy)
            if length == 0.0:
                return OPTIMAL, lower, upper
        dx, dy = dx / length, dy / length
        status, px, py = support(program, dx, dy, tableau, scratch)
        if status != OPTIMAL:
            return status, -np.inf, np.inf
        upper = min(upper, dx * (px - x) + dy * (py - y))
        if not _insert(corners, count, px, py):
            return OPTIMAL, lower, max(lower, upper)
        count += 1


@njit()
def _insert(corners, count, x, y):
    """Put a point into the polygon at the edge that it lies farthest outside of; False where there is none."""
    most, at = _BEYOND, -1
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ex, ey = corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1]
        length = np.sqrt(ex * ex + ey * ey)
        if length > 0.0:
            beyond = (ey * (x - corners[i, 0]) - ex * (y - corners[i, 1])) / length
            if beyond > most:
                most, at = beyond, i
    if at < 0:
        return False
    for i in range(count, at + 1, -1):
        corners[i, 0], corners[i, 1] = corners[i - 1, 0], corners[i - 1, 1]
    corners[at + 1, 0], corners[at + 1, 1] = x, y
    return True
