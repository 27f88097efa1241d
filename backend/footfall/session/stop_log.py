"""Writes down who asked for a stop, without letting a stop wait for the disk."""

import threading
from collections.abc import Callable
from contextvars import copy_context

from footfall.session.access.identity import Identity

PATIENCE = 0.25
"""A stop is answered after this long though its record is not written yet [s]."""
ASKED_AT_MOST = 16
"""So many pages and programs are written down that asked for one stop: no flood of them fills the log."""


class StopLog:
    """Threads that write what is told of stops, and who asked for the stop that is in force."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._asked: list[Identity] = []
        self._writers: list[threading.Thread] = []

    def is_news(self, who: Identity, first: bool) -> bool:
        """Whether ``who`` has not asked for the stop in force before, which is to be written down, once.

        first: this set the stop.
        """
        with self._guard:
            if first:
                self._asked = [who]
                return True
            if len(self._asked) >= ASKED_AT_MOST or any(who.is_same(other) for other in self._asked):
                return False
            self._asked.append(who)
            return True

    def write(self, work: Callable[[], None]) -> None:
        """Do ``work``, and wait for it no longer than PATIENCE."""
        writer = threading.Thread(target=copy_context().run, args=(work,), name="footfall-stop-log", daemon=True)
        try:
            writer.start()
        except RuntimeError:  # no thread can be started
            work()
            return
        with self._guard:
            self._writers = [*(one for one in self._writers if one.is_alive()), writer]
        writer.join(PATIENCE)

    def close(self) -> None:
        """Wait for what is still being written."""
        with self._guard:
            writers = [one for one in self._writers if one is not threading.current_thread()]
        for writer in writers:
            writer.join()
