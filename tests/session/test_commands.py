"""The gate: what it refuses, what it sends, and that a stop always wins."""

import json
import threading

import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.sequence.edit import Edit
from footfall.session.access.identity import LOCAL
from footfall.session.gate.gate import Gate
from footfall.session.storage.sqlite_log import SqliteLog
from tests.support.waiting import BOUND, until


class Rover:
    """What arrives at the other end of the link."""

    def __init__(self):
        self.heard = []

    def __call__(self, text):
        self.heard.append(json.loads(text))

    def ids(self):
        return [m["id"] for m in self.heard if m["type"] == "command"]

    def types(self):
        return [m["type"] for m in self.heard]


@pytest.fixture
def rover():
    return Rover()


@pytest.fixture
def ready(session, rover, frame_of):
    """A session with a sequence of three rows and an idle rover where it starts."""
    session.plan_step(2, (1.0, 0.0)).finish()
    session.make_sequence()
    session.rover_connected(rover)
    session.take_telemetry(frame_of(0))
    return session


def refused(session, check):
    with pytest.raises(CommandRefused) as caught:
        session.arm()
    assert caught.value.details["check"] == check
    return caught.value


def test_rows_go_one_after_another(ready, rover):
    answer = ready.send(ready.arm()["token"])
    ids = answer["commands"]
    assert len(ids) == len(set(ids)) == 3
    for i, command in enumerate(ids):
        assert rover.ids() == ids[: i + 1]
        ready.take_acknowledgement(command, "received")
        ready.take_acknowledgement(command, "started")
        ready.take_acknowledgement(command, "done")
    assert [c.state for c in ready.state.commands] == ["done"] * 3
    assert ready.gate["state"] == "idle"
    assert ready.events()[-1].payload["outcome"] == "done"
    ready.take_acknowledgement(ids[0], "done")
    assert rover.ids() == ids


def test_a_token_sends_once_and_expires(ready):
    token = ready.arm()["token"]
    with pytest.raises(CommandRefused, match="token"):
        ready.send("wrong")
    for command in ready.send(token)["commands"]:
        ready.take_acknowledgement(command, "done")
    with pytest.raises(CommandRefused, match="sends once"):
        ready.send(token)


def test_an_arming_expires():
    now = [0.0]
    gate = Gate(clock=lambda: now[0])
    token = gate.arm("digest", LOCAL)
    now[0] = 10.1
    assert gate.as_dict()["state"] == "idle"
    with pytest.raises(CommandRefused, match="expired"):
        gate.armed_sequence(token)


def test_two_sessions_never_name_a_command_alike(sessions, tiny, state_of, frame_of):
    """The same content in a run of the same number: a rover would take the second for a repetition, and not move."""
    named = []
    for _ in range(2):
        live, rover = sessions.create("again"), Rover()
        live.load_terrain(tiny.dem(), "test")
        live.set_state(state_of())
        live.plan_step(2, (1.0, 0.0)).finish()
        digest = live.make_sequence()
        live.rover_connected(rover)
        live.take_telemetry(frame_of(0))
        sent = live.send(live.arm()["token"])
        for command in sent["commands"]:
            live.take_acknowledgement(command, "done")
        assert rover.ids() == sent["commands"]
        assert [row["id"] for row in live.run["rows"]] == sent["commands"]
        named.append((digest, sent["run"], sent["commands"]))
        live.rover_disconnected()
    (first, run, ids), (second, same, others) = named
    assert (first, run) == (second, same)
    assert not {*ids} & {*others}


def test_a_refused_row_ends_the_run(ready, rover):
    ids = ready.send(ready.arm()["token"])["commands"]
    ready.take_acknowledgement(ids[0], "refused", "joint fault")
    assert rover.ids() == ids[:1]
    assert ready.state.commands[0].state == "refused"
    end = ready.events()[-1]
    assert (end.type, end.payload["outcome"], end.payload["unsent"]) == ("run_ended", "refused", 2)


def test_the_first_end_of_a_command_counts_and_another_is_told(ready):
    ids = ready.send(ready.arm()["token"])["commands"]
    ready.take_acknowledgement(ids[0], "done")
    ready.take_acknowledgement(ids[0], "done")
    assert ready.link.kinds == {}
    ready.take_acknowledgement(ids[0], "outdated", "it came again")  # to a rover that was restarted since
    ready.take_acknowledgement(ids[0], "refused", "the joint is stuck")
    ready.take_acknowledgement(ids[1], "refused", "the joint is stuck")
    ready.take_acknowledgement(ids[1], "done")
    assert [one.state for one in ready.state.commands] == ["done", "refused"]
    assert ready.link.kinds == {"outdated-command": 1, "contradiction": 2}
    assert "had said that it is refused" in ready.link.fault


def test_a_lost_link_ends_the_run_and_leaves_the_row_unknown(ready, rover):
    ids = ready.send(ready.arm()["token"])["commands"]
    ready.rover_disconnected()
    assert ready.state.commands[0].state == "unknown"
    again = Rover()
    ready.rover_connected(again)
    ready.take_acknowledgement(ids[0], "done")  # late, but true
    assert ready.state.commands[0].state == "done"
    assert again.types() == ["query"]  # asked, not told again


def test_the_gate_names_what_does_not_fit(session, rover, frame_of, tiny, monkeypatch):
    session.plan_step(2, (1.0, 0.0)).finish()
    sequence = session.make_sequence()
    refused(session, "link")
    session.rover_connected(rover)
    refused(session, "telemetry")
    session.take_telemetry(frame_of(1, offset=0.02))
    error = refused(session, "start")
    assert error.details["joint"] == session.description.joint_names[7]
    assert error.details["difference"] == pytest.approx(0.02)
    assert session.plan_matches_rover()["ok"] is False
    session.take_telemetry(frame_of(2, mode="moving"))
    refused(session, "mode")
    session.take_telemetry(frame_of(3, offset=0.009))
    session.arm()
    monkeypatch.setattr(type(session.link), "age", property(lambda self: 2.5))
    refused(session, "telemetry")
    monkeypatch.undo()
    session.load_terrain(tiny.dem(0.1))
    refused(session, "terrain")
    session.load_terrain(tiny.dem())
    session.edit_sequence(sequence, Edit("duration", 0, number=1e-3))
    refused(session, "rules")
    assert rover.ids() == []


def test_a_stop_is_latched_and_clears_only_when_acknowledged(ready, rover):
    ids = ready.send(ready.arm()["token"])["commands"]
    ready.stop("operator")
    ready.stop("again")
    assert rover.types() == ["command", "stop", "stop"]
    assert [e.type for e in ready.events()].count("stop_requested") == 1
    ready.take_acknowledgement(ids[0], "done")
    assert rover.ids() == ids[:1]
    refused(ready, "stop")
    with pytest.raises(Conflict, match="not acknowledged"):
        ready.clear_stop()
    ready.take_stop_acknowledgement()
    assert ready.state.stop.acknowledged
    ready.clear_stop()
    assert rover.types()[-1] == "clear_stop"
    assert not ready.state.stop.latched
    ready.arm()


def test_a_stop_survives_reopening_and_reaches_a_returning_rover(sessions, ready, rover):
    ready.rover_disconnected()
    ready.stop("no link")
    session_id = ready.id
    ready.close()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    assert again.gate["stopped"]
    again.rover_connected(rover)
    assert rover.types() == ["stop"]


def test_a_stop_needs_no_disk(ready, rover, monkeypatch):
    def full(*_):
        raise OSError("no space left")

    ready.send(ready.arm()["token"])
    monkeypatch.setattr(SqliteLog, "append", full)
    ready.stop("disk full")
    assert rover.types()[-1] == "stop"
    assert ready.gate["stopped"]
    monkeypatch.undo()
    ready.add_note("the disk is back")
    types = [e.type for e in ready.events()]
    assert types[-3:] == ["stop_requested", "run_ended", "note"]


def test_nothing_is_sent_that_is_not_in_the_log(ready, rover, monkeypatch):
    token = ready.arm()["token"]

    def full(*_):
        raise OSError("no space left")

    monkeypatch.setattr(SqliteLog, "append", full)
    with pytest.raises(OSError, match="no space"):
        ready.send(token)
    assert rover.ids() == []
    monkeypatch.undo()


def test_a_stop_does_not_wait_for_the_session(ready, rover, monkeypatch):
    monkeypatch.setattr("footfall.session.journal.LOCK_PATIENCE", 0.05)
    held, free = threading.Event(), threading.Event()

    def hold(message):
        held.set()
        free.wait(BOUND)

    unlisten = ready.listen(hold)
    thread = threading.Thread(target=ready.add_note, args=("slow listener",))
    thread.start()
    assert held.wait(BOUND)
    ready.stop("now")
    assert thread.is_alive()  # the listener is held still
    assert rover.types()[-1] == "stop"
    free.set()
    thread.join()
    unlisten()
    ready.add_note("later")
    assert "stop_requested" in [e.type for e in ready.events()]


def ends(session):
    return [e.payload["outcome"] for e in session.events() if e.type == "run_ended"]


def test_a_rover_that_falls_silent_ends_the_run(ready, monkeypatch):
    ready.send(ready.arm()["token"])
    monkeypatch.setattr(type(ready.link), "age", property(lambda self: 2.5))
    until(lambda: ends(ready), "the end of the run")
    assert ends(ready) == ["link_lost"]


def test_a_row_that_is_never_acknowledged_ends_the_run(ready, rover, monkeypatch):
    monkeypatch.setattr("footfall.session.gate.runs.RECEIVED_WITHIN", 0.1)
    ready.send(ready.arm()["token"])
    until(lambda: ends(ready), "the end of the run")
    assert ends(ready) == ["overdue"]
    assert len(rover.ids()) == 1


def test_the_link_counts_what_is_missing(ready, frame_of):
    for number in (1, 2, 5, 6, 0, 1):
        ready.take_telemetry(frame_of(number))
    about = ready.link.as_dict()
    assert (about["frames"], about["gaps"], about["restarts"]) == (7, 2, 1)
    assert ready.telemetry_age < 5
    ready.rover_disconnected(lambda text: None)  # an older connection's end changes nothing
    assert ready.link.connected
