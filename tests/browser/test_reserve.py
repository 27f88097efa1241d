"""Moves of the chassis keep a reserve unless the operator asks for none, and the page says what they cost."""

import re

from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, held, press
from tests.support.server import Running
from tests.support.waiting import until

FAR = "0.05"
"""Along x [m]: beyond the reserve of the sample's stance, and within its reach."""


def check_the_move(page: Page, served: Running, dx: str) -> dict:
    """Ask for it on the page; what the server answered."""
    page.locator("#shift-dx").fill(dx)
    before = held(served)["body_move"]
    press(page, "Check the move")
    until(lambda: held(served)["body_move"] not in (None, before), "an answer")
    return held(served, f"{SESSION}/body-moves/current")


def test_a_move_keeps_a_reserve_unless_none_is_asked_for_and_says_what_it_costs(console: Page, quiet: Running) -> None:
    page = console
    page.locator("#panel-what-if summary").click()
    expect(page.locator("#keep-reserve")).to_be_checked()
    answer = page.locator("#what-if-answer")

    near = check_the_move(page, quiet, "0.02")
    assert near["status"] == "found", near["reason"]
    costs = [one for one in near["checks"] if "reserve" in one["name"]]
    assert {one["name"] for one in costs} == {"reach reserve", "joint reserve"}
    for one in costs:
        assert re.search(r"\d\.\d+ before", one["where"]), one
        expect(answer).to_contain_text(one["where"])

    refused = check_the_move(page, quiet, FAR)
    assert refused["status"] != "found"
    expect(answer).to_contain_text("from straight")
    expect(answer.locator("button", has_text="Make commands")).to_have_count(0)

    page.locator("#keep-reserve").uncheck()
    bare = check_the_move(page, quiet, FAR)
    assert bare["status"] == "found", bare["reason"]
    assert not [one for one in bare["checks"] if "reserve" in one["name"]]
    expect(answer).to_contain_text("The chassis can go there")


def test_what_is_asked_for_again_is_answered_again(console: Page, quiet: Running) -> None:
    console.locator("#panel-what-if summary").click()
    answer = console.locator("#what-if-answer")
    press(console, "Find a shift for the footfall")
    until(lambda: held(quiet)["shift"], "an answer")
    expect(answer).not_to_contain_text("Looking for a shift")
    said = answer.locator("p").inner_text()
    first = held(quiet)["shift"]
    with console.expect_request("**/shifts"):
        press(console, "Find a shift for the footfall")
    expect(answer.locator("p")).to_have_text(said)
    assert held(quiet)["shift"] == first
    # refused, nothing is looked for
    console.route("**/shifts", lambda one: one.fulfill(status=409, json={"detail": "not now"}))
    press(console, "Find a shift for the footfall")
    expect(console.locator("#toast")).to_have_text("not now")
    expect(answer).to_have_text("")
