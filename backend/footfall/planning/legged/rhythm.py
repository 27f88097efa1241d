"""Where the feet of a circulating walk come to stand along a guide, and in which order they move.

Every foot is told by how far along the guide the chassis is when the foot is abeam of its stack: there the foot is at
ease. So a foot's place is the same law whether the chassis goes straight or turns in place; only in a turn one stack's
feet come abeam going backward.
"""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.guide import Guide
from footfall.planning.legged.stacks import Stack
from footfall.robot.legged.posture import chassis_pose

PHASES = 24
"""Beginnings of the rhythm that are compared."""
SETTLED = 0.15
"""A foot so near to its place in the rhythm stays where it is [m]."""


class CirculatingRhythm:
    """stride: how far a foot goes in one foot move, along the guide [m]."""

    def __init__(self, soles_at_ease: Array, stacks: tuple[Stack, Stack], guide: Guide) -> None:
        self.guide, self.stacks = guide, stacks
        self.stride = float(min(np.ptp(soles_at_ease[list(stack.legs), 0]) for stack in stacks))
        self._abeam = {}
        for stack in stacks:
            out = float(np.mean(soles_at_ease[list(stack.legs), 1]))
            self._abeam |= dict.fromkeys(stack.legs, np.array([stack.axis[0], out, 0.0]))

    def home(self, leg: int, s: float) -> Array:
        """Place (2,) [m] of a foot that is abeam where the chassis is at s."""
        x, y, yaw = self.guide.at(s)
        return apply(chassis_pose(x, y, 0.0, yaw), self._abeam[leg])[:2]

    def along(self, leg: int, place: Array) -> float:
        """How far along the guide the chassis is when a foot at a place (2,) [m] is abeam."""
        x, y, _ = self.guide.start
        change, length = self.guide.change, self.guide.length
        if not change[2]:
            return float((place - (x, y) - (self.home(leg, 0.0) - (x, y))) @ change[:2]) / length
        away, home = place - (x, y), self.home(leg, 0.0) - (x, y)
        turned = np.arctan2(home[0] * away[1] - home[1] * away[0], home @ away)
        return float(turned / change[2] * length)

    def begun(self, soles: Array) -> dict[int, float]:
        """For each leg where along the guide it is to stand at first: near where it stands, in the same order.

        Of all beginnings that leave the feet of each stack even, and those of the two half as far apart, the one that
        leaves most feet where they are.
        """
        order = [sorted(stack.legs, key=lambda leg: self.along(leg, soles[leg, :2])) for stack in self.stacks]
        return min(
            (self._even(order, phase) for phase in np.arange(PHASES) / PHASES), key=lambda at: self._off(at, soles)
        )

    def _even(self, order: list[list[int]], phase: float) -> dict[int, float]:
        """For each leg its place in the rhythm, order: of each stack from behind; phase: share of the spacing."""
        at: dict[int, float] = {}
        for number, legs in enumerate(order):
            spacing = self.stride / len(legs)
            first = -self.stride / 2 + ((phase + number / 2) % 1.0) * spacing
            at |= {leg: first + k * spacing for k, leg in enumerate(legs)}
        return at

    def _off(self, at: dict[int, float], soles: Array) -> tuple[int, float]:
        """How many feet are elsewhere, and how far in all [m]."""
        off = [float(np.linalg.norm(self.home(leg, s) - soles[leg, :2])) for leg, s in at.items()]
        return sum(one > SETTLED for one in off), sum(off)
