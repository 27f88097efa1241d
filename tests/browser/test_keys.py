"""Keys that a control has for itself, and keys of other layouts and systems."""

from playwright.sync_api import Page, expect

from tests.support.page_steps import RIGID, held
from tests.support.server import Running
from tests.support.waiting import until

WINDOWS = """key => document.querySelector("#h-commands").dispatchEvent(new KeyboardEvent("keydown", {
    key, bubbles: true, cancelable: true, ctrlKey: true, altKey: true, modifierAltGraph: true,
}))"""
"""A character that AltGr types, as Windows tells it."""


def rows(quiet: Running) -> int:
    return len(held(quiet, f"/sequences/{held(quiet)['sequence']}")["commands"])


def test_space_ticks_the_box_that_has_the_focus(console: Page) -> None:
    expect(console.locator("#ghost-play")).to_be_enabled()
    box = console.locator("#conservative")
    for ticked in (True, False):
        box.focus()
        console.keyboard.press("Space")
        expect(box).to_be_checked(checked=ticked)
    expect(console.locator("#ghost-play")).to_have_attribute("aria-label", "Play the ghost")


@RIGID
def test_ctrl_shift_z_makes_again_what_was_undone(console: Page, quiet: Running) -> None:
    before = rows(quiet)
    console.locator("#insert-wait").click()
    until(lambda: rows(quiet) == before + 1, "the wait")
    console.locator("#h-commands").click()
    console.keyboard.press("Control+z")
    until(lambda: rows(quiet) == before, "the list without it")
    expect(console.locator("#redo")).to_be_enabled()
    console.keyboard.press("Control+Shift+Z")
    until(lambda: rows(quiet) == before + 1, "the wait again")


def test_keys_that_another_layout_types_with_altgr_act(console: Page, quiet: Running) -> None:
    expect(console.locator("#ghost-play")).to_be_enabled()
    before = held(quiet)["view"]["scrub"]
    console.evaluate(WINDOWS, "]" if before < 0.5 else "[")
    until(lambda: abs(held(quiet)["view"]["scrub"] - before) > 0.01, "the ghost's next place")
