"""The cameras' process: what it can't do is an error for who asked, and the next request has another try."""

import asyncio
import contextlib

import pytest

import footfall.sim.imager
from footfall.core.errors import WorkerLost
from footfall.sim.imager import Imager
from footfall.sim.process import RoverClient
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import ErrorMessage, ImageRequestMessage, decode, encode


def test_a_process_that_does_not_start_is_told_and_tried_again(athlete, flat, standing, monkeypatch):
    imager = Imager(athlete, flat, 0)
    with monkeypatch.context() as without:

        def refuse(kind: str):
            raise OSError(11, "Resource temporarily unavailable")

        without.setattr(footfall.sim.imager, "get_context", refuse)
        with pytest.raises(WorkerLost, match=r"camera process can't be started: .*Resource temporarily unavailable"):
            imager.take("r1", standing, ())
    try:
        assert imager.take("r2", standing, ("nav0",))
    finally:
        imager.close()


class BrokenImager(Imager):
    """Fails as no cameras are known to."""

    def take(self, request_id, state, pairs):
        raise RuntimeError("no such lens")


def test_who_asked_hears_of_every_failure(athlete, flat, standing, link_server):
    rover = RoverClient(link_server.url, SimulatedRover(athlete, flat, standing), BrokenImager(athlete, flat, 0))

    def errors(frames) -> list[ErrorMessage]:
        found = [decode(frame, legs=6) for frame in frames if isinstance(frame, str)]
        return [one for one in found if isinstance(one, ErrorMessage) and one.id == "r1"]

    async def asked() -> str:
        running = asyncio.create_task(rover.run())
        try:
            await asyncio.to_thread(link_server.wait_for, bool)
            link_server.send(encode(ImageRequestMessage("r1", ("nav0",))))
            return (await asyncio.to_thread(link_server.wait_for, errors))[0].text
        finally:
            running.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await running

    assert asyncio.run(asked()) == "the cameras failed: RuntimeError: no such lens"
