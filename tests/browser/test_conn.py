"""Two pages, one rover: who holds the conn, handing it on, sending step by step, and a stop from either page."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit
from footfall.session.registry import Sessions
from tests.support.page_steps import RIGID, held, keep_pressed, lay_out, planned
from tests.support.server import Running, running_server
from tests.support.spoken import current
from tests.support.waiting import until


@pytest.fixture
def plain(tmp_path: Path, sample: str) -> Iterator[Running]:
    """The sample with its rover, without a scene; its sequence waits a moment first, then for minutes."""

    def prepare(sessions: Sessions) -> None:
        live = sessions.open_sample(sample)
        for seconds in (300.0, 0.5):
            live.sequences.edit(live.state.sequence or "", Edit("insert", 0, Command("WAIT", None, None, seconds)))

    with running_server(tmp_path, prepare=prepare) as running:
        running.rover.start()
        until(lambda: current(running).rover.frame, "the first telemetry")
        yield running


@pytest.fixture
def pages(chromium: Browser, plain: Running) -> Iterator[tuple[Page, Page]]:
    """Two operators' pages; a script error fails the test."""
    contexts = [chromium.new_context(viewport={"width": 1280, "height": 720}) for _ in range(2)]
    faults: list[str] = []
    opened = []
    for context in contexts:
        lay_out(context)
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(f"{plain.url}/?scene=off")
        page.get_by_text(current(plain).state.name, exact=True).wait_for()
        expect(page.locator("#status-mode")).to_have_text("idle")
        opened.append(page)
    yield opened[0], opened[1]
    for context in contexts:
        context.close()
    assert not faults


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def press(page: Page, name: str) -> None:
    expect(button(page, name)).to_be_enabled()
    button(page, name).click()


def row(page: Page, number: int) -> Locator:
    return page.locator("#commands tbody tr").nth(number)


def test_the_conn_is_seen_requested_granted_and_kept_over_a_reload(
    pages: tuple[Page, Page], look_at: Callable[[Page, str], None]
) -> None:
    first, second = pages
    first.keyboard.press("8")
    expect(first.locator("#status-conn")).to_have_text("nobody")
    press(first, "Arm")
    expect(first.locator("#status-conn")).to_have_text("this page")
    expect(second.locator("#status-conn")).to_contain_text("another page")
    expect(button(second, "Arm")).to_be_disabled()
    first.reload()
    expect(first.locator("#status-conn")).to_have_text("this page")
    press(second, "Request conn")
    expect(first.locator("#status-conn")).to_contain_text("requests it")
    expect(first.locator("#toast")).to_contain_text("requests the conn")
    for answer in ("Grant", "Keep conn"):
        expect(button(first, answer)).to_be_in_viewport(ratio=1)
    look_at(first, "asked")
    press(first, "Grant")
    expect(first.locator("#toast")).to_be_hidden()  # it is answered
    expect(second.locator("#status-conn")).to_have_text("this page")
    expect(button(first, "Arm")).to_be_disabled()
    press(second, "Release conn")
    expect(first.locator("#status-conn")).to_have_text("nobody")


@RIGID
def test_rows_go_step_by_step_and_either_page_stops(pages: tuple[Page, Page], plain: Running) -> None:
    first, second = pages
    first.get_by_label("step by step").check()
    press(first, "Arm")
    press(first, "Send to rover")
    expect(row(first, 0)).to_contain_text("done")
    expect(first.locator("#arm-state")).to_contain_text("waits before row 2 of ")
    expect(row(first, 1)).to_contain_text("queued")
    expect(second.locator("#run-next")).to_be_disabled()
    first.locator("#run-next").click()  # not long enough to be meant
    assert held(plain)["gate"]["waiting"] is True
    keep_pressed(first, "#run-next")
    expect(row(second, 1)).to_contain_text("started")
    keep_pressed(first, "#run-resume")
    press(first, "Hold")
    expect(first.locator("#run-state")).to_contain_text("held by local")
    press(first, "Abort")
    expect(first.locator("#run-state")).to_have_text("aborted")
    second.get_by_role("button", name="STOP", exact=True).click()
    expect(second.locator("#stop-state")).to_contain_text("acknowledged by the rover")
    expect(row(first, 1)).to_contain_text("failed")
    expect(row(first, 2)).to_contain_text("not sent")
    kept = r"The conn is held by another page \w+: request it first\."
    expect(second.locator("#next-about")).to_have_text(re.compile(rf"^It can't be cleared here\. {kept}$"))
    expect(first.locator("#next-about")).to_have_text("Clear it, left of STOP, once it is safe to go on.")
    second.get_by_role("button", name="Clear stop").click()
    expect(second.locator("#toast")).to_have_text(re.compile(rf"^{kept}$"))
    first.get_by_role("button", name="Clear stop").click()
    expect(first.locator("#stop-state")).to_contain_text("Not a safety-rated stop.")


def leg_of(page: Page) -> int:
    """The one that is chosen there."""
    return int((page.locator("#legs [aria-checked=true]").get_attribute("id") or "leg--1")[len("leg-") :])


def choose(page: Page, plain: Running, x: float, y: float) -> None:
    """The footfall; then focus is no more in its fields, so that they follow what is chosen."""
    page.locator("#footfall-x").fill(str(x))
    page.locator("#footfall-y").fill(str(y))
    press(page, "Choose")
    until(lambda: held(plain)["footfall"]["x"] == x, "the footfall")
    # an answer that is drawn after the fields are left writes them anew
    drawn = "async () => (await import('/js/page.js')).modules['store.js'].known.summary?.footfall_answer?.x"
    until(lambda: page.evaluate(drawn) == x, "the answer on the page")
    page.locator("#h-footfall").click()


def test_each_page_has_its_own_choices_or_what_the_holder_shows_chosen_openly(
    pages: tuple[Page, Page], plain: Running, look_at: Callable[[Page, str], None]
) -> None:
    first, second = pages
    whose = second.locator("#whose")
    expect(whose).to_have_text("● My own choices")
    leg = held(plain)["footfall"]["leg"]
    first.keyboard.press(f"{leg}")
    choose(first, plain, -0.5, 1.74)
    second.keyboard.press("4")
    expect(second.locator("#leg-4")).to_have_attribute("aria-checked", "true")
    choose(second, plain, -0.45, 1.78)
    # neither leg nor footfall of one page is the other's, and what is planned there is planned for its own
    assert leg_of(first) == leg != 4
    expect(first.locator("#footfall-x")).to_have_value("-0.5")
    planned(first, plain, lambda: first.locator("#plan").click())
    asked = held(plain, "/sessions/current/plans/current")["footfall"]
    assert (asked["leg"], asked["x"], asked["y"]) == (leg, -0.5, 1.74)
    expect(second.locator("#footfall-x")).to_have_value("-0.45")

    press(first, "Take conn")
    expect(second.locator("#status-conn")).to_contain_text("another page")
    second.locator("body").press("_")
    expect(whose).to_have_text("⇄ What the conn holder shows")
    expect(whose).to_have_attribute("aria-pressed", "true")
    expect(second.locator(f"#leg-{leg}")).to_have_attribute("aria-checked", "true")
    expect(second.locator("#footfall-x")).to_have_value("-0.500")
    look_at(second, "follows")
    second.locator("body").press("5")
    expect(second.locator("#toast")).to_contain_text("show your own choices first")
    first.locator("body").press("3")
    expect(second.locator("#leg-3")).to_have_attribute("aria-checked", "true")
    plans = len(held(plain)["jobs"])
    second.locator("#plan").click()
    expect(second.locator("#toast")).to_contain_text("show your own choices first")
    assert len(held(plain)["jobs"]) == plans
    second.locator("#whose").click()
    expect(whose).to_have_text("● My own choices")
    expect(second.locator("#leg-4")).to_have_attribute("aria-checked", "true")
    expect(second.locator("#footfall-x")).to_have_value("-0.450")
    assert leg_of(first) == 3


def test_a_duplicated_tab_is_a_page_of_its_own(console: Page) -> None:
    named = "sessionStorage.getItem('footfall-page')"
    first = console.evaluate(named)
    with console.context.expect_page() as opened:
        # with a copy of what the tab keeps, as a duplicate has
        console.evaluate("() => { window.open(location.href); }")
    second = opened.value
    second.wait_for_function(f"first => ![null, first].includes({named})", arg=first)
    expect(second.locator("#status-server")).to_have_text("connected")
    assert console.evaluate(named) == first
