"""What is chosen and looked at on each page, points for the wheel, and taking choices back or making them again."""

from collections.abc import Callable
from collections.abc import Sequence as Listed
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from footfall.core.errors import Conflict, InvalidInput
from footfall.planning.step.problem import MOST_THROUGH, Footfall, Point
from footfall.session.access.acting import actor
from footfall.session.access.identity import Identity, Role
from footfall.session.answers.choices import Undoable
from footfall.session.choosing.pages import Choices, Pages
from footfall.session.core import SessionCore
from footfall.session.log.fold_choices import Choice
from footfall.session.view import ViewState


class PageChoices:
    """What is chosen and looked at on each page, and taking that back; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    def __init__(self, core: SessionCore, conn_seat: Callable[[], str]) -> None:
        """conn_seat: of the page that holds the conn; "" where none does."""
        self._core, self._conn_seat = core, conn_seat
        chosen = core.state.footfall
        view = ViewState() if chosen is None else ViewState(leg=chosen.leg)
        self._pages = Pages(Choices(view, chosen, core.state.points))

    @property
    def now(self) -> Choices:
        """What is chosen on the page that acts; what was chosen last, where no page acts."""
        return self.of(actor())

    @property
    def view(self) -> ViewState:
        """What is looked at on the page that acts; as :attr:`now`."""
        return self.now.view

    def of(self, who: Identity | None) -> Choices:
        """What a page shows: its own choices, or where it follows, those of the holder of the conn.

        Where nobody holds that, or a program that names no page: what was chosen last. Viewers can't choose, so they
        begin by following.
        """
        own = self._own_choices(who)
        if not own.view.follows:
            return own
        shown = self._pages.of(self._conn_seat())
        return replace(shown, view=replace(shown.view, follows=True))

    def footfall_for(self, leg: int | None, target: tuple[float, float] | None) -> Footfall:
        """Where that leg is to step: at ``target`` (x, y) [m]; without one, the footfall chosen on the page that
        acts, of whichever leg where ``leg`` is None.

        Raises:
            Conflict: no footfall is chosen for that leg.
            InvalidInput: a target without a leg.
        """
        if target is not None:
            if leg is None:
                raise InvalidInput("a target needs the leg that is to step there")
            return Footfall(leg, float(target[0]), float(target[1]))
        chosen = self.now.footfall
        if chosen is None or (leg is not None and chosen.leg != leg):
            raise Conflict("no footfall is chosen for this leg; choose one, or give a target")
        return chosen

    def concerns(self, who: Identity, changed: str) -> bool:
        """Whether a page shows something else since those of the seat ``changed`` ("": of every one) are others."""
        if not who.seat or changed in ("", who.seat):
            return True
        return self._own_choices(who).view.follows and self._conn_seat() in ("", changed)

    def set_view(self, **changes: Any) -> ViewState:
        """Change fields of the view of the page that acts; see :meth:`footfall.session.view.ViewState.changed`.

        follows: whether it shows what the holder of the conn shows. Raises InvalidInput; Conflict where it does.
        """
        if "leg" in changes:
            self._core.require_leg(changes["leg"])
        follows = changes.pop("follows", None)
        with self._core.folded_log.lock:
            if follows is not None:
                self._pages.follow(self._seat(), follows)
            if changes:
                latest = len(self._core.events()) - 1
                self.change(lambda own: replace(own, view=own.view.changed(latest, **changes)))
            else:
                self._tell_choices()
            return self.view

    def change(self, make: Callable[[Choices], Choices]) -> None:
        """Other choices on the page that acts. Raises Conflict where it does not show its own."""
        with self._core.folded_log.lock:
            self.require_own()
            self._pages.change(self._seat(), make)
            self._tell_choices()

    def _tell_choices(self) -> None:
        self._core.folded_log.tell("view", view=asdict(self.view), seat=self._seat())

    def tell_missed(self) -> None:
        """Let the page that acts hear that its click met no ground; no other page does."""
        missed = {"terrain": self._core.state.dem is not None}
        self._core.folded_log.tell("missed", missed=missed, seat=self._seat())

    def require_own(self) -> None:
        """What is chosen is chosen of what is in sight. Raises Conflict where that is another page's."""
        if self._own_choices(actor()).view.follows and self._conn_seat() != self._seat():
            raise Conflict(
                "this page shows what the holder of the conn shows: let it show its own choices, and then choose"
            )

    def _own_choices(self, who: Identity | None) -> Choices:
        return self._pages.of(_seat_of(who), follows=who is not None and who.role is Role.VIEWER)

    def _seat(self) -> str:
        return _seat_of(actor())

    def set_points(self, leg: int, points: Listed[Point]) -> None:
        """Points that the wheel's centre of ``leg`` is to pass in its swing, in their order, site frame [m].

        Nothing is planned yet. Raises InvalidInput.
        """
        self._core.require_leg(leg)
        asked = np.asarray(points, float).reshape(-1, 3) if len(points) else np.zeros((0, 3))
        if len(asked) > MOST_THROUGH or not np.isfinite(asked).all():
            raise InvalidInput(f"a swing passes at most {MOST_THROUGH} points of three finite coordinates [m]")
        with self._core.folded_log.lock:
            self.require_own()
            now = self.now.points
            if now is None or (now.leg, now.points) != (leg, tuple(map(tuple, asked.tolist()))):
                self._core.folded_log.record("points_set", {"leg": leg, "points": asked.tolist()})
                points_now = self._core.state.points
                self.change(lambda own: replace(own, points=points_now))

    @property
    def undoable(self) -> Undoable:
        """What ``undo`` and ``redo`` would turn, as plain JSON; None: nothing."""
        state = self._core.state
        undo, redo = state.choices[-1:], state.choices_ahead[-1:]
        return {"undo": undo[0].as_dict() if undo else None, "redo": redo[0].as_dict() if redo else None}

    def undo(self, seq: int | None = None) -> Choice:
        """Take back the latest choice of a footfall, plan or point, or the latest edit; returns it.

        seq: the choice that is meant, by the number of its event; None: the latest, whichever it is. Raises Conflict
        where there is none, or another came since.
        """
        return self._turn("choice_undone", seq)

    def redo(self, seq: int | None = None) -> Choice:
        """Make the choice again that was taken back last; as :meth:`undo`."""
        return self._turn("choice_redone", seq)

    def _turn(self, event: str, seq: int | None) -> Choice:
        with self._core.folded_log.lock:
            self.require_own()
            back = event == "choice_undone"
            found = self._core.state.choices if back else self._core.state.choices_ahead
            if not found:
                raise Conflict("there is nothing to undo" if back else "there is nothing to redo")
            last = found[-1]
            if seq not in (None, last.seq):
                raise Conflict(
                    "something else was chosen or taken back since: look at what it was before you go on",
                    yours=seq,
                    present=last.seq,
                )
            leg = {} if last.leg is None else {"leg": last.leg}
            before = self._core.state
            self._core.folded_log.record(event, {"choice": last.seq, "kind": last.kind, **leg})
            after = self._core.state
            if last.kind in ("footfall", "points"):
                self.change(lambda own: own.turned(before, after))
            return last


def _seat_of(who: Identity | None) -> str:
    return "" if who is None else who.seat
