"""Choices of a session: points for the wheel, and taking back what was chosen, or making it again."""

from collections.abc import Sequence as Listed
from dataclasses import replace
from typing import Any

import numpy as np

from footfall.core.errors import Conflict, InvalidInput
from footfall.planning.step.problem import MOST_THROUGH, Point
from footfall.session.log.fold_choices import Choice
from footfall.session.products.plans import PlanSession


class ChoiceSession(PlanSession):
    """The part of a session that chooses and takes back; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    def set_points(self, leg: int, points: Listed[Point]) -> None:
        """Points that the wheel's centre of ``leg`` is to pass in its swing, in their order, site frame [m].

        Nothing is planned yet. Raises InvalidInput.
        """
        self._require_leg(leg)
        asked = np.asarray(points, float).reshape(-1, 3) if len(points) else np.zeros((0, 3))
        if len(asked) > MOST_THROUGH or not np.isfinite(asked).all():
            raise InvalidInput(f"a swing passes at most {MOST_THROUGH} points of three finite coordinates [m]")
        with self._journal.lock:
            self._require_own()
            now = self.choices.points
            if now is None or (now.leg, now.points) != (leg, tuple(map(tuple, asked.tolist()))):
                self._journal.record("points_set", {"leg": leg, "points": asked.tolist()})
                points_now = self.state.points
                self._change_choices(lambda own: replace(own, points=points_now))

    @property
    def undoable(self) -> dict[str, dict[str, Any] | None]:
        """What ``undo`` and ``redo`` would turn, as plain JSON; None: nothing."""
        state = self.state
        latest = {"undo": state.choices[-1:], "redo": state.choices_ahead[-1:]}
        return {way: found[0].as_dict() if found else None for way, found in latest.items()}

    def undo_choice(self, seq: int | None = None) -> Choice:
        """Take back the latest choice of a footfall, plan or point, or the latest edit; returns it.

        seq: the choice that is meant, by the number of its event; None: the latest, whichever it is. Raises Conflict
        where there is none, or another came since.
        """
        return self._turn("choice_undone", seq)

    def redo_choice(self, seq: int | None = None) -> Choice:
        """Make the choice again that was taken back last; as :meth:`undo_choice`."""
        return self._turn("choice_redone", seq)

    def _turn(self, event: str, seq: int | None) -> Choice:
        with self._journal.lock:
            self._require_own()
            back = event == "choice_undone"
            found = self.state.choices if back else self.state.choices_ahead
            if not found:
                raise Conflict("there is nothing to undo" if back else "there is nothing to make again")
            last = found[-1]
            if seq not in (None, last.seq):
                raise Conflict(
                    "something else was chosen or taken back since: look at what it was before you go on",
                    yours=seq,
                    present=last.seq,
                )
            leg = {} if last.leg is None else {"leg": last.leg}
            before = self.state
            self._journal.record(event, {"choice": last.seq, "kind": last.kind, **leg})
            after = self.state
            if last.kind in ("footfall", "points"):
                self._change_choices(lambda own: own.turned(before, after))
            return last
