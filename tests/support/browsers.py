"""Chromium for the tests, and its end where it does not answer any more: some of its calls know no bound."""

import contextlib
import os
import signal
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser


class Browsers:
    """The distribution's Chromium, with 3-D drawn in software and without, each started when first asked for.

    start: starts one, given whether it draws. One that was killed is started anew.
    """

    def __init__(self, start: Callable[[bool], Browser]) -> None:
        self._start = start
        self._started: dict[bool, Browser] = {}

    def __call__(self, drawing: bool) -> Browser:
        """The one that draws, or the other."""
        if drawing not in self._started or not self._started[drawing].is_connected():
            self._started[drawing] = self._start(drawing)
        return self._started[drawing]

    def close(self) -> None:
        """Close all that were started."""
        for browser in self._started.values():
            browser.close()


def kill_browsers() -> None:
    """Kill all that Playwright started from this process; what waits for one of them fails."""
    for driver in children(os.getpid()):
        if "playwright" in command_line(driver):
            for browser in children(driver):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(browser, signal.SIGKILL)


def children(process: int) -> list[int]:
    """Processes that ``process`` started and that still are."""
    found: list[int] = []
    for task in Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            found += map(int, (task / "children").read_text().split())
    return found


def command_line(process: int) -> str:
    """How it was started; "" where it has ended."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""
