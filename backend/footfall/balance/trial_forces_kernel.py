"""Contact forces that are worth a try before a linear program is asked; compiled, for held_kernel.py.

The smallest forces that balance the weight, Σ |f|² least, are f_i = a + b × d_i, with d_i the contacts from their
centre: a and b in closed form. Where one is past its friction cone or asks too much of a motor, forces in equilibrium
and forces within bounds are approached in turn (*alternating projections*), which ends at a common point if there is
one.

Arrays over the k feet: arms (k, 3), contacts from the centre of mass [m]; unit (k, 3), normals; forces (k, 3)
[weights]; past (k, 3), what they are past their bounds; all level, z against gravity. spread: (4, 3), the inverse of
the contacts' second moments about their centre [1/m²], and the centre.

References:
----------
H. H. Bauschke, J. M. Borwein, "On projection algorithms for solving convex feasibility problems", SIAM Review 38, 1996.
"""

import math

from footfall.compiled import njit

_BEYOND = 1.9
"""How far each approach goes on along its step, which below 2 only makes it faster."""

_DEEPER = 0.97
"""Share of the bounds that is aimed at, so that the bounds themselves are reached after finitely many rounds."""

_SLACK = 1e-9
"""By how much forces must be inside [weights], that it is not rounding that puts them there."""

_FLAT = 1e-6
"""Contacts with a determinant of second moments this small, in units of their size, are as good as on a line."""


@njit()
def spread_of(arms, spread):
    """Whether the contacts are not on a line, or in a point; fills spread."""
    feet = arms.shape[0]
    cx = cy = cz = 0.0
    for foot in range(feet):
        cx, cy, cz = cx + arms[foot, 0] / feet, cy + arms[foot, 1] / feet, cz + arms[foot, 2] / feet
    xx = yy = zz = xy = xz = yz = 0.0
    for foot in range(feet):
        x, y, z = arms[foot, 0] - cx, arms[foot, 1] - cy, arms[foot, 2] - cz
        xx, yy, zz = xx + y * y + z * z, yy + x * x + z * z, zz + x * x + y * y
        xy, xz, yz = xy - x * y, xz - x * z, yz - y * z
    first, second, third = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = xx * first + xy * second + xz * third
    if not det > _FLAT * (xx + yy + zz) ** 3:
        return False
    spread[0, 0], spread[1, 1], spread[2, 2] = first / det, (xx * zz - xz * xz) / det, (xx * yy - xy * xy) / det
    spread[0, 1] = spread[1, 0] = second / det
    spread[0, 2] = spread[2, 0] = third / det
    spread[1, 2] = spread[2, 1] = (xy * xz - xx * yz) / det
    spread[3, 0], spread[3, 1], spread[3, 2] = cx, cy, cz
    return True


@njit()
def smallest_forces(arms, spread, forces):
    """The smallest forces that balance the weight."""
    share, cx, cy, cz = 1.0 / arms.shape[0], spread[3, 0], spread[3, 1], spread[3, 2]
    # about the contacts' centre the weight turns the rover by −c × (0, 0, −1), which their forces undo
    bx = spread[0, 1] * cx - spread[0, 0] * cy
    by = spread[1, 1] * cx - spread[1, 0] * cy
    bz = spread[2, 1] * cx - spread[2, 0] * cy
    for foot in range(arms.shape[0]):
        x, y, z = arms[foot, 0] - cx, arms[foot, 1] - cy, arms[foot, 2] - cz
        forces[foot, 0], forces[foot, 1] = by * z - bz * y, bz * x - bx * z
        forces[foot, 2] = share + bx * y - by * x


@njit()
def inside_cones(unit, friction, forces):
    """Whether every force is inside its cone, and not by rounding alone."""
    for foot in range(unit.shape[0]):
        along, across = _parts(unit, foot, forces)
        if not across + _SLACK <= friction * along:
            return False
    return True


@njit()
def approach_bounds(arms, unit, spread, friction, effect, constant, most, rounds, forces, past):
    """Whether forces in equilibrium could be brought inside their cones and to a ratio of at most ``most``.

    effect (k, 6, 3) and constant (k, 6) of the ratios of the feet's joints, see least_ratio; no rows: no ratio.
    """
    for _ in range(rounds):
        past[:] = 0.0
        above = effect.shape[0] > 0 and _past_ratio(effect, constant, most, forces, past)
        _past_cones(unit, _DEEPER * friction, forces, past)
        if not above and inside_cones(unit, friction, forces):
            return True
        _approach(arms, spread, forces, past)
    return False


@njit()
def _parts(unit, foot, forces):
    """A force's component along its normal, and the size of what is across."""
    nx, ny, nz = unit[foot, 0], unit[foot, 1], unit[foot, 2]
    fx, fy, fz = forces[foot, 0], forces[foot, 1], forces[foot, 2]
    along = nx * fx + ny * fy + nz * fz
    return along, math.sqrt((fx - along * nx) ** 2 + (fy - along * ny) ** 2 + (fz - along * nz) ** 2)


@njit()
def _past_cones(unit, friction, forces, past):
    """Add how far forces, less what they are past, are from the nearest ones inside their cones."""
    for foot in range(unit.shape[0]):
        nx, ny, nz = unit[foot, 0], unit[foot, 1], unit[foot, 2]
        fx, fy, fz = forces[foot, 0] - past[foot, 0], forces[foot, 1] - past[foot, 1], forces[foot, 2] - past[foot, 2]
        along = nx * fx + ny * fy + nz * fz
        gx, gy, gz = fx - along * nx, fy - along * ny, fz - along * nz
        across = math.sqrt(gx * gx + gy * gy + gz * gz)
        if across <= friction * along:
            continue
        kept = max(0.0, (along + friction * across) / (1.0 + friction * friction))
        lost = 1.0 - friction * kept / across if across > 0.0 else 0.0
        past[foot, 0] += (along - kept) * nx + lost * gx
        past[foot, 1] += (along - kept) * ny + lost * gy
        past[foot, 2] += (along - kept) * nz + lost * gz


@njit()
def _past_ratio(effect, constant, most, forces, past):
    """Whether the ratio of any joint is above ``most``; how far forces are past a little less is added."""
    above, aim = False, _DEEPER * most
    for foot in range(effect.shape[0]):
        fx, fy, fz = forces[foot, 0], forces[foot, 1], forces[foot, 2]
        for joint in range(6):
            ex, ey, ez = effect[foot, joint, 0], effect[foot, joint, 1], effect[foot, joint, 2]
            ratio = constant[foot, joint] + ex * fx + ey * fy + ez * fz
            above = above or not abs(ratio) <= most
            ratio -= ex * past[foot, 0] + ey * past[foot, 1] + ez * past[foot, 2]
            if abs(ratio) > aim:
                size = ex * ex + ey * ey + ez * ez
                if size > 0.0:
                    share = (ratio - math.copysign(aim, ratio)) / size
                    past[foot, 0] += share * ex
                    past[foot, 1] += share * ey
                    past[foot, 2] += share * ez
    return above


@njit()
def _approach(arms, spread, forces, past):
    """Take what forces are past their bounds away, less the force and moment a + b × d_i that this has in all."""
    feet = arms.shape[0]
    cx, cy, cz = spread[3, 0], spread[3, 1], spread[3, 2]
    ax = ay = az = tx = ty = tz = 0.0
    for foot in range(feet):
        gx, gy, gz = past[foot, 0], past[foot, 1], past[foot, 2]
        x, y, z = arms[foot, 0] - cx, arms[foot, 1] - cy, arms[foot, 2] - cz
        ax, ay, az = ax + gx, ay + gy, az + gz
        tx, ty, tz = tx + y * gz - z * gy, ty + z * gx - x * gz, tz + x * gy - y * gx
    ax, ay, az = ax / feet, ay / feet, az / feet
    bx = spread[0, 0] * tx + spread[0, 1] * ty + spread[0, 2] * tz
    by = spread[1, 0] * tx + spread[1, 1] * ty + spread[1, 2] * tz
    bz = spread[2, 0] * tx + spread[2, 1] * ty + spread[2, 2] * tz
    for foot in range(feet):
        x, y, z = arms[foot, 0] - cx, arms[foot, 1] - cy, arms[foot, 2] - cz
        gx, gy, gz = ax + by * z - bz * y, ay + bz * x - bx * z, az + bx * y - by * x
        forces[foot, 0] += _BEYOND * (gx - past[foot, 0])
        forces[foot, 1] += _BEYOND * (gy - past[foot, 1])
        forces[foot, 2] += _BEYOND * (gz - past[foot, 2])
