"""The process that draws the scene ends while the rover is worked: everything else goes on, and the page says so."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import viser
from playwright.sync_api import Browser, Page, expect

import footfall_ui.app
from footfall_ui.viser_door import SceneDoor, open_viser
from tests.support.page_steps import SLOW, held, press
from tests.support.server import Running, running_server, until

pytestmark = pytest.mark.scene


@pytest.fixture
def drawing(monkeypatch: pytest.MonkeyPatch) -> list[viser.ViserServer]:
    """What draws the scene of the test's server, once it has started."""
    opened: list[viser.ViserServer] = []

    def opening() -> tuple[viser.ViserServer, SceneDoor]:
        server, door = open_viser()
        opened.append(server)
        return server, door

    monkeypatch.setattr(footfall_ui.app, "open_viser", opening)
    return opened


@pytest.fixture
def served(drawing: list[viser.ViserServer], tmp_path: Path) -> Iterator[Running]:
    with running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running:
        running.rover.start()
        current = running.sessions.current
        until(lambda: current is not None and current.frame, "the first telemetry", 60)
        yield running


@pytest.fixture
def page(chromium: Browser, served: Running) -> Iterator[Page]:
    """The operator's page with its scene; that requests for the scene fail is what the test is about."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(f"{served.url}/?fixedDpr=0.5")
    page.get_by_text("Stepping over a rock", exact=True).wait_for()
    yield page
    context.close()
    assert not faults


def test_commands_telemetry_and_stop_outlive_the_scene(
    page: Page, served: Running, drawing: list[viser.ViserServer], look: Callable[[str], None]
) -> None:
    note = page.locator("#scene-note")
    expect(note).to_be_hidden(timeout=SLOW)
    until(lambda: drawing[0].get_clients(), "the scene's page", 60)
    drawing[0].stop()
    expect(note).to_contain_text(
        re.compile(r"does not answer any more: its picture is of \d\d:\d\d:\d\d UTC"), timeout=SLOW
    )
    expect(note).to_contain_text("Commands, telemetry and stop go on")
    # what is left of the picture is marked as past
    expect(page.locator("#scene")).to_have_css("filter", "grayscale(1) brightness(0.35)")
    expect(page.get_by_role("button", name="Load the scene again")).to_be_visible()
    look("gone")

    live = served.sessions.current
    assert live is not None
    assert live.frame is not None
    number = live.frame.number
    until(lambda: live.frame is not None and live.frame.number > number + 10, "telemetry after it")
    expect(page.locator("#status-link")).to_have_attribute("data-state", "good", timeout=SLOW)
    expect(page.locator("#arm")).to_be_enabled(timeout=SLOW)
    press(page, "Arm")
    expect(page.locator("#send")).to_be_enabled(timeout=SLOW)
    press(page, "Send to rover")
    until(lambda: any(c["state"] == "done" for c in held(served)["commands"]), "a command done", 90)
    page.keyboard.press("Control+.")
    expect(page.locator("#stop-state")).to_contain_text("acknowledged by the rover", timeout=SLOW)
    assert held(served)["stop"]["acknowledged"]
    look("stopped")
