"""Keys that come faster than the server's answers mean what was chosen last, never what the page showed before."""

import json

import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import held, press
from tests.support.server import Running
from tests.support.waiting import until

LATE = """([method, end]) => {
    const ask = window.fetch;
    window.fetch = async (...asked) => {
        const mine = String(asked[0]).endsWith(end) && asked[1]?.method === method;
        const answer = await ask(...asked);
        if (mine) await new Promise((done) => setTimeout(done, 3000));
        return answer;
    };
}"""
"""Answers to one kind of request take three seconds to the page, though the server is at once done with it."""
REFUSED = """() => {
    const ask = window.fetch;
    window.fetch = async (...asked) => {
        if (!String(asked[0]).endsWith("/footfalls")) return ask(...asked);
        await new Promise((done) => setTimeout(done, 3000));
        return ask(asked[0], { ...asked[1], body: JSON.stringify({ leg: 99, x: 0, y: 0 }) });
    };
}"""


def typed(console: Page, x: float, y: float) -> None:
    """A footfall, typed and chosen without a look at the page."""
    console.keyboard.press("f")
    for number in (x, y):
        console.keyboard.press("Control+a")
        console.keyboard.type(str(number))
        console.keyboard.press("Tab")
    console.keyboard.press("Enter")  # Choose


def plans(quiet: Running) -> list[dict]:
    return [event for event in held(quiet, "/sessions/current/log?limit=1000")["events"] if is_plan(event)]


def is_plan(event: dict) -> bool:
    return event["type"] == "product" and event["payload"]["kind"] == "plan"


def test_a_step_is_planned_to_the_footfall_that_was_typed_just_before(console: Page, quiet: Running) -> None:
    before = plans(quiet)
    old = held(quiet)["footfall"]
    console.evaluate(LATE, ["POST", "/footfalls"])
    typed(console, -0.5, 1.74)
    console.keyboard.press("p")
    until(lambda: len(plans(quiet)) > len(before), "the plan")
    footfall = held(quiet, "/sessions/current/plans/current")["footfall"]
    assert (footfall["x"], footfall["y"]) == (-0.5, 1.74) != (old["x"], old["y"])
    assert len(plans(quiet)) == len(before) + 1


def test_a_footfall_is_of_the_leg_that_was_chosen_just_before(console: Page, quiet: Running) -> None:
    console.evaluate(LATE, ["PUT", "/view"])
    console.keyboard.press("4")
    typed(console, -0.5, 1.74)
    until(lambda: held(quiet)["footfall"]["x"] == -0.5, "the footfall")
    assert held(quiet)["footfall"]["leg"] == held(quiet)["view"]["leg"] == 4


def test_nothing_is_planned_where_what_was_chosen_just_before_is_refused(console: Page, quiet: Running) -> None:
    before, old, jobs = plans(quiet), held(quiet)["footfall"], held(quiet)["jobs"]
    console.evaluate(REFUSED)
    typed(console, -0.5, 1.74)
    console.keyboard.press("p")
    expect(console.locator("#toast")).to_contain_text("your last choice was refused")
    assert json.dumps(held(quiet)["jobs"]) == json.dumps(jobs)
    assert plans(quiet) == before
    assert held(quiet)["footfall"] == old
    # once more: now it is the chosen one that is meant, and in sight
    press(console, "Plan step")
    until(lambda: len(plans(quiet)) > len(before), "the plan")


def test_commands_are_made_of_the_plan_that_was_asked_for_just_before(console: Page, quiet: Running) -> None:
    before, old = plans(quiet), held(quiet)["sequence"]
    console.evaluate(LATE, ["POST", "/plans"])  # the page does not even know its job yet
    typed(console, -0.5, 1.74)
    console.keyboard.press("p")
    console.keyboard.press("s")
    until(lambda: held(quiet)["sequence"] != old, "the commands")
    assert len(plans(quiet)) == len(before) + 1
    plan = held(quiet, "/sessions/current/plans/current")
    assert (plan["footfall"]["x"], plan["footfall"]["y"]) == (-0.5, 1.74)
    assert not held(quiet)["commands_of_another_plan"]


def test_no_commands_are_made_where_the_plan_asked_for_just_before_is_refused(console: Page, quiet: Running) -> None:
    old = held(quiet)["sequence"]
    assert held(quiet)["plan"]["status"] == "found"
    console.evaluate(REFUSED.replace("/footfalls", "/plans").replace("{ leg: 99, x: 0, y: 0 }", "{ leg: 99 }"))
    console.keyboard.press("p")
    console.keyboard.press("s")
    expect(console.locator("#toast")).to_contain_text("Nothing was made")
    assert held(quiet)["sequence"] == old


def test_what_was_taken_in_hand_stays_in_it_when_an_older_summary_comes_late(console: Page, quiet: Running) -> None:
    console.locator("#h-footfall").click()
    console.locator("#panel-what-if summary").click()
    console.evaluate(LATE, ["GET", "/sessions/current"])
    with console.expect_request("**/api/v1/sessions/current"):
        pass  # asked for before anything is in hand
    console.locator("#hand-chassis").click()
    expect(console.locator("#hand-title")).to_have_text("In hand: chassis")
    console.wait_for_timeout(3500)  # it has come, and the next one has not
    console.keyboard.press("Shift+PageDown")
    console.keyboard.press("Enter")
    until(lambda: held(quiet)["what_if"], "the what-if")
    cell = held(quiet)["terrain"]["resolution"]
    assert held(quiet)["what_if"]["dz"] == pytest.approx(-10 * cell)
