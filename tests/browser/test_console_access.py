"""What anybody must be able to use: nothing serious for axe-core in any state; touch targets; keyboard alone."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.node import PACKAGES
from tests.support.page_steps import held, press
from tests.support.server import Running
from tests.support.spoken import say
from tests.support.waiting import until

AXE = PACKAGES / "node_modules" / "axe-core" / "axe.min.js"
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
RUN = """async tags => {
  const { violations } = await axe.run(document, { runOnly: tags });
  return violations.filter(one => ["serious", "critical"].includes(one.impact))
    .flatMap(one => one.nodes.map(part => `${one.id}: ${part.target.join(" ")}: ${part.failureSummary}`));
}"""


SMALL = """() => [...document.querySelectorAll("button, select, summary, input, a, [role=option]")]
  .filter(one => one.checkVisibility())
  .map(one => ["checkbox", "radio", "file"].includes(one.type) ? one.closest("label") ?? one : one)
  .map(one => [one.id || one.textContent.trim(), one.getBoundingClientRect()])
  .filter(([, box]) => Math.min(box.width, box.height) < 24)
  .map(([name, box]) => `${name}: ${box.width} × ${box.height}`)"""


def violations(page: Page) -> list[str]:
    if not page.evaluate("() => 'axe' in window"):
        if not AXE.is_file():
            pytest.fail(f"this test needs {AXE}; `make test` installs it")
        page.evaluate(AXE.read_text())  # the page's own policy lets no script in
    return page.evaluate(RUN, TAGS)


def speak(quiet: Running, athlete) -> None:
    """Every state that a leg can show."""
    forces = np.zeros((6, 3))
    forces[:, 2] = [4000, 0, 1000, 1000, 1000, 1000]
    torques = np.zeros(36)
    torques[6 * 2 + 1] = 0.9 * athlete.torque_limits[13]
    torques[6 * 3 + 2] = 1.1 * athlete.torque_limits[20]
    say(quiet, 1, wheel_forces=forces, joint_torques=torques)


def test_axe_finds_nothing_serious(console: Page, quiet: Running, athlete, look: Callable[[str], None]) -> None:
    found = {"plan a step": violations(console)}
    for summary in console.locator("details:not([open]) > summary").all():
        if summary.is_visible():
            summary.click()
    console.locator("#footfall-x").fill("3.2")
    console.locator("#footfall-y").fill("3.2")
    console.get_by_role("button", name="Choose", exact=True).click()
    expect(console.locator("#footfall-answer .no")).to_be_visible()
    found["opened and refused"] = violations(console)
    look("opened")
    console.locator("#h-ground").click()
    console.keyboard.press("8")
    speak(quiet, athlete)
    field = console.get_by_label("Seconds of row 2", exact=True)
    field.fill("0.01")
    field.press("Enter")
    expect(console.locator("#commands tbody tr").nth(1)).to_have_class("failing")
    expect(console.locator("#legs-note")).to_contain_text("Stale")
    found["execute, failing and stale"] = violations(console)
    look("execute")
    console.locator("#h-commands").click()
    console.keyboard.press("9")
    expect(console.locator("#sessions tbody tr")).to_have_count(1)
    found["review"] = violations(console)
    for key, dialog in (("?", "#help"), (":", "#palette"), ("y", "#note")):
        console.locator("#h-sessions").click()
        console.keyboard.press(key)
        expect(console.locator(dialog)).to_be_visible()
        found[dialog] = violations(console)
        console.locator(dialog).evaluate("dialog => dialog.close()")
    serious = [f"{state}: {told}" for state, several in found.items() for told in several]
    assert not serious, "\n".join(serious)


SILENT = """() => [...document.querySelectorAll("button:disabled")]
  .filter(one => one.checkVisibility() && !one.title).map(one => one.id || one.ariaLabel || one.textContent)"""
"""Buttons in sight that can't be pressed and don't say why."""


def test_every_button_that_is_off_says_why(console: Page, quiet: Running) -> None:
    console.keyboard.press("7")
    press(console, "Alternatives")
    expect(console.locator("#compare tbody tr")).to_have_count(4)
    hidden = console.locator("#area-buttons button[aria-expanded=false]")
    while hidden.count():
        hidden.first.click()
    expect(console.locator("#sessions tbody tr")).to_have_count(1)
    console.evaluate("() => document.querySelectorAll('details').forEach(one => { one.open = true; })")
    assert console.locator("button:disabled").count() > 10
    assert console.evaluate(SILENT) == []


@pytest.mark.parametrize("width", [1280, 1024, 820])
def test_a_finger_meets_what_it_aims_at_and_nothing_is_cut_off(
    console: Page, quiet: Running, athlete, look: Callable[[str], None], width: int
) -> None:
    console.set_viewport_size({"width": width, "height": 720 if width == 1280 else 1000})
    speak(quiet, athlete)
    small, wide = [], {}
    for key in "6789":
        console.keyboard.press(key)
        console.wait_for_function("() => document.getElementById('layout').value")
        small += console.evaluate(SMALL)
        wide[key] = console.evaluate("() => document.documentElement.scrollWidth - innerWidth")
        look(f"layout-{key}")
    assert small == []
    assert wide == {"6": 0, "7": 0, "8": 0, "9": 0}


def test_a_step_is_planned_and_made_into_commands_without_a_pointer(
    console: Page, quiet: Running, look: Callable[[str], None]
) -> None:
    before = held(quiet)
    console.keyboard.press("f")
    for number in ("-0.45", "1.78"):
        console.keyboard.press("Control+a")
        console.keyboard.type(number)
        console.keyboard.press("Tab")
    console.keyboard.press("Enter")  # Choose
    until(lambda: held(quiet)["footfall"]["x"] == -0.45, "the typed footfall")
    expect(console.locator("#footfall-answer")).to_contain_text("−0.450")
    console.keyboard.press("p")
    until(lambda: held(quiet)["plan"]["digest"] != before["plan"]["digest"], "the plan")
    assert held(quiet)["plan"]["status"] == "found"
    expect(console.locator("#plan-answer")).to_contain_text("Found by")
    console.keyboard.press("s")
    until(lambda: held(quiet)["sequence"] != before["sequence"], "the sequence")
    look("planned")
