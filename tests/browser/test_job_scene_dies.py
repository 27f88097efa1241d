"""What draws the scene ends while the rover is worked: all else goes on, the page says so, and it is drawn again."""

import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.drawing import Drawing, drawn
from tests.support.page_steps import RIGID, held, lay_out, let_pass, press
from tests.support.server import Running
from tests.support.spoken import current
from tests.support.waiting import until

pytestmark = pytest.mark.scene
LOOK_PERIOD = 20.0
"""How often the page looks whether its scene is still there [s], as in ``static/js/scene.js``."""


@pytest.fixture
def page(chromium: Browser, drawing: Drawing, served: Running) -> Iterator[Page]:
    """The operator's page with its scene; that requests for the scene fail is what the tests are about."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(f"{served.url}/?fixedDpr=0.5")
    page.get_by_text(current(served).state.name, exact=True).wait_for()
    expect(page.locator("#scene-note")).to_be_hidden()
    until(lambda: drawing.servers[0].get_clients(), "the scene's page")
    yield page
    context.close()
    assert not faults


@RIGID
def test_commands_telemetry_and_stop_outlive_the_scene(
    page: Page, served: Running, drawing: Drawing, look: Callable[[str], None]
) -> None:
    note = page.locator("#scene-note")
    drawing.refused = True
    drawing.servers[0].stop()
    let_pass(page, LOOK_PERIOD)
    expect(note).to_contain_text(re.compile(r"does not answer any more: its picture is of \d\d:\d\d:\d\d UTC"))
    expect(note).to_contain_text("Commands, telemetry and stop go on")
    # what is left of the picture is marked as past
    expect(page.locator("#scene")).to_have_css("filter", "grayscale(1) brightness(0.35)")
    expect(page.get_by_role("button", name="Load the scene again")).to_be_visible()
    look("gone")
    page.get_by_role("button", name="Load the scene again").click()
    expect(note).to_contain_text("can't be shown: OSError: no more ports")

    live = served.sessions.current
    assert live is not None
    assert live.rover.frame is not None
    number = live.rover.frame.number
    until(lambda: live.rover.frame is not None and live.rover.frame.number > number + 10, "telemetry after it")
    expect(page.locator("#status-link")).to_have_attribute("data-state", "good")
    expect(page.locator("#arm")).to_be_enabled()
    press(page, "Arm")
    expect(page.locator("#send")).to_be_enabled()
    press(page, "Send to rover")
    until(lambda: any(c["state"] == "done" for c in held(served)["commands"]), "a command done")
    page.keyboard.press("Control+.")
    expect(page.locator("#stop-state")).to_contain_text("acknowledged by the rover")
    assert held(served)["stop"]["acknowledged"]
    look("stopped")


def test_the_scene_comes_back_by_itself(page: Page, drawing: Drawing, look: Callable[[str], None]) -> None:
    first = drawing.servers[0]
    until(lambda: len(drawn(first)) > 10, "the first scene")
    before = drawn(first)
    # a short end: viser's own page comes in again
    first.stop()
    until(lambda: len(drawing.servers) == 2 and drawing.servers[1].get_clients(), "the page in the second scene")
    until(lambda: drawn(drawing.servers[1]) >= before, "all of it drawn again")
    # a long one: the page has said that it is gone, and loads it again
    drawing.refused = True
    drawing.servers[1].stop()
    let_pass(page, LOOK_PERIOD)
    expect(page.locator("#scene-note")).to_contain_text("does not answer any more")
    drawing.refused = False
    until(lambda: len(drawing.servers) == 3 and drawing.servers[2].get_clients(), "the page in the third scene")
    expect(page.locator("#scene-note")).to_be_hidden()
    expect(page.locator("#scene")).to_have_css("filter", "none")
    until(lambda: drawn(drawing.servers[2]) >= before, "all of it drawn again")
    look("back")
