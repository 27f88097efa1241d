"""Whether what was made is still so: what it was made for, against how things are now. The one place that says.

What is judged cell by cell (maps, and a what-if) holds while nothing moved by more than a measurement may be off. What
is there to be sent holds within what the command gate accepts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import pose_difference
from footfall.planning.stance.body_shift import PredictedState
from footfall.robot.tolerance import JOINT_TOLERANCE
from footfall.sequence.commands import Sequence
from footfall.session.gate.checks import (
    POSE_TOLERANCE,
    START_TOLERANCE,
    WEIGHT_TOLERANCE,
    worst_joint,
)
from footfall.session.jobs.pool import JobPool
from footfall.session.products.kinds import KINDS, WHAT_IF, Kind
from footfall.session.products.remembered import looks_behind
from footfall.session.products.terrains import TerrainSession
from footfall.session.storage.store import SessionStore
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import Looks, OnMap, place_on_map

PLACE_TOLERANCE = 0.005
"""A chassis whose points, one metre from its origin, moved by less is measured to stand where it was [m]."""

MEASURED = JOINT_TOLERANCE, PLACE_TOLERANCE
SENT = START_TOLERANCE, POSE_TOLERANCE
"""Largest difference of a joint [rad] and of the chassis [m] within which something is as it was."""

MOST_STANCES = 64
"""Stances kept at hand, as every telemetry frame asks for them."""


@dataclass(frozen=True)
class Difference:
    """By how much the rover stands otherwise than it did: the joint that turned farthest [rad], the chassis [m]."""

    joint: str
    turned: float
    moved: float

    def beyond(self, joint: float, place: float) -> str:
        """What moved by more than that: "chassis", "joint" or, as nothing did, ""."""
        if not self.moved <= place:
            return "chassis"
        return "" if abs(self.turned) <= joint else "joint"


def difference(
    posture: NDArray[np.float64], T_site_base: NDArray[np.float64], now: RobotState, joint_names: tuple[str, ...]
) -> Difference:
    """Of how the rover stands now from a posture (legs × 6,) and a pose of its chassis (4, 4)."""
    return Difference(*worst_joint(posture, now, joint_names), pose_difference(T_site_base, now.T_site_base))


@dataclass(frozen=True)
class Fit:
    """Whether a product is of how things are now, and in words why not."""

    fits: bool
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON."""
        return {"fits": self.fits, "reason": self.reason}


def unfit_of(fits: Mapping[str, Any]) -> frozenset[str]:
    """Names of what :meth:`UpToDateSession.up_to_date` says is not of how things are now."""
    each = {**fits["maps"], **{name: one for name, one in fits.items() if isinstance(one, dict) and "fits" in one}}
    return frozenset(name for name, one in each.items() if not one["fits"])


@dataclass(frozen=True)
class Present:
    """How things are now.

    robot, dem: digests. stands: how the rover stands, by its latest telemetry or, without, as it was frozen. what_if:
    what is planned from instead; counts_from: how the rover stood when that was asked. measured: by its latest
    telemetry; None: it sent none.
    """

    robot: str | None
    dem: str | None
    stands: RobotState | None
    joint_names: tuple[str, ...]
    what_if: RobotState | None = None
    counts_from: RobotState | None = None
    measured: OnMap | None = None

    def fit(self, kind: Kind, parents: Mapping[str, str], made_for: RobotState, predicted: bool = False) -> Fit:
        """Of a product. made_for: the stance that it was made for; predicted: that was one of a what-if."""
        if parents.get("robot", self.robot) != self.robot:
            return Fit(False, "it was made for another robot")
        if parents.get("dem", self.dem) != self.dem:
            return Fit(False, "the terrain has changed since")
        if self.stands is None:
            return Fit(False, "nothing is known of how the rover stands")
        tolerance = MEASURED if kind.for_cells else SENT
        if self.what_if is not None and self.counts_from is not None and not kind.from_the_rover:
            there = self._change(made_for, self.what_if, tolerance)
            if not there:
                moved = self._change(self.counts_from, self.stands, MEASURED)
                return Fit(not moved, f"the rover moved since the what-if was asked: {moved}" if moved else "")
            if kind.for_cells:
                return Fit(False, f"it is for another stance than the what-if: {there}")
        change = self._change(made_for, self.stands, tolerance)
        if not change:
            return Fit(True) if kind.for_cells else self._fit_in_doubt(made_for, tolerance)
        if predicted:
            return Fit(False, f"it is for a what-if, and the rover stands elsewhere: {change}")
        return Fit(False, f"the rover moved since: {change}")

    def _fit_in_doubt(self, made_for: RobotState, tolerance: tuple[float, float]) -> Fit:
        """Of what fits where the rover is on the map, where images in doubt moved it there."""
        measured = self.measured
        if measured is None or not measured.doubt or not self._change(made_for, measured.told, tolerance):
            return Fit(True)
        return Fit(False, f"it fits on the map alone, not by odometry: {measured.doubt}")

    def what_if_fit(self) -> Fit | None:
        """Of the what-if itself; None where there is none."""
        return None if self.what_if is None or self.counts_from is None else self.fit(WHAT_IF, {}, self.counts_from)

    def _change(self, then: RobotState, now: RobotState, tolerance: tuple[float, float]) -> str:
        """What is otherwise, and by how much; "" where nothing is."""
        found = difference(then.posture, then.T_site_base, now, self.joint_names)
        what = found.beyond(*tolerance)
        if what == "chassis":
            return f"its chassis by {found.moved:z.3f} m"
        if what == "joint":
            return f"{found.joint} by {np.degrees(found.turned):+z.2f}°"
        before, bears = (float(np.linalg.norm(one.wheel_forces.sum(axis=0))) for one in (then, now))
        if before > 0.0 and bears > 0.0 and not abs(bears / before - 1.0) <= WEIGHT_TOLERANCE:
            return f"its wheels bear {bears:z.0f} N, {bears / before - 1.0:+.0%}"
        return ""


class UpToDateSession(TerrainSession):
    """The part of a session that knows which of its products are of how things are now; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    def __init__(self, store: SessionStore, jobs: JobPool) -> None:
        super().__init__(store, jobs)
        self._stances: dict[str, RobotState] = {}
        self._looks: tuple[str, Looks | None] | None = None

    def _measured(self) -> OnMap | None:
        """Where the rover stands by its latest telemetry; None where it sent none."""
        return None

    def things_now(self) -> Present:
        """What products are compared with."""
        state = self.state
        frozen = state.what_if or state.state
        measured = self._measured()
        stands = measured.state if measured is not None else None if frozen is None else self._stance(frozen)
        names = self.description.joint_names
        if state.what_if is None or state.state is None:
            return Present(state.robot, state.dem, stands, names, measured=measured)
        what_if, counts_from = self._stance(state.state), self._stance(state.what_if)
        return Present(state.robot, state.dem, stands, names, what_if, counts_from, measured)

    def maps_fit(self, leg: int) -> Fit:
        """Whether the latest maps of a leg are of the present terrain and stance."""
        digest = self.state.maps.get(str(leg))
        return Fit(False, f"there are no maps of leg {leg} yet") if digest is None else self.fit_of(digest)

    def fit_of(self, digest: str, now: Present | None = None) -> Fit:
        """Whether a product of the session is of how things are ``now``."""
        made = self.state.products[digest]
        return self.fit_of_made(KINDS[made.kind], made.parents, digest, now)

    def fit_of_made(self, kind: Kind, parents: Mapping[str, str], digest: str = "", now: Present | None = None) -> Fit:
        """As :meth:`fit_of`, also of what is being made still. digest: of commands, whose start is their own."""
        stance = digest if kind.is_commands else parents["state"]
        made_for = self._stance(stance)
        return (now or self.things_now()).fit(kind, parents, made_for, isinstance(made_for, PredictedState))

    def up_to_date(self) -> dict[str, Any]:
        """Of the present products, as plain JSON: kind → whether it fits and why not, None where there is none.

        maps: by leg. measured: whether the rover was asked, not only what was frozen of it.
        """
        state, now = self.state, self.things_now()
        latest = {kind.name: state.newest(kind) for kind in KINDS.values() if kind.watched}
        what_if = now.what_if_fit()
        return {
            "measured": self._measured() is not None,
            "what_if": None if what_if is None else what_if.as_dict(),
            "maps": {leg: self.fit_of(digest, now).as_dict() for leg, digest in state.maps.items()},
            **{name: None if one is None else self.fit_of(one, now).as_dict() for name, one in latest.items()},
        }

    def _stance(self, digest: str) -> RobotState:
        """A frozen or predicted state, or where a sequence starts."""
        if digest not in self._stances:
            value = self._shelf.get(digest)
            if isinstance(value, Sequence):
                bears, torques = np.zeros((len(value.start) // 6, 3)), np.zeros(len(value.start))
                value = RobotState(value.robot, 0.0, value.start, value.T_site_base, bears, torques, "idle")
            if not isinstance(value, RobotState):
                return self._shelf.typed(RobotState, digest)  # raises
            if len(self._stances) >= MOST_STANCES:
                self._stances.clear()
            self._stances[digest] = value
            return value
        return self._stances[digest]

    def place_on_map(self, told: RobotState) -> OnMap:
        """Where the present terrain has a rover that tells of itself so."""
        state = self.state
        if state.dem is None:
            return place_on_map(told, None, None)
        dem = self._shelf.typed(Dem, state.dem)
        if dem.correction is None:
            return place_on_map(told, dem, None)
        if self._looks is None or self._looks[0] != state.dem:
            self._looks = state.dem, looks_behind(state, self.events(), self._shelf)
        return place_on_map(told, dem, self._looks[1])
