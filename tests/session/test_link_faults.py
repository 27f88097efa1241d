"""What the link may do wrong, and that none of it passes for news or for a stop that was heard."""

import threading
from dataclasses import replace

import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.session.gate.gate import Gate
from footfall.session.rover.link import RESTART_AFTER, RoverLink


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def link(clock):
    return RoverLink(clock)


@pytest.fixture
def sent():
    return []


@pytest.fixture
def ready(session, sent, frame_of):
    """A session with a sequence of three rows and an idle rover where it starts."""
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(sent.append)
    session.rover.take_telemetry(frame_of(1, time=1.0))
    return session


def test_a_repeated_frame_is_not_news(link, clock, frame_of):
    assert link.take(frame_of(5, time=1.0))
    clock.now = 3.0
    for _ in range(20):
        assert not link.take(frame_of(5, time=1.0))
    assert link.age == 3.0
    assert link.as_dict()["late"] == 20


def test_a_straggler_is_dropped(link, frame_of):
    for number in (1, 2, 4, 3, 5):
        link.take(frame_of(number, time=float(number)))
    assert link.frame.number == 5
    about = link.as_dict()
    assert (about["gaps"], about["late"], about["restarts"], about["clock_jumps"]) == (1, 1, 0, 0)


def test_a_clock_that_goes_back_is_counted(link, frame_of):
    link.take(frame_of(1, time=100.0))
    assert link.take(frame_of(2, time=3.0))
    assert link.take(frame_of(3, time=3.1))
    assert link.as_dict()["clock_jumps"] == 1


def test_a_rover_that_began_anew_is_believed_after_a_few_frames(link, frame_of):
    link.take(frame_of(900, time=100.0))
    taken = [link.take(frame_of(n, time=0.1 * n)) for n in range(RESTART_AFTER + 2)]
    assert taken == [False] * RESTART_AFTER + [True, True]
    assert link.as_dict()["restarts"] == 1


def test_the_first_frame_of_a_new_connection_counts(link, frame_of):
    link.take(frame_of(900, time=100.0))
    link.connect(lambda text: None)
    assert link.take(frame_of(0, time=0.0))
    assert link.as_dict()["restarts"] == 1


def test_the_age_counts_from_when_a_frame_came(link, clock, frame_of):
    clock.now = 5.0
    link.take(frame_of(1), at=2.0)
    assert link.age == 3.0


def test_a_complaint_of_the_rover_is_logged_once_and_counted(session):
    told = []
    session.listen(told.append)
    for _ in range(50):
        session.rover.take_complaint("the cameras are busy", message_id="images-1")
    faults = [e for e in session.events() if e.type == "link_fault"]
    assert [(e.payload["id"], e.payload["reason"]) for e in faults] == [("images-1", "the cameras are busy")]
    assert session.summary()["link"]["fault"] == "the cameras are busy"
    assert session.summary()["link"]["faults"] == 50
    assert told[-1]["link"]["faults"] == 50


def test_a_returning_rover_has_not_acknowledged_the_stop(ready):
    ready.commands.stop("now")
    ready.rover.take_stop_acknowledgement()
    assert ready.state.stop.acknowledged
    ready.rover.disconnected()
    ready.rover.connected(lambda text: None)
    assert not ready.commands.gate["stop_acknowledged"]
    assert not ready.state.stop.acknowledged
    with pytest.raises(Conflict, match="not acknowledged"):
        ready.commands.clear_stop()
    ready.rover.take_stop_acknowledgement()
    ready.commands.clear_stop()
    assert not ready.state.stop.latched


def test_an_acknowledgement_of_a_cleared_stop_is_none_of_the_next(ready):
    gate = ready.rover.commanding.gate
    ready.commands.stop("one")
    first = gate.stop_id
    ready.commands.stop("one again")
    again = gate.stop_id
    ready.rover.take_stop_acknowledgement(first)
    assert ready.commands.gate["stop_acknowledged"]
    ready.commands.clear_stop()
    ready.commands.stop("two")
    ready.rover.take_stop_acknowledgement(again)
    ready.rover.take_stop_acknowledgement("stop")
    assert not ready.commands.gate["stop_acknowledged"]
    ready.rover.take_stop_acknowledgement(gate.stop_id)
    assert ready.commands.gate["stop_acknowledged"]


def test_a_stop_while_another_is_cleared_wins(ready, sent):
    ready.commands.stop("one")
    ready.rover.take_stop_acknowledgement()

    def press(message):
        if message["type"] == "event" and message["event"]["type"] == "stop_cleared":
            other = threading.Thread(target=ready.commands.stop, args=("two",))
            other.start()
            other.join()

    unlisten = ready.listen(press)
    with pytest.raises(Conflict, match="another stop"):
        ready.commands.clear_stop()
    unlisten()
    assert ready.commands.gate["stopped"]
    assert ready.state.stop.latched
    assert not any("clear_stop" in text for text in sent)
    with pytest.raises(CommandRefused):
        ready.commands.arm()


def test_clearing_is_told_with_the_gate_held():
    gate = Gate(stopped=True)
    seen = []
    assert gate.unlatch(gate.stops(), lambda: seen.append(gate._guard.locked()))
    assert seen == [True]


def test_an_older_acknowledgement_does_not_undo_done(ready):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.rover.take_acknowledgement(ids[0], "done")
    ready.rover.take_acknowledgement(ids[0], "received")
    assert ready.state.commands[0].state == "done"


def test_green_needs_a_rover_that_is_there_and_where_it_was(ready, frame_of, monkeypatch):
    assert ready.review.plan_matches_rover()["ok"] is True
    monkeypatch.setattr(type(ready.rover.link), "age", property(lambda self: 2.5))
    assert ready.review.plan_matches_rover()["ok"] is None
    monkeypatch.undo()
    frame = frame_of(2, time=2.0)
    moved = frame.state.T_site_base.copy()
    moved[0, 3] += 0.2
    ready.rover.take_telemetry(replace(frame, state=replace(frame.state, T_site_base=moved)))
    match = ready.review.plan_matches_rover()
    assert match["ok"] is False
    assert "chassis" in match["reason"]
    ready.rover.disconnected()
    assert ready.review.plan_matches_rover()["ok"] is None


def test_a_token_sends_the_version_that_was_armed_and_no_other(ready, sent):
    token = ready.commands.arm()["token"]
    with pytest.raises(CommandRefused, match="another version"):
        ready.commands.send(token, expected="0" * 32)
    assert not any('"command"' in text for text in sent)
    ready.commands.send(token, expected=ready.state.sequence)


def test_looking_at_a_session_leaves_the_rover_where_it_is(sessions, session, tmp_path):
    other = sessions.create("other")
    told = []
    other.listen(told.append)
    assert sessions.current is other
    session.close()
    del sessions._open[session.id]
    assert sessions.get(session.id).id == session.id
    assert sessions.get("current") is other
    assert sessions.opened()[0] is other
    sessions.open(session.id)
    assert sessions.current.id == session.id
    assert told == [{"type": "session", "session": {"current": session.id}}]


def test_no_other_session_takes_the_rover_while_commands_are_sent(sessions, ready):
    bundle = ready.export_bundle()
    ready.commands.send(ready.commands.arm()["token"])
    for take in (lambda: sessions.create("other"), lambda: sessions.import_bundle(bundle)):
        with pytest.raises(Conflict, match="on their way"):
            take()
    assert sessions.open(ready.id) is ready
    ready.commands.stop("enough")
    assert sessions.create("other") is sessions.current
