"""How long a search may run, and how it hears that the caller wants it to stop."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import TYPE_CHECKING

from footfall.core.progress import Progress, no_progress

if TYPE_CHECKING:
    from numba.core.event import TimingListener

INTERVAL = 0.1
"""Longest pause between two reports to the caller [s], as far as the searches call :meth:`Watch.tick`."""


_patience: ContextVar[float] = ContextVar("patience", default=1.0)


@contextmanager
def patience(times: float) -> Iterator[None]:
    """Searches that begin inside have so many times their time limit; what they are asked for stays as it is.

    A replay needs this: a search or smoothing that ended by itself when it was recorded must not be ended by the clock
    on a machine that is slower, or does more.
    """
    before = _patience.set(times)
    try:
        yield
    finally:
        _patience.reset(before)


def time_taken(begun: float) -> float:
    """Seconds since then, a ``time.monotonic()``, as a time limit counts them: fewer where :func:`patience` is had."""
    return (time.monotonic() - begun) / _patience.get()


@cache
def _compiling() -> "TimingListener":
    """Hears how long this process compiles kernels, from its first plan on."""
    from numba.core import event

    listener = event.TimingListener()
    event.register("numba:compile", listener)
    return listener


def _time_compiling() -> float:
    """Seconds in which kernels were compiled since it first was asked, in whichever thread."""
    heard = _compiling()
    return heard.duration if heard.done else 0.0


class OutOfTime(Exception):
    """The time limit passed; inside planning only, where it becomes the status TIME_LIMIT."""


class OutOfTurn(Exception):
    """The looks of a turn are used up; inside planning only, where another planner has its turn then."""


class Watch:
    """Stop condition of one planning request.

    Searches call :meth:`tick` at every configuration that they check. Cancelled passes through from
    ``progress``; OutOfTime and OutOfTurn are raised here. The limit stops a search, it never steers one: what a
    search does until then depends on its seed alone. Looks are counted, so a turn ends at the same look anywhere. Time
    in which kernels are compiled does not count: the first plan after an installation may have to, for minutes.
    """

    def __init__(self, progress: Progress = no_progress, time_limit: float = float("inf")) -> None:
        self._progress = progress
        self._start = self._last = time.monotonic()
        self._deadline = self._start + _patience.get() * time_limit
        self._compiled = _time_compiling()
        self._fraction, self.text = 0.0, ""
        self._looks = float("inf")

    @property
    def elapsed(self) -> float:
        """Seconds since the request began."""
        return time.monotonic() - self._start

    @contextmanager
    def uncounted(self) -> Iterator[None]:
        """Time that the limit does not count."""
        begin, compiled = time.monotonic(), _time_compiling()
        yield
        self._deadline += time.monotonic() - begin - (_time_compiling() - compiled)

    @contextmanager
    def at_most(self, looks: float) -> Iterator[None]:
        """Raise OutOfTurn at the first look beyond so many."""
        self._looks = looks
        try:
            yield
        finally:
            self._looks = float("inf")

    def lift_limit(self) -> None:
        """The answer is there: what is still said of it is not limited."""
        self._deadline = float("inf")

    def phase(self, fraction: float, text: str) -> None:
        """Report that a new part of the work begins. What is told never falls, also where a part is done again."""
        self._fraction, self.text = max(self._fraction, fraction), text
        self._report(time.monotonic())

    def tick(self, looks: int = 1) -> None:
        """Report if it is time to, and raise OutOfTime past the limit or OutOfTurn past the last look.

        looks: how many have been made, or are about to be, since the last tick.
        """
        self.pulse()
        if time.monotonic() - (_time_compiling() - self._compiled) > self._deadline:
            raise OutOfTime
        self._looks -= looks
        if self._looks < 0:
            raise OutOfTurn

    def pulse(self) -> None:
        """Report if it is time to; for work on a path that is already found, which the limit does not stop."""
        now = time.monotonic()
        if now - self._last > INTERVAL:
            self._report(now)

    def _report(self, now: float) -> None:
        self._last = now
        self._progress(self._fraction, self.text)
