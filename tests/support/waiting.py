"""The one way in which tests wait: for what happens, within one generous bound, with what was seen where it did not.

A bound is against waiting for ever; no test is right or wrong by it. ``FOOTFALL_TEST_BOUND`` makes it shorter while a
test is written.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

BOUND = float(os.environ.get("FOOTFALL_TEST_BOUND", "240"))
"""Longest wait for anything [s]."""
BOUND_MS = 1000.0 * BOUND
"""The same for a browser [ms]."""

Seen = Callable[[], Any]


def until(look: Callable[[], Any], what: str, *, seen: Seen | None = None, period: float = 0.02) -> Any:
    """Wait for the first answer of ``look`` that is true, and return it.

    what: in words, for the message. seen: what to tell beside the last answer where it did not happen (a state, the
    last events, a log). period: between two looks [s].
    """
    end = time.monotonic() + BOUND
    while not (answer := look()):
        if time.monotonic() > end:
            told = "" if seen is None else f"; seen: {seen()!r}"
            raise AssertionError(f"{what} did not happen within {BOUND:.0f} s; the last look gave {answer!r}{told}")
        time.sleep(period)
    return answer


def a_while(seconds: float) -> None:
    """Let real time pass in which something must *not* happen: the only wait that does not end by what happens.

    A machine that is too slow makes such a test see less, never fail.
    """
    threading.Event().wait(seconds)


@contextmanager
def at_least(seconds: float) -> Iterator[None]:
    """What is done here takes so much real time or more, as messages with a light time do."""
    began = time.monotonic()
    yield
    assert time.monotonic() - began >= seconds


def joined(thread: threading.Thread) -> None:
    """Wait for the end of a thread."""
    thread.join(BOUND)
    if thread.is_alive():
        raise AssertionError(f"the thread {thread.name} did not end within {BOUND:.0f} s")


@contextmanager
def else_after(seconds: float, act: Callable[[], None]) -> Iterator[None]:
    """What is done here should end by itself; where it still goes on after ``seconds``, ``act`` is to end it."""
    timer = threading.Timer(seconds, act)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
