"""What comes next on the page: what sends is held and not clicked, a stop comes before all, the keyboard finds it."""

import re
import time
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from footfall.session.gate import machine
from tests.browser.test_console_access import violations
from tests.support.page_steps import RIGID, SESSION, as_shown, held, let_pass, press
from tests.support.server import Running
from tests.support.spoken import current, say
from tests.support.waiting import BOUND_MS

Keep = Callable[[str], None]


@RIGID
def test_a_click_on_what_sends_sends_nothing_and_a_stop_comes_before_it(
    page: Page, served: Running, look: Keep
) -> None:
    press(page, "Arm")
    sends = page.locator("#next-hold")
    expect(sends).to_have_text("Send to rover", timeout=BOUND_MS)
    expect(page.locator("#next-act")).to_be_hidden()
    sends.click()
    sends.dblclick()
    sends.press("Enter")
    look("armed")
    assert violations(page) == []
    page.locator("#stop").click()
    expect(page.locator("#next-act")).to_have_text("A stop is in force", timeout=BOUND_MS)
    expect(page.locator("#next-act")).to_be_disabled()
    expect(sends).to_be_hidden()
    assert held(served)["run"] is None
    look("stopped")


@RIGID
def test_what_is_armed_may_be_sent_for_as_long_from_after_its_checks(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long they take; how long an answer is under way counts."""
    monkeypatch.setattr(machine, "ARMED_FOR", 100.0)
    longer = [90.0, 150.0]  # than in truth: said by the server, and passed for the page

    def checked(route: Route) -> None:
        response = route.fetch()
        body = response.json()
        let_pass(page, longer[1])
        route.fulfill(response=response, json={**body, "took": body["took"] + longer[0]})

    page.route("**/arm", checked)
    press(page, "Arm")
    said = page.locator("#arm-state")
    expect(said).to_have_text(re.compile(r"^armed for [1-4]\d s"), timeout=BOUND_MS)
    longer[0] = 0.0
    press(page, "Arm")
    expect(said).to_have_text(re.compile("^not armed"), timeout=BOUND_MS)


@RIGID
def test_why_a_run_waits_is_said_once(page: Page, look: Keep) -> None:
    press(page, "Arm")
    page.locator("#send").click()
    press(page, "Release conn")
    why = "the conn was lost or changed hands; whoever holds it may go on or abort"
    said = re.compile(rf"^Waits before row [0-9]+ of [0-9]+: {why}$")
    expect(page.locator("#verdict")).to_have_text(said, timeout=BOUND_MS)
    expect(page.locator("#next-hold")).to_have_text("Go on")
    expect(page.locator("#next-about")).to_have_text("Sends the rows that are left.")
    look("waits")


def test_by_keyboard_alone_up_to_the_goal(page: Page, served: Running) -> None:
    button = page.locator("#next-act")
    expect(button).to_have_text("Take images", timeout=BOUND_MS)
    expect(page.locator("#next-about")).to_have_text("The ground was seen more than an hour ago.")
    button.focus()
    page.keyboard.press("Tab")
    expect(page.locator("#walk-until")).to_be_focused()
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    expect(button).to_have_text("Build terrain", timeout=BOUND_MS)
    expect(button).to_be_focused()  # also where it could not be pressed meanwhile


def test_what_was_refused_is_in_sight_with_its_reason(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill("900")
    console.locator("#walk-y").fill("0")
    button = console.locator("#next-act")
    expect(button).to_have_text("Plan walk", timeout=BOUND_MS)
    button.click()
    expect(button).to_have_text("Choose another goal", timeout=BOUND_MS)
    reason = as_shown(held(quiet, f"{SESSION}/walks/current")["reason"])
    assert reason
    expect(console.locator("#verdict")).to_have_text(re.compile(rf"^No walk \([a-z ]+\): {re.escape(reason)}$"))
    expect(console.locator("#verdict")).to_have_class("no")
    expect(console.locator("#verdict")).to_be_in_viewport(ratio=1)
    look("refused")


def test_what_failed_before_a_run_is_not_said_of_it_after_a_reload(console: Page, quiet: Running) -> None:
    why = "there is no way around the rock"
    failed = {"id": "failed", "kind": "walk", "state": "failed", "fraction": 0.5, "text": why, "result": None}
    failed |= {"session": held(quiet)["id"], "error": {"kind": "conflict", "message": why, "details": {}}}
    ended = time.time()

    def with_the_job(route: Route) -> None:
        answer = route.fetch()
        body = answer.json()
        route.fulfill(response=answer, json={**body, "jobs": [*body["jobs"], {**failed, "ended": ended}]})

    console.route("**/sessions/current", with_the_job)
    console.reload()
    verdict = console.locator("#verdict")
    expect(verdict).to_have_text(why)
    live = current(quiet)
    live.rover.connected(lambda text: None)
    say(quiet, 1)
    live.commands.send(live.commands.arm()["token"])
    expect(verdict).not_to_have_text(why)
    console.reload()
    expect(verdict).to_contain_text(re.compile("^(Row 1|Run 1) "))
