"""A listener that is slow costs a bounded amount of memory, and is not told that old telemetry is fresh."""

# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false

import asyncio
import json
import time
from dataclasses import replace

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from footfall.api import mailbox
from footfall.api.mailbox import Mailbox
from footfall.api.streams import RATE, Streams, session_stream
from footfall.planning.body.stand import stand
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.waiting import BOUND


@pytest.fixture
def live(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        yield sessions.create("slow listener")


@pytest.fixture
def frames(athlete):
    state = stand(athlete, plane())

    def frame(number):
        return TelemetryFrame(number, replace(state, time=float(number)), state.posture)

    return frame


async def started(live):
    stream = session_stream(live, Streams(), None, Mailbox(live.id, RATE))
    assert (await anext(stream)).event == "link"
    return stream


def test_only_the_newest_telemetry_waits_and_it_grows_old(live, frames, monkeypatch):
    async def listen():
        stream = await started(live)
        first = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        for number in range(100):
            live.rover.take_telemetry(frames(number))
        monkeypatch.setattr(mailbox.time, "monotonic", lambda real=mailbox.time.monotonic: real() + 30.0)
        message = await first
        await stream.aclose()
        return message

    message = asyncio.run(listen())
    assert '"number":99' in message.raw_data.replace(" ", "")
    age = float(message.raw_data.replace(" ", "").split('"age_s":')[1].split(",")[0].rstrip("}"))
    assert age >= 30.0


def test_who_comes_while_the_rover_is_silent_hears_how_it_was(live, frames):
    """The newest of before, with its age; nothing where there was none, and what comes meanwhile goes before it."""

    async def listen(meanwhile):
        stream = await started(live)
        if meanwhile is not None:
            live.rover.take_telemetry(frames(meanwhile))
        message = await asyncio.wait_for(anext(stream), 5.0)
        live.add_note("nothing more")
        assert (await asyncio.wait_for(anext(stream), 5.0)).event == "event"
        await stream.aclose()
        return json.loads(message.raw_data or "{}")

    with pytest.raises(TimeoutError):
        asyncio.run(asyncio.wait_for(listen(None), 0.2))
    live.rover.take_telemetry(frames(1))
    live.rover.take_telemetry(frames(2), time.monotonic() - 30.0)
    heard = asyncio.run(listen(None))
    assert heard["number"] == 2
    assert 30.0 <= heard["age_s"] < 40.0
    heard = asyncio.run(listen(3))
    assert heard["number"] == 3
    assert heard["age_s"] < 10.0


def test_a_listener_that_never_reads_is_let_go(live, monkeypatch):
    monkeypatch.setattr(mailbox, "LONGEST_BACKLOG", 20)

    async def listen():
        stream = await started(live)
        pending = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        for number in range(50):
            live.choices.set_view(scrub=number / 50)
        with pytest.raises(StopAsyncIteration):
            await pending

    asyncio.run(listen())


def test_a_slow_listener_shows_and_what_it_missed_stays_counted(live, frames, monkeypatch):
    async def listen():
        streams = Streams()
        stream = session_stream(live, streams, None, Mailbox(live.id, 50.0))
        await anext(stream)
        pending = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        (fresh,) = streams.listeners(live.id)
        for number in range(30):
            live.rover.take_telemetry(frames(number))
        live.choices.set_view(scrub=0.5)
        monkeypatch.setattr(mailbox.time, "monotonic", lambda real=time.monotonic: real() + 2.0)
        (slow,) = streams.listeners(live.id)
        assert streams.listeners("another session") == []
        pending.cancel()
        await asyncio.gather(pending, return_exceptions=True)
        await stream.aclose()
        return fresh, slow, streams

    fresh, slow, streams = asyncio.run(listen())
    assert (fresh["slow"], fresh["waiting"], fresh["dropped"]) == (False, 0, 0)
    assert slow["slow"]
    assert slow["behind_s"] >= 2.0
    assert (slow["waiting"], slow["dropped"]) == (2, 29)
    assert streams.listeners() == []
    assert streams.dropped == 29


def test_a_listener_that_says_what_it_hears_is_never_further_behind(live, frames):
    """Two are under way; of what comes until it has heard them, the newest goes on, and the rest is counted."""

    async def listen():
        streams, box = Streams(), Mailbox(live.id, 50.0, most_unheard=2)
        stream = session_stream(live, streams, None, box)
        await anext(stream)
        got: list[int] = []

        async def take() -> None:
            async for message in stream:
                got.append(json.loads(message.raw_data or "{}")["number"])

        taking = asyncio.ensure_future(take())
        for number in range(10):
            live.rover.take_telemetry(frames(number))
            await asyncio.sleep(0.03)
        before, behind = list(got), streams.listeners(live.id)[0]
        box.heard(77)  # of no message under way
        await asyncio.sleep(0.1)
        assert got == before
        box.heard(before[1])  # the last of them, so both
        while len(got) < 3:
            await asyncio.sleep(0.01)
        box.close()
        await taking
        return before, behind, got

    before, behind, got = asyncio.run(listen())
    assert len(before) == 2
    assert got == [*before, 9]
    assert behind["waiting"] == 1
    assert behind["dropped"] == 7
    assert behind["behind_s"] > 0


def test_the_line_sends_no_more_than_was_heard_and_takes_nothing_else(server, frames):
    """A line that is not told what was heard carries two telemetry messages, then events alone."""
    live = server.sessions.create("heard")
    url = f"ws{server.api.removeprefix('http')}/sessions/{live.id}/events/line"
    with connect(f"{url}?ahead=2&rate=50", proxy=None) as line, connect(f"{url}?rate=50", proxy=None) as other:
        for socket in (line, other):
            assert json.loads(socket.recv(timeout=BOUND))["type"] == "link"
        for number in range(6):
            live.rover.take_telemetry(frames(number))
            until_number(other, number)
        live.add_note("all is said")
        told = until_note(line)
        assert told == [0, 1]
        line.send(json.dumps({"heard": 1}))
        assert json.loads(line.recv(timeout=BOUND))["data"]["number"] == 5
        line.send(json.dumps({"heard": True}))
        with pytest.raises(ConnectionClosed) as closed:
            until_note(line)
        assert closed.value.rcvd.code == 1008
        assert '{"heard": number}' in closed.value.rcvd.reason


def test_a_click_that_met_no_ground_is_told_to_its_page_alone(server):
    live = server.sessions.create("missed")
    url = f"ws{server.api.removeprefix('http')}/sessions/{live.id}/events/line"
    with connect(f"{url}?page=mine", proxy=None) as mine, connect(f"{url}?page=other", proxy=None) as other:
        for line in (mine, other):
            assert json.loads(line.recv(timeout=BOUND))["type"] == "link"
        with acting(replace(LOCAL, page="mine")):
            live.choices.tell_missed()
        live.choices.set_view(look="top")  # of every page
        told = [json.loads(line.recv(timeout=BOUND)) for line in (mine, mine, other)]
    assert [one["type"] for one in told] == ["missed", "view", "view"]
    assert told[0]["data"] == {"terrain": False}


def until_number(line, number):
    while (told := json.loads(line.recv(timeout=BOUND)))["type"] != "telemetry" or told["data"]["number"] != number:
        pass


def until_note(line):
    """Numbers of the telemetry before the next note."""
    numbers = []
    while (told := json.loads(line.recv(timeout=BOUND)))["type"] != "event" or told["data"]["type"] != "note":
        if told["type"] == "telemetry":
            numbers.append(told["data"]["number"])
    return numbers
