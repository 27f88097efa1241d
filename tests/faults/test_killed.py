"""All that the soak does to a session over REST, in short: SIGKILL to server, workers and rover, a bad link, hanging
workers, and all the while a client that never reads."""

import sys
from collections import Counter
from random import Random

import pytest

from benchmarks.soak.cycles import Soak
from footfall.session.storage.verify import verify

# (whom, when) while the rover carries out whole steps; and while it waits on the spot, which takes less time.
STEPPING = [("server", "command")] * 2 + [("rover", "command")] * 2
WAITING = [
    *[("server", "any")] * 3,
    *[("server", "command")] * 2,
    *[("server", "stop")] * 2,
    *[("rover", "any")] * 2,
    *[("rover", "stop")] * 2,
    *[("worker", "any")] * 4,
    ("worker", "stop"),
    ("link", "command"),
    ("hang", "any"),
]
TROUBLES = len(STEPPING) + len(WAITING)


@pytest.mark.long
def test_no_trouble_loses_or_doubles_what_was_acknowledged(tmp_path, capsys):
    Random(20081).shuffle(waiting := list(WAITING))
    cycles = []
    with Soak(tmp_path, seed=20081, hurry=5.0, workers=1) as soak:
        for number, (kind, moment) in enumerate([*STEPPING, *waiting]):
            cycles.append(cycle := soak.cycle(kind, moment, steps=number < len(STEPPING)))
            assert cycle.verdict.lost == (), cycle
            assert cycle.verdict.doubled == (), cycle
            assert cycle.verdict.damage == (), cycle
            assert cycle.problems == (), cycle
    last = soak.compare()
    with capsys.disabled():
        kinds = ", ".join(f"{count} {kind}" for kind, count in Counter(one.kind for one in cycles).items())
        slowest = max(one.recovery for one in cycles)
        told = f"{len(soak.ledger.heard)} events heard, {last.sent} commands sent, {last.executed} carried out"
        sys.stdout.write(f" {len(cycles)} troubles ({kinds}), back after {slowest:.1f} s at most; {told} ")
    assert last.ok, last
    # a cancelled job leaves what it was made from, a killed server the file that it wrote: prune removes both
    findings = verify(soak.data)
    assert {one.kind for one in findings if not one.harmful} <= {"orphan", "unfinished"}, findings
    assert [one for one in findings if one.harmful] == []
    ledger = soak.ledger
    # it was no idle session: all that could be lost was there
    assert len(ledger.heard) > 10 * TROUBLES
    assert len(ledger.notes) > 2 * TROUBLES
    assert len(ledger.products) > 5
    assert last.executed >= 2 * TROUBLES
    # legs were moving when server and rover died, and stops that were answered were in force when each of the three did
    assert {cycle.kind for cycle in cycles if cycle.under_way == "LEG_MOVE"} >= {"server", "rover"}
    assert {cycle.kind for cycle in cycles if cycle.stopped} >= {"server", "rover", "worker"}
