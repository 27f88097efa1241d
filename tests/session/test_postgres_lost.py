"""PostgreSQL that is lost in the middle of a run, as a client of the interface sees it: honest all the time."""

import json

import pytest

from footfall.api.access import BASE
from footfall.api.assemble import assemble
from footfall.session import commanding
from footfall.session.commanding import Commanding
from footfall.session.gate import checks
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.storage.databases import bind
from footfall.session.storage.store import read_session
from footfall.session.storage.verify import verify
from tests.support.local import Local
from tests.support.waiting import until

CURRENT = f"{BASE}/sessions/current"


@pytest.fixture
def unhurried(monkeypatch):
    """Telemetry is fresh and no row overdue however long the database takes to stop: that alone ends the run."""
    monkeypatch.setattr(commanding, "STALE_AFTER", 1e9)
    monkeypatch.setattr(checks, "STALE_AFTER", 1e9)
    monkeypatch.setattr(Commanding, "look", lambda self: None)


@pytest.fixture
def running(postgres, tmp_path, tiny, athlete, state_of, frame_of, unhurried):
    """(session with a run of several rows, client, what was sent to its rover): two rows are out, one is done."""
    bind(tmp_path / "work", postgres.fresh())
    sent = []
    with Sessions(tmp_path / "work", jobs=InlineJobs("tiny_recipes"), robot=athlete) as sessions:
        live = sessions.create("test")
        live.terrains.load(tiny.dem(), "test")
        live.stances.set(state_of())
        live.plans.step(2, (1.0, 0.0)).finish()
        live.sequences.make()
        live.rover.connected(lambda text: sent.append(json.loads(text)))
        live.rover.take_telemetry(frame_of(0))
        client = Local(assemble(sessions))
        token = client.post(f"{BASE}/sequences/current/arm").json()["token"]
        begun = client.post(f"{BASE}/sequences/current/send", json={"arming": token})
        assert begun.status_code == 202, begun.text
        live.rover.take_acknowledgement(begun.json()["commands"][0], "done")
        assert len(commands(sent)) == 2
        assert len(begun.json()["commands"]) >= 3
        yield live, client, sent
    assert [one for one in verify(tmp_path / "work") if one.harmful] == []


def commands(sent):
    return [message for message in sent if message["type"] == "command"]


def ready(client):
    """What the server says of whether it is ready, and of its log."""
    answer = client.get("/health/ready")
    log = next(one for one in answer.json()["checks"] if one["what"] == "event log")
    assert (answer.status_code == 200) is answer.json()["ready"]
    return answer.json()["ready"], log["ok"], log["text"]


@pytest.mark.parametrize("mode", ["fast", "immediate"])
def test_a_run_ends_where_its_rows_cant_be_written_and_all_goes_on_later(running, postgres, mode):
    live, client, sent = running
    assert ready(client)[:2] == (True, True)
    written = [event.as_dict() for event in live.events()]
    postgres.stop(mode)
    try:
        refused = client.post(f"{CURRENT}/notes", json={"text": "not kept"})
        assert (refused.status_code, refused.json()["type"]) == (503, "/problems/not-recorded")
        assert "so it was not done" in refused.json()["detail"]
        assert ready(client)[:2] == (False, False)
        live.rover.take_acknowledgement(commands(sent)[1]["id"], "done")
        # the row after it can't be written, so it does not go, and the run says so at once
        assert len(commands(sent)) == 2
        run = client.get(f"{CURRENT}/run").json()
        assert run["ended"] is not None
        assert run["outcome"] == "not_recorded", run
        again = client.post(f"{BASE}/sequences/current/arm")
        assert again.status_code in (409, 503), again.text
        stopped = client.post(f"{BASE}/stop", json={"reason": "no database"})
        assert (stopped.status_code, stopped.json()["stopped"]) == (200, True)
        assert sent[-1]["type"] == "stop"
        live.rover.take_stop_acknowledgement()
        assert client.get(f"{BASE}/stop").json()["stop_acknowledged"]
        assert "can't be written" in ready(client)[2]
        # what is in memory is told all the while
        assert client.get(CURRENT).status_code == 200
    finally:
        postgres.start()
    until(lambda: client.post(f"{CURRENT}/notes", json={"text": "kept"}).status_code == 201, "a note that is taken")
    assert ready(client)[:2] == (True, True)
    assert client.get(f"{BASE}/stop").json()["stopped"]
    assert client.post(f"{BASE}/stop/clear").status_code == 200
    records = read_session(live.store.folder).records
    assert records[: len(written)] == written
    later = [record["type"] for record in records[len(written) :]]
    for once in ("command_done", "run_ended", "stop_requested", "stop_acknowledged", "note"):
        assert later.count(once) == 1, later
    assert "command_sent" not in later
    assert later.index("command_done") < later.index("run_ended") < later.index("stop_requested") < later.index("note")


def test_health_is_red_without_the_database_also_where_no_session_is_open(postgres, tmp_path, tiny, athlete):
    bind(tmp_path / "work", postgres.fresh())
    with Sessions(tmp_path / "work", jobs=InlineJobs("tiny_recipes"), robot=athlete) as sessions:
        client = Local(assemble(sessions))
        assert ready(client)[:2] == (True, True)
        postgres.stop("immediate")
        try:
            assert ready(client)[:2] == (False, False)
        finally:
            postgres.start()
        until(lambda: ready(client)[0], "a server that is ready again")
