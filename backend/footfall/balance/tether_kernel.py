"""A tether's pull in the balance of a standing rover; compiled, for held_kernel.py and torques.py.

The pull is f ≥ 0 along a known line, at most what the drum can. In the linear program it is the force of one more foot:
its pyramid is flattened to the line, and its share of the drum's most is the ratio of one more joint (Hauser, Bretl,
Latombe & Wilcox, "Motion planning for a six-legged lunar robot", 2006, Fig. 8: rappelling).

Forces in weights, arrays as in trial_forces_kernel.py; pull: (2, 3) level, its arm from the centre of mass [m], and the
unit vector to the anchor.
"""

import math

from footfall.balance.cones import tangents
from footfall.compiled import njit

ANCHOR, ATTACHMENT, MOST = 0, 3, 6
"""First entries of the row of ``HeldTables.tether``: in site, in base [m]; the drum's most [N]."""

_SHORTEST = 0.01
"""A tether that is shorter has no direction that could be counted on [m]."""


@njit()
def fill_pull(tether, T_site_base, R_level_site, x, y, z, pull):
    """Whether the tether has a direction; fills pull for a centre of mass (x, y, z) in site."""
    row = tether[0]
    ax, ay, az = row[ATTACHMENT], row[ATTACHMENT + 1], row[ATTACHMENT + 2]
    px = T_site_base[0, 0] * ax + T_site_base[0, 1] * ay + T_site_base[0, 2] * az + T_site_base[0, 3]
    py = T_site_base[1, 0] * ax + T_site_base[1, 1] * ay + T_site_base[1, 2] * az + T_site_base[1, 3]
    pz = T_site_base[2, 0] * ax + T_site_base[2, 1] * ay + T_site_base[2, 2] * az + T_site_base[2, 3]
    dx, dy, dz = row[ANCHOR] - px, row[ANCHOR + 1] - py, row[ANCHOR + 2] - pz
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not (length > _SHORTEST and length < math.inf):
        return False
    R = R_level_site
    for i in range(3):
        pull[0, i] = R[i, 0] * (px - x) + R[i, 1] * (py - y) + R[i, 2] * (pz - z)
        pull[1, i] = (R[i, 0] * dx + R[i, 1] * dy + R[i, 2] * dz) / length
    return True


@njit()
def fill_change(arms, spread, pull, change):
    """What a pull of one weight adds to the smallest forces of the feet: force −d and moment −arm × d in all."""
    cx, cy, cz = spread[3, 0], spread[3, 1], spread[3, 2]
    dx, dy, dz = pull[1, 0], pull[1, 1], pull[1, 2]
    x, y, z = pull[0, 0] - cx, pull[0, 1] - cy, pull[0, 2] - cz
    tx, ty, tz = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx
    bx = spread[0, 0] * tx + spread[0, 1] * ty + spread[0, 2] * tz
    by = spread[1, 0] * tx + spread[1, 1] * ty + spread[1, 2] * tz
    bz = spread[2, 0] * tx + spread[2, 1] * ty + spread[2, 2] * tz
    share = 1.0 / arms.shape[0]
    for foot in range(arms.shape[0]):
        x, y, z = arms[foot, 0] - cx, arms[foot, 1] - cy, arms[foot, 2] - cz
        change[foot, 0] = -share * dx - (by * z - bz * y)
        change[foot, 1] = -share * dy - (bz * x - bx * z)
        change[foot, 2] = -share * dz - (bx * y - by * x)


@njit()
def easiest_pull(unit, forces, change, most):
    """The pull 0…``most`` with which the forces across the normals are least, Σ |·|², with forces + pull · change."""
    worth = size = 0.0
    for foot in range(unit.shape[0]):
        along = force = 0.0
        for i in range(3):
            along += unit[foot, i] * change[foot, i]
            force += unit[foot, i] * forces[foot, i]
        for i in range(3):
            across = change[foot, i] - along * unit[foot, i]
            worth -= across * (forces[foot, i] - force * unit[foot, i])
            size += across * across
    return min(max(worth / size, 0.0), most) if size > 0.0 else 0.0


@njit()
def fill_limb(pull, most, arm, faces, effect):
    """The tether as one more foot of least_ratio: its arm (3,), faces (sides, 3) and effect (6, 3).

    most: what the drum can, in weights.
    """
    x, y, z = pull[1, 0], pull[1, 1], pull[1, 2]
    ux, uy, uz, vx, vy, vz = tangents(x, y, z)
    effect[:] = 0.0
    for side in range(faces.shape[0]):
        faces[side, 0], faces[side, 1], faces[side, 2] = x, y, z
    faces[0, 0], faces[0, 1], faces[0, 2] = ux, uy, uz
    faces[1, 0], faces[1, 1], faces[1, 2] = vx, vy, vz
    # with the two above at least zero, this one leaves none of them above it
    faces[2, 0], faces[2, 1], faces[2, 2] = -ux - vx, -uy - vy, -uz - vz
    for i in range(3):
        arm[i] = pull[0, i]
        effect[0, i] = pull[1, i] / most
