"""What the status bar says of a rover that is far, of one that only talks, and of one that talks wrongly."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.session.rover.light_time import LightTime
from footfall.telemetry.link import HelloMessage, encode, message_object
from tests.support.frames import moving_frames
from tests.support.page_steps import lay_out
from tests.support.server import Running, running_server


@pytest.fixture
def plain(tmp_path: Path) -> Iterator[Running]:
    """An empty session; neither rover nor scene."""
    with running_server(tmp_path, prepare=lambda s: s.create("Far away")) as running:
        yield running


@pytest.fixture
def page(chromium: Browser, plain: Running) -> Iterator[Page]:
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    made = context.new_page()
    made.goto(plain.url)
    made.get_by_text("Far away", exact=True).wait_for()
    yield made
    context.close()


def test_light_time_faults_and_the_way_of_a_stop_are_shown(
    page: Page, plain: Running, look: Callable[[str], None]
) -> None:
    plain.sessions.set_light_time(LightTime(telemetry=1.5, commands=2.0))
    url = "ws" + plain.api.removeprefix("http") + "/rover"
    link, stop = page.locator("#status-link"), page.locator("#stop-state")
    with connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None) as rover:
        rover.send(encode(HelloMessage("athlete", 6)))
        rover.send("no json")
        for frame in moving_frames(3):
            rover.send(encode(frame))
        expect(link).to_have_text(re.compile(r"old \+ 1\.5 s on the way, 1 fault$"))
        expect(link).to_have_attribute("title", re.compile("not-json: 1"))
        page.locator("#stop").click()
        reaches = re.compile(r"reaches the rover in \d\.\d s, acknowledgement in \d\.\d s at the earliest")
        expect(stop).to_have_text(reaches)
        box = stop.bounding_box()
        assert box is not None
        assert (box["y"] >= 0, box["y"] + box["height"] <= 58) == (True, True), "the bar cuts it off"
        look("stop-on-its-way")
        expect(stop).to_have_text(re.compile(r"should be there, acknowledgement in"))
        expect(stop).to_have_text(re.compile("NOT YET ACKNOWLEDGED by the rover"))


def test_telemetry_without_a_way_down_is_said_to_be_that(page: Page, plain: Running) -> None:
    hello = {"protocol": 2, "robot": "athlete", "legs": 6, "software": "1"}
    with plain.client() as client:
        frames = [message_object(frame) for frame in moving_frames(2)]
        assert client.post("/rover/telemetry", json={**hello, "frames": frames}).status_code == 200
    expect(page.locator("#status-link")).to_have_text(re.compile("telemetry only, can't be commanded"))
