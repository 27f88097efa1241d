"""The families of problems: each makes one problem of a seed, without looking at what any planner does with it.

Distances and angles about a leg are those of :func:`benchmarks.steps.problem.beside_hip`: 0 is straight outward.
"""

from collections.abc import Callable

import numpy as np

from benchmarks import scenes
from benchmarks.steps.problem import Ground, Load, StepProblem, beside_hip, standing_at, wheel_radius_of

Random = np.random.Generator
Point = tuple[float, float]
Rock = tuple[float, float, float, float]
OUT_OF_REACH = "out of reach"
"""The family whose targets no leg gets to."""
_WHEEL = 0.25
"""A little more than a wheel's radius [m]: rocks stay so far from where wheels stand."""


def _uniform(rng: Random, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _sign(rng: Random) -> int:
    return int(rng.choice((-1, 1)))


def _place(rng: Random) -> tuple[float, float, float]:
    return 0.0, 0.0, _uniform(rng, -np.pi, np.pi)


def _leg(rng: Random) -> int:
    return int(rng.integers(6))


def _easy_ground(rng: Random, rocks: tuple[Rock, ...] = ()) -> Ground:
    """Level, tilted by up to 6°, or rolling."""
    kind = str(rng.choice(("plane", "slope", "fractal")))
    seed = int(rng.integers(1000))
    amount = {"plane": 0.0, "slope": _uniform(rng, 0.02, 0.1), "fractal": _uniform(rng, 0.02, 0.06)}[kind]
    return Ground(kind, amount, seed, rocks)


def _between(a: Point, b: Point, along: float, across: float = 0.0) -> Point:
    """The point a share ``along`` of the way from a to b, ``across`` [m] to its left."""
    way = np.subtract(b, a)
    left = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    x, y = np.asarray(a) + along * way + across * left
    return float(x), float(y)


def _wall(a: Point, b: Point, height: float, width: float = 0.22) -> list[Rock]:
    """Rocks in a row, so close that they leave no gap."""
    count = int(np.ceil(np.hypot(b[0] - a[0], b[1] - a[1]) / 0.08)) + 1
    return [(*_between(a, b, along), width, height) for along in np.linspace(0.0, 1.0, count).tolist()]


def open_ground(seed: int, rng: Random) -> StepProblem:
    place, leg = _place(rng), _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 0.75, 1.15), _uniform(rng, -0.6, 0.6))
    return StepProblem("open ground", seed, _easy_ground(rng), place, "stand", leg, target)


def over_a_rock(seed: int, rng: Random) -> StepProblem:
    """A rock half way, as large as the gap between the wheel's old and new place allows."""
    place, leg, posture = _place(rng), _leg(rng), str(rng.choice(("stand", "crouch")))
    reach = wheel_radius_of(posture)
    start = beside_hip(place, leg, reach, 0.0)
    target = beside_hip(place, leg, reach - _uniform(rng, 0.0, 0.25), _sign(rng) * _uniform(rng, 0.7, 1.15))
    gap = float(np.hypot(target[0] - start[0], target[1] - start[1])) - 2 * _WHEEL
    diameter = max(0.2, gap * _uniform(rng, 0.6, 1.0))
    rock = (*_between(start, target, 0.5, _uniform(rng, -0.1, 0.1)), diameter, _uniform(rng, 0.2, 0.6))
    return StepProblem("over a rock", seed, _easy_ground(rng, (rock,)), place, posture, leg, target)


def between_rocks(seed: int, rng: Random) -> StepProblem:
    """Two tall rocks beside the way, the gap between them not on the straight line."""
    place, leg = _place(rng), _leg(rng)
    reach = wheel_radius_of("stand")
    start = beside_hip(place, leg, reach, 0.0)
    target = beside_hip(place, leg, reach - _uniform(rng, 0.0, 0.3), _sign(rng) * _uniform(rng, 0.8, 1.2))
    aside, gap = _sign(rng) * _uniform(rng, 0.1, 0.3), _uniform(rng, 0.75, 1.0)
    rocks = tuple(
        (*_between(start, target, 0.5, aside + side * gap / 2), _uniform(rng, 0.2, 0.3), _uniform(rng, 0.5, 0.9))
        for side in (-1, 1)
    )
    return StepProblem("between two rocks", seed, _easy_ground(rng, rocks), place, "stand", leg, target)


def toward_the_inside(seed: int, rng: Random) -> StepProblem:
    """The wheel goes near its hip or under the chassis, mostly past a rock."""
    place, leg, posture = _place(rng), _leg(rng), str(rng.choice(("stand", "crouch")))
    start = beside_hip(place, leg, wheel_radius_of(posture), 0.0)
    target = beside_hip(place, leg, _uniform(rng, 0.1, 0.65), _uniform(rng, -1.2, 1.2))
    rocks: tuple[Rock, ...] = ()
    if rng.uniform() < 0.7:
        rocks = ((*_between(start, target, 0.5, _uniform(rng, -0.1, 0.1)), 0.25, _uniform(rng, 0.15, 0.4)),)
    return StepProblem("toward the inside", seed, _easy_ground(rng, rocks), place, posture, leg, target)


def around_a_leg(seed: int, rng: Random) -> StepProblem:
    """The neighbour stands turned towards the leg that moves, which is to step beside it."""
    place, leg, side = _place(rng), _leg(rng), _sign(rng)
    neighbour = (leg + side) % 6
    stands = beside_hip(place, neighbour, _uniform(rng, 0.85, 1.1), -side * _uniform(rng, 0.5, 1.0))
    target = beside_hip(place, leg, _uniform(rng, 0.6, 1.15), side * _uniform(rng, 0.5, 1.4))
    ground, turned = _easy_ground(rng), ((neighbour, *stands),)
    return StepProblem("around a leg", seed, ground, place, "stand", leg, target, turned=turned)


def bug_trap(seed: int, rng: Random) -> StepProblem:
    """A U of rocks that opens towards the wheel, or a slot that it stands in: what goes straight ends at a wall."""
    place, leg, posture = _place(rng), _leg(rng), str(rng.choice(("stand", "crouch")))
    reach, side = wheel_radius_of(posture), _sign(rng)
    start = beside_hip(place, leg, reach, 0.0)
    target = beside_hip(place, leg, reach - _uniform(rng, 0.0, 0.2), side * _uniform(rng, 0.95, 1.3))
    far = float(np.hypot(target[0] - start[0], target[1] - start[1]))
    height, half = _uniform(rng, 0.35, 0.75), _uniform(rng, 0.36, 0.5)
    back = 1.0 - (_WHEEL + 0.13) / far  # just before the target's wheel
    if rng.uniform() < 0.5:
        # the slot: its walls begin beside the wheel that stands in it
        opening, back = -0.1, (_WHEEL + 0.15 + 0.1 * rng.uniform()) / far
    else:
        opening = back - _uniform(rng, 0.25, 0.45) / far
    corners = [_between(start, target, back, s * half) for s in (-1, 1)]
    mouths = [_between(start, target, opening, s * half) for s in (-1, 1)]
    walls = (
        _wall(corners[0], corners[1], height)
        + _wall(corners[0], mouths[0], height)
        + _wall(corners[1], mouths[1], height)
    )
    return StepProblem("bug trap", seed, Ground("plane", rocks=tuple(walls)), place, posture, leg, target)


def long_reach(seed: int, rng: Random) -> StepProblem:
    """Far around the hip and near the end of the leg's reach."""
    place, leg = _place(rng), _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 1.1, 1.36), _sign(rng) * _uniform(rng, 0.8, 1.9))
    rocks = (*beside_hip(place, leg, _uniform(rng, 0.9, 1.2), 0.35), 0.2, _uniform(rng, 0.1, 0.4))
    return StepProblem("long reach", seed, _easy_ground(rng, (rocks,)), place, "crouch", leg, target)


def steep_fractal(seed: int, rng: Random) -> StepProblem:
    place, leg = _place(rng), _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 0.6, 1.2), _sign(rng) * _uniform(rng, 0.3, 1.2))
    ground = Ground("fractal", _uniform(rng, 0.15, 0.35), int(rng.integers(1000)))
    return StepProblem("steep fractal", seed, ground, place, "stand", leg, target)


def under_a_load(seed: int, rng: Random) -> StepProblem:
    """A box hangs under the chassis, and the wheel goes beside or under it."""
    place, leg = _place(rng), _leg(rng)
    size = (_uniform(rng, 0.8, 1.5), _uniform(rng, 0.8, 1.5), _uniform(rng, 0.3, 0.7))
    load = Load(_uniform(rng, 50.0, 150.0), size, (0.0, 0.0, -0.22 - size[2] / 2))
    start = beside_hip(place, leg, wheel_radius_of("stand"), 0.0)
    target = beside_hip(place, leg, _uniform(rng, 0.05, 0.6), _uniform(rng, -1.5, 1.5))
    rocks: tuple[Rock, ...] = ()
    if rng.uniform() < 0.7:
        rocks = ((*_between(start, target, 0.5), 0.25, _uniform(rng, 0.15, 0.4)),)
    return StepProblem("payload under the chassis", seed, _easy_ground(rng, rocks), place, "stand", leg, target, load)


def field_of_rocks(seed: int, rng: Random) -> StepProblem:
    """Rocks of the sizes found at landing sites, wherever they lie."""
    place, leg = _place(rng), _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 0.6, 1.2), _sign(rng) * _uniform(rng, 0.3, 1.2))
    ground = Ground("rocks", _uniform(rng, 0.06, 0.15), int(rng.integers(1000)))
    return StepProblem("field of rocks", seed, ground, place, "stand", leg, target)


def lunar_picture(seed: int, rng: Random) -> StepProblem:
    place = (_uniform(rng, -4.5, 4.5), _uniform(rng, -1.5, 1.5), _uniform(rng, -np.pi, np.pi))
    leg = _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 0.5, 1.2), _sign(rng) * _uniform(rng, 0.3, 1.3))
    return StepProblem("lunar picture", seed, Ground("lunar picture"), place, "stand", leg, target)


def fractal_mesh(seed: int, rng: Random) -> StepProblem:
    place = (_uniform(rng, -22.0, 22.0), _uniform(rng, -22.0, 22.0), _uniform(rng, -np.pi, np.pi))
    leg = _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 0.5, 1.2), _sign(rng) * _uniform(rng, 0.3, 1.3))
    return StepProblem("fractal mesh", seed, Ground("fractal mesh"), place, "stand", leg, target)


def past_a_plate(seed: int, rng: Random) -> StepProblem:
    """Leg 0 or 3 stands on one side of a plate that hangs from the deck, and is to step to the other.

    It has to fold, pass below the plate or between it and the hip, and unfold. Some plates leave no way.
    """
    place, leg, posture = _place(rng), int(rng.choice((0, 3))), str(rng.choice(("stand", "crouch", "tall")))
    reach, side, outward = wheel_radius_of(posture), _sign(rng), 1.0 if leg == 0 else -1.0
    start = beside_hip(place, leg, reach - _uniform(rng, 0.0, 0.15), -side * _uniform(rng, 0.55, 0.9))
    target = beside_hip(place, leg, reach - _uniform(rng, 0.0, 0.3), side * _uniform(rng, 0.55, 0.9))
    from_hip, length, width = _uniform(rng, 0.3, 0.75), _uniform(rng, 1.2, 1.8), _uniform(rng, 0.05, 0.2)
    top, bottom = 0.3, float(standing_at(posture)[2]) + _uniform(rng, 0.5, 0.9)
    hip = float(scenes.robot().description.legs[0].T_base_hip[0, 3])
    middle = (outward * (hip + from_hip + length / 2), _uniform(rng, -0.1, 0.1), (top + bottom) / 2)
    load, turned = Load(20.0, (length, width, top - bottom), middle), ((leg, *start),)
    return StepProblem("past a hanging plate", seed, _easy_ground(rng), place, posture, leg, target, load, turned)


def out_of_reach(seed: int, rng: Random) -> StepProblem:
    """Farther from the hip than the leg is long."""
    place, leg = _place(rng), _leg(rng)
    target = beside_hip(place, leg, _uniform(rng, 1.75, 2.3), _uniform(rng, -0.8, 0.8))
    return StepProblem(OUT_OF_REACH, seed, _easy_ground(rng), place, "stand", leg, target)


MAKERS: dict[str, Callable[[int, Random], StepProblem]] = {
    "open ground": open_ground,
    "over a rock": over_a_rock,
    "between two rocks": between_rocks,
    "toward the inside": toward_the_inside,
    "around a leg": around_a_leg,
    "bug trap": bug_trap,
    "long reach": long_reach,
    "steep fractal": steep_fractal,
    "payload under the chassis": under_a_load,
    "field of rocks": field_of_rocks,
    "lunar picture": lunar_picture,
    "fractal mesh": fractal_mesh,
    "past a hanging plate": past_a_plate,
    OUT_OF_REACH: out_of_reach,
}
HARD = ("over a rock", "between two rocks", "around a leg", "bug trap", "past a hanging plate")
"""Families whose problems are all such that a straight swing fails."""
COUNTS = dict.fromkeys(MAKERS, 20) | dict.fromkeys(
    ("open ground", "over a rock", "bug trap", "past a hanging plate"), 24
)
COUNTS |= dict.fromkeys(("lunar picture", "fractal mesh", OUT_OF_REACH), 12)
"""How many problems each family has."""


def problem(family: str, seed: int) -> StepProblem:
    """The one problem of that family and seed."""
    entropy = [seed, *family.encode()]
    return MAKERS[family](seed, np.random.Generator(np.random.PCG64(entropy)))
