"""A whole step without a pointer: leg, footfall, plan, commands, arming, sending, arrival."""

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.support.page_steps import held, planned, sequenced
from tests.support.server import Running
from tests.support.waiting import until

COUNT_POINTER = """() => {
  window.pointed = 0;
  for (const type of ["pointerdown", "pointermove", "mousedown", "mousemove", "touchstart"])
    window.addEventListener(type, () => { window.pointed += 1; }, true);
}"""


def find_act(page: Page, name: str) -> None:
    """Choose an act in the palette by its name."""
    page.keyboard.press("Control+k")
    expect(page.locator("#palette-input")).to_be_focused()
    page.keyboard.type(name)
    first = page.locator("#palette-list li").first
    expect(first).to_contain_text(name)
    expect(first).not_to_have_attribute("aria-disabled", "true")
    page.keyboard.press("Enter")
    expect(page.locator("#palette")).to_be_hidden()


def test_a_step_is_carried_out_without_a_pointer(page: Page, served: Running, look: Callable[[str], None]) -> None:
    page.evaluate(COUNT_POINTER)
    for leg in (4, 2):
        page.keyboard.press(str(leg))
        until(lambda leg=leg: held(served)["view"]["leg"] == leg, f"leg {leg}")
        expect(page.locator(f"#leg-{leg}")).to_have_attribute("aria-checked", "true")
    page.keyboard.press("f")
    for number in ("-0.45", "1.78"):
        page.keyboard.press("Control+a")
        page.keyboard.type(number)
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")  # Choose
    until(lambda: held(served)["footfall"]["x"] == -0.45, "the typed footfall")
    planned(page, served, lambda: page.keyboard.press("p"))
    expect(page.locator("#make-sequence")).to_be_enabled()
    sequence = sequenced(served, lambda: page.keyboard.press("s"))
    expect(page.locator("#commands tbody tr")).to_have_count(len(sequence["commands"]))
    expect(page.locator("#arm")).to_be_enabled()

    find_act(page, "Arm the commands")
    expect(page.locator("#send")).to_be_enabled()
    look("armed")
    assert not held(served)["commands"]
    find_act(page, "Send to rover")
    until(lambda: held(served)["commands"], "the first command")
    expect(page.locator("#status-mode")).to_have_text("moving")
    last = len(sequence["commands"]) - 1
    until(lambda: any(c["row"] == last and c["state"] == "done" for c in held(served)["commands"]), "the arrival")
    expect(page.locator("#commands tbody tr").nth(last)).to_contain_text("done")
    expect(page.locator("#status-mode")).to_have_text("idle")
    expect(page.locator("#status-match")).to_have_text("carried out as commanded")
    look("arrived")
    assert page.evaluate("window.pointed") == 0
