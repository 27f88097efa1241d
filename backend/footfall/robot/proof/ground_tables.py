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

A plan asks about a small part of the ground, and working out T of all of it takes longer than most plans. So T of a
block is worked out when it is first asked for, and kept: what a lookup answers never depends on what was asked before,
and threads that ask at once write the same.
"""

import math
from functools import lru_cache
from mmap import mmap
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry

_CELLS_PER_RADIUS = 8.0
_FINE = 0.02
"""Cells of a table are the largest that are no larger than a ball's radius over _CELLS_PER_RADIUS, or where that is
larger, than _FINE [m] or the grid's own cells; they are the grid's cells times a power of two."""

MOST_CELLS = 20_000_000
"""Of all tables together (160 MB, of which the machine gives what was asked about): what makes more is refused."""

_NOT_YET = 0.0
"""In place of a T that nobody has asked for; memory that was never written holds it without having been given yet."""

_ZERO = 5e-324
"""In place of a T of zero: the next larger number."""


class GroundTables(NamedTuple):
    """Tables for balls of ``radii`` (k,) ascending [m].

    cells: one array, as each costs time to pass: T of all tables in a row, each by rows from the south-west, _NOT_YET
    until it is asked for; then M of the blocks of each size, √(R² − d²) of each radius, and room for the heights
    themselves (:func:`lay_surface`). layout: (k + 1, 11), columns X to PAD; in the last row, of the heights, X to LAID
    alone. region: (3,) x, y and radius of the circle that holds all places asked about [m]; the radius is inf where the
    tables are of the whole grid. Nothing is proven outside of the circle. heights: of the part that the tables are of.
    """

    radii: Array
    cells: Array
    layout: Array
    region: Array
    heights: NDArray


X, Y, PER_METRE, ROWS, COLUMNS, START, TOPS, TOP_ROWS, TOP_COLUMNS, RISES, PAD = range(11)
"""Columns of a layout: south-west corner of the table [m], cells in a metre, rows, columns, where its T begin; where M
of its blocks begin, rows, columns; where its √(R² − d²) begin, 2 PAD + 1 rows of as many with the ball's own block in
the middle, and −inf where d > R. The table reaches beyond the blocks by PAD on every side."""
LAID = TOPS
"""Column of the heights' row: 1 where they have been laid, else 0."""


def ground_tables(
    heights: ArrayLike,
    geometry: GridGeometry,
    radii: ArrayLike,
    around: ArrayLike | None = None,
    within: float = math.inf,
    most_cells: int = MOST_CELLS,
) -> GroundTables:
    """Tables of the ground for balls of each radius.

    Args:
        heights: (rows, cols) of the cell centres [m], NaN where unknown.
        geometry: the grid.
        radii: of the balls [m].
        around: middle (x, y) of a circle outside of which nothing will be asked [m]; the rest of the grid is left out.
            None: there is none.
        within: radius of that circle [m].
        most_cells: that are made, of all tables together.

    Returns:
        The tables.

    Raises:
        InvalidInput: the heights are not of the geometry's shape, infinite or too many, a radius is not above zero, or
            the circle is none.
    """
    z = np.asarray(heights)
    if z.shape != geometry.shape:
        raise InvalidInput(f"heights of this grid need the shape {geometry.shape}", shape=list(z.shape))
    balls = np.unique(np.asarray(radii, float))
    if not len(balls) or not (np.isfinite(balls) & (balls > 0)).all():
        raise InvalidInput("the radii of balls must be finite and above zero [m]")
    region = np.array([0.0, 0.0, math.inf]) if around is None else _circle(around, within)
    if np.isinf(z).any():
        raise InvalidInput("heights must be finite [m], or NaN where the ground is unknown")
    steps = [_pitch_step(float(radius), geometry.resolution) for radius in balls]
    near = _cut_out(_Patch(z, geometry.x0, geometry.y0, geometry.resolution), region, float(balls[-1]))
    tops = _tops(near, steps, region, float(balls[-1]), most_cells)
    cells = sum(math.prod(n + 2 * _CELLS_PER_RADIUS for n in tops[step].values.shape) for step in steps)
    _require_few(cells, most_cells)
    rises = [_rises(float(radius), geometry.resolution * 2.0**step) for radius, step in zip(balls, steps, strict=True)]
    layout, count = np.zeros((len(balls) + 1, PAD + 1)), 0
    for row, step, rise in zip(layout[:-1], steps, rises, strict=True):
        pitch, pad = geometry.resolution * 2.0**step, len(rise) // 2
        blocks = tops[step]
        rows, cols = (n + 2 * pad for n in blocks.values.shape)
        row[: START + 1] = blocks.x0 - pad * pitch, blocks.y0 - pad * pitch, 1 / pitch, rows, cols, count
        row[TOP_ROWS], row[TOP_COLUMNS], row[PAD] = *blocks.values.shape, pad
        count += rows * cols
    known: list[tuple[int, NDArray]] = []
    for step, blocks in tops.items():
        layout[:-1][[other == step for other in steps], TOPS] = count
        known.append((count, blocks.values))
        count += blocks.values.size
    for row, rise in zip(layout[:-1], rises, strict=True):
        row[RISES] = count
        known.append((count, rise))
        count += rise.size
    layout[-1, : START + 1] = near.x0, near.y0, 1 / near.pitch, *near.values.shape, count
    # memory that the machine gives when it is first touched; zeros of numpy may be written beforehand
    table = np.frombuffer(mmap(-1, 8 * (count + near.values.size)))
    for start, values in known:
        table[start : start + values.size].reshape(values.shape)[:] = values
    return GroundTables(balls, table, layout, region, near.values)


def lay_surface(tables: GroundTables) -> None:
    """Put the heights themselves where a drum looks for them; most tables are never asked by one.

    Args:
        tables: of the ground; threads that lay them at once write the same.
    """
    row = tables.layout[-1]
    if not row[LAID]:
        start = int(row[START])
        tables.cells[start : start + tables.heights.size].reshape(tables.heights.shape)[:] = tables.heights
        row[LAID] = 1.0


def _circle(around: ArrayLike, within: float) -> Array:
    region = np.append(np.asarray(around, float), within)
    if region.shape != (3,) or not np.isfinite(region).all() or within < 0:
        raise InvalidInput("ground is cut out around a finite (x, y), within a radius that is not negative [m]")
    return region


class _Patch(NamedTuple):
    """Heights of cells or tops of blocks (rows, cols), where the first is or begins, and how large each is [m]."""

    values: NDArray
    x0: float
    y0: float
    pitch: float


def _cut_out(patch: _Patch, region: Array, more: float) -> _Patch:
    """The rows and columns of all blocks that come within ``more`` of the region [m]."""
    if math.isinf(region[2]):
        return patch
    cells = (region[2] + more) / patch.pitch + 1.0
    begin, end = [], []
    for at, first, count in zip(region, (patch.x0, patch.y0), patch.values.shape[::-1], strict=False):
        middle = (at - first) / patch.pitch
        begin.append(int(np.clip(math.floor(middle - cells), 0, count - 1)))
        end.append(int(np.clip(math.ceil(middle + cells) + 1, begin[-1] + 1, count)))
    west, south = patch.x0 + begin[0] * patch.pitch, patch.y0 + begin[1] * patch.pitch
    return _Patch(patch.values[begin[1] : end[1], begin[0] : end[0]], west, south, patch.pitch)


def _pitch_step(radius: float, resolution: float) -> int:
    """Power of two between the grid's resolution and the pitch of a table for balls of that radius."""
    return math.floor(math.log2(max(radius / _CELLS_PER_RADIUS, min(_FINE, resolution)) / resolution))


def _tops(ground: _Patch, steps: list[int], region: Array, radius: float, most_cells: int) -> dict[int, _Patch]:
    """Highest point of the surface over each block of 2^step cells, by step; −inf over holes.

    ground: with the region cut out. That is done again each time that cells are halved: the blocks would be too many.
    """
    tops = {0: _over_blocks(ground)}
    for step in range(1, max(steps) + 1):
        before = tops[step - 1]
        tops[step] = before._replace(values=_halved(before.values), pitch=2 * before.pitch)
    for step in range(-1, min(steps) - 1, -1):
        _require_few(4 * ground.values.size, most_cells)
        halved = _Patch(_refined(ground.values), ground.x0, ground.y0, ground.pitch / 2)
        ground = _cut_out(halved, region, radius)
        tops[step] = _over_blocks(ground)
    return {step: tops[step] for step in set(steps)}


def _require_few(cells: float, most: int) -> None:
    if cells > most:
        raise InvalidInput("this ground is too large for tables; cut out what is needed of it", cells=int(cells))


def _over_blocks(ground: _Patch) -> _Patch:
    few = min(ground.values.shape) < 2
    return ground._replace(values=np.full((1, 1), -np.inf) if few else _block_tops(ground.values))


@njit()
def _block_tops(heights: NDArray) -> Array:
    rows, cols = heights.shape
    tops = np.empty((rows - 1, cols - 1))
    for i in range(rows - 1):
        for j in range(cols - 1):
            top, other = max(heights[i, j], heights[i + 1, j + 1]), max(heights[i, j + 1], heights[i + 1, j])
            holes = np.isnan(heights[i, j] + heights[i + 1, j + 1] + heights[i, j + 1] + heights[i + 1, j])
            tops[i, j] = -np.inf if holes else max(top, other)
    return tops


@njit()
def _halved(tops: Array) -> Array:
    rows, cols = tops.shape
    out = np.full(((rows + 1) // 2, (cols + 1) // 2), -np.inf)
    for i in range(rows):
        for j in range(cols):
            out[i // 2, j // 2] = max(out[i // 2, j // 2], tops[i, j])
    return out


@njit()
def _refined(heights: NDArray) -> Array:
    """The same surface on a grid of half the spacing."""
    rows, cols = heights.shape
    out = np.empty((2 * rows - 1, 2 * cols - 1))
    for i in range(rows):
        for j in range(cols):
            out[2 * i, 2 * j] = heights[i, j]
            if j + 1 < cols:
                out[2 * i, 2 * j + 1] = (out[2 * i, 2 * j] + heights[i, j + 1]) / 2
            if i + 1 < rows:
                out[2 * i + 1, 2 * j] = (out[2 * i, 2 * j] + heights[i + 1, j]) / 2
                if j + 1 < cols:
                    # a block with one unknown corner is a hole as a whole; the middle makes all four smaller ones holes
                    other = heights[i + 1, j] + heights[i, j + 1]
                    diagonal = (out[2 * i, 2 * j] + heights[i + 1, j + 1]) / 2
                    out[2 * i + 1, 2 * j + 1] = np.nan if np.isnan(other) else diagonal
    return out


@lru_cache(maxsize=128)
def _rises(radius: float, pitch: float) -> Array:
    """√(R² − d²) for blocks as far as the ball reaches; see PAD."""
    pad = int(radius / pitch) + 2
    away = np.maximum(np.abs(np.arange(-pad, pad + 1)) - 1, 0) * pitch
    square = radius * radius - (away[:, None] ** 2 + away[None, :] ** 2)
    return np.where(square >= 0, np.sqrt(np.maximum(square, 0)), -np.inf)


@njit()
def needed_height(cells: Array, layout: Array, k: int, x: float, y: float) -> float:
    """From which height up the middle of a ball is clear of the ground.

    Args:
        cells: of the tables.
        layout: of the tables.
        k: number of the ball's radius.
        x: east, in site [m].
        y: north, in site [m].

    Returns:
        T of that radius there [m].
    """
    x, y = (x - layout[k, X]) * layout[k, PER_METRE], (y - layout[k, Y]) * layout[k, PER_METRE]
    if not (x >= 0.0 and y >= 0.0 and x < layout[k, COLUMNS] and y < layout[k, ROWS]):
        return -np.inf
    row, column = int(y), int(x)
    at = int(layout[k, START]) + row * int(layout[k, COLUMNS]) + column
    if cells[at] == _NOT_YET:
        height = _highest(cells, layout[k], row, column)
        cells[at] = height if height != 0.0 else _ZERO
    return cells[at]


# without NaN, and whichever zero it is, the largest of many is found by several at a time
@njit(fastmath={"nnan", "nsz"})
def _highest(cells: Array, layout: Array, row: int, column: int) -> float:
    """T of one cell: the largest of M + √(R² − d²)."""
    pad, rows, cols = int(layout[PAD]), int(layout[TOP_ROWS]), int(layout[TOP_COLUMNS])
    tops, rises = int(layout[TOPS]), int(layout[RISES])
    highest = -np.inf
    # blocks from pad south and west of the cell's own to pad north and east of it, of those there are
    south, west = row - 2 * pad, column - 2 * pad
    first, last = max(west, 0), min(column + 1, cols)
    for block in range(max(south, 0), min(row + 1, rows)):
        top = cells[tops + block * cols + first : tops + block * cols + last]
        rise = cells[rises + (block - south) * (2 * pad + 1) + first - west :]
        for j in range(top.size):
            highest = max(highest, top[j] + rise[j])
    return highest
