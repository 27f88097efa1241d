"""Feasible traversability: how long a map of 1024² cells takes, and what changed of it, on grounds of several kinds."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import footfall
from benchmarks.timing import SEED, Figure
from footfall.planning.route.feasible import feasible_ground, updated
from footfall.planning.route.problem import RouteSettings
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights

SIZE, CELL = 1024, 0.1
FLOOR = 2.0
CHANGED = 60
"""Side of the square whose heights change [cells]."""


def rolling(rng: np.random.Generator) -> NDArray[np.float64]:
    """Gentle: hardly anything is searched."""
    return 14.0 * gaussian_filter(rng.normal(size=(SIZE, SIZE)), 40.0)


def boulders(rng: np.random.Generator) -> NDArray[np.float64]:
    """Blocks of 0.2 m to 2.5 m, one on 16 m²: searched nearly everywhere."""
    heights = 0.02 * gaussian_filter(rng.normal(size=(SIZE, SIZE)), 3.0)
    for row, col in rng.integers(0, SIZE - 12, (SIZE * SIZE // 1600, 2)):
        tall, wide = 0.2 + 2.3 * rng.uniform() ** 3, rng.integers(2, 12)
        heights[row : row + wide, col : col + wide] += tall
    return heights


def broken(rng: np.random.Generator) -> NDArray[np.float64]:
    """So uneven that most cells are too steep for a wheel: the longest searches."""
    return 2.2 * gaussian_filter(rng.normal(size=(SIZE, SIZE)), 3.0)


def figures(quick: bool) -> Iterator[Figure]:
    """Processor times, of one core."""
    robot = footfall.load_robot("athlete")
    for kind in (rolling, boulders, broken):
        dem = _map(kind(np.random.default_rng(SEED)))
        before = feasible_ground(robot, dem)
        for headings in (8, 16):
            asked = RouteSettings(headings=headings)
            samples = _times(lambda dem=dem, asked=asked: feasible_ground(robot, dem, asked), quick)
            yield Figure(f"route/feasible_1024_{kind.__name__}_{headings}", samples, "s", FLOOR)
        free = float((before.forbidden == 0).mean())
        yield Figure(f"route/feasible_share_{kind.__name__}", (free,), "")
        heights = dem.heights.copy()
        heights[500 : 500 + CHANGED, 400 : 400 + CHANGED] += 0.125
        newer = replace(dem, heights=heights)
        samples = _times(lambda newer=newer, before=before: updated(robot, newer, before), quick)
        yield Figure(f"route/feasible_update_{kind.__name__}", samples, "s")
        if updated(robot, newer, before).digest != feasible_ground(robot, newer).digest:
            raise AssertionError("what is brought up to date differs from what is computed anew")


def _map(heights: NDArray[np.float64]) -> Dem:
    return from_heights(heights.astype(np.float32), CELL, 0.0, 0.0, "made")


def _times(call: Callable[[], object], quick: bool) -> tuple[float, ...]:
    samples = []
    for _ in range(3 if quick else 9):
        began = time.process_time()
        call()
        samples.append(time.process_time() - began)
    return tuple(samples)
