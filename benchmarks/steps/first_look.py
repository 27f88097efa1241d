"""What the first plan of a stance, a leg or a map costs beyond the same plan asked for again.

Much is made when a plan first needs it, so it is the whole first plan that is timed: a scene takes as long as the first
plan takes longer than the second. The tiles of the ground are forgotten before each first plan: a rover that walks
comes to tiles that nothing was near before. The process has planned elsewhere, so that its code is loaded.
"""

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.steps.problem import beside_hip
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.scene import ground_tiles
from footfall.planning.step.problem import StepSettings
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import rock_field

SIZE, LARGE = 9.8, 12.0
"""Of maps [m]: nearly the largest whose tables are made as a whole, and one whose tables are made for each leg."""
INSIDE, AT_THE_EDGE = (0.0, 0.6), (1.8, 2.4)
"""How far from the map's middle the rover stands [m]: with all that its legs reach on the map, or with some beyond."""
NEW_STANCE, NEW_WORLD = 0.03, 0.5
"""What a scene may take [s]."""
_TRIES = 40
"""Places and targets that are drawn until one will do."""

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Look:
    """Seconds of processor time of the first plan and of the same plan asked for again."""

    first: float
    again: float

    @property
    def scene(self) -> float:
        return self.first - self.again


def figures(quick: bool) -> Iterator[Figure]:
    count = 2 if quick else 16
    rng = np.random.default_rng(SEED)
    known, large = _ground(SEED, SIZE), _ground(SEED, LARGE)
    if _stance(known, rng, INSIDE) is None:
        raise RuntimeError("the rover stands nowhere on the map")
    for name, dem, ring in (
        ("", known, INSIDE),
        ("_at_map_edge", known, AT_THE_EDGE),
        ("_on_large_map", large, INSIDE),
    ):
        looks = [pair for _ in range(count) if (pair := _stance(dem, rng, ring)) is not None]
        for what, which in (("stance", 0), ("leg", 1)):
            yield from _rows(f"new_{what}{name}", [pair[which] for pair in looks], NEW_STANCE)
    yield from _rows("new_world", [look for i in range(count) if (look := _world(rng, i)) is not None], NEW_WORLD)


def _rows(name: str, looks: list[Look], floor: float) -> Iterator[Figure]:
    yield Figure(f"step.first_plan_{name}", tuple(look.first for look in looks), "s")
    yield Figure(f"step.scene_{name}", tuple(look.scene for look in looks), "s", floor, p95_at_most=floor)


def _ground(seed: int, size: float) -> Dem:
    return rock_field(size=size, resolution=0.02, abundance=0.06, largest=0.5, seed=seed)


def _stance(dem: Dem, rng: np.random.Generator, ring: tuple[float, float]) -> tuple[Look, Look] | None:
    """Of a stance that was never planned in: its first leg, and a second one after that. None where none will do."""
    for _ in range(_TRIES):
        stands = _standing(dem, rng, ring)
        if stands is None:
            continue
        state, place = stands
        legs = rng.permutation(6).tolist()
        first = _looked(dem, state, place, legs[0], rng)
        if first is None:
            continue  # this stance is not new any more
        seconds = (_looked(dem, state, place, leg, rng) for leg in legs[1:])
        second = next((look for look in seconds if look is not None), None)
        if second is not None:
            return first, second
    return None


def _world(rng: np.random.Generator, number: int) -> Look | None:
    """Of a map that was never planned on. None where the rover stands nowhere on it."""
    made = _ground(SEED + 1 + number, SIZE)
    for lift in itertools.islice(itertools.count(), _TRIES):
        # another map by its content each time: its heights are other ones
        grid = made.geometry
        dem = from_heights(made.heights + np.float32(1e-3 * lift), grid.resolution, grid.x0, grid.y0)
        stands = _standing(dem, rng, INSIDE)
        if stands is not None and (look := _looked(dem, *stands, int(rng.integers(6)), rng)) is not None:
            return look
    return None


def _standing(dem: Dem, rng: np.random.Generator, ring: tuple[float, float]) -> tuple[RobotState, Place] | None:
    away, way, yaw = rng.uniform(*ring), rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi)
    place = float(away * np.cos(way)), float(away * np.sin(way)), float(yaw)
    try:
        return footfall.stand(robot(), dem, *place), place
    except InvalidInput:
        return None


def _looked(dem: Dem, state: RobotState, place: Place, leg: int, rng: np.random.Generator) -> Look | None:
    """The first plan of a leg in a stance, and the same again; None where there is none to a random footfall."""
    target = beside_hip(place, leg, rng.uniform(0.7, 1.2), rng.uniform(-0.8, 0.8))
    ground_tiles._hierarchy.cache_clear()
    seconds = []
    for _ in range(2):
        begin = time.process_time()
        result = footfall.plan_step(robot(), dem, state, leg, target, settings=StepSettings(seed=1, time_limit=20.0))
        seconds.append(time.process_time() - begin)
        if result.status is not Status.FOUND:
            return None
    return Look(*seconds)
