"""The margin with friction for many places of one foot: what the maps colour cells by once friction counts.

Tracing the whole region at each place would answer for every centre of mass; here there is one for each place. So only
the part of the region that is nearest to it is refined: bounds from below and above close in on the margin, with
about a tenth of the linear programs. The lower bound is the answer: never more than the true margin, and within the
tolerance of it.

While the foot is still in the air the region is that of the feet that stay, and one region serves all places:
:func:`footfall.balance.region.region_margins`.
"""

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import ArrayLike, NDArray

from footfall.balance.balance_settings import SIDES, require_cone
from footfall.balance.cones import fill_generators
from footfall.balance.friction import FRICTION
from footfall.balance.region import equilibrium_region, frame, region_margins, require_stance
from footfall.balance.region_kernel import ROWS, EquilibriumProgram, Scratch, Tableau, fill_foot, fill_slack, nearest
from footfall.balance.simplex import INFEASIBLE, OPTIMAL, UNFINISHED, start
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError, InvalidInput

TOLERANCE = 1e-3
"""How far the answer may be below the true margin [m]."""

NO_LEG = 255
"""Instead of the number of a lost foot, where none binds."""

_MOST_CORNERS = 64
_AT_ONCE = 64


class CandidateRegionMargins(NamedTuple):
    """How far the centre of mass is inside each candidate's region.

    margin: (n,) [m], positive inside. lost: (n,) uint8, the row of the fixed foot whose loss binds, the count of the
    fixed feet for the candidate itself, NO_LEG where no loss was looked at or nothing is known.
    """

    margin: Array
    lost: NDArray[np.uint8]


class _Programs(NamedTuple):
    """One program for each stance that the candidate completes, and a basis of each, feasible wherever it stands.

    columns (s, ROWS, n), those of the candidate left zero; costs (s, 2, n); rhs (ROWS,); ready: (s,) the status of the
    basis, with bases, inverses, values.
    """

    columns: Array
    costs: Array
    rhs: Array
    ready: NDArray[np.int64]
    bases: NDArray[np.int64]
    inverses: Array
    values: Array


class _Candidates(NamedTuple):
    """moved, unit: (n, 3) places and normals of the foot; coms: (n, 2); in units of the stance, from its centre."""

    moved: Array
    unit: Array
    coms: Array
    friction: float
    sides: int
    tolerance: float


def region_margins_for_candidates(
    fixed_contacts: ArrayLike,
    fixed_normals: ArrayLike,
    candidates: ArrayLike,
    candidate_normals: ArrayLike,
    coms_xy: ArrayLike,
    conservative: bool = False,
    friction: float = FRICTION,
    sides: int = SIDES,
    tolerance: float = TOLERANCE,
) -> CandidateRegionMargins:
    """Margins to the equilibrium regions of the fixed feet together with each candidate.

    Args:
        fixed_contacts: (k, 3) of the feet that stay, at least two [m], z up.
        fixed_normals: (k, 3) out of the ground there.
        candidates: (n, 3) [m].
        candidate_normals: (n, 3) out of the ground there.
        coms_xy: centres of mass, (n, 2), or (2,) for all [m].
        conservative: whether the least margin after the loss of any one foot is asked for.
        friction: coefficient between feet and ground.
        sides: of the friction pyramids: 4, 8 or 16.
        tolerance: largest gap between the polygons from inside and from outside [m].

    Returns:
        Margins (n,) [m] and what binds them. NaN for a candidate with a NaN in any of its numbers; −inf where its
        normal does not point up, or no forces hold the rover.

    Raises:
        InvalidInput: the fixed feet or the shapes don't fit.
        FootFallError: a program for the forces was not solved, which is a defect.
    """
    fixed, fixed_unit = require_stance(fixed_contacts, fixed_normals)
    require_cone(friction, sides)
    if not 2 <= len(fixed) < NO_LEG:
        raise InvalidInput("with the candidate there must be at least three feet", fixed_feet=len(fixed))
    if not 0 < tolerance < np.inf:
        raise InvalidInput("the tolerance must be above zero [m]", tolerance=tolerance)
    moved, normals, coms = (
        np.asarray(candidates, float),
        np.asarray(candidate_normals, float),
        np.asarray(coms_xy, float),
    )
    if moved.ndim != 2 or moved.shape[1] != 3 or normals.shape != moved.shape:
        raise InvalidInput("candidates and their normals need n × 3 numbers", shape=list(moved.shape))
    if coms.shape not in ((2,), (len(moved), 2)):
        raise InvalidInput("coms_xy needs two numbers, or two for each candidate", shape=list(coms.shape))
    coms = np.broadcast_to(coms, (len(moved), 2))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    known = np.isfinite(np.hstack([moved, length, coms])).all(axis=1)
    upward = known & (normals[:, 2] > 0)
    center, size = frame(fixed)
    least = np.where(known, np.inf if not conservative else -np.inf, np.nan)
    least[known & ~upward] = -np.inf
    lost = np.full(len(moved), NO_LEG, np.uint8)
    if conservative:
        before = equilibrium_region(fixed, fixed_unit, friction, sides, tolerance)
        least[upward] = region_margins(before, coms[upward])
        lost[upward] = len(fixed)
    chosen = np.flatnonzero(upward)
    edges = np.empty((len(fixed), sides, 3))
    fill_generators(fixed_unit, friction, edges)
    found = least[chosen] / size
    found_lost = lost[chosen]
    asked = _Candidates(
        (moved[chosen] - center) / size,
        normals[chosen] / length[chosen],
        (coms[chosen] - center[:2]) / size,
        float(friction),
        sides,
        float(tolerance / size),
    )
    status = _all_margins(_programs((fixed - center) / size, edges, conservative), asked, found, found_lost)
    if (status == UNFINISHED).any():
        raise FootFallError("an equilibrium program was not solved")
    least[chosen] = size * found
    lost[chosen] = found_lost
    return CandidateRegionMargins(least, lost)


@njit()
def _programs(fixed, edges, conservative):
    """One program for all fixed feet, or (conservative) one for the loss of each."""
    feet, sides = edges.shape[0], edges.shape[1]
    stances = feet if conservative else 1
    n = (feet if conservative else feet + 1) * sides + 1
    columns, costs, rhs = np.zeros((stances, ROWS, n)), np.zeros((stances, 2, n)), np.empty(ROWS)
    bases, inverses = np.empty((stances, ROWS), np.int64), np.empty((stances, ROWS, ROWS))
    values, ready, work = np.empty((stances, ROWS)), np.empty(stances, np.int64), np.empty(n + 2 * ROWS)
    for stance in range(stances):
        first = 0
        for foot in range(feet):
            if not (conservative and foot == stance):
                x, y, z = fixed[foot, 0], fixed[foot, 1], fixed[foot, 2]
                fill_foot(x, y, z, edges[foot], columns[stance], costs[stance], first)
                first += sides
        fill_slack(columns[stance], costs[stance], rhs)
        ready[stance] = start(columns[stance], rhs, bases[stance], inverses[stance], values[stance], work)
    return _Programs(columns, costs, rhs, ready, bases, inverses, values)


@njit(parallel=True)
def _all_margins(programs, asked, least, lost):
    """Lower least (n,) and set lost (n,) where a stance with the candidate has less; returns each part's status."""
    count = asked.moved.shape[0]
    parts = (count + _AT_ONCE - 1) // _AT_ONCE
    status = np.empty(parts, np.int64)
    for part_unsigned in prange(parts):
        part = np.int64(part_unsigned)
        status[part] = _some_margins(part * _AT_ONCE, min(count, (part + 1) * _AT_ONCE), programs, asked, least, lost)
    return status


@njit()
def _some_margins(first, end, programs, asked, least, lost):
    """Candidates first … end − 1. Returns UNFINISHED or OPTIMAL. lost is set only where there are several stances."""
    columns, costs, rhs = programs.columns.copy(), programs.costs.copy(), programs.rhs
    moved, coms, sides = asked.moved, asked.coms, asked.sides
    stances, n = columns.shape[0], columns.shape[2]
    edges = np.empty((1, sides, 3))
    basis, inverse, value = np.empty(ROWS, np.int64), np.empty((ROWS, ROWS)), np.empty(ROWS)
    tableau, scratch = Tableau(basis, inverse, value), Scratch(np.empty(n), np.empty(n + 2 * ROWS))
    corners = np.empty((_MOST_CORNERS, 2))
    worst = OPTIMAL
    for i in range(first, end):
        fill_generators(asked.unit[i : i + 1], asked.friction, edges)
        for stance in range(stances):
            own, worth = columns[stance], costs[stance]
            fill_foot(moved[i, 0], moved[i, 1], moved[i, 2], edges[0], own, worth, n - 1 - sides)
            if programs.ready[stance] == OPTIMAL:
                for r in range(ROWS):
                    basis[r], value[r] = programs.bases[stance, r], programs.values[stance, r]
                    for c in range(ROWS):
                        inverse[r, c] = programs.inverses[stance, r, c]
                answer = OPTIMAL
            else:
                answer = start(own, rhs, basis, inverse, value, scratch.work)
            low = -np.inf
            if answer == OPTIMAL:
                answer, low, _ = nearest(
                    EquilibriumProgram(own, rhs, worth),
                    coms[i, 0],
                    coms[i, 1],
                    asked.tolerance,
                    least[i],
                    tableau,
                    scratch,
                    corners,
                )
            if answer != OPTIMAL and answer != INFEASIBLE:
                worst = UNFINISHED
            if low < least[i]:
                least[i] = low
                if stances > 1:
                    lost[i] = stance
    return worst
