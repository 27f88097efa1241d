"""The conn, steering a run, what is asked before rows go on, and who is on record for it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.session.access.identity import Identity, Role
from footfall.session.gate import lease
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.gate.gate import Gate
from footfall.session.gate.lease import ANSWER_WITHIN, CONN_FOR
from footfall.session.rover.light_time import LightTime
from footfall.session.storage.store import SessionStore
from footfall.telemetry.link import HelloMessage
from tests.support.waiting import until

MARY = Identity("mary", Role.COMMANDER, "10.0.0.1", "page-a")
OTHER_PAGE = replace(MARY, page="page-b")
JOHN = Identity("john", Role.ADMIN, "10.0.0.2", "page-c")
EVE = Identity("eve", Role.VIEWER, "10.0.0.3")
PAST = 1e6  # [s]


@pytest.fixture
def down():
    """What arrives at the rover."""
    return []


@pytest.fixture
def ready(session, down, frame_of):
    """A session with a sequence of three rows and an idle rover where it starts."""
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(lambda text: down.append(json.loads(text)))
    session.rover.take_telemetry(frame_of(0))
    return session


def commands(down):
    return [one["id"] for one in down if one["type"] == "command"]


def begun(session, who=MARY, steps=False):
    return session.commands.send(session.commands.arm(who=who)["token"], who=who, step_by_step=steps)["commands"]


def refused(check, act, *args, **named):
    with pytest.raises(CommandRefused) as caught:
        act(*args, **named)
    assert caught.value.details["check"] == check
    return caught.value


def arrive(session, command, frame):
    """The rover is done with ``command`` and stands where the sequence has it then."""
    row = int(command.rsplit("-", 1)[1])
    posture = session.get(session.state.sequence).predicted[row]
    session.rover.take_telemetry(
        replace(frame, number=row + 1, state=replace(frame.state, posture=posture, time=row + 1.0))
    )
    session.rover.take_acknowledgement(command, "done")


def test_step_by_step_every_row_waits(ready, down, frame_of):
    ids = begun(ready, steps=True)
    assert commands(down) == ids[:1]
    arrive(ready, ids[0], frame_of())
    assert commands(down) == ids[:1]
    assert ready.commands.gate["waiting"]
    ready.commands.next_row(MARY)
    refused("run", ready.commands.next_row, MARY)
    assert commands(down) == ids[:2]
    arrive(ready, ids[1], frame_of())
    ready.commands.resume(MARY)
    arrive(ready, ids[2], frame_of())
    assert ready.commands.run["outcome"] == "done"
    assert commands(down) == ids


def test_hold_resume_and_abort(ready, down, frame_of):
    ids = begun(ready)
    ready.commands.hold(MARY)
    arrive(ready, ids[0], frame_of())
    assert commands(down) == ids[:1]
    assert "held by mary" in ready.commands.gate["why"]
    ready.commands.resume(MARY)
    assert commands(down) == ids[:2]
    ready.commands.abort(MARY)
    assert ready.commands.run["state"] == "aborting"
    refused("run", ready.commands.resume, MARY)
    arrive(ready, ids[1], frame_of())
    assert (ready.commands.run["state"], ready.commands.run["outcome"]) == ("ended", "aborted")
    assert [row["state"] for row in ready.commands.run["rows"]] == ["done", "done", "unsent"]
    assert commands(down) == ids[:2]


def test_an_abort_while_a_run_waits_ends_it_at_once(ready, frame_of):
    ids = begun(ready, steps=True)
    arrive(ready, ids[0], frame_of())
    ready.commands.abort(MARY)
    end = ready.events()[-1]
    assert (end.type, end.payload["outcome"], end.payload["unsent"]) == ("run_ended", "aborted", 2)


def test_every_row_says_how_far_it_came_and_when(ready, frame_of):
    assert ready.summary()["run"] is None
    ids = begun(ready, steps=True)
    for state in ("received", "started"):
        ready.rover.take_acknowledgement(ids[0], state)
    arrive(ready, ids[0], frame_of())
    run = ready.commands.run
    assert run is not None
    first, second, _ = run["rows"]
    assert list(first["times"]) == ["queued", "sent", "received", "started", "done"]
    assert sorted(first["times"].values()) == list(first["times"].values())
    assert (second["state"], list(second["times"]), second["id"]) == ("queued", ["queued"], ids[1])


def test_a_run_goes_on_only_where_its_rows_left_the_rover(ready, down, frame_of, tiny):
    ids = begun(ready, steps=True)
    arrive(ready, ids[0], frame_of())
    moved = replace(ready.rover.frame, number=9, state=replace(ready.rover.frame.state, time=9.0))
    off = ready.rover.frame.state.posture + 0.02
    ready.rover.take_telemetry(replace(moved, state=replace(moved.state, posture=off)))
    assert refused("start", ready.commands.next_row, MARY).details["difference"] == pytest.approx(0.02)
    ready.rover.take_telemetry(replace(moved, number=10, state=replace(moved.state, time=10.0)))
    heavier = np.zeros((6, 3))
    heavier[:, 2] = 1.3 * ready.commands._weight(ready.state.sequence) / 6
    ready.rover.take_telemetry(replace(moved, number=11, state=replace(moved.state, time=11.0, wheel_forces=heavier)))
    for act in (ready.commands.next_row, ready.commands.resume):
        assert "plan again" in refused("load", act, MARY).message
    ready.rover.take_telemetry(replace(moved, number=12, state=replace(moved.state, time=12.0)))
    present = ready.state.dem
    ready.terrains.load(tiny.dem(0.1))
    refused("terrain", ready.commands.next_row, MARY)
    ready.terrains.load(ready.get(present))
    ready.rover.disconnected()
    refused("link", ready.commands.resume, MARY)
    assert commands(down) == ids[:1]


def test_a_row_that_ends_while_it_is_asked_to_go_on_takes_no_other_with_it(ready, down, frame_of, monkeypatch):
    """Held, the run waits after it, and nobody has looked where that left the rover."""
    ids = begun(ready)
    ready.commands.hold(MARY)
    gate, off, asked = ready.rover.commanding.gate, frame_of(1, offset=0.5, time=1.0), []
    steer = gate.steer

    def steered(who):
        run = steer(who)
        if len(asked) == 1:
            ready.rover.take_telemetry(off)
            ready.rover.take_acknowledgement(ids[0], "done")
        asked.append(who)
        return run

    monkeypatch.setattr(gate, "steer", steered)
    assert "has ended just now" in refused("run", ready.commands.resume, MARY).message
    assert (len(asked), ready.commands.gate["waiting"]) == (2, True)
    refused("start", ready.commands.resume, MARY)
    assert commands(down) == ids[:1]


def test_one_page_holds_the_conn_and_arming_takes_it(ready):
    begun(ready)
    assert ready.commands.conn["holder"]["page"] == "page-a"
    for act in (ready.commands.hold, ready.commands.abort, ready.commands.next_row):
        error = refused("conn", act, OTHER_PAGE)
        assert error.details["holder"] == "mary"
    refused("role", ready.commands.conn_act, "take", EVE)
    ready.commands.stop(who=EVE)
    ready.rover.take_stop_acknowledgement()
    refused("role", ready.commands.clear_stop, EVE)
    refused("conn", ready.commands.clear_stop, JOHN)
    ready.commands.clear_stop(MARY)
    assert not ready.commands.gate["stopped"]


def test_the_conn_is_asked_for_granted_denied_and_released(ready):
    ready.commands.conn_act("take", MARY)
    refused("conn", ready.commands.conn_act, "take", JOHN)
    ready.commands.conn_act("request", JOHN)
    assert ready.commands.conn["request"]["by"]["name"] == "john"
    refused("conn", ready.commands.conn_act, "request", OTHER_PAGE)
    ready.commands.conn_act("deny", MARY)
    ready.commands.conn_act("request", JOHN)
    ready.commands.conn_act("grant", MARY)
    assert (ready.commands.conn["holder"]["name"], ready.commands.conn["number"]) == ("john", 2)
    refused("conn", ready.commands.conn_act, "heartbeat", MARY)
    ready.commands.conn_act("release", JOHN)
    assert ready.commands.conn["holder"] is None
    said = [e.payload["act"] for e in ready.events() if e.type == "conn_changed"]
    assert said == ["taken", "requested", "denied", "requested", "granted", "released"]


def test_a_request_that_nobody_answers_is_granted_and_a_conn_that_nobody_renews_runs_out():
    held, _ = lease.take(lease.Conn(), MARY, 0.0)
    asked, _ = lease.ask(held, JOHN, 5.0)
    assert lease.passed(asked, 5.0 + ANSWER_WITHIN - 0.1)[0].holder is MARY
    handed, done = lease.passed(asked, 5.0 + ANSWER_WITHIN)
    assert (handed.holder, handed.number, done[0].act) == (JOHN, 2, "unanswered")
    assert lease.passed(held, CONN_FOR - 0.1)[0].holder is MARY
    free, done = lease.passed(held, CONN_FOR)
    assert (free.holder, free.number, done[0].act) == (None, 1, "expired")
    assert lease.take(held, JOHN, CONN_FOR)[0].number == 2
    in_process = replace(MARY, client="")
    assert lease.passed(lease.take(lease.Conn(), in_process, 0.0)[0], PAST)[0].holder is in_process


def test_an_arming_under_an_older_conn_sends_nothing(ready, down):
    token = ready.commands.arm(who=MARY)["token"]
    ready.commands.conn_act("release", MARY)
    ready.commands.conn_act("take", JOHN)
    refused("conn", ready.commands.send, token, who=JOHN)
    ready.commands.conn_act("release", JOHN)
    ready.commands.conn_act("take", MARY)
    refused("conn", ready.commands.send, token, who=MARY)
    assert commands(down) == []


def test_a_run_waits_when_its_conn_changes_hands_and_the_new_holder_goes_on(ready, down, frame_of):
    ids = begun(ready)
    ready.commands.conn_act("request", JOHN)
    ready.commands.conn_act("grant", MARY)
    arrive(ready, ids[0], frame_of())
    assert commands(down) == ids[:1]
    assert "conn" in ready.commands.gate["why"]
    assert ready.commands.run["state"] == "held"
    refused("conn", ready.commands.resume, MARY)
    ready.commands.resume(JOHN)
    assert commands(down) == ids[:2]
    assert [e.payload["by"]["name"] for e in ready.events() if e.type == "run_resumed"] == ["john"]


def test_no_row_goes_on_stale_telemetry(ready, down, monkeypatch):
    monkeypatch.setattr("footfall.session.commanding.Commanding.look", lambda self: None)
    ids = begun(ready)
    monkeypatch.setattr(type(ready.rover.link), "age", property(lambda self: 2.5))
    ready.rover.take_acknowledgement(ids[0], "done")
    assert commands(down) == ids[:1]
    assert ready.commands.run["outcome"] == "link_lost"


def test_nothing_is_armed_or_sent_before_the_rover_has_confirmed_the_epoch(ready, down, frame_of):
    token = ready.commands.arm(who=MARY)["token"]
    ready.rover.disconnected()
    down.clear()
    hello = HelloMessage(ready.robot.name, 6, id="greeting", epoch=None)
    ready.rover.connected(lambda text: down.append(json.loads(text)), hello)
    ready.rover.take_telemetry(frame_of(1, time=1.0))
    error = refused("epoch", ready.commands.arm, who=MARY)
    assert (error.details["epoch"], error.details["confirmed"]) == (ready.rover.epoch, 0)
    refused("epoch", ready.commands.send, token, who=MARY)
    assert not ready.commands.gate["epoch_known"]
    ready.rover.take_epoch("another greeting", ready.rover.epoch)
    refused("epoch", ready.commands.arm, who=MARY)
    assert down == [{"type": "epoch", "id": "greeting", "epoch": ready.rover.epoch}]
    ready.rover.take_epoch("greeting", ready.rover.epoch)
    begun(ready)
    ready.commands.stop(who=MARY)
    ready.rover.take_stop_acknowledgement()
    ready.commands.clear_stop(MARY)
    refused("epoch", ready.commands.arm, who=MARY)
    assert [one["type"] for one in down] == ["epoch", "command", "stop", "epoch", "clear_stop"]
    ready.rover.take_epoch("greeting", ready.rover.epoch)
    begun(ready)


def test_a_rover_that_comes_back_is_heard_before_anything_goes(ready, down, frame_of):
    """It may have started anew with other joint angles: what it said before tells nothing, however lately that was."""
    ids = begun(ready, steps=True)
    arrive(ready, ids[0], frame_of())
    ready.rover.disconnected()
    ready.rover.connected(lambda text: down.append(json.loads(text)))
    assert ready.rover.telemetry_age < STALE_AFTER
    for act in (ready.commands.next_row, ready.commands.resume):
        assert "since it connected" in refused("telemetry", act, MARY).message
    ready.commands.abort(MARY)
    refused("telemetry", ready.commands.arm, who=MARY)
    assert "since it connected" in ready.fits.unheard()
    assert ready.review.plan_matches_rover()["ok"] is None
    assert commands(down) == ids[:1]
    ready.rover.take_telemetry(frame_of(1))
    assert not ready.fits.unheard()
    begun(ready)
    assert len(commands(down)) == 2


def test_what_a_rover_said_before_it_was_lost_and_comes_after_it_is_back_is_of_before(ready, down, frame_of):
    """With a light time it is still on its way when the rover has come back."""
    link = ready.rover.link
    ready.rover.set_light_time(LightTime(telemetry=0.25))
    ready.rover.take_telemetry(frame_of(1, time=1.0))
    ready.rover.disconnected()
    ready.rover.connected(lambda text: down.append(json.loads(text)))
    until(lambda: link.frame.number == 1, "what was said before")
    assert (link.connected, link.age_since_connected) == (True, None)
    ready.rover.take_telemetry(frame_of(2, time=2.0))
    until(lambda: link.frame.number == 2, "what was said since")
    assert link.age_since_connected is not None


def test_the_number_of_the_conn_goes_on_after_a_restart(sessions, ready):
    ready.commands.conn_act("take", MARY)
    ready.commands.conn_act("release", MARY)
    ready.commands.conn_act("take", JOHN)
    ready.close()
    del sessions._open[ready.id]
    again = sessions.open(ready.id)
    assert (again.commands.conn["number"], again.commands.conn["holder"]) == (2, None)
    again.commands.conn_act("take", MARY)
    assert again.commands.conn["number"] == 3


def test_a_gate_tells_of_what_time_did():
    now, told = [0.0], []
    gate = Gate(clock=lambda: now[0], notify=told.append)
    gate.act("take", MARY)
    now[0] = CONN_FOR
    gate.pass_time()
    gate.pass_time()
    assert [done.act for done in told] == ["taken", "expired"]


def test_another_weight_than_was_planned_with_is_refused(ready, frame_of):
    weight = ready.commands._facts(ready.state.sequence).weight
    for number, (share, fits) in enumerate([(1.0, True), (1.09, True), (1.12, False), (1.62 / 9.81, False)], 1):
        forces = np.zeros((6, 3))
        forces[:, 2] = share * weight / 6
        frame = frame_of(number, time=float(number))
        ready.rover.take_telemetry(replace(frame, state=replace(frame.state, wheel_forces=forces)))
        if fits:
            ready.commands.arm(who=MARY)
        else:
            assert refused("load", ready.commands.arm, who=MARY).details["planned_with"] == pytest.approx(weight)


def test_acts_and_refusals_are_on_record_with_who_what_from_where(ready):
    begun(ready)
    refused("conn", ready.commands.abort, JOHN)
    ready.commands.hold(MARY)
    ready.commands.stop("the wheel sinks", EVE)
    by = {e.type: e.payload for e in ready.events() if "by" in e.payload}
    mary = {"name": "mary", "role": "commander", "client": "10.0.0.1", "page": "page-a"}
    for type in ("conn_changed", "armed", "run_started", "run_held"):
        assert (by[type]["by"], by[type]["conn"]) == (mary, 1), type
    assert (by["act_refused"]["act"], by["act_refused"]["by"]["client"]) == ("abort", "10.0.0.2")
    assert by["act_refused"]["check"] == "conn"
    assert (by["stop_requested"]["by"]["name"], by["stop_requested"]["reason"]) == ("eve", "the wheel sinks")


def test_what_became_of_a_command_is_asked_after_a_restart_and_never_guessed(sessions, ready, down):
    ids = begun(ready)
    ready.close()
    del sessions._open[ready.id]
    again = sessions.open(ready.id)
    assert again.state.commands[0].state == "unknown"
    again.rover.connected(lambda text: down.append(json.loads(text)))
    assert [one for one in down if one["type"] == "query"] == [{"type": "query", "id": ids[0]}]
    again.rover.take_acknowledgement(ids[0], "unknown", "never came")
    assert (again.state.commands[0].state, again.state.commands[0].reason) == ("unknown", "never came")
    again.rover.take_acknowledgement(ids[0], "done")
    again.rover.take_acknowledgement(ids[0], "unknown", "late")
    assert again.state.commands[0].state == "done"
    assert commands(down) == ids[:1]


def test_an_overdue_row_is_asked_for(ready, down, monkeypatch):
    monkeypatch.setattr("footfall.session.gate.runs.RECEIVED_WITHIN", 0.1)
    ids = begun(ready)
    until(lambda: [one["id"] for one in down if one["type"] == "query"] == ids[:1], "the question")
    ready.rover.take_acknowledgement(ids[0], "refused", "the joint is stuck")
    assert ready.state.commands[0].state == "refused"


def test_a_look_that_fails_is_not_the_last_one(ready, down, monkeypatch):
    """Without the next ones no stop would be told again, and no lost link be noticed."""
    commanding, failed = ready.rover.commanding, []
    look = commanding.look

    def fails_once():
        if not failed:
            failed.append(True)
            raise OSError(5, "Input/output error")
        look()

    monkeypatch.setattr(commanding, "look", fails_once)
    ready.commands.stop(who=MARY)
    until(lambda: [one["type"] for one in down].count("stop") > 1, "the stop that is told again")
    assert failed


def test_another_session_does_not_take_the_rover_from_a_run_that_waits(sessions, ready, frame_of):
    ids = begun(ready, steps=True)
    arrive(ready, ids[0], frame_of())
    with pytest.raises(Conflict, match="on their way"):
        sessions.create("other")


def test_a_run_that_begins_while_another_session_is_made_or_read_keeps_the_rover(
    sessions, ready, frame_of, monkeypatch
):
    other = sessions.create("other").id
    sessions.open(ready.id)
    there = {one["id"] for one in sessions.list()}
    # however long that takes, no time passes for rover and run
    monkeypatch.setattr(ready.rover.link, "_clock", lambda: 0.0)
    monkeypatch.setattr(ready.rover.commanding.gate, "_clock", lambda: 0.0)
    ready.rover.take_telemetry(frame_of(1, time=1.0))

    def begins_meanwhile(do):
        def done(*about):
            found = do(*about)
            begun(ready)
            return found

        return done

    for act, module, name in ((sessions.open, sessions, "_load"), (sessions.create, SessionStore, "create")):
        with monkeypatch.context() as slow:
            slow.setattr(module, name, begins_meanwhile(getattr(module, name)))
            with pytest.raises(Conflict, match="on their way"):
                act(other)
        assert sessions.current is ready
        assert ready.commands.gate["run"] is not None
        ready.commands.stop(who=MARY)
        ready.rover.take_stop_acknowledgement()
        ready.commands.clear_stop(MARY)
        ready.commands.conn_act("release", MARY)
    assert {one["id"] for one in sessions.list()} == there
