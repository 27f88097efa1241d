"""A listener that is slow costs a bounded amount of memory, and is not told that old telemetry is fresh."""

# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false

import asyncio
import time
from dataclasses import replace

import pytest

from footfall.api import streams as streams_
from footfall.api.streams import Streams, session_stream
from footfall.planning.stance.stand import stand
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane


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
    stream = session_stream(live, Streams(), None)
    assert (await anext(stream)).event == "link"
    return stream


def test_only_the_newest_telemetry_waits_and_it_grows_old(live, frames, monkeypatch):
    async def listen():
        stream = await started(live)
        first = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        for number in range(100):
            live.take_telemetry(frames(number))
        monkeypatch.setattr(streams_.time, "monotonic", lambda real=streams_.time.monotonic: real() + 30.0)
        message = await first
        await stream.aclose()
        return message

    message = asyncio.run(listen())
    assert '"number":99' in message.raw_data.replace(" ", "")
    age = float(message.raw_data.replace(" ", "").split('"age_s":')[1].split(",")[0].rstrip("}"))
    assert age >= 30.0


def test_a_listener_that_never_reads_is_let_go(live, monkeypatch):
    monkeypatch.setattr(streams_, "LONGEST_BACKLOG", 20)

    async def listen():
        stream = await started(live)
        pending = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        for number in range(50):
            live.set_view(scrub=number / 50)
        with pytest.raises(StopAsyncIteration):
            await pending

    asyncio.run(listen())


def test_a_slow_listener_shows_and_what_it_missed_stays_counted(live, frames, monkeypatch):
    async def listen():
        streams = Streams()
        stream = session_stream(live, streams, None, rate=50.0)
        await anext(stream)
        pending = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        (fresh,) = streams.listeners(live.id)
        for number in range(30):
            live.take_telemetry(frames(number))
        live.set_view(scrub=0.5)
        monkeypatch.setattr(streams_.time, "monotonic", lambda real=time.monotonic: real() + 2.0)
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
