"""The session's products against how things are now: what each was made for is read, and asked of the one law."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from footfall.maps.layers import MapStack
from footfall.planning.body.body_shift import PredictedState
from footfall.sequence.commands import Sequence
from footfall.session.answers.fits import UpToDateAnswer
from footfall.session.core import SessionCore
from footfall.session.gate.checks import STALE_AFTER, UNHEARD_SINCE
from footfall.session.products.kinds import KINDS, Kind, LooksAt
from footfall.session.products.remembered import looks_behind
from footfall.session.products.up_to_date import Fit, OtherGround, Present
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import Looks, OnMap, place_on_map

if TYPE_CHECKING:
    from footfall.terrain.ground.changed import GroundChange, Mask

MOST_STANCES = 64
"""Stances, and grounds compared, that are kept at hand, as every telemetry frame asks for them."""


@dataclass(frozen=True, eq=False)
class ComparedGround:
    """What is otherwise where a product looked. spoiled: cells of maps (rows, cols) that it may have made wrong."""

    ground: OtherGround
    spoiled: "Mask | None" = None


class UpToDate:
    """Which products of a session are of how things are now; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    def __init__(self, core: SessionCore, rover: LinkedRover) -> None:
        self._core, self._rover = core, rover
        self._known_stances: dict[str, RobotState] = {}
        self._looks: tuple[str, Looks | None] | None = None
        self._newer_grounds: dict[tuple[str, str], ComparedGround | None] = {}
        self._latest_change: tuple[tuple[str, str], GroundChange | None] = ("", ""), None

    def measured(self) -> OnMap | None:
        """Where the rover stands by its latest telemetry; None where it sent none."""
        frame = self._rover.frame
        return None if frame is None else self.place_on_map(frame.state)

    def unheard(self) -> str:
        """Why nobody knows whether the rover still stands so; "" where it was heard lately."""
        age = self._rover.link.age
        if age is None:
            return "the rover has sent no telemetry yet"
        if self._rover.link.connected and self._rover.link.age_since_connected is None:
            return UNHEARD_SINCE
        if self._rover.link.connected and age <= STALE_AFTER:
            return ""
        return f"the rover was last heard {age:z.0f} s ago"

    def things_now(self) -> Present:
        """What products are compared with."""
        state = self._core.state
        frozen = state.what_if or state.state
        measured = self.measured()
        stands = measured.state if measured is not None else None if frozen is None else self.stance(frozen)
        layout, unheard, reach = self._core.layout, self.unheard(), self._core.reach
        names, sliding = layout.joint_names, layout.sliding
        if state.what_if is None or state.state is None:
            return Present(state.robot, state.dem, stands, names, None, None, unheard, measured, reach, sliding)
        what_if, counts_from = self.stance(state.state), self.stance(state.what_if)
        return Present(state.robot, state.dem, stands, names, what_if, counts_from, unheard, measured, reach, sliding)

    def of_maps(self, leg: int) -> Fit:
        """Whether the latest maps of a leg are of the present terrain and stance."""
        digest = self._core.state.maps.get(str(leg))
        return Fit(False, f"there are no maps of leg {leg} yet") if digest is None else self.of(digest)

    def of(self, digest: str, now: Present | None = None) -> Fit:
        """Whether a product of the session is of how things are ``now``."""
        made = self._core.state.products[digest]
        return self.of_made(KINDS[made.kind], made.parents, digest, now)

    def of_made(self, kind: Kind, parents: Mapping[str, str], digest: str = "", now: Present | None = None) -> Fit:
        """As :meth:`of`, also of what is being made still. digest: of what is made; "" is of no other map."""
        stance = digest if kind.is_commands else parents["state"]
        made_for, present = self.stance(stance), now or self.things_now()
        compared = self._against_newer(kind, digest, present.dem, made_for)
        ground = None if compared is None else compared.ground
        return present.fit(kind, parents, made_for, isinstance(made_for, PredictedState), ground)

    def ground_holds(self, digest: str) -> bool:
        """Whether the ground that a product of the session looked at is as it was then, wherever the rover stands."""
        made, dem = self._core.state.products[digest], self._core.state.dem
        if made.parents.get("dem") == dem:
            return True
        compared = self._against_newer(KINDS[made.kind], digest, dem, self.stance(made.parents["state"]))
        return compared is not None and not compared.ground.area

    def maps_changed(self, leg: int, layer: str = "") -> "Mask | None":
        """Cells of the latest maps of a leg, (rows, cols), for whose ``layer`` newer ground has other values; None
        where there are none, or none hold.
        """
        digest, dem = self._core.state.maps.get(str(leg)), self._core.state.dem
        if digest is None or dem is None or self._core.state.products[digest].parents["dem"] == dem:
            return None
        from footfall.session.products.looked_at import REMEMBERED

        maps, made_for = (
            self._core.typed(MapStack, digest),
            self.stance(self._core.state.products[digest].parents["state"]),
        )
        compared = self._against_newer(KINDS[self._core.state.products[digest].kind], digest, dem, made_for)
        if compared is None or not self.of(digest).usable:
            return None
        if layer in REMEMBERED or compared.spoiled is None:
            return np.ones(maps.geometry.shape, bool)
        return compared.spoiled if compared.spoiled.any() else None

    def _against_newer(self, kind: Kind, digest: str, now: str | None, made_for: RobotState) -> ComparedGround | None:
        """A product on the ground that is there ``now``; None where it is of that, or that is not asked, or can't be
        told.
        """
        made = self._core.state.products.get(digest)
        then = None if made is None else made.parents.get("dem")
        if then is None or now is None or then == now or kind.looks_at is LooksAt.MAP:
            return None
        key = digest, now
        if key not in self._newer_grounds:
            if len(self._newer_grounds) >= MOST_STANCES:
                self._newer_grounds.clear()
            self._newer_grounds[key] = self._judged_anew(kind, digest, then, now, made_for)
        return self._newer_grounds[key]

    def _judged_anew(self, kind: Kind, digest: str, then: str, now: str, made_for: RobotState) -> ComparedGround | None:
        from footfall.session.products.looked_at import discs_of, other_ground, spoiled
        from footfall.terrain.ground.changed import ground_change

        between, change = self._latest_change
        if between != (then, now):
            change = ground_change(*(self._core.typed(Dem, one) for one in (then, now)))
            self._latest_change = (then, now), change
        if change is None:
            return None
        value = self._core.get(digest)
        looked = change.within(discs_of(kind, self._core.robot, made_for, value))
        if not isinstance(value, MapStack):
            return ComparedGround(other_ground(change, looked))
        marked = spoiled(self._core.robot, made_for, value, change)
        if not marked.any():
            return ComparedGround(OtherGround(), marked)
        # maps say something of every cell, also of those that the leg is nowhere near
        looked = looked | change.within_grid(value.geometry)
        changed = looked if looked.any() else change.cells
        return ComparedGround(other_ground(change, changed, bool(marked.all())), marked)

    def up_to_date(self) -> UpToDateAnswer:
        """Of the present products, as plain JSON: kind → whether it fits and why not, None where there is none.

        maps: by leg. measured: whether the rover was asked, not only what was frozen of it; unheard: why nobody knows
        whether it still stands so, "" where that is known.
        """
        state, now = self._core.state, self.things_now()
        latest = {kind.name: state.newest(kind) for kind in KINDS.values() if kind.watched}
        what_if = now.what_if_fit()
        answer = {
            "measured": self.measured() is not None,
            "unheard": now.unheard,
            "what_if": None if what_if is None else what_if.as_dict(),
            "maps": {leg: self.of(digest, now).as_dict() for leg, digest in state.maps.items()},
            **{name: None if one is None else self.of(one, now).as_dict() for name, one in latest.items()},
        }
        return cast(UpToDateAnswer, answer)  # its members of each kind have names that no type can say

    def stance(self, digest: str) -> RobotState:
        """A frozen or predicted state, or where a sequence starts."""
        if digest not in self._known_stances:
            value = self._core.get(digest)
            if isinstance(value, Sequence):
                bears, torques = np.zeros((len(value.layout.legs), 3)), np.zeros(len(value.start))
                stands, named = value.T_site_base, value.described
                value = RobotState(value.robot, 0.0, value.start, stands, bears, torques, "idle", described=named)
            if not isinstance(value, RobotState):
                return self._core.typed(RobotState, digest)  # raises
            if len(self._known_stances) >= MOST_STANCES:
                self._known_stances.clear()
            self._known_stances[digest] = value
            return value
        return self._known_stances[digest]

    def place_on_map(self, by_odometry: RobotState) -> OnMap:
        """Where the present terrain has a rover that tells of itself so."""
        state = self._core.state
        if state.dem is None:
            return place_on_map(by_odometry, None, None)
        dem = self._core.typed(Dem, state.dem)
        if dem.correction is None:
            return place_on_map(by_odometry, dem, None)
        if self._looks is None or self._looks[0] != state.dem:
            self._looks = state.dem, looks_behind(state, self._core.events(), self._core.value_store)
        return place_on_map(by_odometry, dem, self._looks[1])
