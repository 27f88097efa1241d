"""One check of a legged robot as a whole: every configuration on the way of a step or a walk goes through it."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from footfall.balance.legged_effort import effort_ratio
from footfall.balance.support import margin
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.answers import Check
from footfall.planning.legged.footing import rest_heights
from footfall.planning.legged.over_ground import Surfaces
from footfall.planning.legged.problem import LeggedSettings
from footfall.robot.legged.apart import BodyPairs
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import Placed, placed
from footfall.terrain.dem import Dem

UNITS = {"limits": "rad", "disc": "m", "support": "m", "ground": "m", "foot": "m", "self": "m", "effort": ""}
"""What is checked, in this order, and its unit; limits of a joint that slides are in metres."""
FOLLOWS = 1e-5
"""A joint that follows another is where that one has it but for so much [rad or m]."""
LIMIT_RESERVE = 1e-3
"""Joints stay so far inside their limits [rad or m]."""
DISC_OFF = 0.1
"""A disc may lean so far that its rim is off the ball which stands for it by this share of its radius."""
SCRAPE = 1e-4
"""A foot that is lifted or let down straight may touch the ground; it is not deeper in it than this [m]."""


class Feet(NamedTuple):
    """standing: legs on the ground; contacts, normals: (legs, 3) of all legs, in site [m]."""

    standing: Sequence[int]
    contacts: Array
    normals: Array


class Margin(NamedTuple):
    """How much of a check is left, positive where it holds, and where."""

    size: float
    where: str
    unit: str


class Refusal(NamedTuple):
    """What refused a configuration: name of the check, margin (below zero, NaN: unknown), and where."""

    name: str
    margin: float
    where: str


class WholeCheck:
    """The checks of one robot on one terrain; remembers the least margin that anything accepted had.

    apart: at the clearances of the stance at ease.
    """

    def __init__(self, robot: LeggedRobot, dem: Dem, settings: LeggedSettings, apart: BodyPairs) -> None:
        self.robot, self.dem, self.settings, self.apart = robot, dem, settings, apart
        self.surfaces = Surfaces(robot)
        self._sliding = frozenset(robot.layout.sliding)
        self._followers = {
            f"{robot.joint_names[at]} away from where {robot.joint_names[robot.coupling.leads[at]]} has it": at
            for at in np.flatnonzero(~robot.coupling.free).tolist()
        }

    def margins(self, q: Array, T_site_base: Array, feet: Feet) -> dict[str, Margin] | Refusal:
        """The least margin of each check, or the first refusal."""
        found: dict[str, Margin] = {}
        if not np.isfinite(q).all():
            leg = next(leg for leg in self.robot.legs if not np.isfinite(q[self.robot.slices[leg]]).all())
            return Refusal("limits", float("nan"), f"leg {self.robot.leg_names[leg]} does not reach")
        for name, left in self.each(q, T_site_base, feet):
            if not left.size >= 0:
                return Refusal(name, left.size, left.where)
            found[name] = left
        return found

    def each(self, q: Array, T_site_base: Array, feet: Feet) -> Iterator[tuple[str, Margin]]:
        """Name and least margin of each check, one after the other, for finite q."""
        where = placed(self.robot, q)
        judges = (self._limits, self._discs, self._support, self._ground, self._foot, self._self, self._effort)
        for name, judge in zip(UNITS, judges, strict=True):
            size, at = judge(q, T_site_base, feet, where)
            yield name, Margin(size, at, self.unit(name, at))

    def unit(self, name: str, where: str) -> str:
        """Of a check's margin; ``where`` of limits is a joint."""
        joint = self.robot.joint_names[self._followers[where]] if where in self._followers else where
        return "m" if name == "limits" and joint in self._sliding else UNITS[name]

    def _limits(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        spare = np.minimum(q - self.robot.lower, self.robot.upper - q) - LIMIT_RESERVE
        followed = self.robot.coupling.followed(q)
        for away, joint in self._followers.items():
            off = abs(float(q[joint] - followed[joint]))
            if off > FOLLOWS:
                return FOLLOWS - off, away
        at = int(np.argmin(spare))
        return float(spare[at]), self.robot.joint_names[at]

    def _discs(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        """A disc touches where the ball around it does only while it stands upright."""
        least, which = np.inf, "no disc"
        for leg in feet.standing:
            sole = self.robot.model.legs[leg].sole
            if sole.kind != "wheel":
                continue
            body = self.robot.slices[leg].stop
            R_site_foot = T_site_base[:3, :3] @ where.Ts_base_body[body, :3, :3] @ self.robot.foot_turns[leg]
            lean = float(np.arcsin(np.clip(abs(feet.normals[leg] @ R_site_foot @ sole.axis), 0.0, 1.0)))
            off = sole.radius * (1 - np.cos(lean))
            spare = DISC_OFF * sole.radius - off
            if spare < least:
                least, which = spare, self.robot.leg_names[leg]
        return float(least), which

    def _support(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        com = apply(T_site_base, where.com)
        conservative = self.settings.conservative and len(feet.standing) == len(self.robot.legs)
        spare = margin(feet.contacts[list(feet.standing)], com[:2], conservative)
        return spare - self.settings.least_margin * self.robot.length, f"{len(feet.standing)} feet"

    def _ground(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        lowest = self.surfaces.lowest(self.dem, where, T_site_base)
        name = "no body" if lowest.body < 0 else self.robot.body_names[lowest.body]
        at = f"{name} at ({lowest.place[0]:z.2f}, {lowest.place[1]:z.2f}) m"
        return min(lowest.height, 2 * self.surfaces.clearance) - self.surfaces.clearance, at

    def _foot(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        """Feet in the air are not in the ground."""
        least, which = np.inf, "none in the air"
        for leg in self.robot.legs:
            if leg in feet.standing:
                continue
            center = apply(T_site_base, where.soles[leg])
            over = float(center[2] - rest_heights(self.dem, center[None, :2], float(self.robot.radii[leg]))[0])
            if not over + SCRAPE >= least:
                least, which = over + SCRAPE, self.robot.leg_names[leg]
        return least, which

    def _self(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        if not len(self.apart.pairs):
            return np.inf, "no pair"
        spare, at = self.apart.nearest(where.Ts_base_body)
        return spare, self.apart.pair_names(at)

    def _effort(self, q: Array, T_site_base: Array, feet: Feet, where: Placed) -> tuple[float, str]:
        standing = list(feet.standing)
        ratio = effort_ratio(self.robot, q, T_site_base, standing, feet.contacts[standing], feet.normals[standing])
        return self.settings.most_effort - ratio, "nothing holds it" if np.isinf(ratio) else "largest share of a limit"


class Tally:
    """The least margin of each check over many configurations that held, and what refused others.

    Of what refused also how often, and by how little at best.
    """

    def __init__(self) -> None:
        self.least: dict[str, Margin] = {}
        self.refused: dict[str, int] = {}
        self.nearest: dict[str, tuple[float, str]] = {}

    def take(self, margins: dict[str, Margin], when: str) -> None:
        """Keeps the least margin of each check of one configuration that held; ``when`` is told with it."""
        for name, left in margins.items():
            if name not in self.least or left.size < self.least[name].size:
                self.least[name] = left._replace(where=f"{when}: {left.where}")

    def merge(self, other: "Tally") -> None:
        """Keeps the least margins of another tally, too; what refused there is not taken over."""
        for name, left in other.least.items():
            if name not in self.least or left.size < self.least[name].size:
                self.least[name] = left

    def refuse(self, refusal: Refusal) -> None:
        """Counts what refused one configuration, and keeps by how little at best."""
        self.refused[refusal.name] = self.refused.get(refusal.name, 0) + 1
        kept = self.nearest.get(refusal.name)
        if kept is None or refusal.margin > kept[0] or np.isnan(kept[0]):
            self.nearest[refusal.name] = refusal.margin, refusal.where

    def checks(self) -> tuple[Check, ...]:
        """The checks that held, each with its least margin; NaN where it is not finite."""
        return tuple(
            Check(name, True, one.size if np.isfinite(one.size) else float("nan"), one.unit, one.where)
            for name, one in self.least.items()
        )

    def most_refused(self) -> tuple[tuple[str, int], ...]:
        """What refused, and how often, the most frequent first."""
        return tuple(sorted(self.refused.items(), key=lambda one: (-one[1], one[0])))
