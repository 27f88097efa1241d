"""Things moved by hand on the page: keys with a live read-out, undo of choices, held buttons, and what others do."""

import math
import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests.browser.test_console_access import violations
from tests.browser.test_plots import added
from tests.support.page_steps import as_shown, held, lay_out, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]


def events(quiet: Running) -> list[dict]:
    return held(quiet, "/sessions/current/log")["events"]


def place(quiet: Running) -> tuple[float, float]:
    chosen = held(quiet)["footfall"]
    return chosen["x"], chosen["y"]


@pytest.fixture
def other(chromium: Browser, quiet: Running) -> Iterator[Page]:
    """A second page on the same session."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    page.goto(f"{quiet.url}/?scene=off")
    expect(page.locator("#timeline-text")).to_contain_text("Latest")
    yield page
    context.close()


def test_the_footfall_goes_cell_by_cell_and_is_chosen_once(console: Page, quiet: Running, look: Keep) -> None:
    x, y = place(quiet)
    cell = held(quiet)["terrain"]["resolution"]
    before = len(events(quiet))
    console.locator("#h-footfall").click()
    console.keyboard.press("a")
    expect(console.locator("#hand-title")).to_have_text("In hand: footfall")
    console.keyboard.press("Shift+ArrowRight")
    console.keyboard.press("ArrowUp")
    console.keyboard.press("ArrowUp")
    at = as_shown(f" at ({x + 10 * cell:.3f}, {y + 2 * cell:.3f}, ")
    expect(console.locator("#hand-read")).to_contain_text(re.compile(rf"leg \d{re.escape(at)}"))
    expect(console.locator("#hand-read")).to_contain_text(f"{math.hypot(10 * cell, 2 * cell):.3f} m from where it was")
    expect(console.locator("#hand-read")).to_contain_text("m from the hip")
    look("in-hand")
    assert violations(console) == []
    console.keyboard.press("Enter")
    until(lambda: place(quiet) == pytest.approx((x + 10 * cell, y + 2 * cell)), "the moved footfall")
    # one event for all of it, by this page
    made = events(quiet)[before:]
    assert [event["type"] for event in made] == ["footfall_chosen"]
    assert made[0]["payload"]["by"]["page"] == console.evaluate("sessionStorage.getItem('footfall-page')")
    # resting chooses too; Escape puts back what was not chosen, and takes no stop for it
    console.keyboard.press("ArrowLeft")
    until(lambda: place(quiet) == pytest.approx((x + 9 * cell, y + 2 * cell)), "the footfall that rests")
    expect(console.locator("#hand-title")).to_have_text("In hand: footfall")
    console.keyboard.press("ArrowDown")
    console.keyboard.press("Escape")
    expect(console.locator("#hand")).to_be_hidden()
    assert held(quiet)["hand"] is None
    assert place(quiet) == pytest.approx((x + 9 * cell, y + 2 * cell))
    assert [event["type"] for event in events(quiet)[before:]] == ["footfall_chosen"] * 2
    assert held(quiet)["gate"]["stopped"] is False
    # without anything in hand the arrows are the page's
    console.keyboard.press("ArrowDown")
    assert held(quiet)["hand"] is None


def test_set_again_while_it_is_being_set_it_is_chosen_once(console: Page, quiet: Running) -> None:
    """Enter just when the pause ends: the second finds nothing left to choose."""
    x, y = place(quiet)
    cell = held(quiet)["terrain"]["resolution"]
    before = len(events(quiet))
    asked: list[Route] = []
    console.route("**/hand/commit", lambda route: asked.append(route))
    console.locator("#h-footfall").click()
    console.keyboard.press("a")
    expect(console.locator("#hand-title")).to_have_text("In hand: footfall")
    console.keyboard.press("ArrowRight")
    expect(console.locator("#hand-title")).to_have_text("In hand: footfall, not set yet")
    console.keyboard.press("Enter")
    console.keyboard.press("Enter")
    console.wait_for_timeout(500)  # for a second one to be on its way, if there is one
    for route in asked:
        route.continue_()
    until(lambda: place(quiet) == pytest.approx((x + cell, y)), "the moved footfall")
    console.unroute("**/hand/commit")
    # what comes after it is chosen as well
    console.keyboard.press("ArrowRight")
    console.keyboard.press("Enter")
    until(lambda: place(quiet) == pytest.approx((x + 2 * cell, y)), "the footfall that was moved on")
    assert [event["type"] for event in events(quiet)[before:]] == ["footfall_chosen"] * 2


def test_arrow_keys_on_a_plot_move_that_and_nothing_in_hand(console: Page, quiet: Running) -> None:
    x, y = place(quiet)
    console.locator("#area-plots").click()
    plot = added(console, "torque leg 2 hip pitch")
    console.locator("#h-plots").click()
    console.keyboard.press("a")
    expect(console.locator("#hand-acts")).to_be_visible()
    console.locator("#area-plots").click()
    lines = plot.locator(".plot-lines")
    lines.focus()
    expect(lines).to_be_focused()
    console.keyboard.press("ArrowLeft")
    expect(console.locator("#plots-shown")).to_have_value("between")
    console.locator("#h-plots").click()
    console.keyboard.press("ArrowUp")
    # by the one press that was meant for it
    until(lambda: place(quiet) != (x, y), "the moved footfall")
    assert place(quiet) == pytest.approx((x, y + held(quiet)["terrain"]["resolution"]))


def test_undo_goes_back_over_choices_and_edits_in_their_order(console: Page, quiet: Running, look: Keep) -> None:
    first, sequence = place(quiet), held(quiet)["sequence"]
    console.locator("#footfall-x").fill("-0.45")
    console.locator("#footfall-y").fill("1.78")
    press(console, "Choose")
    until(lambda: place(quiet) == (-0.45, 1.78), "the footfall")
    field = console.get_by_label("Seconds of row 2", exact=True)
    field.fill("30")
    field.press("Enter")
    until(lambda: held(quiet)["sequence"] != sequence, "the edit")
    edited = held(quiet)["sequence"]
    console.locator("#h-footfall").click()
    console.keyboard.press("a")
    expect(console.locator("#hand-acts")).to_be_visible()
    console.keyboard.press("ArrowUp")
    # what is being moved is the latest choice: taken back as such, without a wait
    console.keyboard.press("Control+z")
    until(lambda: "choice_undone" in [event["type"] for event in events(quiet)], "the first undo")
    assert place(quiet) == (-0.45, 1.78)
    assert held(quiet)["sequence"] == edited
    console.keyboard.press("Control+z")
    until(lambda: held(quiet)["sequence"] == sequence, "the edit taken back")
    console.keyboard.press("Control+z")
    until(lambda: place(quiet) == first, "the footfall taken back")
    expect(console.locator("#redo")).to_be_enabled()
    look("undone")
    console.keyboard.press("Control+y")
    until(lambda: place(quiet) == (-0.45, 1.78), "the footfall made again")
    console.keyboard.press("Control+y")
    until(lambda: held(quiet)["sequence"] == edited, "the edit made again")


def test_points_are_the_session_s_and_move_by_hand(console: Page, quiet: Running, look: Keep) -> None:
    leg = held(quiet)["footfall"]["leg"]
    with quiet.client() as client:
        client.put("/sessions/current/points", json={"leg": leg, "points": [[1.0, 1.5, 0.9]]}).raise_for_status()
    console.get_by_text("Lead the wheel through points", exact=False).click()
    height = console.get_by_label("z of point 1", exact=True)
    expect(height).to_have_value("0.900")
    console.get_by_label("Move point 1 by hand", exact=True).click()
    expect(console.locator("#hand-title")).to_have_text("In hand: point 1")
    console.keyboard.press("Shift+PageDown")
    console.keyboard.press("Enter")
    cell = held(quiet)["terrain"]["resolution"]
    until(lambda: held(quiet)["points"]["points"][0][2] == pytest.approx(0.9 - 10 * cell), "the lowered point")
    expect(height).to_have_value(f"{0.9 - 10 * cell:.3f}")
    look("point")
    # typed numbers are set when they rest
    height.fill("0.95")
    height.press("Tab")
    until(lambda: held(quiet)["points"]["points"][0][2] == 0.95, "the typed height")
    console.locator("#h-plan").click()
    for expected in (0.9 - 10 * cell, 0.9):
        console.keyboard.press("Control+z")
        until(lambda z=expected: held(quiet)["points"]["points"][0][2] == pytest.approx(z), "the height before")
    expect(height).to_have_value("0.900")


# At once: where two of them come a second apart, the page takes what is in hand to rest between them.
FAR_UP = """() => {
  const up = () => new KeyboardEvent("keydown", { key: "PageUp", shiftKey: true, bubbles: true });
  for (let i = 0; i < 20; i += 1) document.activeElement.dispatchEvent(up());
}"""


def test_the_chassis_is_refused_where_a_foot_can_t_stay(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#h-footfall").click()
    console.locator("#panel-what-if summary").click()
    console.locator("#hand-chassis").click()
    expect(console.locator("#hand-title")).to_have_text("In hand: chassis")
    cell = held(quiet)["terrain"]["resolution"]
    console.keyboard.press("Shift+PageDown")
    console.keyboard.press("Enter")
    until(lambda: held(quiet)["what_if"], "the what-if")
    assert held(quiet)["what_if"]["dz"] == pytest.approx(-10 * cell)
    expect(console.locator("#shift-dz")).to_have_value(f"{-10 * cell:g}")
    console.evaluate(FAR_UP)
    expect(console.locator("#hand-read .no").first).to_contain_text("leg")
    console.keyboard.press("Enter")
    expect(console.locator("#hand-read")).to_contain_text("Put back")
    assert held(quiet)["what_if"]["dz"] == pytest.approx(-10 * cell)
    look("refused")


def test_what_others_do_is_told_in_one_line(console: Page, other: Page, quiet: Running, look: Keep) -> None:
    leg = held(quiet)["footfall"]["leg"]
    other.locator("#footfall-x").fill("-0.45")
    other.locator("#footfall-y").fill("1.78")
    press(other, "Choose")
    expect(console.locator("#others")).to_contain_text(f"Another page chose a footfall for leg {leg}")
    look("other")
    assert violations(console) == []
    # a hand is seen, and is nobody else's
    other.locator("#hand-footfall").click()
    expect(console.locator("#hand-title")).to_have_text("Another page moves: footfall")
    expect(console.locator("#hand-acts")).to_be_hidden()
    console.locator("#h-footfall").click()
    before = held(quiet)["hand"]["place"]
    console.keyboard.press("ArrowUp")
    assert held(quiet)["hand"]["place"] == before
    # the page's own acts are not told to itself
    expect(other.locator("#others")).to_be_empty()
    other.keyboard.press("Control+z")
    expect(console.locator("#others")).to_contain_text("Another page took back the footfall")
    console.keyboard.press(",")
    expect(console.locator("#timeline-text")).to_contain_text("footfall")


HOLDING = """async () => {
  const { actWhenHeld } = (await import("/js/page.js")).modules["holding.js"];
  window.acts = 0;
  const button = Object.assign(document.createElement("button"), { id: "held", textContent: "Try" });
  document.querySelector(".areas").append(button);
  actWhenHeld(button, () => { window.acts += 1; });
}"""


def test_a_button_to_hold_acts_only_when_it_is_held(console: Page) -> None:
    console.evaluate(HOLDING)
    button = console.locator("#held")
    acts = "() => window.acts"

    def still_nothing() -> None:
        # longer than it would have taken
        console.wait_for_timeout(1000)
        assert console.evaluate(acts) == 0

    button.click()
    expect(button).not_to_have_class(re.compile(r"\bheld\b"))
    still_nothing()
    button.focus()
    console.keyboard.press("Enter")
    console.keyboard.press(" ")
    still_nothing()
    for key in ("Enter", " "):
        before = console.evaluate(acts)
        console.keyboard.down(key)
        expect(button).to_have_class(re.compile(r"\bheld\b"))
        console.wait_for_function(f"() => window.acts === {before} + 1")
        console.keyboard.up(key)
    button.hover()
    console.mouse.down()
    console.mouse.move(5, 5)  # off the button
    still = console.evaluate(acts)
    console.mouse.up()
    assert still == 2
    button.hover()
    console.mouse.down()
    console.wait_for_function("() => window.acts === 3")
    console.mouse.up()
    assert console.evaluate(acts) == 3
    console.emulate_media(reduced_motion="reduce")
    button.hover()
    console.mouse.down()
    expect(button).to_have_css("transition-duration", "0s")
    moving = "() => getComputedStyle(document.querySelector('#held'), '::before').transitionDuration"
    assert console.evaluate(moving) == "0s"
    console.mouse.up()
