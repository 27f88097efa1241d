"""What an operator has in hand: the footfall, a point for the wheel, or the chassis, moved about before it is chosen.

While it is moved, everybody hears where it is and what is to be said of that place; nothing is logged. Committing makes
it the choice, by the same way as any other: one event, which can be undone.
"""

import math
from dataclasses import dataclass, replace

from footfall.core.errors import Conflict, FootFallError, InvalidInput
from footfall.maps.layers import MapStack
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.step.problem import Footfall, Point
from footfall.session.access.acting import actor
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.answers.choices import HeldAnswer, ReadOutAnswer, What
from footfall.session.choosing.choices import PageChoices
from footfall.session.choosing.read_outs import UNREAD, Hip, from_hip, read_chassis, read_footfall, read_point
from footfall.session.core import SessionCore, present
from footfall.session.products.compared import UpToDate
from footfall.session.products.maps import LegMaps
from footfall.session.products.stances import Stances
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

COUNTS = {"footfall": 2, "point": 3, "chassis": 6}
"""What can be held, and how many numbers place it: x, y; x, y, z [m]; a shift from how the rover stands (BodyShift)."""

UNMOVED = 1e-6
"""A chassis that is shifted by less stands as the rover does [m, rad]."""


@dataclass(frozen=True)
class Held:
    """What one operator holds.

    leg: whose footfall or point; index: of the point; origin: where it was taken up; refused: why it could not be
    chosen where it was let go, "" where it could or was not tried; stance: how the rover would stand with the chassis
    there, the latest that can be; None for all else.
    """

    what: What
    index: int
    leg: int | None
    origin: tuple[float, ...]
    place: tuple[float, ...]
    by: Identity
    read: ReadOutAnswer
    refused: str = ""
    stance: RobotState | None = None

    def as_dict(self) -> HeldAnswer:
        """Plain JSON."""
        return {
            "what": self.what,
            "index": self.index,
            "leg": self.leg,
            "place": list(self.place),
            "moved": self.place != self.origin,
            "by": self.by.as_dict(),
            "read": self.read,
            "refused": self.refused,
        }


class Hand:
    """What is moved by hand. One thing is held at a time; who takes another up has it.

    Thread-safe as :class:`footfall.session.core.SessionCore` says.
    """

    _held: Held | None = None

    def __init__(
        self, core: SessionCore, choices: PageChoices, fits: UpToDate, stances: Stances, maps: LegMaps
    ) -> None:
        self._core, self._choices, self._fits, self._stances, self._maps = core, choices, fits, stances, maps

    @property
    def held(self) -> Held | None:
        """What is in hand; None: nothing. What was chosen otherwise, undone or removed meanwhile is as it is now."""
        return self._present_hand()

    def as_dict(self) -> HeldAnswer | None:
        """What is in hand, as plain JSON; None: nothing."""
        held = self._present_hand()
        return None if held is None else held.as_dict()

    def hold(self, what: What, place: tuple[float, ...] | None = None, index: int = 0) -> HeldAnswer:
        """Take something up, and move it to ``place`` (None: it stays where it is); what is told there.

        index: of the point. Raises Conflict where there is no such thing, InvalidInput.
        """
        if what not in COUNTS:
            raise InvalidInput(f"what can be held is {', '.join(COUNTS)}", what=what)
        if place is not None and (len(place) != COUNTS[what] or not all(map(math.isfinite, place))):
            raise InvalidInput(f"the place of a {what} is {COUNTS[what]} finite numbers", place=list(place))
        self._choices.require_own()
        who = actor() or LOCAL
        leg, origin = self._thing(what, index, who)
        at = origin if place is None else tuple(float(one) for one in place)
        before = self._held
        stance = before.stance if before is not None and before.what == what else None
        return self._have(self._with_read_out(Held(what, index, leg, origin, at, who, UNREAD, stance=stance)))

    def commit(self) -> HeldAnswer:
        """What is in hand becomes the choice, and stays in hand; where it is refused, it goes back to where it was.

        Raises Conflict where nothing is held, or by somebody else; InvalidInput where the feet can't stay.
        """
        held = self._mine()
        try:
            if held.place != held.origin:
                self._choose(held)
        except FootFallError as err:
            self._have(self._with_read_out(replace(held, place=held.origin, refused=err.message)))
            raise
        return self.hold(held.what, None, held.index)

    def put_down(self) -> None:
        """Nothing is in hand any more; what was moved and not committed is where it was. Raises Conflict."""
        if self._present_hand() is not None:
            self._mine()
        with self._core.folded_log.lock:
            self._held = None
            self._core.folded_log.tell("hand", hand=None)

    def _have(self, held: Held) -> HeldAnswer:
        answer = held.as_dict()
        with self._core.folded_log.lock:
            self._held = held
            self._core.folded_log.tell("hand", hand=answer)
        return answer

    def _mine(self) -> Held:
        held = self._present_hand()
        if held is None:
            raise Conflict("nothing is in hand: take up the footfall, a point or the chassis first")
        who = actor() or LOCAL
        # what each of two pages chose is its own; one that says no name may be either
        if held.by.name != who.name or (held.by.seat and who.seat and held.by.seat != who.seat):
            raise Conflict(f"{held.by.name} has taken it in hand since; take it up again to move it", by=held.by.name)
        return held

    def _present_hand(self) -> Held | None:
        """What is held, as it is by now: it may have been chosen anew, undone or removed by somebody."""
        with self._core.folded_log.lock:
            held = self._held
        if held is None:
            return None
        try:
            leg, origin = self._thing(held.what, held.index, held.by)
        except Conflict:
            return None
        if (leg, origin) == (held.leg, held.origin):
            return held
        now = self._with_read_out(replace(held, leg=leg, origin=origin, place=origin, refused="", stance=None))
        with self._core.folded_log.lock:
            if self._held is held:
                self._held = now
        return now

    def _thing(self, what: What, index: int, who: Identity) -> tuple[int | None, tuple[float, ...]]:
        """Of which leg it is that ``who`` chose, and where. Raises Conflict where there is none."""
        chosen = self._choices.of(who)
        if what == "footfall":
            if chosen.footfall is None:
                raise Conflict("there is no chosen footfall to move: choose one first")
            return chosen.footfall.leg, (chosen.footfall.x, chosen.footfall.y)
        if what == "point":
            points = () if chosen.points is None else chosen.points.points
            if chosen.points is None or not 0 <= index < len(points):
                raise Conflict(f"there is no point {index + 1} for the wheel to pass", points=len(points))
            return chosen.points.leg, points[index]
        now = self._core.typed(RobotState, self._stances.ground()["state"])
        return None, tuple(BodyShift.between(self._stands().T_site_base, now.T_site_base).vector.tolist())

    def _stands(self) -> RobotState:
        return self._core.typed(RobotState, self._stances.standing()["state"])

    def _choose(self, held: Held) -> None:
        if held.what == "footfall" and held.leg is not None:
            self._maps.choose_footfall(held.leg, *held.place)
        elif held.what == "point" and (chosen := self._choices.now.points) is not None:
            points: list[Point] = list(chosen.points)
            points[held.index] = _point(held.place)
            self._choices.set_points(chosen.leg, points)
        elif max(map(abs, held.place)) > UNMOVED:
            self._stances.what_if(BodyShift(*held.place))
        elif self._core.state.what_if is not None:
            self._stances.end_what_if()

    def _with_read_out(self, held: Held) -> Held:
        """With what is to be said of its place."""
        dem = self._core.typed(Dem, present(self._core.state.dem, "there is no terrain yet"))
        if held.leg is None:
            # names what computes only when the chassis is in hand
            from footfall.planning.body.shift import shifted_state

            shift = BodyShift(*held.place)
            found = shifted_state(self._core.robot, dem, self._stands(), shift)
            stance = found if isinstance(found, RobotState) else held.stance
            return replace(held, read=read_chassis(shift, found), stance=stance)
        return replace(held, read=self._read(dem, held, held.leg))

    def _read(self, dem: Dem, held: Held, leg: int) -> ReadOutAnswer:
        place, away = held.place, math.dist(held.place, held.origin)
        if held.what == "point":
            point = _point(place)
            return read_point(dem, self._core.robot.wheel_radius, held.index, point, away, self._from_hip(leg, point))
        answer = self._maps.footfall_answer(Footfall(leg, place[0], place[1]))
        contact = None if answer["z"] is None else (answer["x"], answer["y"], answer["z"])
        hip = None if contact is None else self._from_hip(leg, contact)
        return read_footfall(answer, self._lines(leg, place[0], place[1]), away, hip)

    def _from_hip(self, leg: int, point: Point) -> Hip | None:
        state = self._core.state.state
        if state is None or self._core.described is not None:  # where legs of others begin is said nowhere
            return None
        return from_hip(self._core.robot, self._core.typed(RobotState, state), leg, point)

    def _lines(self, leg: int, x: float, y: float) -> tuple[str, ...]:
        """What every layer says there; nothing without current maps of it, nor for robots that others described."""
        state = self._core.state
        if self._core.described is not None or not self._fits.of_maps(leg).usable or self._maps.doubt(leg, x, y):
            return ()
        maps = self._core.typed(MapStack, state.maps[str(leg)])
        return self._maps.explain(maps, x, y).lines if maps.geometry.contains(x, y) else ()


def _point(place: tuple[float, ...]) -> Point:
    x, y, z = place
    return x, y, z
