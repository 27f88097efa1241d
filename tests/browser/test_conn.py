"""Two pages, one rover: who holds the conn, handing it on, sending step by step, and a stop from either page."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit
from footfall.session.registry import Sessions
from tests.support.page_steps import held, keep_pressed
from tests.support.server import Running, running_server
from tests.support.waiting import until


@pytest.fixture
def plain(tmp_path: Path) -> Iterator[Running]:
    """The rock-step sample with its rover, without a scene; its sequence waits a moment first, then for minutes."""

    def prepare(sessions: Sessions) -> None:
        live = sessions.open_sample("rock-step")
        for seconds in (300.0, 0.5):
            live.edit_sequence(live.state.sequence or "", Edit("insert", 0, Command("WAIT", None, None, seconds)))

    with running_server(tmp_path, prepare=prepare) as running:
        running.rover.start()
        current = running.sessions.current
        until(lambda: current is not None and current.frame, "the first telemetry")
        yield running


@pytest.fixture
def pages(chromium: Browser, plain: Running) -> Iterator[tuple[Page, Page]]:
    """Two operators' pages; a script error fails the test."""
    contexts = [chromium.new_context(viewport={"width": 1280, "height": 720}) for _ in range(2)]
    faults: list[str] = []
    opened = []
    for context in contexts:
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(f"{plain.url}/?scene=off")
        page.get_by_text("Stepping over a rock", exact=True).wait_for()
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
    look_at(first, "asked")
    press(first, "Grant")
    expect(first.locator("#toast")).to_be_hidden()  # it is answered
    expect(second.locator("#status-conn")).to_have_text("this page")
    expect(button(first, "Arm")).to_be_disabled()
    press(second, "Release conn")
    expect(first.locator("#status-conn")).to_have_text("nobody")


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
    second.get_by_role("button", name="Clear stop").click()
    expect(second.locator("#toast")).to_contain_text("holds the conn")
    first.get_by_role("button", name="Clear stop").click()
    expect(first.locator("#stop-state")).to_contain_text("Not a safety-rated stop.")
