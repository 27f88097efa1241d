"""Processes that write events are killed (SIGKILL) at random points: what was acknowledged is there, once."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

from footfall.session.storage.store import SessionStore, read_session
from footfall.session.storage.verify import verify
from tests.support.waiting import a_while

CYCLES = 25
ABOUT = {"format": "footfall-session", "version": 1, "name": "s"}


def test_no_acknowledged_event_is_lost_or_doubled_by_kills(work):
    rng = random.Random(20081)
    folder = work / "s"
    SessionStore.create(folder, ABOUT).close()
    acknowledged: dict[int, str] = {}
    writer = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("killed_writer.py"))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert writer.stdin is not None
    assert writer.stdout is not None
    with writer:
        for _ in range(CYCLES):
            writer.stdin.write(f"{folder}\n")
            writer.stdin.flush()
            pid = int(writer.stdout.readline().removeprefix("pid "))
            heard = [writer.stdout.readline() for _ in range(rng.choice([0, 0, 1, 2, 5, 20]))]
            a_while(rng.uniform(0.0, 0.02))
            os.kill(pid, signal.SIGKILL)
            while (line := writer.stdout.readline()) != "died\n":
                heard.append(line)
            acknowledged.update((int(seq), chained) for seq, chained in (line.split() for line in heard))

            assert [one for one in verify(work) if one.harmful] == []
            records = read_session(folder).records
            assert {r["seq"]: r["hash"] for r in records if r["seq"] in acknowledged} == acknowledged
            texts = [record["payload"]["text"] for record in records]
            assert len(set(texts)) == len(texts)
            # each life may leave one event that was written and not acknowledged any more
            lives = {text.split()[0] for text in texts}
            assert len(records) <= len(acknowledged) + len(lives)
        writer.stdin.close()
    assert len(acknowledged) > CYCLES
    store = SessionStore(folder)
    assert store.repairs == []
    store.close()
