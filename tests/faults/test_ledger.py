"""The comparison behind the soak sees what it is there for."""

import pytest

from benchmarks.soak.ledger import Ledger, compare
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions


@pytest.fixture
def kept(tmp_path):
    """(compared with an empty ledger and journal, change → verdict)."""
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("kept")
        live.add_note("once")
        live.add_note("twice")
        live.add_note("twice")
        live.folded_log.record("run_started", {"run": 1, "sequence": "0" * 32, "rows": 1})
        live.folded_log.record("command_sent", {"id": "sent", "sequence": "0" * 32, "run": 1, "row": 0})
        live.folded_log.record("command_done", {"id": "sent", "reason": ""})

        def verdict(ledger, executed=("sent",)):
            return compare(ledger, tmp_path, live.id, list(executed))

        yield live, verdict


def test_a_true_ledger_finds_nothing(kept):
    live, verdict = kept
    ledger = Ledger(notes=["once"], asked=["once"], runs={1: ["sent"]})
    for event in live.events():
        ledger.hear(event.as_dict())
    assert verdict(ledger).ok


def test_each_loss_and_each_doubling_is_named(kept):
    live, verdict = kept
    last = live.events()[-1].as_dict()
    assert "event 99 was heard" in verdict(Ledger(heard={99: "0"})).lost[0]
    assert "was heard" in verdict(Ledger(heard={last["seq"]: "another hash"})).lost[0]
    assert "'never'" in verdict(Ledger(notes=["never"])).lost[0]
    assert "run 2" in verdict(Ledger(runs={2: []})).lost[0]
    assert "product" in verdict(Ledger(products=["f" * 32])).lost[0]
    assert "never began it" in verdict(Ledger(), executed=()).lost[0]
    assert "stray" in verdict(Ledger(), executed=("sent", "stray")).lost[0]
    assert "carried out 2 times" in verdict(Ledger(), executed=("sent", "sent")).doubled[0]
    assert "'twice' is in the log 2 times" in verdict(Ledger(asked=["twice"])).doubled[0]
    contradicted = Ledger()
    contradicted.hear(last)
    contradicted.hear({**last, "hash": "another"})
    assert "two contents" in verdict(contradicted).doubled[0]


def test_damage_is_named(kept, tmp_path):
    live, verdict = kept
    next((tmp_path / live.id / "artifacts").iterdir()).write_bytes(b"not what it was")
    assert verdict(Ledger()).damage
