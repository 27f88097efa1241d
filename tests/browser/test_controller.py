"""A game controller or 3-D mouse moves the view, and sends nothing. What the browser tells of them is simulated."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Request, expect

from tests.support.drawing import Drawing
from tests.support.waiting import until

SIMULATED = """() => {
  const pad = {
    id: "Simulated pad", index: 0, connected: true, mapping: "standard", axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 })),
  };
  window.pad = pad;
  window.asked = 0;
  navigator.getGamepads = () => { window.asked += 1; return [pad, null]; };
  window.connectPad = (mapping = "standard") => {
    pad.mapping = mapping;
    const event = new Event("gamepadconnected");
    event.gamepad = pad;
    dispatchEvent(event);
  };
  window.press = (button, value) => { pad.buttons[button] = { pressed: value > 0, touched: value > 0, value }; };
}"""
PLAY, BEFORE, AFTER, LEFT, TRIGGER = 0, 4, 5, 14, 7


def connect(page: Page, mapping: str = "standard") -> None:
    page.evaluate(SIMULATED)
    page.evaluate("mapping => connectPad(mapping)", mapping)


def press(page: Page, button: int, value: float = 1.0) -> None:
    page.evaluate("([button, value]) => press(button, value)", [button, value])


def looked(page: Page) -> None:
    """The page has asked for what is pressed since."""
    page.evaluate("window.asked = 0")
    page.wait_for_function("() => asked > 4")


def test_it_plays_the_ghost_and_sends_nothing(console: Page) -> None:
    changes: list[Request] = []
    console.on("request", lambda one: changes.append(one) if one.method != "GET" else None)
    connect(console)
    expect(console.get_by_text("Simulated pad. It moves view and ghost, and sends nothing.")).to_be_visible()
    slider = console.locator("#scrub")
    expect(slider).to_have_value("1000")
    press(console, LEFT)  # held: it acts again and again
    until(lambda: int(slider.input_value()) < 970, "the ghost, moved twice")
    press(console, LEFT, 0.0)
    press(console, BEFORE)  # held: it acts once
    expect(console.locator("#scrub-read")).to_contain_text(re.compile(r"row \d+ of \d+"))
    press(console, BEFORE, 0.0)
    press(console, PLAY)
    expect(console.locator("#ghost-play")).to_have_text("❚❚")
    press(console, PLAY, 0.0)
    looked(console)
    press(console, PLAY)
    expect(console.locator("#ghost-play")).to_have_text("▶")
    press(console, AFTER)
    for button in range(17):
        press(console, button)
    console.evaluate("pad.axes = [1, 1, 1, 1]")
    looked(console)
    assert changes
    assert {one.url.rsplit("/", 1)[-1] for one in changes} == {"view"}


def test_camera_keys_are_held_as_long_as_a_stick_is_pushed(console: Page) -> None:
    console.evaluate("""() => {
      window.heard = [];
      const inside = document.getElementById("scene").contentDocument;
      const hear = one => heard.push(`${one.type} ${one.code}${one.key}`);
      for (const type of ["keydown", "keyup"]) inside.addEventListener(type, hear);
    }""")
    connect(console)
    console.evaluate("pad.axes = [0, -0.9, 0.3, 0]")
    console.wait_for_function("() => heard.length === 1")
    console.evaluate("pad.axes = [0, -0.4, 0, 0]")
    console.wait_for_function("() => heard.length === 2")
    press(console, TRIGGER)
    console.wait_for_function("() => heard.length === 3")
    console.evaluate("pad.connected = false")
    console.wait_for_function("() => heard.length === 4")
    told = console.evaluate("heard")
    assert told == ["keydown KeyW", "keyup KeyW", "keydown KeyE", "keyup KeyE"]


PUCK = """() => {
  const puck = Object.assign(new EventTarget(), { productName: "Simulated puck", opened: false });
  puck.open = async () => { puck.opened = true; };
  window.report = (reportId, numbers) => {
    const data = new DataView(new ArrayBuffer(2 * numbers.length));
    numbers.forEach((one, i) => data.setInt16(2 * i, one, true));
    puck.dispatchEvent(Object.assign(new Event("inputreport"), { reportId, data }));
  };
  const hid = Object.assign(new EventTarget(), { getDevices: async () => [], requestDevice: async () => [puck] });
  window.pullOut = () => hid.dispatchEvent(Object.assign(new Event("disconnect"), { device: puck }));
  Object.defineProperty(navigator, "hid", { value: hid });
}"""


def test_a_3_d_mouse_holds_camera_keys_and_sends_nothing(console: Page) -> None:
    console.add_init_script(f"({PUCK})()")
    console.reload()
    expect(console.locator("#timeline-text")).to_contain_text("Latest")
    console.evaluate("""() => {
      window.heard = [];
      const inside = document.getElementById("scene").contentDocument;
      const hear = one => heard.push(`${one.type} ${one.code}${one.key}`);
      for (const type of ["keydown", "keyup"]) inside.addEventListener(type, hear);
    }""")
    console.keyboard.press("Control+k")
    console.locator("#palette-input").fill("3-D mouse")
    console.keyboard.press("Enter")
    expect(console.get_by_text("3-D mouse connected: Simulated puck.")).to_be_visible()
    changes: list[Request] = []
    console.on("request", lambda one: changes.append(one) if one.method != "GET" else None)
    console.evaluate("report(1, [350, -99, 0])")  # to the right; what is pushed little does nothing
    console.evaluate("report(2, [0, 300, -200])")  # to the left, as it is turned
    console.evaluate("report(1, [0, -200, 0])")  # away
    console.evaluate("report(3, [1])")  # a button
    console.evaluate("report(1, [0, 0, 0, 150, 0, 0])")  # of a newer one: turns come along
    console.evaluate("pullOut()")
    assert console.evaluate("heard") == [
        "keydown KeyD",
        "keydown ArrowLeft",
        "keyup KeyD",
        "keydown KeyW",
        "keyup KeyW",
        "keyup ArrowLeft",
        "keydown ArrowUp",
        "keyup ArrowUp",
    ]
    assert changes == []


def test_one_whose_buttons_are_not_known_is_not_used(console: Page) -> None:
    connect(console, "")
    expect(console.get_by_text("Simulated pad is not used: the browser does not know its buttons.")).to_be_visible()
    press(console, LEFT)
    looked(console)
    expect(console.locator("#scrub")).to_have_value("1000")


@pytest.mark.scene
def test_the_view_turns_with_the_stick(drawing: Drawing, page: Page, look: Callable[[str], None]) -> None:
    def eye() -> tuple[float, ...]:
        return tuple(next(iter(drawing.servers[0].get_clients().values())).camera.position)

    until(lambda: drawing.servers and drawing.servers[0].get_clients(), "the scene's page")
    expect(page.locator("#scene-note")).to_be_hidden()
    before = eye()
    connect(page)
    page.evaluate("pad.axes = [1, 0, 0, 0]")
    until(lambda: eye() != before, "a view from elsewhere")
    page.evaluate("pad.axes = [0, 0, 0, 0]")
    look("turned")
