"""A walk on a tether on the page: its anchor taken and typed, what its drum does told, a bad one refused."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from footfall.planning.body.stand import stand
from tests.support.chassis_ground import wavy
from tests.support.page_steps import figure, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]
WALK = "/sessions/current/walks/current"


def walked(console: Page, served: Running) -> dict:
    """Plan the walk; the new answer."""
    before = held(served)["walk"]
    press(console, "Plan walk")
    until(lambda: held(served)["walk"] != before, "the walk")
    return held(served, WALK)


def test_a_walk_on_a_tether_is_asked_for_and_told(console: Page, quiet: Running, look: Keep) -> None:
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    live.maps.choose_footfall(2, -3.2, 1.9)
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill("0.4")
    console.locator("#walk-y").fill("0.1")
    console.locator("#walk-yaw").fill("0")
    told = console.locator("#walk-answer")

    # its fields count only where the rover hangs on it, and are asked for where one is missing
    console.locator("#walk-tether summary").click()
    console.locator("#tether-on").check()
    press(console, "Plan walk")
    assert console.evaluate("() => document.activeElement.id") == "tether-x"
    assert held(quiet)["walk"] is None
    expect(console.locator("#tether-here")).to_be_enabled()
    press(console, "Anchor at the footfall")
    expect(console.locator("#tether-x")).to_have_value("-3.200")
    expect(console.locator("#tether-y")).to_have_value("1.900")
    ground = held(quiet)["footfall_answer"]["z"]
    expect(console.locator("#tether-z")).to_have_value(f"{ground:.3f}".replace("-0.000", "0.000"))

    console.locator("#tether-z").fill("2")
    made = walked(console, quiet)
    assert made["status"] == "found", made["reason"]
    tethered = made["plan"]["tethered"]
    tether = tethered["tether"]
    assert (tether["anchor"], tether["attachment"]) == ([-3.2, 1.9, 2.0], [-1.05, 0.615, -0.1])
    assert (tether["free_length"], tether["most_force"]) == (30.0, 12000.0)
    lengths, pulls = np.array(tethered["lengths"]), np.array(tethered["pulls"])
    expect(console.locator("#walk-tethered")).to_contain_text(
        f"Tether: {lengths[0]:.2f} → {lengths[-1]:.2f} m of 30.0 m, "
        f"pulled with {pulls.min():.0f} to {pulls.max():.0f} N of 12000 N"
    )
    moves = np.array(made["plan"]["moves"])
    out = float(np.diff(lengths)[moves[1:] == 0].sum())
    expect(told.locator("ol li").first).to_contain_text(f", tether {'+' if out > 0 else ''}{figure(out, 2)} m")
    expect(console.locator("#walk-doubt")).to_be_hidden()
    look("on-a-tether")

    console.locator("#tether-z").fill("-1")
    refused = walked(console, quiet)
    assert refused["status"] == "start_invalid"
    expect(told.locator("p.no")).to_contain_text("m below the ground")
    expect(console.locator("#walk-tethered")).to_have_count(0)
    look("refused")

    console.locator("#tether-on").uncheck()
    console.locator("#tether-x").fill("")
    alone = walked(console, quiet)
    assert alone["status"] == "found"
    assert alone["plan"]["tethered"] is None
    assert alone["provenance"]["parents"].keys() == {"dem", "state", "robot"}

    live.terrains.load(wavy(half=4.0, seed=1), "made for the test")
    expect(console.locator("#walk-doubt")).to_contain_text(
        "Out of date: the terrain has changed since: by up to 0.02 m on "
    )


@pytest.mark.parametrize("missing", ["tether-length", "tether-at-z"])
def test_nothing_is_guessed_for_a_field_that_is_empty(console: Page, quiet: Running, missing: str) -> None:
    console.locator("#area-goal").click()
    for field, text in (("walk-x", "0.4"), ("walk-y", "0"), ("tether-x", "-3"), ("tether-y", "2"), ("tether-z", "2")):
        if field == "tether-x":
            console.locator("#walk-tether summary").click()
            console.locator("#tether-on").check()
        console.locator(f"#{field}").fill(text)
    console.locator(f"#{missing}").fill("")
    jobs = len(held(quiet)["jobs"])
    press(console, "Plan walk")
    assert console.evaluate("() => document.activeElement.id") == missing
    assert len(held(quiet)["jobs"]) == jobs
