"""The gate: what it refuses, what it sends, and that a stop always wins."""

import json
import threading
from types import SimpleNamespace

import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.sequence.edit import Edit
from footfall.session import commands
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
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(rover)
    session.rover.take_telemetry(frame_of(0))
    return session


def refused(session, check):
    with pytest.raises(CommandRefused) as caught:
        session.commands.arm()
    assert caught.value.details["check"] == check
    return caught.value


def test_rows_go_one_after_another(ready, rover):
    answer = ready.commands.send(ready.commands.arm()["token"])
    ids = answer["commands"]
    assert len(ids) == len(set(ids)) == 3
    for i, command in enumerate(ids):
        assert rover.ids() == ids[: i + 1]
        ready.rover.take_acknowledgement(command, "received")
        ready.rover.take_acknowledgement(command, "started")
        ready.rover.take_acknowledgement(command, "done")
    assert [c.state for c in ready.state.commands] == ["done"] * 3
    assert ready.commands.gate["state"] == "idle"
    assert ready.events()[-1].payload["outcome"] == "done"
    ready.rover.take_acknowledgement(ids[0], "done")
    assert rover.ids() == ids


def test_a_token_sends_once_and_expires(ready):
    token = ready.commands.arm()["token"]
    with pytest.raises(CommandRefused, match="token"):
        ready.commands.send("wrong")
    for command in ready.commands.send(token)["commands"]:
        ready.rover.take_acknowledgement(command, "done")
    with pytest.raises(CommandRefused, match="sends once"):
        ready.commands.send(token)


def test_what_is_armed_says_how_long_that_was_checked(ready, monkeypatch):
    looks = iter((100.0, 112.0))
    monkeypatch.setattr(commands, "time", SimpleNamespace(monotonic=lambda: next(looks)))
    answer = ready.commands.arm()
    assert answer["took"] == 12.0
    assert 9.0 < answer["expires_in"] <= 10.0


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
        live.terrains.load(tiny.dem(), "test")
        live.stances.set(state_of())
        live.plans.step(2, (1.0, 0.0)).finish()
        digest = live.sequences.make()
        live.rover.connected(rover)
        live.rover.take_telemetry(frame_of(0))
        sent = live.commands.send(live.commands.arm()["token"])
        for command in sent["commands"]:
            live.rover.take_acknowledgement(command, "done")
        assert rover.ids() == sent["commands"]
        assert [row["id"] for row in live.commands.run["rows"]] == sent["commands"]
        named.append((digest, sent["run"], sent["commands"]))
        live.rover.disconnected()
    (first, run, ids), (second, same, others) = named
    assert (first, run) == (second, same)
    assert not {*ids} & {*others}


def test_a_refused_row_ends_the_run(ready, rover):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.rover.take_acknowledgement(ids[0], "refused", "joint fault")
    assert rover.ids() == ids[:1]
    assert ready.state.commands[0].state == "refused"
    end = ready.events()[-1]
    assert (end.type, end.payload["outcome"], end.payload["unsent"]) == ("run_ended", "refused", 2)


def test_the_first_end_of_a_command_counts_and_another_is_told(ready):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.rover.take_acknowledgement(ids[0], "done")
    ready.rover.take_acknowledgement(ids[0], "done")
    assert ready.rover.link.kinds == {}
    ready.rover.take_acknowledgement(ids[0], "outdated", "it came again")  # to a rover that was restarted since
    ready.rover.take_acknowledgement(ids[0], "refused", "the joint is stuck")
    ready.rover.take_acknowledgement(ids[1], "refused", "the joint is stuck")
    ready.rover.take_acknowledgement(ids[1], "done")
    assert [one.state for one in ready.state.commands] == ["done", "refused"]
    assert ready.rover.link.kinds == {"outdated-command": 1, "contradiction": 2}
    assert "had said that it is refused" in ready.rover.link.fault


def test_a_lost_link_ends_the_run_and_leaves_the_row_unknown(ready, rover):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.rover.disconnected()
    assert ready.state.commands[0].state == "unknown"
    again = Rover()
    ready.rover.connected(again)
    ready.rover.take_acknowledgement(ids[0], "done")  # late, but true
    assert ready.state.commands[0].state == "done"
    assert again.types() == ["query"]  # asked, not told again


def test_the_gate_names_what_does_not_fit(session, rover, frame_of, tiny, monkeypatch):
    session.plans.step(2, (1.0, 0.0)).finish()
    sequence = session.sequences.make()
    refused(session, "link")
    session.rover.connected(rover)
    refused(session, "telemetry")
    session.rover.take_telemetry(frame_of(1, offset=0.02))
    error = refused(session, "start")
    assert error.details["joint"] == session.description.joint_names[7]
    assert error.details["difference"] == pytest.approx(0.02)
    assert session.review.plan_matches_rover()["ok"] is False
    session.rover.take_telemetry(frame_of(2, mode="moving"))
    refused(session, "mode")
    session.rover.take_telemetry(frame_of(3, offset=0.009))
    session.commands.arm()
    monkeypatch.setattr(type(session.rover.link), "age", property(lambda self: 2.5))
    refused(session, "telemetry")
    monkeypatch.undo()
    session.terrains.load(tiny.dem(0.1))
    refused(session, "terrain")
    session.terrains.load(tiny.dem())
    session.sequences.edit(sequence, Edit("duration", 0, number=1e-3))
    refused(session, "rules")
    assert rover.ids() == []


def test_of_two_edits_of_one_version_one_is_told_that_it_was_dropped(ready, monkeypatch):
    sequence = ready.state.sequence
    both_asked, planned_on = threading.Barrier(2, timeout=BOUND), ready.sequences.planned_on

    def together(digest):
        both_asked.wait()
        return planned_on(digest)

    monkeypatch.setattr(ready.sequences, "planned_on", together)
    made: list[str] = []
    dropped: list[Conflict] = []

    def edit(row):
        try:
            made.append(ready.sequences.edit(sequence, Edit("duration", row, number=30.0 + row)))
        except Conflict as error:
            dropped.append(error)

    editors = [threading.Thread(target=edit, args=(row,)) for row in (0, 1)]
    for one in editors:
        one.start()
    for one in editors:
        one.join(BOUND)
    assert [ready.state.sequence] == made
    (error,) = dropped
    assert "dropped" in error.message
    assert error.details == {"yours": sequence, "present": made[0]}
    assert ready.state.sequence_history[-1] == sequence


def test_what_is_undone_and_redone_is_what_was_meant(ready):
    first = ready.state.sequence
    second = ready.sequences.edit(first, Edit("duration", 0, number=30.0))
    third = ready.sequences.edit(second, Edit("duration", 0, number=31.0))
    with pytest.raises(Conflict) as caught:
        ready.sequences.undo(second)
    assert caught.value.details == {"yours": second, "present": third}
    assert ready.sequences.undo(third) == second
    with pytest.raises(Conflict, match="has changed"):
        ready.sequences.redo(third)
    assert ready.sequences.redo(second) == third == ready.state.sequence


def test_a_stop_is_latched_and_clears_only_when_acknowledged(ready, rover):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.commands.stop("operator")
    ready.commands.stop("again")
    assert rover.types() == ["command", "stop", "stop"]
    assert [e.type for e in ready.events()].count("stop_requested") == 1
    ready.rover.take_acknowledgement(ids[0], "done")
    assert rover.ids() == ids[:1]
    refused(ready, "stop")
    with pytest.raises(Conflict, match="not acknowledged"):
        ready.commands.clear_stop()
    ready.rover.take_stop_acknowledgement()
    assert ready.state.stop.acknowledged
    ready.commands.clear_stop()
    assert rover.types()[-1] == "clear_stop"
    assert not ready.state.stop.latched
    ready.commands.arm()


def test_a_stop_survives_reopening_and_reaches_a_returning_rover(sessions, ready, rover):
    ready.rover.disconnected()
    ready.commands.stop("no link")
    session_id = ready.id
    ready.close()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    assert again.commands.gate["stopped"]
    again.rover.connected(rover)
    assert rover.types() == ["stop"]


def test_a_stop_needs_no_disk(ready, rover, monkeypatch):
    def full(*_):
        raise OSError("no space left")

    ready.commands.send(ready.commands.arm()["token"])
    monkeypatch.setattr(SqliteLog, "append", full)
    ready.commands.stop("disk full")
    assert rover.types()[-1] == "stop"
    assert ready.commands.gate["stopped"]
    monkeypatch.undo()
    ready.add_note("the disk is back")
    types = [e.type for e in ready.events()]
    assert types[-3:] == ["stop_requested", "run_ended", "note"]


def test_nothing_is_sent_that_is_not_in_the_log(ready, rover, monkeypatch):
    token = ready.commands.arm()["token"]

    def full(*_):
        raise OSError("no space left")

    monkeypatch.setattr(SqliteLog, "append", full)
    with pytest.raises(OSError, match="no space"):
        ready.commands.send(token)
    assert rover.ids() == []
    monkeypatch.undo()


def test_a_stop_does_not_wait_for_the_session(ready, rover, monkeypatch):
    monkeypatch.setattr("footfall.session.folded_log.LOCK_PATIENCE", 0.05)
    held, free = threading.Event(), threading.Event()

    def hold(message):
        held.set()
        free.wait(BOUND)

    unlisten = ready.listen(hold)
    thread = threading.Thread(target=ready.add_note, args=("slow listener",))
    thread.start()
    assert held.wait(BOUND)
    ready.commands.stop("now")
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
    ready.commands.send(ready.commands.arm()["token"])
    monkeypatch.setattr(type(ready.rover.link), "age", property(lambda self: 2.5))
    until(lambda: ends(ready), "the end of the run")
    assert ends(ready) == ["link_lost"]


def test_a_row_that_is_never_acknowledged_ends_the_run(ready, rover, monkeypatch):
    monkeypatch.setattr("footfall.session.gate.runs.RECEIVED_WITHIN", 0.1)
    ready.commands.send(ready.commands.arm()["token"])
    until(lambda: ends(ready), "the end of the run")
    assert ends(ready) == ["overdue"]
    assert len(rover.ids()) == 1


def test_the_link_counts_what_is_missing(ready, frame_of):
    for number in (1, 2, 5, 6, 0, 1):
        ready.rover.take_telemetry(frame_of(number))
    about = ready.rover.link.as_dict()
    assert (about["frames"], about["gaps"], about["restarts"]) == (7, 2, 1)
    assert ready.rover.telemetry_age < 5
    ready.rover.disconnected(lambda text: None)  # an older connection's end changes nothing
    assert ready.rover.link.connected
