"""A move of the chassis on the page: checked, made into commands, played by the ghost, sent, and arrived."""

from collections.abc import Callable

import numpy as np
from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]


def test_a_checked_move_becomes_commands_and_is_sent(page: Page, served: Running, look: Keep) -> None:
    page.locator("#panel-what-if summary").click()
    page.locator("#shift-dz").fill("-0.1")
    before = held(served)["sequence"]
    press(page, "Check the move")
    expect(page.locator("#what-if-answer")).to_contain_text("The chassis can go there, up −0.100 m, through")
    page.locator("#make-body-move").click()
    until(lambda: held(served)["sequence"] != before, "the commands")
    digest = held(served)["sequence"]
    assert held(served)["played"] == digest
    with served.client() as client:
        sequence = client.get(f"/sequences/{digest}").json()
    assert sequence["valid"], sequence["rules"]
    rows = page.locator("#commands tbody tr")
    expect(rows).to_have_count(len(sequence["commands"]))
    cells = rows.first.locator("td")
    assert [cells.nth(i).inner_text() for i in (1, 2, 3)] == ["POSTURE_MOVE", "all", "shift"]
    page.locator("#scrub").fill("1000")
    expect(page.locator("#scrub-read")).to_contain_text("100 % of the commands, shift")
    until(lambda: held(served)["view"]["scrub"] == 1.0, "the ghost's place")
    look("ghost")

    press(page, "Arm")
    expect(page.locator("#arm-state")).to_contain_text("armed for")
    press(page, "Send to rover")
    until(
        lambda: [one["state"] for one in held(served)["commands"]].count("done") == len(sequence["commands"]),
        "the arrival",
    )
    # the rover says "done" before its next frame of telemetry comes
    until(
        lambda: held(served, f"{SESSION}/telemetry")["posture"] == sequence["predicted"][-1], "telemetry of the arrival"
    )
    state = held(served, f"{SESSION}/telemetry")
    np.testing.assert_allclose(state["T_site_base"], sequence["Ts_site_base"][-1], atol=1e-9)
    look("arrived")
