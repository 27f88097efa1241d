"""Standing on maps of 400 × 600 cells, in processor time: where the rover stands, and where it is refused."""

import time
from collections.abc import Iterator

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidInput
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, rock_field

SHAPE = (400, 600)
RESOLUTIONS = (0.05, 0.02, 0.015)
MOST = 0.2
"""What one answer may take [s]."""


def _grounds() -> Iterator[Dem]:
    for resolution in RESOLUTIONS:
        size = ((SHAPE[1] - 1) * resolution, (SHAPE[0] - 1) * resolution)
        yield rock_field(size=size, resolution=resolution, abundance=0.06, largest=0.5, seed=SEED)
        for roughness in (0.1, 0.3):
            yield fractal(size=size, resolution=resolution, roughness=roughness, seed=SEED)


def figures(quick: bool) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    taken: dict[str, list[float]] = {"stands": [], "refused": []}
    for dem in _grounds():
        free = np.maximum(np.array(dem.geometry.bounds[2:]) - 3.0, 0.0)
        places = [*rng.uniform(-free, free, (2 if quick else 10, 2))]
        # the first call loads what is compiled
        _asked(dem, 0.0, 0.0, 0.0)
        for x, y in places:
            answer, seconds = _asked(dem, float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
            taken[answer].append(seconds)
    for name, samples in taken.items():
        if samples:
            yield Figure(f"stand.{name}", tuple(samples), "s", MOST, p95_at_most=MOST)


def _asked(dem: Dem, x: float, y: float, yaw: float) -> tuple[str, float]:
    begin = time.process_time()
    try:
        footfall.stand(robot(), dem, x=x, y=y, yaw=yaw)
        answer = "stands"
    except InvalidInput:
        answer = "refused"
    return answer, time.process_time() - begin


if __name__ == "__main__":
    for figure in figures(False):
        row = figure.as_dict()
        print(
            f"{figure.name:<24} median {row['median']:.3f} s  p95 {row['p95']:.3f} s  n {row['n']}  {MOST:g} s at most"
        )
