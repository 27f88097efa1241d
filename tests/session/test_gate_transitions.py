"""What each input of the gate makes of each state: one transition, one refusal at a time, to the edge of bounds."""

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from footfall.core.errors import CommandRefused
from footfall.core.value import Provenance
from footfall.sequence.commands import Command, Sequence
from footfall.session.access.identity import Identity, Role
from footfall.session.answers.commands import GateAnswer
from footfall.session.gate import machine
from footfall.session.gate.lease import CONN_FOR, Conn, Request
from footfall.session.gate.machine import ARMED_FOR, Armed, Latch, State
from footfall.session.gate.runs import STEP_BY_STEP, Run

MARY = Identity("mary", Role.COMMANDER, "10.0.0.1", "page-a")
JOHN = Identity("john", Role.ADMIN, "10.0.0.2", "page-c")
EVE = Identity("eve", Role.VIEWER, "10.0.0.3")
MOVE = Command("LEG_MOVE", 0, np.zeros(6), 1.0)
SEQUENCE = Sequence("r", (MOVE,) * 3, np.zeros(36), np.zeros((3, 36)), np.eye(4), (), Provenance({}))
DIGEST, TOKEN, MARK = "d" * 32, "a token", "m"
NOW = 100.0

OPEN = State(Conn(4))
HELD = State(Conn(4, MARY, NOW))
ARMED = machine.arm(HELD, MARY, DIGEST, TOKEN, NOW)
STOPPED = machine.latch(HELD)


def begun(state: State = ARMED, steps: bool = False) -> State:
    return machine.begin(state, MARY, TOKEN, SEQUENCE, MARK, NOW, steps)


DUE = begun()
CLAIMED = machine.claim(DUE, 1, NOW, True)[0]


def run_of(state: State) -> Run:
    assert state.run is not None
    return state.run


OUT: Any = machine.release(CLAIMED, run_of(CLAIMED), NOW, True)
WAITING = begun(steps=True)
WAITING = replace(WAITING, run=replace(run_of(WAITING), phase="waiting"))
UNTOLD = {"epoch": 3, "heard": 2}
"""Of a state whose epoch the rover has not confirmed."""


def refused(check, act, *args, **named) -> CommandRefused:
    with pytest.raises(CommandRefused) as caught:
        act(*args, **named)
    assert caught.value.details["check"] == check
    assert caught.value.message
    return caught.value


# -- arming ------------------------------------------------------------------------------------


def test_arming_takes_the_conn_that_nobody_holds_and_lasts_ten_seconds():
    armed = machine.arm(OPEN, MARY, DIGEST, TOKEN, NOW)
    assert armed.armed == Armed(TOKEN, DIGEST, NOW + 10.0, 5)
    assert (armed.conn.holder, armed.conn.number, armed.run) == (MARY, 5, None)
    assert [done.act for done in armed.done] == ["taken"]
    assert ARMED.armed == Armed(TOKEN, DIGEST, NOW + ARMED_FOR, 4)
    assert ARMED.done == ()


def test_nothing_is_armed_where_something_is_in_the_way():
    refused("stop", machine.arm, STOPPED, MARY, DIGEST, TOKEN, NOW)
    error = refused("busy", machine.arm, OUT, MARY, DIGEST, TOKEN, NOW)
    assert error.details["run"] == 1
    refused("conn", machine.arm, HELD, JOHN, DIGEST, TOKEN, NOW)
    refused("role", machine.arm, OPEN, EVE, DIGEST, TOKEN, NOW)
    error = refused("epoch", machine.arm, replace(HELD, **UNTOLD), MARY, DIGEST, TOKEN, NOW)
    assert (error.details["epoch"], error.details["confirmed"]) == (3, 2)
    assert machine.arm(replace(HELD, epoch=3, heard=3), MARY, DIGEST, TOKEN, NOW).armed
    assert machine.arm(replace(HELD, epoch=3, heard=None), MARY, DIGEST, TOKEN, NOW).armed


def test_a_newer_arming_replaces_an_older_one():
    again = machine.arm(ARMED, MARY, "e" * 32, "another", NOW + 1)
    assert machine.armed_sequence(again, "another", NOW + 1) == "e" * 32
    refused("arming", machine.armed_sequence, again, TOKEN, NOW + 1)


def test_a_token_is_good_until_its_last_moment_and_under_its_number_only():
    assert machine.armed_sequence(ARMED, TOKEN, NOW + ARMED_FOR) == DIGEST
    late = refused("arming", machine.armed_sequence, ARMED, TOKEN, NOW + ARMED_FOR + 1e-6)
    assert "10 s" in late.message
    refused("arming", machine.armed_sequence, ARMED, "another", NOW)
    refused("arming", machine.armed_sequence, HELD, TOKEN, NOW)
    for number in (3, 5):
        error = refused("conn", machine.armed_sequence, replace(ARMED, conn=Conn(number, MARY, NOW)), TOKEN, NOW)
        assert error.details["number"] == number
    refused("conn", machine.armed_sequence, replace(ARMED, conn=Conn(4)), TOKEN, NOW)
    # the lease ran out, though nobody has looked yet
    gone = replace(ARMED, conn=Conn(4, MARY, NOW - CONN_FOR))
    refused("conn", machine.armed_sequence, gone, TOKEN, NOW)


# -- a run -------------------------------------------------------------------------------------


def test_a_run_begins_with_its_first_row_due_and_uses_the_token_up():
    state = machine.begin(replace(ARMED, runs=6), MARY, TOKEN, SEQUENCE, MARK, NOW + 3)
    run = run_of(state)
    assert (run.number, run.mark, run.digest, run.sequence) == (7, MARK, DIGEST, SEQUENCE)
    assert (run.by, run.fence, run.row, run.phase, run.going, run.why) == (MARY, 4, 0, "due", True, "")
    assert (state.runs, state.armed, state.conn.renewed) == (7, None, NOW + 3)
    step = run_of(begun(steps=True))
    assert (step.going, step.why, step.phase) == (False, STEP_BY_STEP, "due")


def test_nothing_is_begun_where_something_is_in_the_way():
    refused("stop", machine.begin, replace(ARMED, stop=Latch(True)), MARY, TOKEN, SEQUENCE, MARK, NOW)
    refused("busy", machine.begin, replace(ARMED, run=DUE.run), MARY, TOKEN, SEQUENCE, MARK, NOW)
    refused("arming", machine.begin, ARMED, MARY, "another", SEQUENCE, MARK, NOW)
    refused("conn", machine.begin, ARMED, JOHN, TOKEN, SEQUENCE, MARK, NOW)
    refused("epoch", machine.begin, replace(ARMED, **UNTOLD), MARY, TOKEN, SEQUENCE, MARK, NOW)


def hindered(state: State, now: float = NOW, fresh: bool = True) -> str:
    return machine.hindrance(state, now, fresh)


def test_what_keeps_a_row_from_going_is_told_in_the_order_of_what_is_worst():
    assert hindered(DUE) == ""
    assert hindered(DUE, fresh=False) == "telemetry"
    assert hindered(replace(DUE, **UNTOLD)) == "epoch"
    assert hindered(replace(DUE, **UNTOLD), fresh=False) == "telemetry"
    assert hindered(DUE, NOW + CONN_FOR) == "conn"
    assert hindered(DUE, NOW + CONN_FOR - 0.01) == ""
    for conn in (Conn(4), Conn(3, MARY, NOW), Conn(5, MARY, NOW)):
        assert hindered(replace(DUE, conn=conn), fresh=False) == "conn"
    assert hindered(replace(DUE, stop=Latch(True), conn=Conn(9))) == "stop"
    assert hindered(replace(DUE, run=None)) == "stop"
    assert hindered(replace(DUE, run=replace(run_of(DUE), aborted=True))) == "stop"


def test_a_row_is_claimed_once_and_by_its_run_only():
    state, run, why = machine.claim(DUE, 1, NOW, True)
    assert (run_of(state), why) == (run, "")
    assert run_of(state).phase == "claimed"
    over = replace(OUT, run=replace(run_of(OUT), phase="over"))
    for other, number in ((DUE, 2), (DUE, 0), (state, 1), (HELD, 1), (OUT, 1), (WAITING, 1), (over, 1)):
        assert machine.claim(other, number, NOW, True) == (other, None, "")


def test_a_row_that_is_hindered_is_not_claimed_and_waits_only_for_conn_and_epoch():
    assert machine.claim(DUE, 1, NOW, False) == (DUE, None, "telemetry")
    stopped = replace(DUE, stop=Latch(True))
    assert machine.claim(stopped, 1, NOW, True) == (stopped, None, "stop")
    for changed, check in (({"conn": Conn(4)}, "conn"), (UNTOLD, "epoch")):
        state, run, why = machine.claim(replace(DUE, **changed), 1, NOW, True)
        assert (run, why) == (None, check)
        held = run_of(state)
        assert (held.phase, held.going, held.why) == ("waiting", False, machine.HOLDS[check])


def test_only_the_row_that_is_claimed_is_released_and_only_while_nothing_hinders_it():
    out = machine.release(CLAIMED, run_of(CLAIMED), NOW + 1, True)
    assert out is not None
    assert (run_of(out).phase, run_of(out).released_at, run_of(out).received) == ("out", NOW + 1, False)
    claimed = run_of(CLAIMED)
    assert machine.release(HELD, claimed, NOW, True) is None
    assert machine.release(DUE, run_of(DUE), NOW, True) is None
    assert machine.release(CLAIMED, replace(claimed, row=1), NOW, True) is None
    assert machine.release(CLAIMED, replace(claimed, number=2), NOW, True) is None
    assert machine.release(CLAIMED, claimed, NOW, False) is None
    assert machine.release(replace(CLAIMED, stop=Latch(True)), claimed, NOW, True) is None
    assert machine.release(replace(CLAIMED, **UNTOLD), claimed, NOW, True) is None


def test_an_acknowledgement_counts_for_the_row_that_is_out_alone():
    name = run_of(OUT).command_id
    known = machine.heard(OUT, name)
    assert known is not None
    assert run_of(known).received
    assert not run_of(OUT).received
    for state in (HELD, DUE, CLAIMED, WAITING):
        assert machine.heard(state, name) is None
    for other in ("", name[:-1] + "1", name + "0"):
        assert machine.heard(OUT, other) is None


def test_a_row_that_is_done_makes_the_next_one_due():
    run = run_of(OUT)
    state = machine.row_done(OUT, run)
    assert state is not None
    assert (run_of(state).row, run_of(state).phase) == (1, "due")
    over = replace(OUT, run=replace(run, phase="over"))
    for other in (HELD, DUE, CLAIMED, WAITING, over):
        assert machine.row_done(other, run) is None
    assert machine.row_done(OUT, replace(run, row=1)) is None
    assert machine.row_done(OUT, replace(run, number=2)) is None


# -- steering ----------------------------------------------------------------------------------


def test_the_holder_steers_and_whoever_comes_where_nobody_holds_the_conn():
    state, run = machine.steered(OUT, MARY, NOW + 5)
    assert (run, state.conn.renewed) == (OUT.run, NOW + 5)
    for act in (machine.hold, machine.abort):
        refused("conn", act, OUT, JOHN, NOW)
        refused("run", act, HELD, MARY, NOW)
    refused("conn", machine.go_on, OUT, JOHN, NOW, True)
    taken = machine.hold(replace(OUT, conn=Conn(4)), JOHN, NOW)
    assert (taken.conn.holder, taken.conn.number) == (JOHN, 5)


def test_a_run_is_held_after_its_row_and_an_aborted_one_stays_as_it_is():
    held = run_of(machine.hold(OUT, MARY, NOW))
    assert (held.going, held.phase, held.why) == (False, "out", "held by mary")
    aborted = machine.abort(OUT, MARY, NOW)
    assert (run_of(aborted).aborted, run_of(aborted).phase) == (True, "out")
    assert run_of(machine.hold(aborted, MARY, NOW)) == run_of(aborted)


def test_a_run_that_waits_goes_on_with_all_rows_or_with_one():
    for going, why in ((True, ""), (False, STEP_BY_STEP)):
        run = run_of(machine.go_on(WAITING, MARY, NOW, going))
        assert (run.phase, run.going, run.why, run.by, run.fence) == ("due", going, why, MARY, 4)
    taken = run_of(machine.go_on(replace(WAITING, conn=Conn(7)), JOHN, NOW, True))
    assert (taken.by, taken.fence) == (JOHN, 8)


def test_a_run_that_is_under_way_goes_on_whole_but_not_row_by_row():
    held = machine.hold(OUT, MARY, NOW)
    assert run_of(machine.go_on(held, MARY, NOW, True)).going
    error = refused("run", machine.go_on, held, MARY, NOW, False)
    assert error.details["row"] == 0
    # the row that is out was told in time: the epoch is asked of what goes next
    assert run_of(machine.go_on(replace(held, **UNTOLD), MARY, NOW, True)).phase == "out"


def test_a_run_goes_on_only_as_it_was_when_the_rover_was_looked_at():
    ended: Any = machine.row_done(machine.hold(OUT, MARY, NOW), run_of(OUT))
    assert (run_of(ended).phase, run_of(ended).row) == ("waiting", 1)
    for before in (OUT, WAITING):
        assert "row 1 has ended" in refused("run", machine.go_on, ended, MARY, NOW, True, run_of(before)).message
    assert run_of(machine.go_on(ended, MARY, NOW, True, run_of(ended))).phase == "due"
    held = machine.hold(OUT, MARY, NOW)
    assert run_of(machine.go_on(held, MARY, NOW, True, run_of(held))).going


def test_nothing_goes_on_where_something_is_in_the_way():
    refused("stop", machine.go_on, replace(WAITING, stop=Latch(True)), MARY, NOW, True)
    refused("epoch", machine.go_on, replace(WAITING, **UNTOLD), MARY, NOW, True)
    refused("run", machine.go_on, HELD, MARY, NOW, True)
    error = refused("run", machine.go_on, machine.abort(OUT, MARY, NOW), MARY, NOW, True)
    assert error.details["run"] == 1


def test_a_run_ends_where_it_is_meant():
    assert machine.end(OUT).run is None
    assert machine.end(OUT, 1).run is None
    assert machine.end(OUT, 2) is OUT
    assert machine.end(OUT, 0) is OUT
    assert machine.end(HELD, 1) is HELD


# -- the stop ----------------------------------------------------------------------------------


def test_a_stop_ends_all_and_begins_an_epoch_once():
    state = machine.latch(replace(OUT, armed=ARMED.armed, epoch=5, stop=Latch(count=2, cleared=1)))
    assert (state.run, state.armed, state.epoch) == (None, None, 6)
    assert state.stop == Latch(True, False, 3, 1)
    known = machine.acknowledged(state, True)
    again = machine.latch(known)
    assert (again.epoch, again.stop) == (6, Latch(True, True, 4, 1))
    assert machine.latch(state).stop.acknowledged is False
    # what was acknowledged before a clearing says nothing of the next stop
    assert machine.latch(replace(HELD, stop=Latch(False, True))).stop.acknowledged is False


def test_a_stop_is_cleared_unless_there_was_another_since():
    twice = machine.latch(STOPPED)
    assert machine.unlatch(twice, 1) is None
    assert machine.unlatch(twice, 3) is None
    for count in (None, 2):
        cleared = machine.unlatch(machine.acknowledged(twice, True), count)
        assert cleared is not None
        assert cleared.stop == Latch(False, False, 2, 3)


def test_whoever_clears_a_stop_holds_the_conn_or_finds_it_free():
    assert machine.require_conn_or_free(STOPPED, MARY, NOW).conn == STOPPED.conn
    assert machine.require_conn_or_free(OPEN, JOHN, NOW).conn == OPEN.conn
    refused("conn", machine.require_conn_or_free, STOPPED, JOHN, NOW)
    refused("role", machine.require_conn_or_free, OPEN, EVE, NOW)
    freed = machine.require_conn_or_free(STOPPED, JOHN, NOW + CONN_FOR)
    assert (freed.conn.holder, [done.act for done in freed.done]) == (None, ["expired"])


def test_an_acknowledgement_of_a_stop_counts_only_while_one_is_in_force():
    assert machine.acknowledged(STOPPED, True).stop.acknowledged
    assert not machine.acknowledged(machine.acknowledged(STOPPED, True), False).stop.acknowledged
    assert not machine.acknowledged(HELD, True).stop.acknowledged


# -- epochs ------------------------------------------------------------------------------------


def test_epochs_only_grow():
    state = replace(HELD, epoch=5)
    assert [machine.new_epoch(state, beyond).epoch for beyond in (0, 4, 5, 6, 9)] == [6, 6, 6, 7, 10]
    assert machine.new_epoch(state).epoch == 6


def test_a_rover_that_comes_has_confirmed_nothing():
    state = machine.rover_came(replace(machine.acknowledged(STOPPED, True), heard=1, epoch=5), 8, True)
    assert (state.epoch, state.heard, state.stop.stopped, state.stop.acknowledged) == (9, 0, True, False)
    assert machine.rover_came(STOPPED, 0, False).heard is None
    assert not machine.epoch_known(state)
    assert machine.epoch_known(replace(state, heard=None))


def test_what_the_rover_confirms_counts_and_what_another_session_told_it_begins_an_epoch():
    state = replace(HELD, epoch=5, heard=2)
    for epoch, heard in ((1, 2), (2, 2), (4, 4), (5, 5)):
        assert machine.epoch_heard(state, epoch, True) == replace(state, heard=heard)
    assert machine.epoch_heard(state, 4, False) == state
    assert machine.epoch_heard(state, 5, False) == state
    assert machine.epoch_heard(state, 6, False) == replace(state, epoch=7)
    assert machine.epoch_heard(replace(state, heard=None), 5, True).heard is None
    known = [machine.epoch_known(replace(HELD, epoch=5, heard=heard)) for heard in (4, 5, 6)]
    assert known == [False, True, True]


# -- the conn, and what is shown -----------------------------------------------------------------


def test_time_and_acts_change_the_conn_and_tell_what_they_did():
    assert [done.act for done in machine.passed(HELD, NOW + CONN_FOR).done] == ["expired"]
    assert machine.passed(HELD, NOW) == HELD
    asked = machine.conn(HELD, "request", JOHN, NOW)
    assert asked.conn.request == Request(JOHN, NOW)
    told = {act: machine.conn(asked, act, MARY, NOW).done[-1].act for act in ("grant", "deny", "release")}
    assert told == {"grant": "granted", "deny": "denied", "release": "released"}
    assert machine.conn(OPEN, "take", JOHN, NOW).conn.holder == JOHN
    assert machine.conn(HELD, "heartbeat", MARY, NOW + 1).conn.renewed == NOW + 1
    # what was done before is kept until it is told
    both = machine.conn(machine.conn(OPEN, "take", MARY, NOW), "release", MARY, NOW)
    assert [done.act for done in both.done] == ["taken", "released"]


def test_what_acts_for_the_holder_of_the_conn_renews_nothing():
    renewed = machine.conn(HELD, "take", MARY, NOW + 1)
    assert machine.unrenewed(HELD, renewed) == HELD
    taken = machine.conn(OPEN, "take", MARY, NOW + 1)
    assert machine.unrenewed(OPEN, taken) is taken
    given_up = machine.conn(HELD, "release", MARY, NOW + 1)
    assert machine.unrenewed(HELD, given_up) is given_up


def shown(state: State, now: float = NOW) -> GateAnswer:
    return machine.as_dict(state, now)


IDLE = {
    "state": "idle",
    "stopped": False,
    "stop_acknowledged": False,
    "epoch": 0,
    "epoch_known": True,
    "run": None,
    "row": None,
    "sequence": None,
    "expires_in": None,
    "mode": None,
    "waiting": False,
    "why": "",
    "aborted": False,
}


def test_what_is_shown_is_what_is():
    assert shown(HELD) == IDLE
    assert shown(ARMED, NOW + 4) == {**IDLE, "state": "armed", "sequence": DIGEST, "expires_in": 6.0}
    assert shown(ARMED, NOW + ARMED_FOR) == IDLE
    assert shown(ARMED, NOW + ARMED_FOR + 1) == IDLE
    assert shown(ARMED, NOW + ARMED_FOR - 0.5)["state"] == "armed"
    sending = {**IDLE, "state": "sending", "run": 1, "row": 0, "sequence": DIGEST, "mode": "whole"}
    assert shown(OUT) == sending
    assert shown(WAITING) == {**sending, "mode": "steps", "waiting": True, "why": STEP_BY_STEP}
    aborted = {**sending, "mode": "steps", "why": "aborted", "aborted": True}
    assert shown(machine.abort(OUT, MARY, NOW)) == aborted
    stopped = {**IDLE, "stopped": True, "stop_acknowledged": True, "epoch": 1, "epoch_known": False}
    assert shown(machine.acknowledged(STOPPED, True)) == stopped


def test_a_new_state_has_confirmed_the_epoch_that_none_has_begun_yet():
    assert State() == State(Conn(), 0, 0, 0, Latch(False, False, 0, 0), None, None, ())
    # what was told is no part of what is
    taken = machine.conn(OPEN, "take", MARY, NOW)
    assert taken.done
    assert replace(taken, done=()) == taken
    for one, name in ((State(), "run"), (Latch(), "stopped"), (ARMED.armed, "until")):
        with pytest.raises(FrozenInstanceError):
            setattr(one, name, None)


def test_the_conn_is_refused_with_what_is_in_the_way():
    taken = machine.conn(OPEN, "request", JOHN, NOW)
    assert (taken.conn.holder, taken.conn.request, taken.done[0].act) == (JOHN, None, "taken")
    again = machine.conn(HELD, "request", MARY, NOW + 1)
    assert (again.conn.holder, again.conn.request, again.conn.renewed) == (
        MARY,
        None,
        NOW + 1,
    )
    asked = machine.conn(HELD, "request", JOHN, NOW)
    assert machine.conn(asked, "request", JOHN, NOW + 1).conn == asked.conn
    error = refused("conn", machine.conn, asked, "request", replace(MARY, page="page-b"), NOW)
    assert error.details["asking"] == "john"
    for act in ("grant", "deny"):
        assert "nobody asks" in refused("conn", machine.conn, HELD, act, MARY, NOW).message
    for act in ("heartbeat", "release", "grant", "deny"):
        error = refused("conn", machine.conn, OPEN, act, MARY, NOW)
        assert (error.details["holder"], error.message) == (None, "nobody holds the conn; take it first")
