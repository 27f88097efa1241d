"""Writing the log: each event waits for the disk, twice: the database, and the head beside it.

The peer appends the same events to a plain file and waits once for each.

Measured on the disk of the working folder (or of FOOTFALL_BENCH_DISK); wall-clock times, the two in turn.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.timing import Figure
from footfall.io.event_log import line
from footfall.session.log.event import Event, next_event
from footfall.session.storage.backup import backup
from footfall.session.storage.store import SessionStore
from footfall.session.storage.verify import verify

LIMIT = 0.02
"""What an event may take [s]: a command waits for it."""
MOST_FLUSHES = 4.0
"""How many times as long as the peer's one flush of the disk it may take."""


def figures(quick: bool) -> Iterator[Figure]:
    count = 200 if quick else 2000
    with TemporaryDirectory(prefix=".footfall-bench-", dir=os.environ.get("FOOTFALL_BENCH_DISK", ".")) as work:
        folder = Path(work) / "sessions" / "s"
        about = {"format": "footfall-session", "version": 1, "name": "benchmark"}
        with closing(SessionStore.create(folder, about)) as store, (Path(work) / "plain").open("ab", 0) as plain:

            def peer(event: Event) -> None:
                plain.write(line(event.as_dict()))
                os.fsync(plain.fileno())

            ours, theirs = _in_turn(store.append, peer, _events(count))
            ratios = tuple(a / b for a, b in zip(ours, theirs, strict=True))
            yield Figure("operations.append an event", ours, "s", floor=LIMIT)
            yield Figure("operations.append an event, plain file and fsync", theirs, "s")
            yield Figure("operations.append, ours / plain", ratios, "ratio", floor=MOST_FLUSHES)
            yield Figure("operations.events a second", (count / sum(ours),), "1/s")
        begin = time.perf_counter()
        found = verify(folder.parent)
        yield Figure("operations.verify, per event", ((time.perf_counter() - begin) / count,), "s")
        begin = time.perf_counter()
        found += backup(folder.parent, Path(work) / "copy")
        yield Figure("operations.backup and verify, per event", ((time.perf_counter() - begin) / count,), "s")
        if found:
            raise RuntimeError(f"what was written is not whole: {found}")


def _events(count: int) -> Iterator[Event]:
    """Acknowledgements with a posture: the most that a run writes."""
    last = None
    posture = [0.1 * i for i in range(36)]
    for i in range(count):
        last = next_event(last, float(i), "command_done", {"id": f"{i}", "reason": "", "posture": posture})
        yield last


def _in_turn(
    ours: Callable[[Event], None], peer: Callable[[Event], None], events: Iterator[Event]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    times: tuple[list[float], list[float]] = ([], [])
    for event in events:
        for call, taken in zip((ours, peer), times, strict=True):
            begin = time.perf_counter()
            call(event)
            taken.append(time.perf_counter() - begin)
    return tuple(times[0]), tuple(times[1])
