"""A target is refused, the page says why and what to try, and the operator comes to a step that is sent."""

import re
from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.support.page_steps import as_shown, held, made, planned, press, sequenced
from tests.support.server import Running
from tests.support.waiting import until


def test_a_refused_target_leads_to_a_suggested_one_that_is_sent(
    page: Page, served: Running, look: Callable[[str], None]
) -> None:
    page.get_by_role("radio", name="Leg 2", exact=True).click()
    made(served, "maps", lambda: press(page, "Show where leg 2 can stand"))
    page.locator("#footfall-x").fill("3.2")
    page.locator("#footfall-y").fill("3.2")
    press(page, "Choose")
    said = page.locator("#footfall-answer")
    expect(said.locator(".no")).to_be_visible()
    for reason in held(served)["footfall_answer"]["reasons"]:
        expect(said).to_contain_text(as_shown(reason))
    made(served, "plan", lambda: press(page, "Plan step"))
    refused = held(served, "/sessions/current/plans/current")
    assert refused["status"] != "found"
    assert re.search(r"is \d+\.\d\d m from its hip, farther than the \d+\.\d\d m it can reach", refused["reason"])
    assert "choose a footfall that the reach map shows green" in refused["reason"]
    expect(page.locator("#plan-answer")).to_contain_text(as_shown(refused["reason"]))
    expect(page.get_by_role("button", name="Make commands")).to_be_disabled()
    expect(page.locator("#gauge-ghost output")).to_contain_text("the plan was refused")
    # the commands are still those of the plan before
    expect(page.locator("#gauge-worst .doubt")).to_contain_text("of another plan")
    look("refused")

    press(page, "Suggest footfalls")
    first = page.locator("#suggestions button").first
    expect(first).to_be_visible()
    first.click()
    until(lambda: held(served)["footfall"]["x"] != 3.2, "the suggested footfall")
    assert held(served)["footfall_answer"]["acceptable"]
    expect(said.locator(".yes")).to_be_visible()
    answer = planned(page, served, lambda: press(page, "Plan step"))
    sequence = sequenced(served, lambda: press(page, "Make commands"))
    assert sequence["parents"]["plan"] == answer["plan"]["digest"]
    press(page, "Arm")
    expect(page.locator("#send")).to_be_enabled()
    press(page, "Send to rover")
    until(lambda: any(c["state"] == "done" for c in held(served)["commands"]), "the first command done")
    expect(page.locator("#commands tbody tr").first).to_contain_text("done")
    look("sent")
