"""A small dense simplex, compiled: maximise cost · x where columns · x = rhs and x ≥ 0.

Revised primal simplex with an explicit inverse of the basis, for a handful of rows and up to a few hundred columns.
A basis that solved one cost is a start for the next: only the cost may change between two calls on one problem.

The caller owns all arrays (m rows, n columns):

- columns (m, n), rhs (m,) ≥ 0;
- basis (m,) int64: the column of each row of the basis; n + r stands for the artificial column of row r;
- inverse (m, m) of the basis, values (m,) of its variables;
- work (n + 2 m,): scratch.

Dantzig's rule, and Bland's where the value stands still, which can't cycle.

Where many bounds meet, as on level ground, pivots can be so small that the inverse is lost to rounding: a column enters
twice, or the search ends where the value is not the largest. So no answer is given that its certificate does not bear
out (:func:`_sound`); where it does not, all is done anew with larger pivots and an inverse that is computed at each.

References:
----------
G. B. Dantzig, "Linear Programming and Extensions", 1963, chapter 9.
R. G. Bland, "New finite pivoting rules for the simplex method", Mathematics of Operations Research 2, 1977.
"""

import numpy as np

from footfall.compiled import njit

OPTIMAL, INFEASIBLE, UNBOUNDED, UNFINISHED = 0, 1, 2, 3

_GAIN = 1e-10
"""A column enters only where it gains more than this for each unit."""
_PIVOT = 1e-9
"""Smallest pivot."""
_TIE = 1e-12
_FEASIBLE = 1e-9
"""Largest sum of artificial variables of a feasible problem."""
_MOST_PIVOTS = 2000
_STANDSTILL = 20
"""Pivots without progress after which Bland's rule takes over until there is some."""
_FRESH = 40
"""Pivots after which the inverse is computed anew."""
_CAREFUL_PIVOT = 1e-7
"""Smallest pivot where rounding has spoilt the first answer; then the inverse is computed anew after each."""
_SOUND = 1e-6
"""What the certificate of an answer may be off, of numbers about 1."""


@njit()
def start(columns, rhs, basis, inverse, values, work):
    """Find a first basis: OPTIMAL, INFEASIBLE or UNFINISHED. Costs are not looked at."""
    m, n = columns.shape
    if (
        basis.size != m
        or inverse.shape[0] != m
        or inverse.shape[1] != m
        or rhs.size != m
        or values.size != m
        or work.size < n + 2 * m
    ):
        raise ValueError("the arrays of the simplex don't fit each other")
    status = _first_basis(columns, rhs, basis, inverse, values, work, False)
    return _first_basis(columns, rhs, basis, inverse, values, work, True) if status == UNFINISHED else status


@njit()
def improve(columns, rhs, cost, basis, inverse, values, work):
    """Maximise from a feasible basis: OPTIMAL, UNBOUNDED or UNFINISHED. cost: (n,)."""
    status = _pivot_on(columns, rhs, cost, False, basis, inverse, values, work, False)
    if status != UNFINISHED:
        return status
    if _first_basis(columns, rhs, basis, inverse, values, work, True) != OPTIMAL:
        return UNFINISHED
    return _pivot_on(columns, rhs, cost, False, basis, inverse, values, work, True)


@njit()
def prices(columns, cost, basis, inverse, out):
    """The dual variables of the basis, (m,) into out: what one unit more of each row's rhs is worth."""
    m, n = columns.shape
    for r in range(m):
        total = 0.0
        for i in range(m):
            if basis[i] < n:
                total += cost[basis[i]] * inverse[i, r]
        out[r] = total


@njit()
def _first_basis(columns, rhs, basis, inverse, values, work, careful):
    m, n = columns.shape
    for i in range(m):
        basis[i] = n + i
        values[i] = rhs[i]
        for r in range(m):
            inverse[i, r] = 1.0 if i == r else 0.0
    status = _pivot_on(columns, rhs, values, True, basis, inverse, values, work, careful)
    if status != OPTIMAL:
        return UNFINISHED
    left = 0.0
    for i in range(m):
        if basis[i] >= n:
            left += values[i]
            values[i] = 0.0
    return OPTIMAL if left <= _FEASIBLE else INFEASIBLE


@njit()
def _pivot_on(columns, rhs, cost, first_phase, basis, inverse, values, work, careful):
    """As :func:`improve`; UNFINISHED also where the answer is not sound. first_phase: cost is that of the start."""
    m, n = columns.shape
    dual, entering_column = n, n + m
    smallest, fresh = (_CAREFUL_PIVOT, 1) if careful else (_PIVOT, _FRESH)
    since_fresh = still = 0
    for _ in range(_MOST_PIVOTS):
        bland = still > _STANDSTILL
        entering = _entering(columns, cost, first_phase, basis, inverse, work, dual, bland)
        if entering < 0:
            return OPTIMAL if _sound(columns, rhs, cost, first_phase, basis, values, work, dual) else UNFINISHED
        for i in range(m):
            total = 0.0
            for r in range(m):
                total += inverse[i, r] * columns[r, entering]
            work[entering_column + i] = total
        leaving = _leaving(n, first_phase, basis, values, work, entering_column, bland, smallest)
        if leaving < 0:
            ray = work[entering_column : entering_column + m]
            return UNBOUNDED if _off(columns, columns[:, entering], basis, ray) <= _SOUND else UNFINISHED
        pivot = work[entering_column + leaving]
        step = values[leaving] / pivot
        still = still + 1 if abs(step) <= _TIE else 0
        for i in range(m):
            if i != leaving:
                share = work[entering_column + i]
                values[i] = max(0.0, values[i] - step * share)
                share /= pivot
                for r in range(m):
                    inverse[i, r] -= share * inverse[leaving, r]
        for r in range(m):
            inverse[leaving, r] /= pivot
        values[leaving] = max(0.0, step)
        basis[leaving] = entering
        since_fresh += 1
        if since_fresh == fresh:
            since_fresh = 0
            _refresh(columns, rhs, basis, inverse, values)
    return UNFINISHED


@njit()
def _sound(columns, rhs, cost, first_phase, basis, values, work, dual):
    """Whether a basis at which no column gains is the best there is.

    Its values have to fulfil the rows, and be worth what the prices ``work[dual:]`` say, which no others exceed.
    """
    m, n = columns.shape
    worth = bound = 0.0
    for i in range(m):
        bound += work[dual + i] * rhs[i]
        if basis[i] >= n:
            worth -= values[i] if first_phase else 0.0
        elif not first_phase:
            worth += cost[basis[i]] * values[i]
    return abs(worth - bound) <= _SOUND * (1.0 + abs(bound)) and _off(columns, rhs, basis, values) <= _SOUND


@njit()
def _off(columns, wanted, basis, values):
    """The most by which the columns of a basis, taken so often, miss what is wanted (m,)."""
    m, n = columns.shape
    most = 0.0
    for r in range(m):
        total = -wanted[r]
        for i in range(m):
            if basis[i] < n:
                total += columns[r, basis[i]] * values[i]
            elif basis[i] - n == r:
                total += values[i]
        most = max(most, abs(total))
    return most


@njit()
def _entering(columns, cost, first_phase, basis, inverse, work, dual, bland):
    """The column that gains most (Bland: the first that gains), or −1 where none does."""
    m, n = columns.shape
    for r in range(m):
        total = 0.0
        for i in range(m):
            if first_phase:
                if basis[i] >= n:
                    total -= inverse[i, r]
            elif basis[i] < n:
                total += cost[basis[i]] * inverse[i, r]
        work[dual + r] = total
    for j in range(n):
        work[j] = 0.0 if first_phase else cost[j]
    for r in range(m):
        price = work[dual + r]
        for j in range(n):
            work[j] -= price * columns[r, j]
    entering, most = -1, _GAIN
    for j in range(n):
        if work[j] > most:
            entering, most = j, work[j]
            if bland:
                break
    return entering


@njit()
def _leaving(n, first_phase, basis, values, work, at, bland, smallest):
    """The row whose variable reaches zero first, or −1 where none does. smallest: pivot that is taken.

    After the first phase an artificial variable must stay at zero, so it leaves as soon as it would change.
    """
    m = basis.size
    if not first_phase:
        for i in range(m):
            if basis[i] >= n and abs(work[at + i]) > smallest:
                return i
    least = np.inf
    for i in range(m):
        if work[at + i] > smallest:
            least = min(least, values[i] / work[at + i])
    leaving = -1
    for i in range(m):
        share = work[at + i]
        if share > smallest and values[i] / share <= least + _TIE:
            if leaving < 0:
                leaving = i
            elif bland:
                leaving = i if basis[i] < basis[leaving] else leaving
            elif share > work[at + leaving]:
                leaving = i
    return leaving


@njit()
def _refresh(columns, rhs, basis, inverse, values):
    """Inverse and values from the basis itself (Gauss–Jordan, row pivots), rid of the rounding of many updates."""
    m, n = columns.shape
    both = np.zeros((m, 2 * m))
    for i in range(m):
        for r in range(m):
            if basis[i] < n:
                both[r, i] = columns[r, basis[i]]
            elif basis[i] - n == r:
                both[r, i] = 1.0
        both[i, m + i] = 1.0
    for c in range(m):
        top = c
        for r in range(c + 1, m):
            if abs(both[r, c]) > abs(both[top, c]):
                top = r
        if abs(both[top, c]) < 1e-14:
            return  # keep the updated inverse: the basis is nearly singular
        for k in range(2 * m):
            both[c, k], both[top, k] = both[top, k], both[c, k]
        pivot = both[c, c]
        for k in range(2 * m):
            both[c, k] /= pivot
        for r in range(m):
            if r != c and both[r, c] != 0.0:
                share = both[r, c]
                for k in range(2 * m):
                    both[r, k] -= share * both[c, k]
    for i in range(m):
        total = 0.0
        for r in range(m):
            inverse[i, r] = both[i, m + r]
            total += inverse[i, r] * rhs[r]
        values[i] = max(0.0, total)
