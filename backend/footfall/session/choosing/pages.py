"""What each page has chosen: what it looks at, its footfall, its points. What one page chooses is no other's choice.

A page begins with what was chosen last by anybody. Who names no page, as a script does, chooses for every page.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from footfall.core.errors import InvalidInput
from footfall.planning.step.problem import Footfall
from footfall.session.log.fold import SessionState
from footfall.session.log.fold_choices import alike
from footfall.session.log.records import LeadPoints
from footfall.session.view import ViewState

MOST_PAGES = 200
"""Of more, the page that was asked about longest ago begins anew."""


@dataclass(frozen=True)
class Choices:
    """footfall, points: None where none were chosen."""

    view: ViewState = field(default_factory=ViewState)
    footfall: Footfall | None = None
    points: LeadPoints | None = None

    def turned(self, before: SessionState, after: SessionState) -> "Choices":
        """After something was taken back, or made again: that where it is these choices', else what they were."""
        mine = [name for name in ("footfall", "points") if alike(getattr(self, name), getattr(before, name))]
        return replace(self, **{name: getattr(after, name) for name in mine})


class Pages:
    """The choices of every page, by its seat (:attr:`Identity.seat`); "" is the seat of who names no page.

    Thread-safe.
    """

    def __init__(self, first: Choices) -> None:
        self._lock = threading.Lock()
        self._latest = first
        self._own: OrderedDict[str, Choices] = OrderedDict()

    def of(self, seat: str, follows: bool = False) -> Choices:
        """A page's own choices; of "", what was chosen last. follows: whether a page that is new follows the conn."""
        with self._lock:
            return self._of(seat, follows)

    def follow(self, seat: str, follows: bool) -> None:
        """Whether a page shows what the holder of the conn shows; its own choices wait. Raises InvalidInput."""
        if not seat:
            raise InvalidInput("who names no page (FootFall-Page) chooses for every page, and follows none")
        with self._lock:
            own = self._of(seat)
            self._own[seat] = replace(own, view=replace(own.view, follows=follows))

    def change(self, seat: str, make: Callable[[Choices], Choices]) -> None:
        """``make`` other choices out of a page's, or, for "", out of those of each. What it raises changes nothing."""
        with self._lock:
            latest = make(self._of(seat))
            made = {seat: latest} if seat else {one: make(own) for one, own in self._own.items()}
            self._own.update(made)
            self._latest = replace(latest, view=replace(latest.view, follows=False))

    def _of(self, seat: str, follows: bool = False) -> Choices:
        if not seat:
            return self._latest
        if seat not in self._own:
            self._own[seat] = replace(self._latest, view=replace(self._latest.view, follows=follows))
            if len(self._own) > MOST_PAGES:
                self._own.popitem(last=False)
        self._own.move_to_end(seat)
        return self._own[seat]
