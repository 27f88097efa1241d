"""Sessions on the page: begun under a name, counted as they grow, copies told apart; and a stop that looks in force."""

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.support.page_steps import held, press
from tests.support.server import Running
from tests.support.spoken import current
from tests.support.waiting import until

Keep = Callable[[str], None]
LOADS = """() => {
  if (window === window.top) sessionStorage.setItem("loads", Number(sessionStorage.getItem("loads") ?? 0) + 1);
}"""


def test_a_session_is_begun_under_its_name_and_its_events_are_counted(
    console: Page, quiet: Running, look: Keep
) -> None:
    console.context.add_init_script(f"({LOADS})()")
    console.keyboard.press("9")
    press(console, "Begin")
    expect(console.locator("#new-session-name")).to_be_focused()  # a session without a name is none
    console.keyboard.type("morning drive" + "e" * 68)
    console.keyboard.press("Enter")
    expect(console.locator("#toast")).to_contain_text("leave out 1")
    console.locator("#new-session-name").fill("morning drive")
    console.keyboard.press("Enter")
    expect(console.locator("#status-session")).to_have_text("morning drive")
    expect(console.locator("#sessions tbody tr")).to_have_count(2)
    assert held(quiet)["name"] == "morning drive"
    count = console.locator("#sessions tr.current td.count")
    expect(count).to_have_text(str(held(quiet)["events"]))
    current(quiet).add_note("one more")
    expect(count).to_have_text(str(held(quiet)["events"]))
    assert console.evaluate("() => sessionStorage.getItem('loads')") == "1"
    look("begun")


def test_copies_of_one_session_are_told_apart(console: Page, quiet: Running) -> None:
    first = held(quiet)["id"]
    with quiet.client() as client:
        client.post("/sessions", json={"sample": "rock-step"}).raise_for_status()
    second = held(quiet)["id"]
    name = "Stepping over a rock"
    expect(console.locator("#status-session")).to_have_text(f"{name} ({second[-4:]})")
    console.keyboard.press("9")
    rows = console.locator("#sessions tbody tr td:first-child span")
    expect(rows).to_have_count(2)
    expect(console.locator("#sessions tr.current td:first-child span")).to_have_text(f"▸ {name} ({second[-4:]})")
    assert sorted(rows.all_inner_texts()) == sorted([f"▸ {name} ({second[-4:]})", f"{name} ({first[-4:]})"])


def test_a_session_is_renamed_in_its_row(console: Page, quiet: Running, look: Keep) -> None:
    first = held(quiet)["id"]
    with quiet.client() as client:
        client.post("/sessions", json={"sample": "rock-step"}).raise_for_status()
    second = held(quiet)["id"]
    console.keyboard.press("9")
    row = console.locator(f'#sessions tr[data-session="{first}"]')
    name, field, rename = (
        row.locator("td:first-child span"),
        row.get_by_role("textbox"),
        row.get_by_role("button", name="Rename"),
    )
    row.get_by_role("button", name="Rename").click()
    expect(field).to_be_focused()
    console.keyboard.type("from the west")
    look("written")
    console.keyboard.press("Escape")
    expect(name).to_have_text(f"Stepping over a rock ({first[-4:]})")
    expect(rename).to_be_focused()
    assert not held(quiet)["stop"]["latched"]
    rename.click()
    console.keyboard.type("x" * 81)
    console.keyboard.press("Enter")
    expect(console.locator("#toast")).to_contain_text("leave out 1")
    expect(field).to_have_value("x" * 81)  # what was written is not lost
    field.fill("from the west")
    field.press("Enter")
    expect(name).to_have_text("from the west")
    expect(console.locator("#sessions tr.current td:first-child span")).to_have_text("▸ Stepping over a rock")
    with quiet.client() as client:
        listed = {one["id"]: one["name"] for one in client.get("/sessions").json()["sessions"]}
    assert listed == {first: "from the west", second: "Stepping over a rock"}
    look("renamed")


def test_the_session_that_is_shown_is_renamed_from_the_palette(console: Page, quiet: Running) -> None:
    console.keyboard.press("Control+K")
    console.keyboard.type("Rename this session")
    console.keyboard.press("Enter")
    expect(console.locator("#sessions tr.current").get_by_role("textbox")).to_be_focused()
    console.keyboard.type("the steep side")
    console.keyboard.press("Enter")
    expect(console.locator("#status-session")).to_have_text("the steep side")
    expect(console.locator("#timeline-text")).to_contain_text("the steep side")
    assert held(quiet)["name"] == "the steep side"


def test_what_clears_a_stop_is_not_beside_what_stops(console: Page, quiet: Running, look: Keep) -> None:
    red = console.locator("#stop").evaluate("one => getComputedStyle(one).backgroundColor")
    with quiet.client() as client:
        client.post("/stop", json={}).raise_for_status()
    clear, stop = console.locator("#stop-clear"), console.locator("#stop")
    expect(clear).to_be_visible()
    expect(stop).to_have_attribute("data-sent", "true")
    look("stopped")
    left, right = clear.bounding_box(), stop.bounding_box()
    assert left is not None
    assert right is not None
    assert right["x"] - (left["x"] + left["width"]) > right["width"]
    in_force = stop.evaluate("one => getComputedStyle(one).backgroundColor")
    assert in_force != red
    levels = [int(one) for one in in_force.removeprefix("rgb(").removesuffix(")").split(",")]
    assert levels[0] > 3 * max(levels[1:]), "it stays red while it is in force"
    clear.click()
    expect(clear).to_be_hidden()
    until(lambda: not held(quiet)["stop"]["latched"], "the end of the stop")
