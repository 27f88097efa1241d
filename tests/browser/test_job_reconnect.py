"""The server ends and comes back with the same store and port: the page goes on as it is."""

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from tests.browser.pictures import OUTPUTS
from tests.support.page_steps import held, lay_out
from tests.support.server import running_server
from tests.support.spoken import current
from tests.support.waiting import until


def shown(page: Page) -> dict[str, str]:
    """What the operator had chosen and made, as the page tells it."""
    parts = {
        "leg": "#legs [aria-checked=true]",
        "footfall": "#footfall-answer",
        "plan": "#checks tbody",
        "rows": "#commands tbody",
    }
    return {name: page.locator(selector).inner_text() for name, selector in parts.items()}


def test_the_page_goes_on_without_reload_when_its_server_is_back(chromium: Browser, tmp_path: Path) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    server = page.locator("#status-server")
    with running_server(tmp_path, prepare=lambda s: s.open_sample("rock-step")) as first:
        current(first).rover.connected(lambda text: None)
        page.goto(f"{first.url}/?scene=off")
        page.keyboard.press("2")
        until(lambda: held(first)["view"]["leg"] == 2, "leg 2")
        expect(page.locator("#leg-2")).to_have_attribute("aria-checked", "true")
        expect(page.locator("#commands tbody tr").first).to_be_visible()
        expect(server).to_have_attribute("data-state", "good")
        page.locator("#seed").fill("7")  # typed, and not yet sent to anybody
        page.evaluate("window.marker = 'the same page'")
        arm = page.get_by_role("button", name="Arm", exact=True)
        expect(arm).to_be_enabled()
        before, session = shown(page), held(first)["id"]
        port = int(first.url.rsplit(":", 1)[1])
    expect(server).to_contain_text("silent for")
    expect(server).to_have_attribute("data-state", "bad")
    expect(arm).to_be_disabled()
    expect(arm).to_have_attribute("title", re.compile("server has been silent for"))
    assert shown(page)["rows"] == before["rows"]
    page.screenshot(path=OUTPUTS / "test_the_page_goes_on_without_reload_when_its_server_is_back-lost.png")
    with running_server(tmp_path, prepare=lambda s: s.open(session), port=port) as second:
        expect(server).to_have_attribute("data-state", "good")
        expect(page.locator("#commands tbody tr").first).to_be_visible()
        until(lambda: shown(page) == before, "choices and commands as before")
        current(second).rover.connected(lambda text: None)
        expect(arm).to_be_enabled()
        with second.client() as client:
            client.post("/sessions/current/notes", json={"text": "written after the restart"}).raise_for_status()
        expect(page.locator("#log li").first).to_contain_text("written after the restart")
        page.locator("#h-ground").click()  # out of the field, where 4 is a digit
        page.keyboard.press("4")
        expect(page.locator("#leg-4")).to_have_attribute("aria-checked", "true")
        assert held(second)["view"]["leg"] == 4
        expect(page.locator("#seed")).to_have_value("7")
        assert page.evaluate("window.marker") == "the same page"
    context.close()
    assert not faults
