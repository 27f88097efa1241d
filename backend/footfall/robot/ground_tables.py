"""How high a ball must be to be clear of the ground, as tables: one lookup answers for a ball anywhere in a cell.

The ground is the triangulation of a height grid: two triangles for every block of 2 × 2 known cells, cut from
south-west to north-east; a block with an unknown cell is a hole. Over a block the surface is nowhere higher than the
highest of the block's four heights, M. A block with its middle heights put in (edges: the mean of their ends;
centre: the mean of south-west and north-east) is four smaller blocks of the *same* surface, so tables may be finer
than the grid. They may be coarser, with M the largest of several blocks.

Let R be a ball's radius and p its centre, somewhere in the (closed) square of block i. T(i) is the largest, over all
blocks j, of M(j) + √(R² − d²), where d is the least horizontal distance between the squares of i and j and blocks with
d > R are left out. A point s of the surface in block j with horizontal distance e ≤ R from p has e ≥ d and
s_z ≤ M(j), so p_z ≥ T(i) gives p_z − s_z ≥ √(R² − e²): s is at least R from p, and below it. Points with e > R are
farther than R anyway. So **p_z ≥ T(i) proves that the open ball is clear of the surface and that no surface is above p
within R**. The tables reach beyond the grid by R on every side; outside them no surface is within R.
Where there is no surface within R, T is −inf. On level ground T is exact.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry

Array = NDArray[np.float64]

_CELLS_PER_RADIUS = 8.0
_FINE = 0.02
"""Cells of a table are the largest that are no larger than a ball's radius over _CELLS_PER_RADIUS, or where that is
larger, than _FINE [m] or the grid's own cells; they are the grid's cells times a power of two."""

_MOST_CELLS = 20_000_000
"""Of all tables together (160 MB): what makes more is refused."""


class GroundTables(NamedTuple):
    """Tables for balls of ``radii`` (k,) ascending [m].

    heights: T of all tables in a row, each by rows from the south-west. layout: (k, 6), columns X to START.
    region: (3,) x, y and radius of the circle that holds all places asked about [m]; the radius is inf where the
    tables are of the whole grid. Outside of the circle heights may be inf: nothing is proven there.
    """

    radii: Array
    heights: Array
    layout: Array
    region: Array


X, Y, PER_METRE, ROWS, COLUMNS, START = range(6)
"""Columns of a layout: south-west corner of the table [m], cells in a metre, rows, columns, where its heights begin."""


def ground_tables(
    heights: ArrayLike,
    geometry: GridGeometry,
    radii: ArrayLike,
    around: ArrayLike | None = None,
    within: float = math.inf,
) -> GroundTables:
    """Tables of the ground for balls of each radius.

    heights: (rows, cols) [m] of the cell centres, NaN where unknown. around: (x, y) and within [m]: a circle outside of
    which nothing will be asked; the rest of the grid is left out. Raises InvalidInput where the heights are not of the
    geometry's shape, infinite or too many, where a radius is not above zero, and where the circle is none.
    """
    z = np.asarray(heights)
    if z.shape != geometry.shape:
        raise InvalidInput(f"heights of this grid need the shape {geometry.shape}", shape=list(z.shape))
    balls = np.unique(np.asarray(radii, float))
    if not len(balls) or not (np.isfinite(balls) & (balls > 0)).all():
        raise InvalidInput("the radii of balls must be finite and above zero [m]")
    if around is None:
        region, x0, y0 = np.array([0.0, 0.0, math.inf]), geometry.x0, geometry.y0
    else:
        region = _circle(around, within)
        z, x0, y0 = _cut_out(z, geometry, region[:2], within + float(balls[-1]))
    if np.isinf(z).any():
        raise InvalidInput("heights must be finite [m], or NaN where the ground is unknown")
    steps = [_pitch_step(float(radius), geometry.resolution) for radius in balls]
    cells = sum(math.prod(n * 0.5**step + 2 * _CELLS_PER_RADIUS for n in z.shape) for step in steps)
    if cells > _MOST_CELLS:
        raise InvalidInput("this ground is too large for tables; cut out what is needed of it", cells=int(cells))
    tops = {step: _tops(z.astype(float), step) for step in set(steps)}
    tables, layout, start = [], [], 0
    for radius, step in zip(balls, steps, strict=True):
        pitch = geometry.resolution * 2.0**step
        table, west, south = _dilated(tops[step], float(radius), pitch, region - (x0, y0, 0.0))
        layout.append((x0 + west, y0 + south, 1 / pitch, *table.shape, start))
        tables.append(table.ravel())
        start += table.size
    return GroundTables(balls, np.concatenate(tables), np.array(layout, float), region)


def _circle(around: ArrayLike, within: float) -> Array:
    region = np.append(np.asarray(around, float), within)
    if region.shape != (3,) or not np.isfinite(region).all() or within < 0:
        raise InvalidInput("ground is cut out around a finite (x, y), within a radius that is not negative [m]")
    return region


def _cut_out(heights: NDArray, geometry: GridGeometry, around: Array, far: float) -> tuple[NDArray, float, float]:
    """The rows and columns of all blocks that come within ``far`` of a point, and where they begin."""
    cells = far / geometry.resolution + 1.0
    begin, end = [], []
    for at, first, count in zip(around, (geometry.x0, geometry.y0), (geometry.cols, geometry.rows), strict=True):
        middle = (at - first) / geometry.resolution
        begin.append(int(np.clip(math.floor(middle - cells), 0, count - 1)))
        end.append(int(np.clip(math.ceil(middle + cells) + 1, begin[-1] + 1, count)))
    west, south = (first + i * geometry.resolution for first, i in zip((geometry.x0, geometry.y0), begin, strict=True))
    return heights[begin[1] : end[1], begin[0] : end[0]], west, south


def _pitch_step(radius: float, resolution: float) -> int:
    """Power of two between the grid's resolution and the pitch of a table for balls of that radius."""
    return math.floor(math.log2(max(radius / _CELLS_PER_RADIUS, min(_FINE, resolution)) / resolution))


def _tops(heights: Array, step: int) -> Array:
    """Highest point of the surface over each block of 2^step cells; −inf over holes."""
    for _ in range(-step):
        heights = _refined(heights)
    if min(heights.shape) < 2:
        return np.full((1, 1), -np.inf)
    blocks = np.maximum(
        np.maximum(heights[:-1, :-1], heights[1:, :-1]), np.maximum(heights[:-1, 1:], heights[1:, 1:])
    )  # np.maximum gives NaN where either is
    tops = np.where(np.isnan(blocks), -np.inf, blocks)
    for _ in range(step):
        even = np.full([n + n % 2 for n in tops.shape], -np.inf)
        even[: tops.shape[0], : tops.shape[1]] = tops
        tops = even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2).max(axis=(1, 3))
    return tops


def _refined(heights: Array) -> Array:
    """The same surface on a grid of half the spacing."""
    rows, cols = heights.shape
    out = np.empty((2 * rows - 1, 2 * cols - 1))
    out[::2, ::2] = heights
    out[::2, 1::2] = (heights[:, :-1] + heights[:, 1:]) / 2
    out[1::2, ::2] = (heights[:-1] + heights[1:]) / 2
    # a block with one unknown corner is a hole as a whole; the middle makes all four smaller ones holes
    diagonal = (heights[:-1, :-1] + heights[1:, 1:]) / 2
    other = heights[1:, :-1] + heights[:-1, 1:]
    out[1::2, 1::2] = np.where(np.isnan(other), np.nan, diagonal)
    return out


def _dilated(tops: Array, radius: float, pitch: float, region: Array) -> tuple[Array, float, float]:
    """T on the blocks and as far around them as the ball reaches, or on what of that is in the circle ``region``.

    Returns it and its south-west corner, x and y from that of the blocks.
    """
    pad = int(radius / pitch) + 2
    # the edge of the table looks as far again, so the source carries the padding twice
    source = np.pad(tops, 2 * pad, constant_values=-np.inf)
    away = np.maximum(np.arange(pad + 1) - 1, 0) * pitch
    square = radius * radius - (away[:, None] ** 2 + away[None, :] ** 2)
    rise = np.where(square >= 0, np.sqrt(np.maximum(square, 0)), -np.inf)
    # in cells of the table; one more all around for what rounding does to a place on the circle
    x, y, within = region / pitch + (pad, pad, 1.0)
    rows, cols = (count + 2 * pad for count in tops.shape)
    first_row, last_row = _span(y, within, rows)
    first_col, last_col = _span(x, within, cols)
    table = np.full((last_row - first_row, last_col - first_col), np.inf)
    souths = np.arange(first_row, last_row)
    past = np.maximum(np.maximum(souths - y, y - (souths + 1)), 0.0)
    half = np.sqrt(np.maximum(within**2 - past**2, 0.0))
    spans = np.clip(np.column_stack([np.floor(x - half), np.ceil(x + half)]), first_col, last_col) - first_col
    _dilate(source[first_row : last_row + 2 * pad, first_col : last_col + 2 * pad], rise, spans.astype(np.int64), table)
    return table, (first_col - pad) * pitch, (first_row - pad) * pitch


def _span(middle: float, half: float, count: int) -> tuple[int, int]:
    """First and last + 1 of ``count`` cells that come within ``half`` of a place, all [cells]."""
    if math.isinf(half):
        return 0, count
    begin = min(max(math.floor(middle - half), 0), count - 1)
    return begin, max(min(math.ceil(middle + half), count), begin + 1)


@njit(cache=True, parallel=True)
def _dilate(source: Array, rise: Array, spans: NDArray[np.int64], table: Array) -> None:
    """table[i, j] = max over (a, b) of source[i + pad ± a, j + pad ± b] + rise[a, b]; a, b run from 0 to pad.

    spans: (rows, 2) first and last + 1 column that is wanted of each row.
    """
    pad = rise.shape[0] - 1
    for row in prange(table.shape[0]):
        i = np.int64(row) + pad
        begin, end = spans[row, 0], spans[row, 1]
        cols = end - begin
        out = table[row, begin:end]
        out[:] = -np.inf
        for a in range(pad + 1):
            pair = np.maximum(source[i - a, begin : end + 2 * pad], source[i + a, begin : end + 2 * pad])
            for b in range(pad + 1):
                up = rise[a, b]
                if up > -np.inf:
                    left, right = pair[pad - b : pad - b + cols], pair[pad + b : pad + b + cols]
                    for j in range(cols):
                        top = (left[j] if left[j] > right[j] else right[j]) + up
                        out[j] = top if top > out[j] else out[j]


@njit(cache=True)
def needed_height(heights: Array, layout: Array, k: int, x: float, y: float) -> float:
    """T of the k-th radius at (x, y) in site [m]: from there up, the middle of a ball is clear of the ground."""
    column = (x - layout[k, X]) * layout[k, PER_METRE]
    row = (y - layout[k, Y]) * layout[k, PER_METRE]
    if not (column >= 0.0 and row >= 0.0 and column < layout[k, COLUMNS] and row < layout[k, ROWS]):
        return -np.inf
    return heights[int(layout[k, START]) + int(row) * int(layout[k, COLUMNS]) + int(column)]
