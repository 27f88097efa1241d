"""What the ground makes of commands: standing wheels carry the chassis, and a lowered wheel ends where it touches.

The rover is taken as rigid here, and its wheels as locked: how it sags is :mod:`footfall.planning.compliance`'s.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.maps.standing import standing, wheel_gaps
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import Command
from footfall.sequence.predict import after, target
from footfall.telemetry.command_kinds import POSTURE_MOVE
from footfall.terrain.dem import Dem

CLEAR = 0.01
"""A wheel higher than this over the ground, or over where it stood, is off it [m]."""
_STEP = 0.01
"""Largest joint step between two postures that are asked whether the wheel touches [rad]."""
_HALVINGS = 40


@dataclass(frozen=True)
class Passage:
    """How the rover stands before and after one row.

    before, after: postures (legs × 6,) [rad]; target: what is asked for, beyond ``after`` where a wheel touches first.
    T_before, T_after: T_site_base (4, 4). resting: the posture in which each leg was put where it is. standing: of a
    POSTURE_MOVE, the legs whose wheels stand when it starts.
    """

    before: Array
    target: Array
    after: Array
    T_before: Array
    T_after: Array
    resting: Array
    standing: tuple[int, ...] = ()


def passages(
    robot: Robot,
    start: Array,
    T_site_base: Array,
    commands: tuple[Command, ...],
    dem: Dem | None = None,
    down: Sequence[int] | None = None,
) -> list[Passage]:
    """How each row goes.

    Args:
        robot: the rover.
        start: posture before the first, (legs × 6,) [rad].
        T_site_base: pose of the chassis before the first, (4, 4).
        commands: the rows.
        dem: the ground, in site; None: a LEG_LOWER goes all its way.
        down: which legs stand, where there is no ground to tell; None: it is not known.

    Returns:
        One for each row.

    Raises:
        InvalidSequence: a POSTURE_MOVE is to be followed, and there is neither ground nor ``down``.
    """
    rows: list[Passage] = []
    posture, T, resting = np.asarray(start, float), np.asarray(T_site_base, float), np.asarray(start, float)
    for command in commands:
        asked, moved = after(posture, command), target(command, robot.leg_count)
        reached, T_reached, legs = asked, T, ()
        next_resting = resting
        if moved is not None and command.kind.moves_all:
            legs = _standing(robot, dem, resting, posture, T, down)
            T_reached, holding = carried(robot, T, posture, asked, legs)
            # their wheels stay where they were put, though their joints turn
            own = [6 * leg + i for leg in holding for i in range(6)]
            same = [i for i in own if resting[i] == posture[i]]
            next_resting = resting.copy()
            next_resting[same] = asked[same]
        elif moved is not None and command.kind.ends_by_force and dem is not None and command.leg is not None:
            reached = posture + touch(robot, dem, T, posture, asked, command.leg) * (asked - posture)
        rows.append(Passage(posture, asked, reached, T, T_reached, resting, legs))
        posture, T, resting = reached, T_reached, next_resting
    return rows


def poses(rows: Sequence[Passage]) -> Array | None:
    """T_site_base after each row, (rows, 4, 4); None where the chassis stays where it is."""
    if all(row.T_after is row.T_before for row in rows):
        return None
    return np.array([row.T_after for row in rows])


def postures(rows: Sequence[Passage], start: Array) -> Array:
    """The posture after each row, (rows, legs × 6) [rad]."""
    return np.array([row.after for row in rows]).reshape(len(rows), len(start))


def carried(
    robot: Robot, T_site_base: Array, before: Array, now: Array, legs: Sequence[int]
) -> tuple[Array, list[int]]:
    """Pose that standing wheels give the chassis when the joints move.

    It is the rigid pose that leaves their centres where they were, in least squares (Kabsch, "A solution for the best
    rotation to relate two sets of vectors", 1976). Where they can't all stay, the most that hold the others over the
    ground: legs that are drawn up take no part. Fewer than three wheels hold nothing: the pose stays.

    Args:
        robot: the rover.
        T_site_base: pose of the chassis before, (4, 4).
        before: posture then, (legs × 6,) [rad].
        now: posture after it, (legs × 6,) [rad].
        legs: numbers of those that stand.

    Returns:
        T_site_base (4, 4) after it, and the legs that hold.
    """
    if len(legs) < 3 or np.array_equal(before, now):
        return T_site_base, list(legs)
    stood = apply(T_site_base, wheel_centers(robot, before))
    centers = wheel_centers(robot, now)
    T, off = fitted(centers, stood, legs)
    if np.linalg.norm(off[list(legs)], axis=1).max() <= CLEAR:
        return T, list(legs)
    for count in range(len(legs) - 1, 2, -1):
        found = []
        for holding in itertools.combinations(legs, count):
            T_held, off = fitted(centers, stood, holding)
            away = float(np.linalg.norm(off[list(holding)], axis=1).max())
            if away <= CLEAR and all(off[leg, 2] > 0 for leg in legs if leg not in holding):
                found.append((away, holding, T_held))
        if found:
            _, holding, T_held = min(found, key=lambda one: one[:2])
            return T_held, list(holding)
    return T, list(legs)


def touch(robot: Robot, dem: Dem, T_site_base: Array, before: Array, target: Array, leg: int) -> float:
    """The share of a straight joint-space line at which a wheel first is on the ground.

    Args:
        robot: the rover.
        dem: the ground, in site.
        T_site_base: pose of the chassis all the while, (4, 4).
        before: posture where the line begins, (legs × 6,) [rad].
        target: posture where it ends, (legs × 6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        0…1; 1 where it never is.
    """
    count = max(1, int(np.ceil(np.max(np.abs(target - before)) / _STEP)))

    def on_ground(share: float) -> bool:
        posture = before + share * (target - before)
        return bool(wheel_gaps(robot, dem, posture, T_site_base, [leg])[0] <= 0.0)

    for number in range(count + 1):
        high = number / count
        if not on_ground(high):
            continue
        low = max(high - 1 / count, 0.0)
        for _ in range(_HALVINGS if number else 0):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if on_ground(middle) else (middle, high)
        return high
    return 1.0


def standing_legs(
    robot: Robot, dem: Dem, resting: Array, posture: Array, T_site_base: Array, legs: Sequence[int]
) -> list[int]:
    """The legs that carry the rover.

    On unseen ground that is one that never left it, not one that was put there.

    Args:
        robot: the rover.
        dem: the ground, in site.
        resting: posture that it stood in, (legs × 6,) [rad].
        posture: that it is in now, (legs × 6,) [rad].
        T_site_base: pose of the chassis now, (4, 4).
        legs: numbers of those that are asked about.

    Returns:
        Numbers of those that stand.
    """
    moved = [leg for leg in legs if (posture != resting)[6 * leg : 6 * leg + 6].any()]
    gaps = wheel_gaps(robot, dem, posture, T_site_base, moved)
    unseen = [leg for leg, gap in zip(moved, gaps, strict=True) if np.isnan(gap)]
    return [leg for leg in standing(robot, dem, posture, T_site_base, legs) if leg not in unseen]


def _standing(
    robot: Robot, dem: Dem | None, resting: Array, posture: Array, T_site_base: Array, given: Sequence[int] | None
) -> tuple[int, ...]:
    if dem is not None:
        return tuple(standing_legs(robot, dem, resting, posture, T_site_base, robot.legs))
    if given is None:
        raise InvalidSequence(
            f"a {POSTURE_MOVE.name} needs the terrain: the wheels that stand say where the chassis goes"
        )
    return tuple(given)


def fitted(centers: Array, stood: Array, legs: Sequence[int]) -> tuple[Array, Array]:
    """The pose that brings the centres of some legs nearest to where they stood.

    Args:
        centers: of all wheels, (n, 3) [m].
        stood: where they stood, (n, 3) in site [m].
        legs: numbers of the wheels that count.

    Returns:
        The pose (4, 4) that takes the centres to site, and how far each is off then, (n, 3) [m].
    """
    a, b = centers[list(legs)], stood[list(legs)]
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    U, _, Vt = np.linalg.svd((a - middle_a).T @ (b - middle_b))
    turned = np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))])
    T = np.eye(4)
    T[:3, :3] = Vt.T @ turned @ U.T
    T[:3, 3] = middle_b - T[:3, :3] @ middle_a
    return T, apply(T, centers) - stood
