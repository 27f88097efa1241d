"""All map layers for one leg as the session makes them, end to end: ground, reach, collisions, balance, quality."""

import time
from collections.abc import Iterator

from benchmarks import balance, reach, stance, traversability
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import Figure, seconds
from footfall.maps.layers import MapSettings
from footfall.planning.step.leg_maps import compute_maps


def figures(quick: bool) -> Iterator[Figure]:
    n = 3 if quick else 15
    yield Figure("maps.first_picture", tuple(_first_picture() for _ in range(n + 1))[1:], "s", 0.15)
    yield Figure("maps.one_leg", seconds(lambda: _maps(2, MapSettings()), n), "s", 1.0)
    yield Figure("maps.six_legs", seconds(_six_legs, 1 if quick else 5), "s", 5.0)
    yield Figure("maps.one_leg_with_friction", seconds(lambda: _maps(2, MapSettings(friction=True)), n), "s", 3.0)
    for area in (reach, balance, traversability, stance):
        yield from area.figures(quick)


def _maps(leg: int, settings: MapSettings) -> None:
    compute_maps(robot(), rocks(), standing(), leg, settings, preview=lambda coarse: None)


def _first_picture() -> float:
    """Seconds from the request to the coarse maps; nothing is kept from an earlier request."""
    seen: list[float] = []
    begin = time.perf_counter()
    compute_maps(
        robot(), rocks(), standing(), 2, MapSettings(), preview=lambda coarse: seen.append(time.perf_counter() - begin)
    )
    return seen[0]


def _six_legs() -> None:
    for leg in robot().legs:
        _maps(leg, MapSettings())
