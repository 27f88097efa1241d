"""Ten million points become 10 × 10 m of ground at 2 cm: processor time, and the memory of the whole process."""

import resource
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.timing import SEED, Figure
from footfall.terrain.gridding import terrain_of_scan
from footfall.terrain.scan import Scan, ScanSettings

POINTS = 10_000_000
SIDE = 10.0
CELL = 0.02
MOST_SECONDS = 3.0
MOST_GIGABYTES = 2.0


def scan(count: int) -> Scan:
    """Waves with noise of 1 cm, some grass, and one return in a thousand anywhere."""
    rng = np.random.default_rng(SEED)
    points = np.empty((count, 3))
    points[:, :2] = rng.uniform(0, SIDE, (count, 2))
    points[:, 2] = 0.2 * np.sin(points[:, 0]) + 0.01 * rng.normal(size=count)
    points[: count // 20, 2] += rng.uniform(0.1, 0.4, count // 20)
    points[-count // 1000 :, 2] = rng.uniform(-3, 3, len(points[-count // 1000 :]))
    return Scan(points, "bench", unit="m", up="z")


def figures(quick: bool) -> Iterator[Figure]:
    terrain_of_scan(scan(1000), ScanSettings(resolution=0.5))  # loads what is compiled
    many = scan(POINTS)
    for name, vegetation in (("surface", False), ("ground_under_grass", True)):
        taken = []
        for _ in range(1 if quick else 5):
            begin = time.process_time()
            terrain_of_scan(many, ScanSettings(resolution=CELL, vegetation=vegetation))
            taken.append(time.process_time() - begin)
        yield Figure(f"scans.{name}", tuple(taken), "s", MOST_SECONDS)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    yield Figure("scans.memory", (peak,), "GB", MOST_GIGABYTES)


if __name__ == "__main__":
    for figure in figures(False):
        row = figure.as_dict()
        told = f"median {row['median']:.3f} p95 {row['p95']:.3f} {figure.unit}, at most {figure.floor:g}"
        print(f"{figure.name:<28} {told}")
