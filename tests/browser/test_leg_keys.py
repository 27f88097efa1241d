"""A leg's number is its key; what is typed in a field, or would be in one that has gone, chooses nothing."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import held
from tests.support.server import Running
from tests.support.waiting import until


def leg(quiet: Running) -> int:
    return held(quiet)["view"]["leg"]


def test_the_number_of_a_leg_is_its_key(console: Page, quiet: Running) -> None:
    console.locator("#h-plan").click()
    for number in (0, 5, 3, 1, 4, 2):
        expect(console.locator(f"#leg-{number}")).to_have_text(f"Leg {number}key {number}")
        console.keyboard.press(str(number))
        until(lambda number=number: leg(quiet) == number, f"leg {number}")
        expect(console.locator(f"#leg-{number}")).to_have_attribute("aria-checked", "true")
    console.keyboard.press("6")
    console.keyboard.press("1")
    until(lambda: leg(quiet) == 1, "leg 1, and nothing else of 6")


def test_a_step_of_another_leg_than_the_chosen_one_is_named_before_it_is_planned(console: Page, quiet: Running) -> None:
    assert held(quiet)["footfall"]["leg"] == 2
    plan = console.locator("#plan")
    expect(plan).to_have_text("Plan step")
    console.keyboard.press("3")
    expect(plan).to_have_text("Plan step: leg 2")
    console.keyboard.press("2")
    expect(plan).to_have_text("Plan step")


GOES = {
    "removed": "field => field.remove()",
    "drawn anew": "field => field.replaceWith(field.cloneNode())",
    "disabled": "field => { field.disabled = true; document.activeElement.blur(); }",
    "hidden": "field => { field.parentElement.hidden = true; }",
}


@pytest.mark.parametrize("how", GOES)
def test_what_is_typed_where_its_field_has_gone_chooses_nothing(console: Page, quiet: Running, how: str) -> None:
    before, jobs = leg(quiet), len(held(quiet)["jobs"])
    asked: list[Any] = []
    console.on("request", lambda one: asked.append(one.post_data_json) if one.url.endswith("/view") else None)
    field = console.locator("#footfall-x")
    field.click()
    console.keyboard.type("1")
    assert leg(quiet) == before
    field.evaluate(GOES[how])
    until(lambda: console.evaluate("document.activeElement === document.body"), "the end of the focus")
    console.keyboard.type("04p")
    # keys count again where the operator points: by then those before had their time
    console.locator("#h-plan").click()
    with console.expect_request("**/view"):
        console.keyboard.press("5")
    until(lambda: leg(quiet) == 5, "leg 5")
    assert len(held(quiet)["jobs"]) == jobs
    assert asked == [{"leg": 5}]
