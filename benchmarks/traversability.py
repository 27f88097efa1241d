"""Planes fitted at every cell: time, growth, memory, and the differences to two least-squares methods of another kind.
Then the quality of footfalls from such layers.

The ground is a seeded fractal of 3 cm cells and a window of 17 × 17, with a tenth of the cells unknown one by one and
rectangles of 1.2 × 0.9 m unknown altogether.
"""

import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numba
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import correlate1d

from benchmarks.timing import SEED, Figure, paired, seconds
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.layers import MapSettings
from footfall.maps.quality import LegSituation, quality
from footfall.maps.quality_settings import RAMPS, QualitySettings
from footfall.maps.reach_classes import FREE
from footfall.maps.suggest import explain, suggest
from footfall.maps.traversability import Traversability, traversability, updated_traversability, window_cells
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal

SIDE = 1024
RESOLUTION = 0.03
SETTINGS = MapSettings()
HALF = window_cells(SETTINGS.window, RESOLUTION) // 2

_ROWS_AT_ONCE = 8


def figures(quick: bool) -> Iterator[Figure]:
    n = 5 if quick else 20
    dem = ground(SIDE)
    yield Figure("maps.traversability_1024", seconds(lambda: traversability(dem, SETTINGS), n), "s", 0.15)
    yield from _threads(dem, n)
    yield _again(dem, n)
    yield paired(
        "maps.traversability_1024_over_scipy",
        lambda: traversability(dem, SETTINGS),
        lambda: planes_and_steps_by_scipy(dem.heights),
        2 if quick else 5,
    )
    yield from _differences(dem, traversability(dem, SETTINGS), quick)
    yield from _growth(n)
    yield from _footfalls(n)


def ground(side: int) -> Dem:
    """``side`` × ``side`` cells with holes."""
    rng = np.random.default_rng(SEED)
    heights = fractal(size=(side - 0.5) * RESOLUTION, resolution=RESOLUTION, seed=SEED).heights[:side, :side].copy()
    heights[rng.random(heights.shape) < 0.1] = np.nan
    for row, col in rng.integers(0, side - 40, (side * side // 50_000, 2)):
        heights[row : row + 40, col : col + 30] = np.nan
    geometry = GridGeometry(0.0, 0.0, RESOLUTION, *heights.shape)
    return Dem(heights, geometry, "fractal with holes", Provenance({}, seed=SEED))


def _again(dem: Dem, n: int) -> Figure:
    """A newer map in which 1 % of the cells changed, in one square: whole, over only what changed."""
    before, heights = traversability(dem, SETTINGS), dem.heights.copy()
    heights[500:602, 300:402] += 0.1
    newer = replace(dem, heights=heights)
    return paired(
        "maps.traversability_whole_over_changed",
        lambda: traversability(newer, SETTINGS),
        lambda: updated_traversability(newer, SETTINGS, before, dem.heights),
        n,
    )


def _threads(dem: Dem, n: int) -> Iterator[Figure]:
    """One thread over all of them, and whether the answer is the same to the last bit."""

    def alone() -> Traversability:
        threads = numba.get_num_threads()
        numba.set_num_threads(1)
        try:
            return traversability(dem, SETTINGS)
        finally:
            numba.set_num_threads(threads)

    yield paired("maps.traversability_one_thread_over_all", alone, lambda: traversability(dem, SETTINGS), n)
    same = alone().digest == traversability(dem, SETTINGS).digest
    yield Figure("maps.traversability_same_on_one_thread", (float(same),), "yes/no", 1.0, at_most=False)


def _differences(dem: Dem, found: Traversability, quick: bool) -> Iterator[Figure]:
    """Largest differences to numpy.linalg.lstsq on random cells, and to QR factors at every cell."""
    rng = np.random.default_rng(SEED)
    cells = np.argwhere(np.isfinite(found.slope))
    chosen = cells[rng.choice(len(cells), 500 if quick else 5000, replace=False)]
    at = tuple(chosen.T)
    expected = np.array([_by_lstsq(dem.heights, row, col) for row, col in chosen])
    yield _largest("slope_difference", found.slope[at], expected[:, 0], "rad", 1e-5)
    yield _largest("roughness_difference", found.roughness[at], expected[:, 1], "m", 1e-5)
    yield _largest("step_difference", found.step[at], expected[:, 2], "m", 1e-5)
    rows = range(0, SIDE, 16 * _ROWS_AT_ONCE if quick else _ROWS_AT_ONCE)
    parts = [(slice(first, first + _ROWS_AT_ONCE), _by_qr(dem.heights, first)) for first in rows]
    for index, (layer, unit) in enumerate((("slope", "rad"), ("roughness", "m"), ("step", "m"))):
        ours = np.concatenate([getattr(found, layer)[where] for where, _ in parts])
        peer = np.concatenate([part[index] for _, part in parts])
        name = f"{layer}_difference_{'some_rows' if quick else 'all_cells'}"
        yield _largest(name, ours[np.isfinite(ours)], peer[np.isfinite(ours)], unit, 1e-5)


def _largest(name: str, ours: np.ndarray, peer: np.ndarray, unit: str, floor: float) -> Figure:
    return Figure(f"maps.traversability_{name}", (float(np.abs(ours - peer).max()),), unit, floor)


def _by_lstsq(heights: np.ndarray, row: int, col: int) -> tuple[float, float, float]:
    """Slope [rad], roughness and step [m] of one window."""
    rows = slice(max(row - HALF, 0), row + HALF + 1)
    cols = slice(max(col - HALF, 0), col + HALF + 1)
    window = heights[rows, cols].astype(np.float64)
    i, j = np.nonzero(np.isfinite(window))
    z = window[i, j]
    matrix = np.column_stack([RESOLUTION * j, RESOLUTION * i, np.ones(len(z))])
    plane = np.linalg.lstsq(matrix, z, rcond=None)[0]
    residual = z - matrix @ plane
    return (
        float(np.arctan(np.hypot(plane[0], plane[1]))),
        float(np.sqrt(np.mean(residual**2))),
        float(np.ptp(residual)),
    )


def _by_qr(heights: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slope, roughness and step of _ROWS_AT_ONCE rows by Householder QR of every window's own matrix.

    R of [x y 1 | z], rows of unknown cells zero: its upper left solves for the plane, and its last diagonal is the
    norm of the residual (G. Golub, Numerische Mathematik 7, 1965).
    """
    side = 2 * HALF + 1
    padded = np.pad(heights.astype(np.float64), HALF, constant_values=np.nan)
    z = sliding_window_view(padded[first : first + _ROWS_AT_ONCE + 2 * HALF], (side, side)).reshape(-1, side * side)
    known = np.isfinite(z)
    i, j = np.indices((side, side)).reshape(2, -1) * RESOLUTION
    matrix = np.stack(np.broadcast_arrays(j, i, 1.0, np.nan_to_num(z)), axis=-1) * known[..., None]
    r = np.asarray(np.linalg.qr(matrix, mode="r"))
    with np.errstate(divide="ignore", invalid="ignore"):  # windows that leave the plane open, as the map says too
        c = r[:, 2, 3] / r[:, 2, 2]
        b = (r[:, 1, 3] - r[:, 1, 2] * c) / r[:, 1, 1]
        a = (r[:, 0, 3] - r[:, 0, 1] * b - r[:, 0, 2] * c) / r[:, 0, 0]
        residual = z - (a[:, None] * j + b[:, None] * i + c[:, None])
    highest = np.where(known, residual, -np.inf).max(axis=1)
    lowest = np.where(known, residual, np.inf).min(axis=1)
    shape = (-1, heights.shape[1])
    roughness = np.abs(r[:, 3, 3]) / np.sqrt(np.maximum(known.sum(axis=1), 1))
    return np.arctan(np.hypot(a, b)).reshape(shape), roughness.reshape(shape), (highest - lowest).reshape(shape)


def planes_and_steps_by_scipy(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same layers by scipy's separable correlation and numpy, whole arrays at a time: the peer for speed."""
    known = np.isfinite(heights)
    filled = np.where(known, heights.astype(np.float64) - np.nanmean(heights, dtype=np.float64), 0.0)
    offsets = np.arange(-HALF, HALF + 1, dtype=np.float64)
    powers = [np.ones_like(offsets), offsets, offsets**2]

    def moment(field: np.ndarray, east: int, north: int) -> np.ndarray:
        return correlate1d(correlate1d(field, powers[north], 0, mode="constant"), powers[east], 1, mode="constant")

    mask = known.astype(np.float64)
    n = np.maximum(moment(mask, 0, 0), 1.0)
    sx, sy, sz = moment(mask, 1, 0), moment(mask, 0, 1), moment(filled, 0, 0)
    cxx, cyy = moment(mask, 2, 0) - sx * sx / n, moment(mask, 0, 2) - sy * sy / n
    cxy = moment(mask, 1, 1) - sx * sy / n
    cxz, cyz = moment(filled, 1, 0) - sx * sz / n, moment(filled, 0, 1) - sy * sz / n
    czz = moment(filled**2, 0, 0) - sz * sz / n
    with np.errstate(all="ignore"):
        determinant = cxx * cyy - cxy * cxy
        a, b = (cxz * cyy - cyz * cxy) / determinant, (cyz * cxx - cxz * cxy) / determinant
        roughness = np.sqrt(np.maximum((czz - a * cxz - b * cyz) / n, 0.0))
        center = (sz - a * sx - b * sy) / n
        highest, lowest = np.full_like(a, -np.inf), np.full_like(a, np.inf)
        padded = np.pad(np.where(known, filled, np.nan), HALF, constant_values=np.nan)
        rows, cols = heights.shape
        for i in range(2 * HALF + 1):
            for j in range(2 * HALF + 1):
                residual = padded[i : i + rows, j : j + cols] - (center + (j - HALF) * a + (i - HALF) * b)
                np.fmax(highest, residual, out=highest)
                np.fmin(lowest, residual, out=lowest)
        return np.arctan(np.hypot(a, b) / RESOLUTION), roughness, highest - lowest


def _growth(n: int) -> Iterator[Figure]:
    """From 10⁴ to 10⁶ cells: seconds and the largest memory of numpy's arrays beyond the map.

    Each thread adds the buffers of one tile, 0.3 MB whatever the map.
    """
    per_cell = []
    for side in (100, 316, 1000):
        dem = ground(side)
        times = seconds(lambda d=dem: traversability(d, SETTINGS), n)
        per_cell.append(min(times) / side**2)
        yield Figure(f"maps.traversability_{side}x{side}", times, "s")
        tracemalloc.start()
        traversability(dem, SETTINGS)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        yield Figure(f"maps.traversability_{side}x{side}_memory", (peak / side**2,), "B/cell")
    yield Figure("maps.traversability_time_per_cell_1e6_over_1e4", (per_cell[-1] / per_cell[0],), "ratio", 1.5)


def _footfalls(n: int) -> Iterator[Figure]:
    """All factors at 160 000 cells of which none is refused, and the ten best."""
    grid = GridGeometry(-6.0, -6.0, RESOLUTION, 400, 400)
    rng = np.random.default_rng(SEED)
    layers: dict[str, Any] = {
        name: rng.uniform(min(ramp), max(ramp), grid.shape).astype(np.float32)
        for name, ramp in RAMPS.items()
        if name != "advance"
    }
    layers["height"] = np.zeros(grid.shape, np.float32)
    layers["reach_class"] = np.full(grid.shape, FREE, np.uint8)
    here = LegSituation(hip=(0.0, 0.0, 1.8), foot=(0.5, 0.0, 0.0), length=20.0, towards=(1.0, 0.0))
    times = seconds(lambda: suggest(quality(grid, layers, here, QualitySettings()), 10), n)
    yield Figure("maps.quality_and_ten_footfalls_160000_cells", times, "s", 0.05)
    found = quality(grid, layers, here, QualitySettings())
    yield Figure("maps.quality_explained_at_a_cell", seconds(lambda: explain(found, 200, 200), 10 * n), "s", 0.05)
