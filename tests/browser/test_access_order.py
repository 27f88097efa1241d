"""The way of the focus through the page, by Tab alone, and axe-core where no other test has it look."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from playwright.sync_api import Browser, Page, expect

from footfall.io.account_store import FILE
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from tests.browser.test_console_access import violations
from tests.support.server import Running, running_server
from tests.support.waiting import until

MOST_STOPS = 400
SHOWN = {"6": "#panel-goal", "7": "#panel-plan", "8": "#panel-legs", "9": "#panel-sessions"}
"""What a layout has and the others have not."""
# where the focus is: its place in the document, the part of the page, whether it can be seen
HERE = """() => {
  const one = document.activeElement;
  if (!one || one === document.body || one === document.documentElement) return null;
  const part = one.closest("header, nav, .next, .scene, #dock, #timeline, #side > .panel");
  const box = one.getBoundingClientRect(), style = getComputedStyle(one);
  return {
    name: one.id || one.textContent.trim().slice(0, 40),
    part: part ? part.id || part.className || part.tagName.toLowerCase() : "",
    at: [...document.querySelectorAll("*")].indexOf(one),
    ringed: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
    inside: box.bottom > 0 && box.top < innerHeight && box.right > 0 && box.left < innerWidth,
  };
}"""
PARTS = """() => [...document.querySelectorAll("header, nav, .next, .scene, #dock, #timeline, #side > .panel")]
  .filter(one => one.checkVisibility()).map(one => one.id || one.className || one.tagName.toLowerCase())"""


def walked(page: Page) -> list[dict]:
    """Every place of the focus, from the top of the page until Tab has left it."""
    page.evaluate("() => { document.activeElement?.blur(); getSelection().setPosition(document.body, 0); }")
    stops: list[dict] = []
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        here = page.evaluate(HERE)
        if here is None or (stops and here["at"] == stops[0]["at"]):
            return stops
        assert not stops or here["at"] != stops[-1]["at"], f"the focus is trapped in {here['name']}"
        stops.append(here)
    raise AssertionError(f"{MOST_STOPS} presses of Tab do not lead through the page")


def test_a_scene_that_has_the_keys_is_marked(console: Page) -> None:
    """By keyboard alone: a click in it is no news. Switched off, as here, Tab passes it."""
    scene, mark = (
        console.locator("#scene"),
        "() => getComputedStyle(document.querySelector('.scene'), '::after').content",
    )
    console.locator("#open-help").focus()
    console.keyboard.press("Tab")
    assert "scene" not in [one["name"] for one in walked(console)]
    scene.evaluate("one => { one.tabIndex = 0; document.getElementById('leg-0').focus(); }")
    console.keyboard.press("Shift+Tab")
    until(lambda: console.evaluate(mark) == '""', "the mark")
    expect(scene).to_have_class("focused")
    console.locator("#leg-2").focus()
    until(lambda: console.evaluate(mark) == "none", "the mark to go")


@pytest.mark.parametrize("key", SHOWN)
def test_tab_leads_through_the_page_in_reading_order(console: Page, key: str) -> None:
    console.keyboard.press(key)
    expect(console.locator(SHOWN[key])).to_be_visible()
    stops = walked(console)
    assert [one["at"] for one in stops] == sorted(one["at"] for one in stops)
    parts = list(dict.fromkeys(one["part"] for one in stops))
    there = console.evaluate(PARTS)
    assert parts == [part for part in there if part in parts], "parts are met out of their order"
    assert parts[0] == "status"
    assert stops[-1]["part"].startswith("panel-")
    assert [one["name"] for one in stops if not one["ringed"]] == []
    assert [one["name"] for one in stops if not one["inside"]] == []


@pytest.mark.parametrize("key", SHOWN)
def test_axe_finds_nothing_serious_in_a_layout(console: Page, key: str) -> None:
    console.keyboard.press(key)
    expect(console.locator(SHOWN[key])).to_be_visible()
    assert violations(console) == []


@pytest.mark.scene
def test_axe_finds_nothing_serious_on_a_small_screen_with_its_scene(
    page: Page, served: Running, look: Callable[[str], None]
) -> None:
    page.set_viewport_size({"width": 1024, "height": 768})
    expect(page.locator("#scene-note")).to_be_hidden()
    assert violations(page) == []
    look("small")


def test_axe_finds_nothing_serious_where_people_log_in(
    chromium: Browser, tmp_path: Path, look_at: Callable[[Page, str], None]
) -> None:
    with closing(Accounts(tmp_path / FILE, hasher=PasswordHasher(1, 8, 1))) as accounts:
        accounts.add("ada", Role.ADMIN, "a long and good one", Identity("boss", Role.ADMIN, "command line"))
        with running_server(tmp_path, accounts=accounts) as guarded:
            context = chromium.new_context(viewport={"width": 1280, "height": 720})
            page = context.new_page()
            page.goto(guarded.url)
            expect(page).to_have_url(f"{guarded.url}/login.html")
            found = violations(page)
            page.get_by_label("Name").fill("ada")
            page.get_by_label("Password").fill("a wrong password")
            page.keyboard.press("Enter")
            expect(page.get_by_role("alert")).to_have_text("Name or password is wrong.")
            found += violations(page)
            look_at(page, "refused")
            context.close()
    assert found == []
