"""One rover, one stop, one conn, whichever session holds them: another session is no way around."""

import json
import threading
from itertools import count
from types import SimpleNamespace

import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.session import folded_log, registry
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL, Identity, Role
from footfall.session.clock import ClockWatch
from footfall.session.gate_notices import AGAIN_AFTER
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.storage.head import HELD, HeadFile
from footfall.session.storage.store import SessionStore
from footfall.telemetry.link import HelloMessage
from tests.support.waiting import BOUND, a_while, until

MARY = Identity("mary", Role.COMMANDER, "10.0.0.1", "page-a")
JOHN = Identity("john", Role.COMMANDER, "10.0.0.2", "page-b")


@pytest.fixture
def anew(work, tiny, athlete):
    """anew() → the sessions of one working folder, as another start of FootFall finds them."""
    return lambda: Sessions(work, jobs=InlineJobs("tiny_recipes"), robot=athlete)


@pytest.fixture
def rover():
    heard = []

    def take(text):
        heard.append(json.loads(text)["type"])

    take.heard = heard
    return take


def made(sessions):
    return sessions.create("second")


def opened_again(sessions):
    first = sessions.current.id
    with acting(None):
        sessions.create("between").commands.stop("of the one between")
        sessions.current.commands.clear_stop()
    return sessions.open(first)


def carried_in(sessions):
    return sessions.import_bundle(sessions.current.export_bundle())


@pytest.mark.parametrize("follow", [made, opened_again, carried_in], ids=lambda follow: follow.__name__)
def test_a_stop_stays_in_force_whichever_session_follows(sessions, rover, follow):
    sessions.create("first").commands.stop("danger", MARY)
    live = follow(sessions)
    assert sessions.current is live
    assert live.commands.gate["stopped"]
    live.rover.connected(rover)
    assert rover.heard[0] == "stop"
    with pytest.raises(Conflict, match="not acknowledged"):
        live.commands.clear_stop()
    live.rover.take_stop_acknowledgement()
    live.commands.clear_stop()
    assert not live.commands.gate["stopped"]


def test_the_session_that_follows_says_where_its_stop_comes_from(sessions):
    first = sessions.create("first")
    first.commands.stop("dust storm", MARY)
    with acting(JOHN):
        second = sessions.create("second")
    assert second.state.stop.reason == f"still in force from session {first.id}: dust storm"
    assert [e.payload["by"]["name"] for e in second.events() if e.type == "stop_requested"] == ["john"]


def test_a_stop_that_was_cleared_does_not_come_back(sessions):
    first = sessions.create("first")
    first.commands.stop("danger", MARY)
    first.commands.clear_stop()
    assert not sessions.create("second").commands.gate["stopped"]


def test_a_stop_survives_into_a_new_session_after_the_end_of_the_server(anew):
    with anew() as sessions:
        sessions.create("before")
        first = sessions.create("first")
        first.commands.stop("danger", MARY)
    with anew() as sessions:
        second = sessions.create("second")
        assert second.commands.gate["stopped"]
        assert first.id in second.state.stop.reason
        second.commands.clear_stop()
    with anew() as sessions:
        assert not sessions.create("third").commands.gate["stopped"]


@pytest.fixture
def wall(monkeypatch):
    """The time of day of all sessions, to be set."""
    now = SimpleNamespace(time=2e9)
    monkeypatch.setattr(folded_log, "ClockWatch", lambda last: ClockWatch(last, lambda: now.time))
    return now


def note_elsewhere(sessions, other, wall):
    sessions.get(other).add_note("written last")


def clock_back(sessions, other, wall):
    wall.time -= 3600.0
    sessions.current.add_note("written last, at an earlier time")


@pytest.mark.parametrize("then", [note_elsewhere, clock_back], ids=lambda then: then.__name__)
def test_no_time_in_the_logs_decides_whose_stop_is_left(anew, wall, then):
    with anew() as sessions:
        other = sessions.create("other").id
        first = sessions.create("first")
        then(sessions, other, wall)
        first.commands.stop("danger", MARY)
        if then is note_elsewhere:
            note_elsewhere(sessions, other, wall)
    with anew() as sessions:
        second = sessions.create("second")
        assert second.state.stop.reason == f"still in force from session {first.id}: danger"
        # nor does one come back that was cleared where the rover was by then
        wall.time -= 3600.0
        second.commands.clear_stop()
    with anew() as sessions:
        assert not sessions.create("third").commands.gate["stopped"]


def test_an_end_while_the_rover_changes_sessions_loses_no_stop(anew, monkeypatch):
    with anew() as sessions:
        first = sessions.create("first")
        first.commands.stop("danger", MARY)
        with monkeypatch.context() as patched:
            patched.setattr(registry, "_stay_stopped", lambda *_: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                sessions.create("second")
    with anew() as sessions:
        assert sessions.create("third").state.stop.reason == f"still in force from session {first.id}: danger"
        sessions.current.commands.clear_stop()
    with anew() as sessions:
        assert not sessions.create("fourth").commands.gate["stopped"]


def test_a_session_that_cant_be_read_is_taken_for_stopped(anew, work):
    with anew() as sessions:
        first = sessions.create("first")
        first.commands.stop("danger", MARY)
        first.commands.clear_stop()
    HeadFile(work / first.id).renew(99, "0" * 32)
    with anew() as sessions:
        assert "log can't be read" in sessions.create("second").state.stop.reason


def test_of_sessions_of_an_older_version_the_one_that_was_written_to_last_counts(anew, work):
    with anew() as sessions:
        sessions.create("other")
        first = sessions.create("first")
        first.commands.stop("danger", MARY)
    (held,) = work.glob(f"*/{HELD}")
    assert held.parent.name == first.id
    held.unlink()
    with anew() as sessions:
        assert first.id in sessions.create("second").state.stop.reason


def test_the_session_that_is_opened_again_after_the_end_of_the_server_has_its_own_stop_only(anew):
    with anew() as sessions:
        first = sessions.create("first")
        first.commands.stop("danger", MARY)
        second = sessions.create("second")
        second.commands.clear_stop()
    with anew() as sessions:
        assert not sessions.open(second.id).commands.gate["stopped"]
        assert sessions.open(first.id).state.stop.reason == "danger"


def test_who_holds_the_conn_keeps_the_rover(sessions):
    first = sessions.create("first")
    bundle = first.export_bundle()
    second = sessions.create("second")
    second.commands.conn_act("take", MARY)
    for switch in (
        lambda: sessions.create("third"),
        lambda: sessions.open(first.id),
        lambda: sessions.import_bundle(bundle),
    ):
        with acting(JOHN), pytest.raises(CommandRefused, match=r"mary at 10\.0\.0\.1 holds the conn") as caught:
            switch()
        assert caught.value.details["check"] == "conn"
        assert sessions.current is second
    with acting(JOHN):
        assert sessions.open(second.id) is second
        assert sessions.get(first.id) is first
    with acting(MARY):
        assert sessions.open(first.id) is first
    with acting(JOHN):
        sessions.create("of john, for nobody holds the conn of the first")


def test_a_script_that_holds_the_sessions_may_switch(sessions):
    sessions.create("first").commands.conn_act("take", MARY)
    assert sessions.create("second") is sessions.current


def test_a_stop_waits_for_no_session_that_is_being_made(sessions, monkeypatch):
    first = sessions.create("first")
    begun, let_go = threading.Event(), threading.Event()
    create = SessionStore.create

    def slowly(*about):
        begun.set()
        assert let_go.wait(BOUND)
        return create(*about)

    monkeypatch.setattr(SessionStore, "create", slowly)
    making = threading.Thread(target=sessions.create, args=("second",))
    making.start()
    try:
        assert begun.wait(BOUND)
        stopping = threading.Thread(target=sessions.stop, args=("danger",))
        stopping.start()
        stopping.join(BOUND)
        assert not stopping.is_alive()
        assert first.commands.gate["stopped"]
        assert sessions.get(first.id) is sessions.get("current") is first
    finally:
        let_go.set()
        making.join()
    assert sessions.current is not first
    assert sessions.current.commands.gate["stopped"]


def test_a_stop_reaches_the_session_that_took_the_rover_over_meanwhile(sessions, monkeypatch):
    first = sessions.create("first")
    stop, asked = first.commands.stop, []

    def late(*about):
        # the one that follows has looked for a stop before this one came
        if not asked:
            asked.append(sessions.create("second"))
        return stop(*about)

    monkeypatch.setattr(first.commands, "stop", late)
    assert sessions.stop("danger", LOCAL)["stopped"]
    assert sessions.current is asked[0]
    assert asked[0].commands.gate["stopped"]


def test_there_is_nothing_to_stop_without_a_session(sessions):
    with pytest.raises(Conflict, match="no session is open"):
        sessions.stop()


@pytest.mark.parametrize(
    ("heard", "then", "told"),
    [
        pytest.param(0, "", True, id="of nothing later"),
        pytest.param(1, "", False, id="of another ground, which may have stopped it"),
        pytest.param(0, "armed", False, id="of nothing later, and it was idle since"),
    ],
)
def test_a_clearing_that_died_with_the_server_is_told_by_the_next(anew, frame_of, heard, then, told):
    with anew() as sessions:
        live = sessions.create("first")
        name, first = live.robot.name, live.id
        live.rover.connected(lambda text: None, HelloMessage(name, 6, id="before"))
        live.commands.stop("danger")
        live.rover.take_stop_acknowledgement()
        live.commands.clear_stop()
        epoch = live.rover.epoch
        if then:
            live.folded_log.record("armed", {"sequence": "", "conn": 1, "by": None})
    with anew() as sessions:
        live, texts = sessions.open(first), []
        hello = HelloMessage(name, 6, id="after", epoch=epoch + heard)
        live.rover.connected(lambda text: texts.append(json.loads(text)), hello)
        live.rover.take_epoch("after", live.rover.epoch)
        number = count(1)

        def cleared() -> bool:
            """Whether it was told, after one more frame that says that it is stopped."""
            frame = next(number)
            live.rover.take_telemetry(frame_of(frame, time=0.1 * frame, mode="stopped"))
            return any(one["type"] == "clear_stop" for one in texts)

        if told:
            until(cleared, "the clearing")
        for _ in range(0 if told else 30):
            a_while(AGAIN_AFTER / 10)
            assert not cleared()
        assert not live.commands.gate["stopped"]
