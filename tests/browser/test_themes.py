"""The page's themes: chosen on it, remembered by the browser; nothing serious for axe-core."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.architecture.test_page_themes import FLOORS, themes
from tests.browser.test_console_access import violations
from tests.support.waiting import until

SHOWN = {"6": "#panel-goal", "7": "#panel-plan", "8": "#panel-legs", "9": "#panel-sessions"}
GROUND = "() => getComputedStyle(document.body).backgroundColor"
CORNER = """() => {
  const canvas = document.getElementById("timeline-canvas");
  return canvas.width ? [...canvas.getContext("2d").getImageData(1, 1, 1, 1).data] : null;
}"""


def rgb(theme: str, name: str) -> list[int]:
    return [round(255 * one) for one in themes()[theme][name][:3]]


def told(theme: str, name: str) -> str:
    return f"rgb({', '.join(str(one) for one in rgb(theme, name))})"


@pytest.mark.parametrize("theme", FLOORS)
def test_axe_finds_nothing_serious_in_a_theme(console: Page, theme: str, look: Callable[[str], None]) -> None:
    console.get_by_label("Theme").select_option(theme)
    found = []
    for key, panel in SHOWN.items():
        console.locator("#h-next").evaluate("one => document.activeElement.blur()")
        console.keyboard.press(key)
        expect(console.locator(panel)).to_be_visible()
        found += violations(console)
        look(f"{theme}-{key}")
    assert found == []


def test_a_theme_is_remembered_and_drawn(console: Page) -> None:
    assert console.evaluate(GROUND) == told("dark", "ground")
    until(lambda: console.evaluate(CORNER) == [*rgb("dark", "well"), 255], "the timeline, dark")
    console.get_by_label("Theme").select_option("light")
    assert console.evaluate(GROUND) == told("light", "ground")
    until(lambda: console.evaluate(CORNER) == [*rgb("light", "well"), 255], "the timeline, light")
    console.reload()
    expect(console.get_by_label("Theme")).to_have_value("light")
    assert console.evaluate(GROUND) == told("light", "ground")
    until(lambda: console.evaluate(CORNER) == [*rgb("light", "well"), 255], "the whole page, light")

    console.keyboard.press("Control+k")
    console.locator("#palette-input").fill("Theme: sunlight")
    console.keyboard.press("Enter")
    until(lambda: console.evaluate(GROUND) == told("sunlight", "ground"), "the theme by the palette")
    expect(console.get_by_label("Theme")).to_have_value("sunlight")


def test_what_a_browser_kept_and_no_theme_is_leaves_the_page_dark(console: Page) -> None:
    console.evaluate("() => localStorage.setItem('footfall.theme', 'neon')")
    console.reload()
    expect(console.get_by_label("Theme")).to_have_value("dark")
    assert console.evaluate(GROUND) == told("dark", "ground")
