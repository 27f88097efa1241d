"""A rover with masses and springs makes a step that was commanded for sag: sent from the page, measured sag told."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, SLOW, commanded, held, planned, press, sequenced
from tests.support.server import Running, until


@pytest.mark.parametrize("physics", [True])
def test_measured_sag_is_told_beside_the_predicted(page: Page, served: Running, look: Callable[[str], None]) -> None:
    planned(page, served, lambda: press(page, "Plan step"))
    page.locator("#execution-settings-box summary").click()
    page.locator("#sag-speed_fraction").fill("1")
    answer = commanded(page, served, lambda: press(page, "Command for sag"))
    assert answer["status"] == "found", answer["reason"]
    expect(page.locator("#execution-measured")).to_be_hidden()
    sequence = sequenced(served, lambda: press(page, "Make commands for sag"))
    expect(page.locator("#commands tbody tr")).to_have_count(len(sequence["commands"]), timeout=SLOW)
    press(page, "Arm")
    expect(page.locator("#arm-state")).to_contain_text("armed for", timeout=SLOW)
    press(page, "Send to rover")

    def ended() -> bool:
        states = [one["state"] for one in held(served)["commands"] if one["sequence"] == sequence["digest"]]
        return states.count("done") == len(sequence["commands"])

    until(ended, "the step", sequence["duration"] + 240)  # physics may run slower than the world
    said = page.locator("#execution-measured")
    expect(said).to_be_visible(timeout=SLOW)
    sag = held(served, f"{SESSION}/sag")
    assert 0.9 < sag["ratio"] < 1.1
    assert said.inner_text() == (
        f"Measured sag is {sag['ratio']:.2f} times the predicted, at {len(sag['rows'])} pauses of the latest run."
    )
    said.evaluate("line => line.scrollIntoView({block: 'end'})")
    look("measured")
