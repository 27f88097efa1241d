"""One thread that draws what is out of date; what could not be drawn stays so, and is tried again."""

import logging
import threading
import time
from collections.abc import Callable, Mapping

_log = logging.getLogger(__name__)

FIRST_PAUSE, LONGEST_PAUSE = 0.05, 2.0
"""Before what failed is tried again; twice as long each time [s]."""


class Redrawing:
    """Draws named parts, in their order, each as often as it is marked and no more often than it can be drawn.

    A part that fails is a part of a view: the others are drawn all the same, it is drawn again after a pause, and
    each kind of failure is logged once until the part is drawn.
    """

    def __init__(self, parts: Mapping[str, Callable[[], None]]) -> None:
        self._parts = parts
        self._changed = threading.Condition()
        self._marked: set[str] = set()
        self._failed: set[str] = set()
        self._jobs: list[Callable[[], None]] = []
        self._closed = False
        self._reported: set[tuple[str, type[Exception]]] = set()
        self._pause = FIRST_PAUSE
        self._due = 0.0
        self._thread = threading.Thread(target=self._run, name="scene", daemon=True)
        self._thread.start()

    def mark(self, *names: str) -> None:
        """These parts are out of date; no names: all."""
        with self._changed:
            self._marked.update(names or self._parts)
            self._changed.notify()

    def soon(self, job: Callable[[], None]) -> None:
        """Do something once in the drawing thread, before what is drawn next; where it fails, it is logged."""
        with self._changed:
            self._jobs.append(job)
            self._changed.notify()

    def close(self) -> None:
        """Draw nothing more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=10)

    def _run(self) -> None:
        while (work := self._wait()) is not None:
            jobs, due = work
            for job in jobs:
                self._try("job", job)
            failed = {name for name, draw in self._parts.items() if name in due and not self._try(name, draw)}
            with self._changed:
                self._failed |= failed
                if failed:
                    self._due = time.monotonic() + self._pause
                    self._pause = min(2 * self._pause, LONGEST_PAUSE)
                elif not self._failed:
                    self._pause = FIRST_PAUSE

    def _wait(self) -> tuple[list[Callable[[], None]], set[str]] | None:
        """Until there is something to do: what, None to end."""
        with self._changed:
            while not self._closed:
                if self._failed and time.monotonic() >= self._due:
                    self._marked |= self._failed
                if self._jobs or self._marked:
                    work = self._jobs, self._marked
                    self._failed -= self._marked
                    self._jobs, self._marked = [], set()
                    return work
                self._changed.wait(max(self._due - time.monotonic(), 0.0) if self._failed else None)
            return None

    def _try(self, name: str, draw: Callable[[], None]) -> bool:
        try:
            draw()
        except Exception as error:
            if (name, type(error)) not in self._reported:
                self._reported.add((name, type(error)))
                _log.exception("%s: could not be drawn, and is tried again", name)
            return False
        self._reported = {known for known in self._reported if known[0] != name}
        return True
