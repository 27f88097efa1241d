"""What a walk in a closed loop decides, told as it comes, and what each part of it takes of the processor."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from footfall.session.live import LiveSession
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.rover import SimulatedRover

BY_ROVER = ("images", "motion")
BY_ACT = {"look": "map", "lift": "map", "replan": "plan", "go": "execution"}
"""Decision → the part that counts for all that the rover itself does not take until the next."""


class Diary:
    """Prints each decision of a session's walk as it comes: when, after how much, where the rover truly is, and why.

    costs: part → processor time so far [s].
    """

    def __init__(self, live: LiveSession, rover: PhysicalRover | SimulatedRover) -> None:
        self._live, self._rover = live, rover
        self.costs: defaultdict[str, float] = defaultdict(float)
        self._began, self._since = time.perf_counter(), time.process_time()
        self._act, self._of_rover = "", 0.0

    def __enter__(self) -> "Diary":
        self._unlisten = self._live.listen(self._hear)
        return self

    def __exit__(self, *error: object) -> None:
        self._unlisten()

    @contextmanager
    def rovers(self, part: str, clock: Callable[[], float]) -> Iterator[None]:
        """What the rover itself does, a part of BY_ROVER; clock: of the processor time that it takes [s]."""
        began = clock()
        yield
        self.costs[part] += clock() - began

    def in_words(self, foot_moves: int) -> str:
        """Processor time of each part, of one of so many foot moves."""
        each = max(foot_moves, 1)
        parts = ", ".join(
            f"{part} {self.costs[part] / each:z.1f}" for part in dict.fromkeys((*BY_ROVER, *BY_ACT.values()))
        )
        return f"processor time of a foot move [s]: {parts}; in all {sum(self.costs.values()) / each:z.1f}"

    def _hear(self, message: dict[str, Any]) -> None:
        if message["type"] != "event" or message["event"]["type"] != "walk_decided":
            return
        decided, now = message["event"]["payload"], time.process_time()
        of_rover = sum(self.costs[part] for part in BY_ROVER)
        took = now - self._since
        if self._act in BY_ACT:
            self.costs[BY_ACT[self._act]] += max(took - (of_rover - self._of_rover), 0.0)
        self._since, self._of_rover, self._act = now, of_rover, decided["act"]
        x, y = self._rover.T_site_base[:2, 3]
        clock = time.perf_counter() - self._began
        print(
            f"    {clock:z.0f} s, {took:z.1f} s of the processor, at ({x:z.2f}, {y:z.2f}): "
            f"{self._act}: {decided['reason']}",
            flush=True,
        )
