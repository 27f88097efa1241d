"""Ground to walk over: dunes, craters, boulders, fractals, made of a seed from easy to hard, and parts of maps."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from footfall.terrain.rocks import add_rocks, draw_rocks

RESOLUTION = 0.1
BEYOND, WIDE = 12.0, 12.0
"""How much longer than a route the ground is, and how wide [m]."""
AROUND = 4.0
"""How much of a map is known around a route over it [m]."""
PLACES = 2000
"""Places and directions of a map that are tried."""
LEARNED, UNSEEN = range(10_000), range(10_000, 20_000)
"""Seeds to learn from, and those that policies are compared on."""


def ground(seed: int, metres: float) -> Dem:
    """The ground of a seed, for a route of so many metres straight to the east through (0, 0). Equal arguments give
    equal ground; the seed's remainder decides which of FAMILIES it is of."""
    name = family(seed)
    rng = np.random.default_rng((seed, *name.encode()))
    made = FAMILIES[name]((metres + BEYOND, WIDE), rng)
    return Dem(made.heights, made.geometry, f"{name} {seed}", Provenance({}, seed=seed))


def part_of(dem: Dem, seed: int, metres: float) -> Dem:
    """A part of a map, turned and moved so that a route of so many metres goes straight to the east through (0, 0).

    Its place and direction are drawn with the seed; between the map's cells heights are those of its surface. Raises
    InvalidInput where no part is known that is long and wide enough.
    """
    rng = np.random.default_rng((seed, *b"part of a map"))
    length, width = metres + 2.0 * AROUND, 2.0 * AROUND
    x, y = np.meshgrid(_places(length), _places(width))
    west, south, east, north = dem.geometry.bounds
    for _ in range(PLACES):
        middle = rng.uniform((west, south), (east, north))
        turned = np.stack([x, y], axis=-1) @ rotation("z", rng.uniform(-math.pi, math.pi))[:2, :2].T + middle
        heights = height_at(dem, turned[..., 0], turned[..., 1])
        if np.isfinite(heights).all():
            name = f"{dem.name} {seed}"
            return from_heights(heights.astype(np.float32), RESOLUTION, -0.5 * length, -0.5 * width, name)
    raise InvalidInput(
        f"of {dem.name} no part of {length:g} × {width:g} m is known; take shorter routes or another map"
    )


def family(seed: int) -> str:
    """The name of its family."""
    return tuple(FAMILIES)[seed % len(FAMILIES)]


def _places(length: float) -> Array:
    return np.linspace(-0.5 * length, 0.5 * length, round(length / RESOLUTION) + 1)


def _dunes(size: tuple[float, float], rng: np.random.Generator) -> Dem:
    """Ridges across a random direction with a gentle side and a steep one."""
    base = _rough(size, float(rng.uniform(0.0, 0.02)), rng)
    across, length = rng.uniform(-math.pi, math.pi), rng.uniform(4.0, 9.0)
    height = rng.uniform(0.02, 0.12) * length
    x, y = np.meshgrid(base.geometry.xs, base.geometry.ys)
    phase = (math.cos(across) * x + math.sin(across) * y) / length * 2.0 * math.pi + rng.uniform(0.0, 2.0 * math.pi)
    # a sine whose phase leans on itself: crests move towards one side
    return _raised(base, 0.5 * height * np.sin(phase + 0.4 * np.sin(phase)))


def _craters(size: tuple[float, float], rng: np.random.Generator) -> Dem:
    """Bowls with rims, worn down: fresh ones are 0.196 of their width deep, with rims 0.036 of it high (R. Pike,
    "Size-dependence in the shape of fresh impact craters on the Moon", 1977)."""
    base = _rough(size, float(rng.uniform(0.0, 0.05)), rng)
    x, y = np.meshgrid(base.geometry.xs, base.geometry.ys)
    rise = np.zeros_like(x)
    for _ in range(int(rng.integers(2, 8))):
        width, left = rng.uniform(1.5, 8.0), rng.uniform(0.15, 0.8)
        away = np.hypot(x - rng.uniform(x.min(), x.max()), y - rng.uniform(y.min(), y.max())) / (0.5 * width)
        rim, depth = 0.036 * width * left, 0.196 * width * left
        rise += np.where(away < 1.0, depth * (away**2 - 1.0) + rim, rim * np.maximum(away, 1.0) ** -3.0)
    return _raised(base, rise)


def _boulders(size: tuple[float, float], rng: np.random.Generator) -> Dem:
    """Gentle ground strewn with rocks."""
    base = _rough(size, float(rng.uniform(0.0, 0.08)), rng)
    rocks = draw_rocks(base.geometry.bounds, float(rng.uniform(0.01, 0.12)), 0.15, 1.0, rng)
    return add_rocks(base, rocks)


def _fractal(size: tuple[float, float], rng: np.random.Generator) -> Dem:
    """Jagged or smooth at all sizes."""
    return _rough(size, float(rng.uniform(0.05, 0.5)), rng, float(rng.uniform(0.6, 0.95)))


def _rough(size: tuple[float, float], roughness: float, rng: np.random.Generator, hurst: float = 0.8) -> Dem:
    return fractal(size, RESOLUTION, roughness, hurst, seed=int(rng.integers(2**31)))


def _raised(base: Dem, rise: Array) -> Dem:
    return Dem((base.heights + rise).astype(np.float32), base.geometry, base.name, base.provenance)


FAMILIES: Mapping[str, Callable[[tuple[float, float], np.random.Generator], Dem]] = {
    "dunes": _dunes,
    "craters": _craters,
    "boulders": _boulders,
    "fractal": _fractal,
}
