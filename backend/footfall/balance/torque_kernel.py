"""The least torque ratio of a posture as a small linear program; compiled, for torques.py, where it is explained.

Unknown are the contact forces f, in weights, and the ratio t: least t with |constant + effect · f| ≤ t, faces · f ≥ 0,
balance · f = wanted. The balance is eliminated (Gauss–Jordan), which leaves d = 3 k − 6 numbers z and f = f0 + N z. Its
dual has d + 1 rows, one column for each bound, and a start at hand: see simplex.py. The ratio and z are its prices.
"""

import numpy as np
from numba import prange

from footfall.balance.cones import fill_facets
from footfall.balance.simplex import INFEASIBLE, OPTIMAL, UNBOUNDED, UNFINISHED, improve, prices, start
from footfall.compiled import njit

_SMALLEST_PIVOT = 1e-9
_LEFT_OVER = 1e-7
"""Largest force and moment that may be left over, in weights and in weights × size of the stance."""


@njit()
def jacobians_at(jacobian, legs, points):
    """d(point) / d(joint angles of its leg), (k, 3, 6), for points (k, 3) of the last links of legs (k,).

    jacobian: (6, legs × 6), linear (of the point at the origin) over angular.
    """
    out = np.empty((legs.size, 3, 6))
    for i in range(legs.size):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for joint in range(6):
            at = 6 * legs[i] + joint
            wx, wy, wz = jacobian[3, at], jacobian[4, at], jacobian[5, at]
            out[i, 0, joint] = jacobian[0, at] + wy * z - wz * y
            out[i, 1, joint] = jacobian[1, at] + wz * x - wx * z
            out[i, 2, joint] = jacobian[2, at] + wx * y - wy * x
    return out


@njit()
def least_ratio(arms, faces, effect, constant, forces):
    """Status and least ratio; the forces (k, 3) that reach it are filled in.

    arms (k, 3): contacts from the centre of mass, in units of the stance's size; faces (k, sides, 3): inward normals of
    the friction pyramids; effect (k, 6, 3): of a foot's force on the ratios of its leg's six joints; constant (k, 6).
    """
    wide = 3 * faces.shape[0]
    rows, rank, N, f0 = _balanced(arms)
    for r in range(rank, 6):
        if abs(rows[r, wide]) > _LEFT_OVER:
            return INFEASIBLE, np.inf
    free = wide - rank
    columns = _columns(N, faces, effect)
    m, count = columns.shape
    worth = np.empty(count)
    _fill_worth(f0[0], faces, effect, constant, worth)
    rhs, values, work = np.zeros(m), np.empty(m), np.empty(count + 2 * m)
    rhs[free] = 1.0
    basis, inverse = np.empty(m, np.int64), np.empty((m, m))
    if start(columns, rhs, basis, inverse, values, work) != OPTIMAL:
        return UNFINISHED, np.inf
    status = improve(columns, rhs, worth, basis, inverse, values, work)
    if status == UNBOUNDED:
        return INFEASIBLE, np.inf
    if status != OPTIMAL:
        return status, np.inf
    solution = np.empty(m)
    prices(columns, worth, basis, inverse, solution)
    for j in range(wide):
        total = f0[0, j]
        for c in range(free):
            total += N[j, c] * solution[c]
        forces[j // 3, j % 3] = total
    return OPTIMAL, solution[free]


@njit()
def ratios_for_centers(contacts, faces, effect, constant, coms, ratios):
    """:func:`least_ratio` for n centres of mass (n, 3) over the same feet; ratios (n,) is filled.

    contacts (k, 3) and coms in one frame, z against gravity [m]. inf where no forces hold the rover; False where a
    program was not solved. Of the programs only the worth of the columns depends on the centre, so the end of one is
    the start of the next.
    """
    if ratios.size != coms.shape[0]:
        raise ValueError("each centre of mass needs a ratio")
    if coms.shape[0] == 0:
        return True
    arms = contacts - coms[0]
    size = max(np.abs(arms).max(), 1e-6)
    wide = 3 * faces.shape[0]
    rows, rank, N, f0 = _balanced(arms / size)
    free = wide - rank
    columns = _columns(N, faces, effect)
    m, count = columns.shape
    worth, forces, solution = np.empty(count), np.empty(wide), np.empty(m)
    rhs, values, work = np.zeros(m), np.empty(m), np.empty(count + 2 * m)
    rhs[free] = 1.0
    basis, inverse = np.empty(m, np.int64), np.empty((m, m))
    ready = False
    for i in range(coms.shape[0]):
        x, y = (coms[i, 0] - coms[0, 0]) / size, (coms[i, 1] - coms[0, 1]) / size
        ratios[i], balanced = np.inf, True
        for r in range(rank, 6):
            if not abs(rows[r, wide] + x * rows[r, wide + 1] + y * rows[r, wide + 2]) <= _LEFT_OVER:
                balanced = False
        if not balanced:
            continue
        for j in range(wide):
            forces[j] = f0[0, j] + x * f0[1, j] + y * f0[2, j]
        _fill_worth(forces, faces, effect, constant, worth)
        if not ready and start(columns, rhs, basis, inverse, values, work) != OPTIMAL:
            return False
        status = improve(columns, rhs, worth, basis, inverse, values, work)
        ready = status == OPTIMAL
        if ready:
            prices(columns, worth, basis, inverse, solution)
            ratios[i] = solution[free]
        elif status != UNBOUNDED:
            return False
    return True


@njit()
def _balanced(arms):
    """Forces of contacts (k, 3) that balance a unit of weight: f = f0 + N z for every z.

    Returns the eliminated rows (6, 3 k + 3), their rank, N (3 k, d) and f0 (3, 3 k): for a weight over the origin of
    the arms, and what its x and its y add. The last three columns of rows past the rank tell what is left over.
    """
    feet = arms.shape[0]
    wide = 3 * feet
    rows = np.zeros((6, wide + 3))
    for foot in range(feet):
        x, y, z = arms[foot, 0], arms[foot, 1], arms[foot, 2]
        at = 3 * foot
        rows[0, at] = rows[1, at + 1] = rows[2, at + 2] = 1.0
        rows[3, at + 1], rows[3, at + 2] = -z, y
        rows[4, at], rows[4, at + 2] = z, -x
        rows[5, at], rows[5, at + 1] = -y, x
    rows[2, wide] = 1.0
    # the moment of the weight: y about x, −x about y
    rows[4, wide + 1], rows[3, wide + 2] = -1.0, 1.0
    pivots = np.full(6, -1, np.int64)
    rank = _eliminate(rows, wide, pivots)
    # the columns without a pivot are z themselves
    N, f0 = np.zeros((wide, wide - rank)), np.zeros((3, wide))
    is_pivot = np.zeros(wide, np.bool_)
    for r in range(rank):
        is_pivot[pivots[r]] = True
        for k in range(3):
            f0[k, pivots[r]] = rows[r, wide + k]
    z = 0
    for j in range(wide):
        if not is_pivot[j]:
            N[j, z] = 1.0
            for r in range(rank):
                N[pivots[r], z] = -rows[r, j]
            z += 1
    return rows, rank, N, f0


@njit()
def _columns(N, faces, effect):
    """Columns of the dual (d + 1, k (12 + sides)): two for each joint's ratio, one for each face of the pyramids."""
    feet, sides, free = faces.shape[0], faces.shape[1], N.shape[1]
    columns = np.zeros((free + 1, feet * (12 + sides)))
    at = 0
    for foot in range(feet):
        for joint in range(6):
            for c in range(free):
                share = 0.0
                for axis in range(3):
                    share += effect[foot, joint, axis] * N[3 * foot + axis, c]
                columns[c, at], columns[c, at + 1] = -share, share
            columns[free, at] = columns[free, at + 1] = 1.0
            at += 2
        for side in range(sides):
            for c in range(free):
                share = 0.0
                for axis in range(3):
                    share += faces[foot, side, axis] * N[3 * foot + axis, c]
                columns[c, at] = share
            at += 1
    return columns


@njit()
def _fill_worth(forces, faces, effect, constant, worth):
    """What the columns of :func:`_columns` are worth where forces (3 k,) take the place of f0."""
    at = 0
    for foot in range(faces.shape[0]):
        for joint in range(6):
            level = constant[foot, joint]
            for axis in range(3):
                level += effect[foot, joint, axis] * forces[3 * foot + axis]
            worth[at], worth[at + 1] = level, -level
            at += 2
        for side in range(faces.shape[1]):
            level = 0.0
            for axis in range(3):
                level += faces[foot, side, axis] * forces[3 * foot + axis]
            worth[at] = -level
            at += 1


@njit()
def hull_rows(points, order):
    """Rows of points (n, 2) that are corners of their convex hull, at least one; Andrew's monotone chain (1979).

    order: (n,) the rows by x, and by y where x is equal.
    """
    n = order.size
    chain, size = np.empty(2 * n + 1, np.int64), 0
    for side in range(2):
        base = size
        for k in range(n):
            row = order[k] if side == 0 else order[n - 1 - k]
            while size >= base + 2:
                a, b = points[chain[size - 2]], points[chain[size - 1]]
                left = (b[0] - a[0]) * (points[row, 1] - a[1])
                if left - (b[1] - a[1]) * (points[row, 0] - a[0]) > 0.0:
                    break
                size -= 1
            chain[size] = row
            size += 1
        # the last of one side is the first of the other
        size -= 1
    return chain[: max(size, 1)].copy()


@njit()
def _eliminate(rows, wide, pivots):
    """Gauss–Jordan with full pivots on the first ``wide`` columns, in place; returns the rank."""
    height = rows.shape[0]
    for r in range(height):
        top, column, most = -1, -1, _SMALLEST_PIVOT
        for i in range(r, height):
            for j in range(wide):
                if abs(rows[i, j]) > most:
                    top, column, most = i, j, abs(rows[i, j])
        if top < 0:
            return r
        pivot = rows[top, column]
        for j in range(rows.shape[1]):
            swapped = rows[r, j]
            rows[r, j] = rows[top, j] / pivot
            if top != r:
                rows[top, j] = swapped
        for i in range(height):
            if i != r:
                share = rows[i, column]
                for j in range(rows.shape[1]):
                    rows[i, j] -= share * rows[r, j]
        pivots[r] = column
    return height


@njit(parallel=True)
def least_ratios(
    fixed, faces, effect, constant, moved, unit, moved_effect, moved_constant, coms, size, friction, ratios
):
    """:func:`least_ratio` for n places of one more foot; ratios (n,) is filled, the status of each returned.

    fixed (k, 3), faces (k, sides, 3), effect (k, 6, 3) and constant (k, 6) of the feet that stay; moved (n, 3), unit
    normals (n, 3), moved_effect (n, 6, 3) and moved_constant (n, 6); coms (n, 3). A place with NaN gets NaN, one where
    no forces hold the rover inf.
    """
    count = moved.shape[0]
    if (
        ratios.size != count
        or coms.shape[0] != count
        or unit.shape[0] != count
        or moved_effect.shape[0] != count
        or moved_constant.shape[0] != count
    ):
        raise ValueError("the arrays of the places don't fit each other")
    status = np.empty(count, np.int64)
    for unsigned in prange(count):
        i = np.int64(unsigned)
        status[i], ratios[i] = _ratio_at(
            i, fixed, faces, effect, constant, moved, unit, moved_effect, moved_constant, coms, size, friction
        )
    return status


@njit()
def _ratio_at(i, fixed, faces, effect, constant, moved, unit, moved_effect, moved_constant, coms, size, friction):
    """UNFINISHED or OPTIMAL, and the ratio of one place."""
    feet, sides = faces.shape[0] + 1, faces.shape[1]
    arms, own_faces = np.empty((feet, 3)), np.empty((feet, sides, 3))
    own_effect, own_constant = np.empty((feet, 6, 3)), np.empty((feet, 6))
    for axis in range(3):
        for foot in range(feet - 1):
            arms[foot, axis] = (fixed[foot, axis] - coms[i, axis]) / size
        arms[feet - 1, axis] = (moved[i, axis] - coms[i, axis]) / size
        if np.isnan(arms[feet - 1, axis]) or np.isnan(unit[i, axis]):
            return OPTIMAL, np.nan
    fill_facets(unit[i : i + 1], friction, own_faces[feet - 1 :])
    for foot in range(feet):
        for joint in range(6):
            own_constant[foot, joint] = constant[foot, joint] if foot < feet - 1 else moved_constant[i, joint]
            for axis in range(3):
                share = effect[foot, joint, axis] if foot < feet - 1 else moved_effect[i, joint, axis]
                own_effect[foot, joint, axis] = share
        for side in range(sides):
            for axis in range(3):
                if foot < feet - 1:
                    own_faces[foot, side, axis] = faces[foot, side, axis]
    status, ratio = least_ratio(arms, own_faces, own_effect, own_constant, np.empty((feet, 3)))
    return (OPTIMAL if status == INFEASIBLE else status), ratio
