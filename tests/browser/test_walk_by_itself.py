"""A walk by itself on the page: begun over the sample's rover, held, let go on, cancelled; its decisions in sight."""

import re
from collections.abc import Callable

from playwright.sync_api import Page, Request, expect

from footfall.core.value import fields_of
from footfall.planning.choice.onward import CHOOSERS
from footfall.planning.walk_execution.decision import WayOnSettings
from tests.browser.test_console_access import violations
from tests.support.page_steps import figure, held, keep_pressed
from tests.support.server import Running
from tests.support.waiting import BOUND_MS, until

Keep = Callable[[str], None]
LOOP = "/sessions/current/walk-loop"


def test_it_is_begun_held_let_go_on_and_cancelled(page: Page, served: Running, look: Keep) -> None:
    begin, next_act, next_hold = (page.locator(f"#{name}") for name in ("loop-begin", "next-act", "next-hold"))
    steered: list[str] = []
    page.on("request", lambda one: steered.append(one.url.rpartition("/")[2]) if "/walk-loop/" in one.url else None)
    page.locator("#area-loop").click()
    expect(begin).to_be_disabled()
    expect(begin).to_have_attribute("title", re.compile("Set the goal of the walk first"))
    page.locator("#area-goal").click()
    page.locator("#walk-ahead").fill("1")
    page.locator("#seed").fill("3")
    begin.click()
    assert held(served)["walk_loop"] is None  # a click is not held

    # a heading that is no number is not the same as any
    page.locator("#walk-yaw").press_sequentially("9e")
    keep_pressed(page, "#loop-begin")
    assert page.evaluate("document.querySelector('#walk-yaw').validity.badInput")
    assert held(served)["walk_loop"] is None
    page.locator("#walk-yaw").fill("")

    page.locator("#loop-look_every").fill("0")  # the sample's ground is seen already
    page.locator("#loop-route").check()

    def begins(one: Request) -> bool:
        return one.method == "POST" and one.url.endswith("/walk-loop")

    ways = page.locator("#loop-choose_by option").evaluate_all("all => all.map((one) => one.value)")
    assert ways == list(CHOOSERS)

    with page.expect_request(begins, timeout=BOUND_MS) as asked:
        keep_pressed(page, "#loop-begin")
    order = asked.value.post_data_json
    assert order is not None
    assert order["limits"] == {**fields_of(WayOnSettings()), "look_every": 0}
    assert (order["farthest"], order["walk"]["seed"], order["route"]) == (3.0, 3, {"no_go": []})
    assert order["choose_by"] == "planner"
    until(lambda: held(served)["run"], "the first commands")
    assert held(served)["route"] is not None
    goal = held(served, LOOP)["goal"]
    expect(page.locator("#loop-now")).to_contain_text("Decided: go: the walk fits", timeout=BOUND_MS)
    expect(next_act).to_have_text("Hold the walk", timeout=BOUND_MS)
    at_which = re.compile(r"foot move \d+ of \d+: leg \d")
    expect(page.locator("#next-about")).to_contain_text(
        f"By itself to ({figure(goal['x'], 2)}, {figure(goal['y'], 2)}) m: foot move"
    )
    expect(page.locator("#loop-part")).to_have_text(at_which)
    expect(page.locator("#loop-way")).to_have_text(
        re.compile(r"^This piece by the walk planner: \d+ foot moves, \d+ s of motion\.$")
    )
    for button in (begin, page.locator("#loop-on")):
        expect(button).to_be_disabled()
    expect(page.locator("#loop-hold")).to_be_enabled()
    decisions = page.locator("#loop-decisions li")
    expect(decisions.last).to_have_text(re.compile(r"\d\d:\d\d:\d\d replan: there is no walk yet$"))
    look("goes")

    expect(page.locator("#walk-until")).to_be_hidden()
    expect(page.locator("#next-loop-cancel")).to_be_in_viewport(ratio=1)
    # a page that is loaded anew shows it, with the limits that it walks by
    page.reload()
    expect(page.locator("#loop-now")).to_contain_text("Decided: go: the walk fits", timeout=BOUND_MS)
    expect(page.locator("#loop-part")).to_have_text(at_which)
    expect(page.locator("#loop-look_every")).to_have_value("0")
    expect(decisions.filter(has_text="go: the walk fits").first).to_be_visible()
    expect(page.locator("#next-loop-cancel")).to_be_in_viewport(ratio=1)

    next_act.click()
    until(lambda: held(served, LOOP)["state"] == "held", "the hold")
    expect(page.locator("#loop-now")).to_contain_text("Held. Decided last: go")
    until(lambda: held(served)["gate"]["waiting"] or held(served)["gate"]["state"] == "idle", "the end of the row")
    expect(page.locator("#verdict")).to_contain_text("Held. Decided last: go")
    expect(page.locator("#next-about")).to_contain_text("Waits for somebody to let it go on", timeout=BOUND_MS)
    expect(page.locator("#next-loop-hold")).to_be_hidden()
    expect(next_hold).to_have_text("Go on by itself", timeout=BOUND_MS)
    assert violations(page) == []
    look("held")
    next_hold.click()
    assert held(served, LOOP)["state"] == "held"

    # by keyboard: Enter is held
    for key in ("Tab", "Shift+Tab"):
        page.keyboard.press(key)
    expect(next_hold).to_be_focused()
    page.keyboard.down("Enter")
    until(lambda: held(served, LOOP)["state"] == "going", "the walk's going on")
    expect(next_act).to_be_focused(timeout=BOUND_MS)
    page.keyboard.down("Enter")  # still: it repeats on the button that holds the walk
    page.keyboard.up("Enter")
    expect(page.locator("#loop-on")).to_be_disabled()

    page.keyboard.press("Control+k")
    page.keyboard.type("cancel the walk by itself")
    page.keyboard.press("Enter")
    until(lambda: held(served, LOOP)["state"] == "ended", "the end")
    assert held(served, LOOP)["outcome"] == "cancelled"
    page.evaluate("null")  # requests are heard of only while the page is spoken to
    assert steered == ["hold", "resume", "cancel"]
    words = "By itself to the goal: cancelled: ended by local"
    expect(page.locator("#loop-now")).to_have_text(words)
    expect(page.locator("#verdict")).to_have_text(words, timeout=BOUND_MS)
    expect(decisions.first).to_contain_text("end: cancelled")
    expect(page.locator("#loop-cancel")).to_be_disabled()
    expect(page.locator("#next-loop")).to_be_hidden()
    until(lambda: held(served)["gate"]["state"] == "idle", "the end of the run")
    look("cancelled")


def test_why_a_wave_was_refused_is_told_with_what_is_gone_in_its_place(page: Page, served: Running) -> None:
    """As an answer has it; the rover goes by waves in tests/session."""
    refused = {"gait": "wave", "reason": "step 5 (leg 5) fails wrist of leg 0 by 0.0458 rad"}
    chosen = {"action": "walk", "found": True, "foot_moves": 3, "motion": 120.4, "refused": refused}
    told = page.evaluate(
        "async (chosen) => (await import('/js/page.js')).modules['texts/walk.js'].wayTold(chosen)", chosen
    )
    assert told == (
        "No wave: step 5 (leg 5) fails wrist of leg 0 by 0.0458 rad. This piece by the walk planner: 3 foot moves, "
        "120 s of motion."
    )
