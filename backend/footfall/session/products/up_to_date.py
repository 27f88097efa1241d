"""Whether what was made is still so: what it was made for, against how things are now. The one place that says.

What is judged cell by cell (maps, and a what-if) holds while nothing moved by more than a measurement may be off. What
is there to be sent holds within what the command gate accepts. Newer ground leaves a product as it is where all that
it looked at is as it was; commands are of one map and no other, as the gate has it. In doubt nothing holds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import pose_difference
from footfall.robot.tolerance import JOINT_TOLERANCE
from footfall.session.answers.fits import FitAnswer, UpToDateAnswer
from footfall.session.gate.checks import (
    POSE_TOLERANCE,
    START_TOLERANCE,
    WEIGHT_TOLERANCE,
    worst_joint,
)
from footfall.session.products.kinds import WHAT_IF, Kind, LooksAt
from footfall.telemetry.joint_layout import joint_in_words
from footfall.telemetry.state import RobotState
from footfall.terrain.fusion.on_map import OnMap

PLACE_TOLERANCE = 0.005
"""A chassis whose points, one metre from its origin, moved by less is measured to stand where it was [m]."""

MEASURED = JOINT_TOLERANCE, PLACE_TOLERANCE
SENT = START_TOLERANCE, POSE_TOLERANCE
"""Largest difference of a joint [rad] and of the chassis [m] within which something is as it was."""

LEAST_NAMED = 0.005
"""Smaller changes of height would be told as none [m]."""


@dataclass(frozen=True)
class StandingDifference:
    """By how much the rover stands otherwise than it did: the joint that turned farthest [rad], the chassis [m].

    reach: how far from its origin the chassis is compared [m]. slides: whether that joint does, so that its way is [m].
    """

    joint: str
    turned: float
    moved: float
    reach: float = 1.0
    slides: bool = False

    def beyond(self, joint: float, place: float) -> str:
        """What moved by more than that: "chassis", "joint" or, as nothing did, "".

        place: for one metre of reach, as joint is for one that slides.
        """
        if not self.moved <= place * self.reach:
            return "chassis"
        return "" if abs(self.turned) <= self.allowed(joint) else "joint"

    def allowed(self, joint: float) -> float:
        """How far that joint may be off [rad or m] where so much is allowed one that turns [rad]."""
        return joint * self.reach if self.slides else joint


def difference(
    posture: NDArray[np.float64],
    T_site_base: NDArray[np.float64],
    now: RobotState,
    joint_names: tuple[str, ...],
    reach: float = 1.0,
    sliding: tuple[str, ...] = (),
) -> StandingDifference:
    """Of how the rover stands now from a posture (joints,) and a pose of its chassis (4, 4)."""
    moved = pose_difference(T_site_base, now.T_site_base, reach)
    joint, turned = worst_joint(posture, now, joint_names, reach, sliding)
    return StandingDifference(joint, turned, moved, reach, joint in sliding)


def near_enough_in_words(found: StandingDifference) -> str:
    """Why what is to be sent holds where what is judged cell by cell does not; "" where both do, or neither."""
    if not found.beyond(*MEASURED) or found.beyond(*SENT):
        return ""
    (turn, way), (near_turn, near_way), unit = SENT, MEASURED, "m" if found.slides else "rad"
    return (
        f"the rover stands {found.moved:z.3f} m and {abs(found.turned):z.4f} {unit} from where the plan starts: the "
        f"gate sends plans from within {way * found.reach:.2g} m and {found.allowed(turn):.2g} {unit}; colours hold "
        f"within {near_way * found.reach:.2g} m and {found.allowed(near_turn):.2g} {unit}"
    )


@dataclass(frozen=True)
class OtherGround:
    """How much of the ground that a product looked at is otherwise on a newer map.

    area: of all that changed; turned: of what became known or unknown, of that [m²]. by: largest change of height of
    what is known on both [m]. everywhere: no part of the product holds.
    """

    area: float = 0.0
    turned: float = 0.0
    by: float = 0.0
    everywhere: bool = True

    def in_words(self) -> str:
        """In words, for a reason; "" where nothing changed."""
        if not self.area:
            return ""
        height = f"by up to {self.by:z.2f} m " if self.by >= LEAST_NAMED else ""
        turned = f", of which {self.turned:z.2f} m² became known or unknown" if self.turned else ""
        return f"{height}on {self.area:z.2f} m² that it looked at{turned}"


Verdict = Literal["fresh", "differs", "unknown"]


@dataclass(frozen=True)
class Fit:
    """Whether a product is of how things are now, as far as they are known, and in words why not.

    heard: whether the rover was heard lately; else it may have moved. ground: what is otherwise where it looked; None
    where it is of the present map, or can't be compared. partly: what it says holds in part, where the ground does.
    """

    fits: bool
    reason: str = ""
    heard: bool = True
    ground: OtherGround | None = None
    partly: bool = False

    @property
    def usable(self) -> bool:
        """Whether it holds, at least in part."""
        return self.fits or self.partly

    @property
    def verdict(self) -> Verdict:
        """Fresh; differs from how things are; unknown: nothing that is known differs, and the rover is not heard."""
        if not self.fits:
            return "differs"
        return "fresh" if self.heard else "unknown"

    def as_dict(self) -> FitAnswer:
        """Plain JSON."""
        return {
            "fits": self.fits,
            "reason": self.reason,
            "verdict": self.verdict,
            "partly": self.partly,
            "ground": None if self.ground is None else {"area": self.ground.area, "by": self.ground.by},
        }


def unfit_of(fits: UpToDateAnswer) -> frozenset[str]:
    """Names of what :meth:`.UpToDate.up_to_date` says is not of how things are now."""
    each = {**fits["maps"], **{name: one for name, one in fits.items() if isinstance(one, dict) and "fits" in one}}
    return frozenset(name for name, one in each.items() if not one["fits"])


@dataclass(frozen=True)
class Present:
    """How things are now.

    robot, dem: digests. stands: how the rover stands, by its latest telemetry or, without, as it was frozen. what_if:
    what is planned from instead; counts_from: how the rover stood when that was asked. unheard: why nobody knows
    whether the rover still stands so; "" where it was heard lately. measured: by its latest telemetry; None: it sent
    none. reach: how far from its origin the chassis is compared [m]. sliding: joints that slide.
    """

    robot: str | None
    dem: str | None
    stands: RobotState | None
    joint_names: tuple[str, ...]
    what_if: RobotState | None = None
    counts_from: RobotState | None = None
    unheard: str = ""
    measured: OnMap | None = None
    reach: float = 1.0
    sliding: tuple[str, ...] = ()

    def fit(
        self,
        kind: Kind,
        parents: Mapping[str, str],
        made_for: RobotState,
        predicted: bool = False,
        ground: OtherGround | None = None,
    ) -> Fit:
        """Of a product. made_for: the stance that it was made for; predicted: that was one of a what-if. ground: of a
        product of another map what is otherwise where it looked; None: nobody knows.
        """
        if parents.get("robot", self.robot) != self.robot:
            return Fit(False, "it was made for another robot")
        stance = replace(self._stance_fit(kind, made_for, predicted), heard=not self.unheard)
        if parents.get("dem", self.dem) == self.dem:
            return stance
        if ground is None or kind.looks_at is LooksAt.MAP:
            return Fit(False, "the terrain has changed since")
        if not ground.area:
            return replace(stance, ground=ground)
        reason = f"the terrain has changed since: {ground.in_words()}"
        partly = kind.for_cells and stance.fits and not ground.everywhere
        return Fit(False, reason, stance.heard, ground, partly)

    def _stance_fit(self, kind: Kind, made_for: RobotState, predicted: bool) -> Fit:
        if self.stands is None:
            return Fit(False, "nothing is known of how the rover stands")
        tolerance = MEASURED if kind.for_cells else SENT
        # a move may be planned from a predicted end; commands are the rover's, wherever they begin
        from_there = not kind.from_the_rover or (predicted and not kind.is_commands)
        if self.what_if is not None and self.counts_from is not None and from_there:
            there = self._change(made_for, self.what_if, tolerance, kind.of_chassis)
            if not there:
                moved = self._change(self.counts_from, self.stands, MEASURED)
                return Fit(not moved, f"the rover moved since the what-if was asked: {moved}" if moved else "")
            if kind.for_cells:
                return Fit(False, f"it is for another stance than the what-if: {there}")
        change = self._change(made_for, self.stands, tolerance, kind.of_chassis)
        if not change:
            return Fit(True) if kind.for_cells else self._fit_in_doubt(made_for, tolerance, kind.of_chassis)
        if predicted:
            return Fit(False, f"it is for a what-if, and the rover stands elsewhere: {change}")
        return Fit(False, f"the rover moved since: {change}")

    def _fit_in_doubt(self, made_for: RobotState, tolerance: tuple[float, float], of_chassis: bool) -> Fit:
        """Of what fits where the rover is on the map, where images in doubt moved it there."""
        measured = self.measured
        if (
            measured is None
            or not measured.doubt
            or not self._change(made_for, measured.by_odometry, tolerance, of_chassis)
        ):
            return Fit(True)
        return Fit(False, f"it fits on the map alone, not by odometry: {measured.doubt}")

    def what_if_fit(self) -> Fit | None:
        """Of the what-if itself; None where there is none."""
        return None if self.what_if is None or self.counts_from is None else self.fit(WHAT_IF, {}, self.counts_from)

    def _change(
        self, then: RobotState, now: RobotState, tolerance: tuple[float, float], of_chassis: bool = False
    ) -> str:
        """What is otherwise, and by how much; "" where nothing is. of_chassis: nothing else is asked."""
        found = difference(then.posture, then.T_site_base, now, self.joint_names, self.reach, self.sliding)
        what = found.beyond(*tolerance)
        if what == "chassis":
            return f"its chassis by {found.moved:z.3f} m"
        if of_chassis:
            return ""
        if what == "joint":
            if found.slides:
                return f"{joint_in_words(found.joint)} by {found.turned:+z.4f} m"
            return f"{joint_in_words(found.joint)} by {np.degrees(found.turned):+z.2f}°"
        before, bears = (float(np.linalg.norm(one.wheel_forces.sum(axis=0))) for one in (then, now))
        if before > 0.0 and bears > 0.0 and not abs(bears / before - 1.0) <= WEIGHT_TOLERANCE:
            return f"its wheels bear {bears:z.0f} N, {bears / before - 1.0:+.0%}"
        return ""
