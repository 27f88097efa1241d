"""The order of a gait: which legs move together, where the chassis is then, and how long each foot stands."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array, Ints
from footfall.planning.gait.problem import RIPPLE, TRIPOD
from footfall.robot.model import Robot


def groups_of(robot: Robot, gait: str, heading: float) -> tuple[tuple[int, ...], ...]:
    """Which legs move together, in their order, in one cycle.

    Args:
        robot: the rover.
        gait: one of GAITS.
        heading: of the way in base [rad].

    Returns:
        Groups of numbers of legs.
    """
    legs, half = robot.legs, robot.leg_count // 2
    if gait == TRIPOD:
        return tuple(tuple(leg for leg in legs if leg % 2 == one) for one in (0, 1))
    way = (math.cos(heading), math.sin(heading))
    ahead = [round(float(leg.T_base_hip[:2, 3] @ way), 6) for leg in robot.description.legs]
    rear_to_front = sorted(legs, key=lambda leg: (ahead[leg], leg))
    if gait == RIPPLE:
        return tuple(tuple(sorted((leg, (leg + half) % robot.leg_count))) for leg in rear_to_front[:half])
    return tuple((leg,) for leg in rear_to_front)


@dataclass(frozen=True, eq=False)
class Rhythm:
    """A gait over a way. groups: of one cycle; cycles: how many; stride: of each [m].

    ways: (n + 1,) how far along the chassis is before foot move 0…n − 1, and after the last [m].
    Of every foot that is put somewhere, those that it begins with first, in order: legs; first, last: the first and
    last of ``ways`` at which it stands there; ideal: where along the way the rover at ease would have it there [m].
    """

    groups: tuple[tuple[int, ...], ...]
    cycles: int
    stride: float
    ways: Array
    legs: Ints
    first: Ints
    last: Ints
    ideal: Array

    @property
    def moves(self) -> int:
        """How many foot moves there are."""
        return len(self.ways) - 1

    @property
    def begins(self) -> range:
        """The rows of the feet that it begins with."""
        return range(sum(len(group) for group in self.groups))

    def rows(self, move: int) -> range:
        """The rows of the feet that a foot move puts down; all groups are equally large."""
        each = len(self.groups[0])
        first = len(self.begins) + each * move
        return range(first, first + each)

    def group(self, move: int) -> tuple[int, ...]:
        """The legs of a foot move."""
        return self.groups[move % len(self.groups)]


def rhythm(groups: tuple[tuple[int, ...], ...], length: float, longest: float) -> Rhythm:
    """The rhythm of a way, its strides all equal.

    A foot stands over one stride of the chassis: it is put half of that ahead of where it would be at ease. It goes
    neither behind the beginning nor beyond the end.

    Args:
        groups: legs that move together, in their order.
        length: of the way [m].
        longest: a stride is at most so long [m].

    Returns:
        Which group moves when, and how far each foot goes.
    """
    count, cycles = len(groups), max(1, math.ceil(length / longest - 1e-9))
    moves = count * cycles
    rows: list[tuple[int, int, int, float]] = []
    for number, group in enumerate(groups):
        rows += [(leg, 0, number, number - 0.5 * count) for leg in group]
    for move in range(moves):
        rows += [(leg, move, min(move + count, moves), move + 0.5 * count) for leg in groups[move % count]]
    legs, first, last = (np.array([row[i] for row in rows], np.int64) for i in range(3))
    ideal = length / moves * np.clip([row[3] for row in rows], 0.0, moves)
    return Rhythm(groups, cycles, length / cycles, np.linspace(0.0, length, moves + 1), legs, first, last, ideal)
