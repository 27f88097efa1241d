"""Ground to walk on, made of a seed: ``python -m benchmarks.walks.terrains`` prints its slopes.

Slopes are those of the plane fitted under a wheel, at every cell. Where a family has a range of slopes, each terrain's
95th percentile is drawn from it, and the heights are scaled to it: tangents of fitted planes are linear in heights.
"""

import argparse
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks.scenes import robot
from footfall.core.arrays import Array
from footfall.core.frames import rotation
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane
from footfall.terrain.ground.rasterise import rasterise
from footfall.terrain.ground.surface import normal_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rocks import HEIGHT_PER_DIAMETER, add_rocks

TRAINING, REPORTED = range(10_000), range(10_000, 20_000)
"""Seeds to look at while a planner is being made, and those that are measured and reported."""
SIZES: Mapping[float, tuple[float, float]] = {
    2.0: (12.0, 8.0),
    2.75: (12.0, 8.0),
    5.0: (14.0, 10.0),
    10.0: (20.0, 20.0),
    20.0: (30.0, 10.0),
    50.0: (60.0, 10.0),
}
"""Extent (east, north) of the ground for a walk of so many metres straight to the east, its middle in (0, 0)."""


@dataclass(frozen=True)
class Family:
    """steepest: range of the 95th percentile of slopes [rad], None: level. rough: jagged down to a cell, or smooth.

    incline: all of it falls to the east so steeply [rad]; ``steepest`` is across that then. rocks: strewn with rocks.
    blocked: a wall with a gap beside the way, or a boulder, stands in the way. resolution: of its cells [m]. least: the
    shortest walk over it [m].
    """

    steepest: tuple[float, float] | None
    rough: bool = False
    rocks: bool = False
    blocked: bool = False
    incline: float = 0.0
    resolution: float = 0.1
    least: float = 0.0


def _degrees(low: float, high: float) -> tuple[float, float]:
    return float(np.deg2rad(low)), float(np.deg2rad(high))


FAMILIES: Mapping[str, Family] = {
    "flat": Family(None),
    "smooth": Family(_degrees(6.0, 14.0)),
    "rocks": Family(_degrees(3.0, 8.0), rocks=True, resolution=0.05),
    "steep": Family(_degrees(33.0, 48.0), rough=True),
    "around": Family(_degrees(3.0, 8.0), blocked=True, least=10.0),
    "very steep": Family(_degrees(50.0, 60.0), rough=True),
    "rappel": Family(_degrees(10.0, 20.0), rough=True, incline=math.radians(60.0), resolution=0.05),
}

SMOOTH = 0.8
"""Standard deviation of the bell that smooth ground is blurred with: undulations of some 4 m [m]."""
SMALLEST, LARGEST = 0.1, 1.0
"""Diameters of rocks [m]."""
ROCKS, FALL = 0.00234, 2.11
"""Rocks of a metre or more per m², and the power that their number falls with, seen at the place of Surveyor I."""


@dataclass(frozen=True)
class Slopes:
    """Median, 95th percentile and largest slope under a wheel [deg]."""

    median: float
    p95: float
    most: float


def start_of(metres: float) -> tuple[float, float]:
    """Where every walk of so many metres begins, x, y [m]; it heads east."""
    return -0.5 * metres, 0.0


def terrain(family: str, seed: int, metres: float = 2.75) -> Dem:
    """The ground of a family and seed for walks of so many metres, one of SIZES. Equal arguments give equal ground."""
    kind, rng = FAMILIES[family], np.random.default_rng((seed, *family.encode()))
    ground = plane(SIZES[metres], kind.resolution)
    if kind.steepest is not None:
        shape = _jagged if kind.rough else _undulating
        ground = _scaled(shape(SIZES[metres], kind.resolution, rng), float(rng.uniform(*kind.steepest)))
    if kind.incline:
        return _inclined(ground, kind.incline, f"{family} {seed}", seed)
    if kind.blocked:
        ground = _blocked(ground, rng)
    if kind.rocks:
        ground = add_rocks(ground, lunar_rocks(ground, rng))
    return Dem(ground.heights, ground.geometry, f"{family} {seed}", Provenance({}, seed=seed))


def lunar_rocks(ground: Dem, rng: np.random.Generator) -> Array:
    """Rocks (n, 4) all over the ground, as :func:`footfall.terrain.rocks.add_rocks` takes them.

    N(D) = 0.00234 D^−2.11 rocks of at least D [m] lie on a square metre at the place of Surveyor I: E. M. Shoemaker,
    E. C. Morris, "Physical characteristics of the lunar regolith determined from Surveyor television observations",
    Radio Science 5, 1970.
    """
    west, south, east, north = ground.geometry.bounds
    shares = np.array([SMALLEST, LARGEST]) ** -FALL
    count = rng.poisson(ROCKS * (shares[0] - shares[1]) * (east - west) * (north - south))
    diameters = rng.uniform(shares[1], shares[0], count) ** (-1 / FALL)
    x, y = rng.uniform(west, east, count), rng.uniform(south, north, count)
    return np.column_stack([x, y, diameters, HEIGHT_PER_DIAMETER * diameters])


def slopes(ground: Dem) -> Slopes:
    """Of the planes under a wheel at every cell that is as far from the edge as a wheel is wide."""
    tangents = _tangents(ground)
    median, p95, most = np.rad2deg(np.arctan(np.percentile(tangents, (50, 95, 100))))
    return Slopes(float(median), float(p95), float(most))


def _tangents(ground: Dem) -> Array:
    radius, grid = robot().wheel_radius, ground.geometry
    inner = int(np.ceil(radius / grid.resolution))
    x, y = np.meshgrid(grid.xs[inner:-inner], grid.ys[inner:-inner])
    normals = normal_at(ground, x, y, radius)
    tangents = np.hypot(normals[..., 0], normals[..., 1]) / normals[..., 2]
    return tangents[np.isfinite(tangents)]


def _scaled(ground: Dem, p95: float) -> Dem:
    heights = ground.heights * (np.tan(p95) / np.percentile(_tangents(ground), 95))
    return Dem(heights.astype(np.float32), ground.geometry, ground.name, ground.provenance)


def _blocked(ground: Dem, rng: np.random.Generator) -> Dem:
    """The ground with a wall across it, the gap to one side, or with a boulder, in its middle."""
    x, y = np.meshgrid(ground.geometry.xs, ground.geometry.ys)
    middle, height = rng.uniform(-0.5, 0.5), rng.uniform(1.5, 2.5)
    if rng.uniform() < 0.5:
        gap, wide = rng.choice([-1.0, 1.0]) * rng.uniform(3.0, 4.5), rng.uniform(5.5, 7.0)
        above = np.where((np.abs(x - middle) < 0.25) & (np.abs(y - gap) > 0.5 * wide), height, 0.0)
    else:
        radius, beside = rng.uniform(0.8, 1.6), rng.uniform(-0.8, 0.8)
        shares = 1.0 - ((x - middle) ** 2 + (y - beside) ** 2) / radius**2
        above = height * np.sqrt(np.clip(shares, 0.0, None))
    heights = (ground.heights + above).astype(np.float32)
    return Dem(heights, ground.geometry, ground.name, ground.provenance)


def _inclined(ground: Dem, incline: float, name: str, seed: int) -> Dem:
    """The ground turned about its north axis until it falls to the east, seen from above.

    It is turned, not sheared: what is rough stands across the slope.
    """
    turned = triangulate(ground)
    points = np.asarray(turned.vertices) @ rotation("y", incline).T
    steep = rasterise(Mesh(points, turned.triangles), ground.geometry.resolution, name)
    return Dem(steep.heights, steep.geometry, name, Provenance({}, seed=seed))


def _jagged(size: tuple[float, float], resolution: float, rng: np.random.Generator) -> Dem:
    return fractal(size, resolution, roughness=1.0, hurst=0.8, seed=int(rng.integers(2**31)))


def _undulating(size: tuple[float, float], resolution: float, rng: np.random.Generator) -> Dem:
    flat = plane(size, resolution)
    heights = gaussian_filter(rng.standard_normal(flat.heights.shape), SMOOTH / resolution)
    west, south, _, _ = flat.geometry.bounds
    return from_heights(heights.astype(np.float32), resolution, west, south, "undulating")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--terrains", type=int, default=5, help="of each family")
    parser.add_argument("--metres", type=float, choices=tuple(SIZES), default=2.75, help="length of the walks")
    asked = parser.parse_args()
    print(f"{'terrain':<18}{'median':>8}{'p95':>8}{'most':>8}  slope under a wheel [deg]")
    for family in FAMILIES:
        for seed in REPORTED[: asked.terrains]:
            found = slopes(terrain(family, seed, max(asked.metres, FAMILIES[family].least)))
            print(f"{family + ' ' + str(seed):<18}{found.median:>8.1f}{found.p95:>8.1f}{found.most:>8.1f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
