"""How far a tether is from the ground, the legs and the chassis it leaves; compiled.

What is told is never more than the true distance. The ground is asked through a table of the highest ground around each
cell: where all ground that is nearer than so much seen from above is lower by as much, none is nearer. A leg's links
are inside capsules. The chassis is inside the planes of its hull: where attachment and tether are both outside of one
of them, the tether leaves it.
"""

import math
from typing import NamedTuple

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import PART_COUNT

FREE, GROUND, DECK, REEL = -1, -2, -3, -4
"""What is too near: nothing, the ground, the chassis, the end of what can be paid out; else a link, 7 · leg + part."""
_LOOK = 0.5
"""How far along the tether it is asked whether it leaves the chassis [m]."""
_ON_HULL = 0.001
"""An attachment this deep inside the hull is on it [m]."""


class TetherTables(NamedTuple):
    """A tether, the leg's parts and the chassis as numbers.

    line: (1, 9) anchor in site, attachment in base, clearance, length that may lie on the ground, longest [m]; no row:
    there is no tether.

    capsules: (7, 7) of a leg's parts, in the part's frame: both ends, radius [m]. walls: (k, 4) the planes of the
    chassis' hull in base: outward normal, offset [m]. highest: (rows, cols) what no ground is above that is nearer to
    the cell, seen from above, than clearance and a step along the tether [m]; highest_at: (3,) x, y of cell (0, 0),
    cells in a metre.
    """

    line: Array
    capsules: Array
    walls: Array
    highest: Array
    highest_at: Array


@njit()
def tether_spare(poses: Array, T_site_base: Array, tables: TetherTables) -> tuple[float, int]:
    """What the tether has to spare beyond its clearance [m], and to what: see FREE. Infinite without a tether.

    poses: (legs × 7, 3, 4) of the links in site, see ``place_rover``; T_site_base: (3, 4).
    """
    if tables.line.shape[0] == 0:
        return np.inf, FREE
    line, at = tables.line[0], np.empty(3)
    anchor, clearance = line[:3], line[6]
    for i in range(3):
        at[i] = T_site_base[i, 3]
        for k in range(3):
            at[i] += T_site_base[i, k] * line[3 + k]
    least, code = _off_deck(at, anchor, T_site_base, tables), DECK
    spare = line[8] - math.sqrt((at[0] - anchor[0]) ** 2 + (at[1] - anchor[1]) ** 2 + (at[2] - anchor[2]) ** 2)
    if spare < least:
        least, code = spare, REEL
    spare = _above_ground(at, anchor, line[7], tables) - clearance
    if spare < least:
        least, code = spare, GROUND
    for link in range(poses.shape[0]):
        spare = _from_link(at, anchor, poses, link, tables.capsules[link % PART_COUNT]) - clearance
        if spare < least:
            least, code = spare, link
    return least, code


@njit()
def _off_deck(at: Array, anchor: Array, T_site_base: Array, tables: TetherTables) -> float:
    """How far the tether is outside of the chassis' hull a little way from it, per so much of that way [m]."""
    here, toward, length = tables.line[0, 3:6], np.empty(3), 0.0
    for i in range(3):
        length += (anchor[i] - at[i]) ** 2
    length = max(math.sqrt(length), 1e-9)
    for k in range(3):
        toward[k] = 0.0
        for i in range(3):
            toward[k] += T_site_base[i, k] * (anchor[i] - at[i]) / length
    best = -_LOOK
    for k in range(tables.walls.shape[0]):
        outside = out = 0.0
        for i in range(3):
            outside += tables.walls[k, i] * here[i]
            out += tables.walls[k, i] * toward[i]
        if outside - tables.walls[k, 3] >= -_ON_HULL:
            best = max(best, _LOOK * out)
    return best


@njit()
def _above_ground(at: Array, anchor: Array, bare: float, tables: TetherTables) -> float:
    """Least height of the tether over the ground around it [m], its first part by the anchor left out."""
    x, y, z = anchor[0] - at[0], anchor[1] - at[1], anchor[2] - at[2]
    length = math.sqrt(x * x + y * y + z * z)
    way = length - bare
    if not way > 0.0:
        return np.inf
    highest, place = tables.highest, tables.highest_at
    step = 0.5 / place[2]
    count, least = int(way / step) + 2, np.inf
    # between two looks the tether is lower than at them by no more than this
    sag = 0.5 * abs(z) / length * way / (count - 1)
    for i in range(count):
        share = way / length * i / (count - 1)
        column = math.floor((at[0] + share * x - place[0]) * place[2] + 0.5)
        row = math.floor((at[1] + share * y - place[1]) * place[2] + 0.5)
        if row < 0 or column < 0 or row >= highest.shape[0] or column >= highest.shape[1]:
            return -np.inf
        least = min(least, at[2] + share * z - sag - highest[row, column])
    return least


@njit()
def _from_link(at: Array, anchor: Array, poses: Array, link: int, capsule: Array) -> float:
    """Distance of the tether from a link's capsule [m]."""
    a, b = np.empty(3), np.empty(3)
    for i in range(3):
        a[i] = b[i] = poses[link, i, 3]
        for k in range(3):
            a[i] += poses[link, i, k] * capsule[k]
            b[i] += poses[link, i, k] * capsule[3 + k]
    return segments_apart(at, anchor, a, b) - capsule[6]


@njit()
def segments_apart(p: Array, q: Array, a: Array, b: Array) -> float:
    """Distance of the segments p–q and a–b, (3,) each (Ericson, "Real-Time Collision Detection", 2005, §5.1.9)."""
    dd = ee = de = dr = er = 0.0
    for i in range(3):
        d, e, r = q[i] - p[i], b[i] - a[i], p[i] - a[i]
        dd, ee, de, dr, er = dd + d * d, ee + e * e, de + d * e, dr + d * r, er + e * r
    det = dd * ee - de * de
    s = min(max((de * er - dr * ee) / det, 0.0), 1.0) if det > 1e-12 * dd * ee else 0.0
    t = (de * s + er) / ee if ee > 0.0 else 0.0
    if t < 0.0 or t > 1.0 or ee == 0.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((de * t - dr) / dd, 0.0), 1.0) if dd > 0.0 else 0.0
    away = 0.0
    for i in range(3):
        away += (p[i] + s * (q[i] - p[i]) - a[i] - t * (b[i] - a[i])) ** 2
    return math.sqrt(away)
