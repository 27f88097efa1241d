"""Light time: messages keep their order, none is lost, none is early; and what the operator may know, when."""

import itertools
import json
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Conflict, InvalidInput
from footfall.session.access.identity import LOCAL
from footfall.session.gate.gate import Gate
from footfall.session.gate.runs import RECEIVED_WITHIN
from footfall.session.rover import light_time as light_times
from footfall.session.rover.light_time import DelayLine, LightPath, LightTime
from footfall.session.rover.link import RoverLink
from tests.support.waiting import at_least, until

steps = st.lists(
    st.tuples(
        st.floats(0, 3),  # seconds that pass before
        st.sampled_from(["send", "look"]) | st.floats(0, 5),  # a number: from now on this delay
    ),
    max_size=60,
)


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@given(steps=steps)
def test_order_is_kept_nothing_is_lost_and_nothing_is_early(steps):
    line: DelayLine[int] = DelayLine()
    now, delay, sent = 0.0, 1.28, {}
    came: list[tuple[int, float]] = []

    def look() -> None:
        while (item := line.take(now)) is not None:
            came.append((item, now))

    for pause, what in steps:
        now += pause
        if what == "send":
            sent[len(sent)] = (now + delay, line.put(len(sent), now, delay))
        elif what == "look":
            look()
        else:
            delay = what
    now += 100.0
    look()
    assert [item for item, _ in came] == list(range(len(sent)))
    assert all(at >= sent[item][0] for item, at in came)
    # never later than its own delay asks for, or than what went before it
    arrivals = list(sent.values())
    for (_, before), (own, told) in itertools.pairwise([(0.0, 0.0), *arrivals]):
        assert told in (own, before)
    assert line.next is None
    assert len(line) == 0


def test_a_path_delivers_in_order_while_its_delay_changes_and_many_send():
    path, got = LightPath("test"), []
    for number in range(300):
        path.carry(lambda number=number: got.append(number), (0.05, 0.0, 0.02)[number % 3])
    until(lambda: len(got) == 300, "the last message")
    assert got == list(range(300))
    path.close()


def test_without_a_delay_the_caller_makes_the_call_and_hears_what_went_wrong():
    path = LightPath("test")
    made = []
    path.carry(lambda: made.append(threading.current_thread()), 0.0)
    assert made == [threading.current_thread()]
    with pytest.raises(ZeroDivisionError):
        path.carry(lambda: 1 / 0, 0.0)


def test_a_call_that_fails_on_arrival_does_not_stop_the_next(caplog):
    path, got = LightPath("test"), []
    path.carry(lambda: 1 / 0, 0.01)
    path.carry(lambda: got.append(1), 0.01)
    until(lambda: got, "the second message")
    path.close()
    assert "could not be used when it arrived" in caplog.text


def test_a_path_that_is_full_refuses_by_name(monkeypatch):
    monkeypatch.setattr(light_times, "MOST_ON_THE_WAY", 2)
    path = LightPath("test")
    path.carry(lambda: None, 60.0)
    path.carry(lambda: None, 60.0)
    with pytest.raises(Conflict, match="2 messages are on their way"):
        path.carry(lambda: None, 60.0)
    path.close()


@pytest.mark.parametrize("delay", [-0.1, 1500.1, float("nan"), float("inf")])
def test_an_impossible_delay_is_refused(delay):
    with pytest.raises(InvalidInput, match="0 to 1500 s"):
        LightTime(telemetry=delay)
    with pytest.raises(InvalidInput, match="delay of commands"):
        LightTime(commands=delay)


def test_what_is_on_its_way_says_when_it_arrives_and_when_an_answer_is_possible():
    clock = Clock()
    link = RoverLink(clock, LightTime(telemetry=2.0, commands=1.0))
    link.connect(lambda text: None)
    link.send('{"type": "stop", "id": "s1"}')
    assert link.on_the_way == [{"type": "stop", "id": "s1", "arrives_in_s": 1.0, "answer_in_s": 3.0}]
    clock.now = 1.5
    assert link.as_dict()["on_the_way"] == [{"type": "stop", "id": "s1", "arrives_in_s": 0.0, "answer_in_s": 1.5}]
    clock.now = 3.0
    assert link.on_the_way == []
    link.close()


def test_the_age_of_what_was_measured_counts_the_way(frame_of):
    clock = Clock()
    link = RoverLink(clock, LightTime(telemetry=1.28))
    link.take(frame_of(1), at=0.0, light=1.28)
    clock.now = 0.5
    about = link.as_dict()
    assert (about["age_s"], about["measured_age_s"]) == (0.5, pytest.approx(1.78))
    link.close()


def test_a_message_to_a_rover_that_left_is_lost_and_never_reaches_the_next():
    link = RoverLink(light_time=LightTime(commands=0.1))
    second = []

    def gone(text: str) -> None:
        raise Conflict("the rover has gone")

    link.connect(gone)
    link.send('{"type": "command", "id": "c1"}')
    link.disconnect()
    link.connect(second.append)
    link.send('{"type": "stop", "id": "s1"}')
    until(lambda: second, "the stop")
    assert [json.loads(text)["id"] for text in second] == ["s1"]
    assert link.lost_on_the_way == 1
    link.close()


def test_a_stop_reaches_the_rover_though_another_session_takes_over_its_connection():
    before, after, heard = RoverLink(light_time=LightTime(commands=0.1)), RoverLink(), []
    before.connect(heard.append)
    before.send('{"type": "stop", "id": "s1"}')
    before.disconnect()
    after.connect(heard.append)
    assert heard == []
    until(lambda: heard, "the stop")
    before.close()


@pytest.fixture
def far(session):
    session.rover.set_light_time(LightTime(telemetry=0.25, commands=0.15))
    return session


def test_a_session_hears_late_what_was_said_in_time_and_records_at_once_what_it_sends(far, frame_of):
    sent: list[str] = []
    with at_least(0.25):
        with at_least(0.15):
            far.rover.connected(sent.append)
            far.rover.take_telemetry(frame_of(1, time=1.0))
            assert far.rover.frame is None
            far.commands.stop("enough")
            assert [e.type for e in far.events()][-1] == "stop_requested"
            far.rover.take_stop_acknowledgement()
            assert not far.commands.gate["stop_acknowledged"]
            until(lambda: sent, "the first message to the rover", period=0.005)
        until(lambda: far.rover.frame, "the frame", period=0.005)
    until(lambda: far.commands.gate["stop_acknowledged"], "the acknowledgement")
    assert far.rover.link.as_dict()["measured_age_s"] >= 0.25
    assert [e.payload["round_trip_s"] for e in far.events() if e.type == "light_time_set"] == [0.4]


def test_a_command_is_not_overdue_before_its_answer_could_be_here(session, frame_of):
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    clock = Clock()
    gate = Gate(clock=clock)
    sequence = session.get(session.state.sequence)
    begun = gate.begin(gate.arm(sequence.digest, LOCAL), sequence, LOCAL)
    run, _ = gate.claim(begun.number, fresh=True)
    assert run is not None
    assert gate.release(run, lambda: None, fresh=True)
    clock.now = RECEIVED_WITHIN + 2.0
    assert "did not acknowledge" in str(gate.overdue(1.9))
    assert gate.overdue(2.1) is None


def test_new_sessions_and_open_ones_have_the_light_time_of_the_registry(sessions, session):
    sessions.set_light_time(LightTime(1.28, 1.28))
    assert session.rover.link.light_time.round_trip == 2.56
    assert sessions.create("another").rover.link.light_time.telemetry == 1.28
