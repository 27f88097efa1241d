"""The records of stops may be written in another order than it happened in: the stop is answered before its record."""

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidBundle
from footfall.session import stop_log
from footfall.session.access.identity import Identity, Role
from footfall.session.log.event import next_event
from footfall.session.log.fold import fold_all
from tests.support.waiting import BOUND

STOPS = st.lists(st.tuples(st.booleans(), st.integers(0, 2)), min_size=1, max_size=4)
"""Of each stop: whether the rover said that it stands, and how often it was asked for again."""


def happened(stops, cleared):
    """What is told of ``stops`` one after the other; the last one is cleared or not."""
    told, number = [], 0
    for heard, again in stops:
        number += 1
        told.append(("stop_requested", {"stop": number, "reason": f"number {number}", "at": float(number)}))
        number += again
        if heard:
            told.append(("stop_acknowledged", {"stop": number}))
        told.append(("stop_cleared", {"stop": number}))
    return told if cleared else told[:-1]


def folded(steps):
    events = []
    for i, (type, payload) in enumerate(steps):
        events.append(next_event(events[-1] if events else None, 1000.0 + i, type, payload))
    return fold_all(events)


@given(STOPS, st.booleans(), st.data())
def test_the_order_of_the_records_changes_nothing(stops, cleared, data):
    told = happened(stops, cleared)
    state = folded(data.draw(st.permutations(told))).stop
    assert state.latched == (not cleared)
    assert state.acknowledged == (not cleared and stops[-1][0])
    assert state.reason == ("" if cleared else f"number {sum(1 + again for _, again in stops[:-1]) + 1}")


@given(st.lists(st.tuples(st.booleans(), st.just(0)), max_size=3), st.booleans())
def test_logs_from_before_stops_were_numbered_are_read_by_their_order(stops, cleared):
    stops = [*stops, (True, 0)]
    old = [(type, {k: v for k, v in payload.items() if k != "stop"}) for type, payload in happened(stops, cleared)]
    assert folded(old).stop.digest == folded(happened(stops, cleared)).stop.digest


def test_a_rover_that_comes_has_heard_of_no_stop_yet():
    told = happened([(True, 0)], cleared=False)
    assert not folded([*told, ("link_connected", {"epoch": 2})]).stop.acknowledged
    assert folded([*told, ("link_connected", {"epoch": 2}), told[1]]).stop.acknowledged


@pytest.mark.parametrize("number", [-1, 1.0, True, "1", 2**53])
def test_what_is_no_number_of_a_stop_is_refused(number):
    with pytest.raises(InvalidBundle, match="no number of a stop"):
        folded([("stop_acknowledged", {"stop": number})])


@given(st.permutations(["run_started", "command_sent", "run_ended"]))
def test_a_run_that_a_stop_ends_has_ended_whenever_its_beginning_is_written(order):
    told = {
        "run_started": {"run": 3, "mark": "m", "sequence": "s", "rows": 2},
        "command_sent": {"id": "m-1", "sequence": "s", "run": 3, "row": 0},
        "run_ended": {"run": 3, "outcome": "stopped", "reason": "stopped", "unsent": 1},
    }
    state = folded([(type, told[type]) for type in order])
    assert state.run is not None
    assert (state.runs, state.run.number, state.run.state, state.run.outcome) == (3, 3, "ended", "stopped")
    if order.index("run_started") < order.index("run_ended"):
        assert (state.run.rows, state.run.mark) == (2, "m")


def test_the_end_of_a_run_says_nothing_of_the_commands_of_the_next():
    state = folded(
        [
            ("run_started", {"run": 2, "rows": 1}),
            ("command_sent", {"id": "b", "sequence": "s", "run": 2, "row": 0}),
            ("run_ended", {"run": 1, "reason": "stopped"}),
        ]
    )
    assert [command.state for command in state.commands] == ["sent"]
    assert state.run is not None
    assert state.run.state == "going"


@pytest.fixture
def ready(session, frame_of):
    """A session with a rover on the link."""
    session.rover.connected(lambda text: None)
    session.rover.take_telemetry(frame_of(0))
    return session


@pytest.fixture
def slow_record(ready, monkeypatch):
    """The log writes that a stop was asked for only once this is set."""
    monkeypatch.setattr(stop_log, "PATIENCE", 0.05)
    goes_on, record = threading.Event(), ready.rover.commanding._record_anyway

    def record_anyway(type, payload):
        if type == "stop_requested":
            assert goes_on.wait(BOUND)
        record(type, payload)

    monkeypatch.setattr(ready.rover.commanding, "_record_anyway", record_anyway)
    return goes_on


def written(ready, slow_record):
    slow_record.set()
    ready.rover.commanding._stop_log.close()
    return [event.type for event in ready.events() if event.type.startswith("stop_")]


def test_an_acknowledgement_that_is_written_before_its_stop_counts(ready, slow_record):
    ready.commands.stop("now")
    ready.rover.take_stop_acknowledgement()
    assert written(ready, slow_record) == ["stop_acknowledged", "stop_requested"]
    assert ready.state.stop.latched
    assert ready.state.stop.acknowledged
    assert ready.summary()["stop"]["acknowledged"]


def test_a_clearing_that_is_written_before_its_stop_counts(ready, slow_record):
    ready.commands.stop("now")
    ready.rover.take_stop_acknowledgement()
    ready.commands.clear_stop()
    assert written(ready, slow_record) == ["stop_acknowledged", "stop_cleared", "stop_requested"]
    assert not ready.state.stop.latched
    assert not ready.commands.gate["stopped"]


def test_stops_are_counted_on_after_the_session_was_closed(sessions, ready):
    for _ in range(2):
        ready.commands.stop("now")
        ready.commands.stop("again")
        ready.rover.take_stop_acknowledgement()
        ready.commands.clear_stop()
    session_id = ready.id
    ready.close()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    again.commands.stop("after it was opened anew")
    assert again.state.stop.latched
    assert again.state.stop.number == 5


ANN, BOB = (Identity(name, Role.VIEWER, "10.0.0.1") for name in ("ann", "bob"))


def askers(ready):
    return [
        (event.type, event.payload["by"]["name"], event.payload["by"]["page"], event.payload["reason"])
        for event in ready.events()
        if event.type in ("stop_requested", "stop_repeated")
    ]


def test_everybody_who_asks_for_a_stop_is_in_the_log_once(ready):
    again = Identity("ann", Role.VIEWER, "10.0.0.1", "another page")
    for who, reason in ((ANN, "smoke"), (ANN, "smoke"), (BOB, "it tips"), (again, ""), (BOB, ""), (ANN, "")):
        ready.commands.stop(reason, who)
    first = [
        ("stop_requested", "ann", "", "smoke"),
        ("stop_repeated", "bob", "", "it tips"),
        ("stop_repeated", "ann", "another page", ""),
    ]
    assert askers(ready) == first
    assert ready.state.stop.reason == "smoke"
    ready.rover.take_stop_acknowledgement()
    ready.commands.clear_stop()
    assert not ready.state.stop.latched
    ready.commands.stop("again", BOB)
    ready.commands.stop("again", ANN)
    assert askers(ready) == [*first, ("stop_requested", "bob", "", "again"), ("stop_repeated", "ann", "", "again")]


def test_a_flood_of_pages_that_ask_for_a_stop_does_not_fill_the_log(ready):
    for page in range(3 * stop_log.ASKED_AT_MOST):
        ready.commands.stop("", Identity("ann", Role.VIEWER, "10.0.0.1", f"page {page}"))
    assert len(askers(ready)) == stop_log.ASKED_AT_MOST
    assert ready.commands.gate["stopped"]


def test_a_stop_by_somebody_else_is_answered_while_the_first_is_still_being_written(ready, slow_record):
    ready.commands.stop("now", ANN)
    ready.commands.stop("now", BOB)
    assert askers(ready) == [("stop_repeated", "bob", "", "now")]
    assert not ready.state.stop.latched  # of the log; the gate has it
    assert ready.commands.gate["stopped"]
    assert written(ready, slow_record) == ["stop_repeated", "stop_requested"]
    assert ready.state.stop.latched
