"""Compiled: what lies under the rover around every cell, and for which headings enough legs find a footfall there.

Sums are of whole numbers, and the rest are largest, smallest and first: nothing depends on where a part of a map that
is computed by itself begins.
"""

from typing import NamedTuple

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array, Bytes, Floats32, Ints32

FREE, UNKNOWN, NO_FOOTING, TOO_HIGH, TOO_FEW, UNSUPPORTED = range(6)
"""What forbids a cell; words for them are in feasible.py."""
LEAST_LEGS = 5
"""Legs that must find footfalls, those that support conservatively."""


class LegPlaces(NamedTuple):
    """Which cells around the chassis each leg has a footfall on, and how deep it reaches there (leg_places.py).

    radius: of the disc under body and sweeping legs [cells]. room: of the base over the highest ground there [m].

    Of each heading below a half turn and each leg, counter-clockwise (the other half turn has the same places):
    rows, cols: (headings / 2, LEGS, most) int32 how far a footfall is from the chassis [cells]. strokes: how far below
    the highest ground the wheel reaches there [m].
    count: (headings / 2, LEGS) how many there are. clockwise: so many, the first ones, are clockwise of its azimuth.
    runs: (n, 4) int32 the same cells as runs along a row: its row; level, first and second column of two windows of
    2^level cells that together are the run. first_run: (headings / 2, 2 LEGS + 1) number of the first run of each leg's
    clockwise half, and of its counter-clockwise one.
    """

    radius: int
    room: float
    rows: Ints32
    cols: Ints32
    strokes: Array
    count: Ints32
    clockwise: Ints32
    runs: Ints32
    first_run: Ints32

    @property
    def stroke(self) -> float:
        """How far below the highest ground every wheel reaches, wherever it is put [m]."""
        used = np.arange(self.strokes.shape[2]) < self.count[..., None]
        return float(self.strokes[used].min())


class UnderRover(NamedTuple):
    """What lies in the disc around each cell, all (rows, cols).

    highest, lowest: known ground; best: highest footing [m]. trusted: sum of trust. footed: how many cells have a
    footing.
    """

    highest: Floats32
    lowest: Floats32
    best: Floats32
    trusted: Ints32
    footed: Ints32


@njit()
def footings(ground: Floats32, beside: int, steepest: float, feet: Floats32) -> None:
    """Write the ground where a wheel may stand on it, −inf elsewhere, (rows, cols) [m].

    It may where no cell ``beside`` cells away in one of eight directions is unknown, or so high or low that the rise
    [m for each cell] is beyond ``steepest``.
    """
    rows, cols = ground.shape
    for i in range(rows):
        for j in range(cols):
            here = np.float64(ground[i, j])
            good = i >= beside and j >= beside and i < rows - beside and j < cols - beside and np.isfinite(here)
            if good:
                for di in range(-1, 2):
                    for dj in range(-1, 2):
                        rise = abs(np.float64(ground[i + di * beside, j + dj * beside]) - here)
                        limit = steepest * beside * np.sqrt(np.float64(di * di + dj * dj))
                        # a rise that is unknown is not within the limit
                        if not rise <= limit:
                            good = False
            feet[i, j] = ground[i, j] if good else -np.inf


@njit()
def _wider(near: Floats32, wide: Floats32, largest: bool) -> None:
    """Write for each cell the largest (or least) of ``near`` among it and the two beside it."""
    last = near.size - 1
    for j in range(1, last):
        if largest:
            wide[j] = max(near[j], max(near[j - 1], near[j + 1]))
        else:
            wide[j] = min(near[j], min(near[j - 1], near[j + 1]))
    for j in (0, last):
        other = near[min(j + 1, last)] if j == 0 else near[j - 1]
        wide[j] = max(near[j], other) if largest else min(near[j], other)


@njit()
def _largest_under(layer: Floats32, halves: Ints32, largest: bool, out: Floats32) -> None:
    """Write the largest (or least) known number in the disc around each cell; halves: half its width, row by row."""
    rows, cols = layer.shape
    radius = halves.size // 2
    nothing = np.float32(-np.inf) if largest else np.float32(np.inf)
    out[:] = nothing
    near, wide = np.empty(cols, np.float32), np.empty(cols, np.float32)
    for i in range(rows):
        for j in range(cols):
            near[j] = layer[i, j] if np.isfinite(layer[i, j]) else nothing
        for half in range(radius + 1):
            for k in range(halves.size):
                row = i + k - radius
                if halves[k] == half and 0 <= row < rows:
                    best = out[row]
                    if largest:
                        for j in range(cols):
                            best[j] = max(best[j], near[j])
                    else:
                        for j in range(cols):
                            best[j] = min(best[j], near[j])
            _wider(near, wide, largest)
            near, wide = wide, near


@njit()
def _sum_under(layer: Bytes, halves: Ints32, out: Ints32) -> None:
    """Write the sum over the disc around each cell; beyond the layer there is 0."""
    rows, cols = layer.shape
    radius = halves.size // 2
    sums = np.zeros(cols + 2 * radius + 1, np.int32)
    out[:] = 0
    for i in range(rows):
        total = np.int32(0)
        for j in range(cols):
            total += np.int32(layer[i, j])
            sums[radius + 1 + j] = total
        sums[radius + 1 + cols :] = total
        for k in range(halves.size):
            row, half = i + k - radius, halves[k]
            if 0 <= row < rows:
                before, after = sums[radius - half :], sums[radius + half + 1 :]
                for j in range(cols):
                    out[row, j] += after[j] - before[j]


@njit()
def look_under_rover(ground: Floats32, feet: Floats32, trust: Bytes, halves: Ints32, under: UnderRover) -> None:
    """Write what lies in the disc around each cell; halves: half its width, row by row."""
    _largest_under(ground, halves, True, under.highest)
    _largest_under(ground, halves, False, under.lowest)
    _largest_under(feet, halves, True, under.best)
    _sum_under(trust, halves, under.trusted)
    _sum_under(np.isfinite(feet).astype(np.uint8), halves, under.footed)


@njit()
def _outermost(feet, at, high, offsets, strokes, places):
    """The first of some places of a leg that it reaches; −1 where there is none."""
    for k in places:
        if high - np.float64(feet[at + offsets[k]]) <= strokes[k]:
            return k
    return -1


@njit()
def _five_support(feet, at, high, offsets, places, heading, halves, j, least, most, missing):
    """Whether five legs find footfalls that support the middle conservatively.

    Whether any closed half-plane at the middle holds fewer than two feet depends on their directions alone: none does
    where no two feet with one between them are more than a half turn apart. Of legs that keep to sectors of 60° only
    the pairs around the missing one can be, and these share no leg. The legs of a pair are on opposite sides: their
    places have the same directions, turned by a half turn.

    offsets: of the places of that heading in ``feet``. halves: the highest footings of column j, in the clockwise and
    the counter-clockwise half of each leg's sector. least, most: how deep each leg reaches all over its sector, and
    somewhere in it.
    """
    count, clockwise, strokes = places.count[heading], places.clockwise[heading], places.strokes[heading]
    rows, cols, legs = places.rows[heading], places.cols[heading], places.count.shape[1]
    for behind, ahead in ((missing - 2, missing + 1), (missing - 1, missing + 2)):
        a, b = (behind + legs) % legs, ahead % legs
        below_a, below_b = high - np.float64(halves[2 * a + 1, j]), high - np.float64(halves[2 * b, j])
        if below_a <= least[a] and below_b <= least[b]:
            continue
        # a half without any footing need not be looked through
        last = clockwise[a] if below_a > most[a] else count[a]
        first = clockwise[b] if below_b > most[b] else 0
        i = _outermost(feet, at, high, offsets[a], strokes[a], range(last - 1, -1, -1))
        k = _outermost(feet, at, high, offsets[b], strokes[b], range(first, count[b]))
        # the foot behind × the foot ahead: positive up to a half turn, in whole numbers
        if cols[a, i] * rows[b, k] - rows[a, i] * cols[b, k] < 0:
            return False
    return True


@njit()
def _widen(line: Floats32, wide: Floats32) -> None:
    """Write the highest of 1, 2, 4, … cells from each one of a line on, (levels, cells)."""
    wide[0] = line
    for level in range(1, len(wide)):
        half = 1 << (level - 1)
        near, out = wide[level - 1], wide[level]
        last = line.size - half
        for j in range(last):
            out[j] = max(near[j], near[j + half])
        out[last:] = near[last:]


@njit()
def _highest_of(wide: Floats32, i: int, west: int, margin: int, runs: Ints32, best: Floats32) -> None:
    """Write the highest footing in half a leg's sector around the cells of row i from column ``west`` on.

    wide: of ``_widen``, the rows around row i, one after the other in a ring. runs: of that half, see LegPlaces.
    """
    best[:] = -np.inf
    for run in range(len(runs)):
        around = wide[(i + margin + runs[run, 0]) % len(wide), runs[run, 1]]
        first, last = around[west + margin + runs[run, 2] :], around[west + margin + runs[run, 3] :]
        for j in range(best.size):
            best[j] = max(best[j], max(first[j], last[j]))


@njit()
def _depths(strokes: Array, count: Ints32) -> tuple[Array, Array]:
    """How deep a leg reaches wherever in its sector, and where it reaches deepest, each (headings, legs) [m]."""
    least, most = np.full(count.shape, np.inf), np.full(count.shape, -np.inf)
    for heading in range(count.shape[0]):
        for leg in range(count.shape[1]):
            for k in range(count[heading, leg]):
                least[heading, leg] = min(least[heading, leg], strokes[heading, leg, k])
                most[heading, leg] = max(most[heading, leg], strokes[heading, leg, k])
    return least, most


@njit()
def find_footfalls(
    feet: Floats32,
    under: UnderRover,
    places: LegPlaces,
    least_trusted: float,
    all_cells: int,
    stroke: float,
    search_all: bool,
    legs: Bytes,
    why: Bytes,
) -> None:
    """Write how many legs find footfalls that support, (headings, rows, cols), 0 where too few; and why all are 0.

    feet: with as many cells of −inf all around as the disc's radius. all_cells: of the disc. Where each of these has a
    footing within ``stroke`` of the highest ground all legs find one, and nothing is searched, unless ``search_all``.

    Row by row: the highest footing in each half of a leg's sector, of windows that all headings, legs and rows share,
    says of nearly every cell whether that leg finds one. Where it does not, place by place is looked at.
    """
    highest, runs, margin = under.highest, places.runs, places.radius
    headings, leg_count = places.count.shape
    width, side = feet.shape[1], 2 * margin + 1
    flat, offsets = feet.ravel(), places.rows * width + places.cols
    least, most = _depths(places.strokes, places.count)
    deepest = most.max()
    wide = np.empty((side, runs[:, 1].max() + 1, width), np.float32)
    for row in range(side - 1):
        _widen(feet[row], wide[row])
    searched = np.empty(highest.shape[1], np.bool_)
    halves = np.empty((2 * leg_count, highest.shape[1]), np.float32)
    for i in range(highest.shape[0]):
        _widen(feet[i + side - 1], wide[(i + side - 1) % side])
        west, east = highest.shape[1], 0
        for j in range(highest.shape[1]):
            high = np.float64(highest[i, j])
            legs[:, i, j] = 0
            searched[j] = False
            if under.trusted[i, j] < least_trusted:
                why[i, j] = UNKNOWN
            elif not search_all and under.footed[i, j] == all_cells and high - np.float64(under.lowest[i, j]) <= stroke:
                legs[:, i, j] = leg_count
                why[i, j] = FREE
            elif under.footed[i, j] == 0:
                why[i, j] = NO_FOOTING
            elif high - np.float64(under.best[i, j]) > deepest:
                why[i, j] = TOO_HIGH
            else:
                why[i, j], searched[j] = TOO_FEW, True
                west, east = min(west, j), j + 1
        for h in range(headings if west < east else 0):
            for half in range(2 * leg_count):
                own = runs[places.first_run[h, half] : places.first_run[h, half + 1]]
                _highest_of(wide, i, west, margin, own, halves[half, west:east])
            for j in range(west, east):
                if not searched[j]:
                    continue
                high, at = np.float64(highest[i, j]), (i + margin) * width + j + margin
                missing, lacking = -1, 0
                for leg in range(leg_count):
                    below = high - np.float64(max(halves[2 * leg, j], halves[2 * leg + 1, j]))
                    if below <= least[h, leg]:
                        continue
                    every, strokes = range(places.count[h, leg]), places.strokes[h, leg]
                    if below > most[h, leg] or _outermost(flat, at, high, offsets[h, leg], strokes, every) < 0:
                        missing = leg
                        lacking += 1
                if lacking == 0:
                    legs[h, i, j] = leg_count
                elif leg_count - lacking >= LEAST_LEGS:
                    if _five_support(flat, at, high, offsets[h], places, h, halves, j, least[h], most[h], missing):
                        legs[h, i, j] = leg_count - lacking
                    elif why[i, j] != FREE:
                        why[i, j] = UNSUPPORTED
                if legs[h, i, j] > 0:
                    why[i, j] = FREE
