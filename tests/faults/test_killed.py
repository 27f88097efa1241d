"""Server, workers and rover of a session over REST are killed (SIGKILL) at random points: the soak, in short."""

from random import Random

import pytest

from benchmarks.soak.cycles import Soak
from footfall.session.storage.verify import verify

KILLS = ["server"] * 10 + ["rover"] * 7 + ["worker"] * 3


@pytest.mark.long
def test_no_kill_loses_or_doubles_what_was_acknowledged(tmp_path):
    Random(20081).shuffle(kills := list(KILLS))
    with Soak(tmp_path, seed=20081, light=True, hurry=5.0) as soak:
        for kind in kills:
            cycle = soak.cycle(kind)
            assert cycle.verdict.lost == (), cycle
            assert cycle.verdict.doubled == (), cycle
            assert cycle.verdict.damage == (), cycle
            assert cycle.problems == (), cycle
    last = soak.compare()
    assert last.ok
    assert verify(soak.data) == []
    ledger = soak.ledger
    # it was no idle session: all that could be lost was there
    assert len(ledger.heard) > 10 * len(kills)
    assert len(ledger.notes) > 2 * len(kills)
    assert len(ledger.products) > KILLS.count("worker")
    assert last.executed >= 3 * len(kills)
