"""A rover with masses and springs makes a step that was commanded for sag: sent from the page, measured sag told."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, commanded, held, planned, press, sequenced
from tests.support.server import Running
from tests.support.waiting import until

pytestmark = pytest.mark.long


@pytest.mark.parametrize("physics", [True])
def test_measured_sag_is_told_beside_the_predicted(page: Page, served: Running, look: Callable[[str], None]) -> None:
    planned(page, served, lambda: press(page, "Plan step"))
    page.locator("#execution-settings-box summary").click()
    page.locator("#sag-speed_fraction").fill("1")
    answer = commanded(page, served, lambda: press(page, "Predict sag"))
    assert answer["status"] == "found", answer["reason"]
    expect(page.locator("#execution-measured")).to_be_hidden()
    sequence = sequenced(served, lambda: press(page, "Compensate for sag"))
    expect(page.locator("#commands tbody tr")).to_have_count(len(sequence["commands"]))
    press(page, "Arm")
    expect(page.locator("#arm-state")).to_contain_text("armed for")
    press(page, "Send to rover")

    def ended() -> bool:
        states = [one["state"] for one in held(served)["commands"] if one["sequence"] == sequence["digest"]]
        return states.count("done") == len(sequence["commands"])

    until(ended, "the step")  # physics may run slower than the world
    said = page.locator("#execution-measured")
    expect(said).to_be_visible()
    sag = held(served, f"{SESSION}/sag")
    assert 0.9 < sag["ratio"] < 1.1
    assert said.inner_text() == (
        f"Measured sag is {sag['ratio']:.2f} times the predicted, at {len(sag['rows'])} pauses of the latest run."
    )
    said.evaluate("line => line.scrollIntoView({block: 'end'})")
    look("measured")
    until(lambda: held(served)["run"]["compared"]["state"] == "compared", "the comparison with the prediction")
    compared = held(served, f"{SESSION}/run")["compared"]
    assert compared["verdict"] == "as_predicted", compared
    text = page.locator("#outcome-text")
    expect(text).to_have_text(f"Run 1: {compared['reason']}.")
    expect(text).to_have_class("yes")
    expect(page.locator("#status-match")).to_have_text("carried out as predicted")
    rows = page.locator("#outcome-table tbody tr")
    expect(rows).to_have_count(len(compared["differences"]))
    for row, one in zip(rows.all(), compared["differences"], strict=True):
        digits = 0 if one["unit"] == "N" else 3
        numbers = [one[name] for name in ("predicted", "measured", "difference", "uncertainty")]
        assert [float(cell.replace("−", "-")) for cell in row.locator("td").all_inner_texts()[:4]] == pytest.approx(
            [round(number, digits) for number in numbers], abs=1.1 * 10**-digits
        )
        assert row.locator("td").last.inner_text() == "●"
    expect(page.locator("#outcome-advice li")).to_have_count(0)
    text.evaluate("line => line.scrollIntoView({block: 'start'})")
    look("compared")


@pytest.mark.parametrize("physics", [True])
def test_a_step_commanded_as_planned_is_not_called_good(
    page: Page, served: Running, look: Callable[[str], None]
) -> None:
    planned(page, served, lambda: press(page, "Plan step"))
    page.locator("#as-commanded").check()
    sequence = sequenced(served, lambda: press(page, "Make commands"))
    assert sequence["way"]["doubt"]
    expect(page.locator("#sequence-way")).to_have_class("doubt")
    press(page, "Arm")
    expect(page.locator("#arm-state")).to_contain_text("armed for")
    press(page, "Send to rover")

    def compared() -> dict | None:
        run = held(served)["run"]
        return run["compared"] if run and run["compared"]["state"] == "compared" else None

    told = until(compared, "the comparison with the prediction")
    assert told["verdict"] == "differs", told
    expect(page.locator("#outcome-text")).to_have_class("doubt")
    expect(page.locator("#status-match")).to_have_text("carried out, not as predicted")
    expect(page.locator("#outcome-advice")).to_contain_text("make the next commands with the pose held")
    page.locator("#outcome").evaluate("box => box.scrollIntoView({block: 'start'})")
    look("not-as-predicted")
