"""Run by test_storage_killed: for each line on stdin, a process of its own that appends events until it is killed.

It says ``pid N``, then ``SEQ HASH`` for each event that was acknowledged; ``died`` follows when it is gone.
"""

import os
import sys
from pathlib import Path

import footfall.session.storage.postgres_log  # noqa: F401 (loaded once, not in each life)
from footfall.session.log.event import next_event
from footfall.session.storage.store import SessionStore


def say(text: str) -> None:
    os.write(1, f"{text}\n".encode())


def append_for_ever(folder: Path, life: str) -> None:
    say(f"pid {os.getpid()}")
    store = SessionStore(folder)
    last = store.events[-1] if store.events else None
    for i in range(1_000_000):
        name = store.put_bytes(f"{life} {i}".encode(), "txt") if i % 3 == 0 else ""
        last = next_event(last, 1.0, "note", {"text": f"{life} {i}", "file": name, "long": "x" * (i * 997 % 5000)})
        store.append(last)
        say(f"{last.seq} {last.hash}")


for life, line in enumerate(sys.stdin):
    child = os.fork()
    if child == 0:
        append_for_ever(Path(line.strip()), str(life))
    os.waitpid(child, 0)
    say("died")
