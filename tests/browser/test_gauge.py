"""The gauge of the margin: which outline, how much, of what; and the age of the ground in the legend."""

import re
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from typing import cast

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from footfall.session.core import present
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem
from tests.support.page_steps import SESSION, held
from tests.support.server import Running
from tests.support.waiting import until

STEADINESS = f"{SESSION}/steadiness"
NAMES = {"plain": "polygon", "conservative": "any leg lost", "friction": "friction μ 0.60"}


def number(page: Page, row: str) -> float:
    told = page.locator(f"#gauge-{row} output")
    expect(told).to_have_text(re.compile(r"\d m"))
    found = re.search(r"(−?)(\d+\.\d+) m", told.inner_text())
    assert found
    return (-1 if found[1] else 1) * float(found[2])


def telling(quiet: Running, number: int, **fields) -> None:
    """Telemetry of a rover that stands as the session plans from, with other fields."""
    live = quiet.sessions.current
    assert live is not None
    state = replace(cast(RobotState, live.get(present(live.state.state, "no state"))), time=float(number), **fields)
    live.rover.take_telemetry(TelemetryFrame(number, state, np.array(state.posture)))


def test_margins_of_rover_ghost_and_worst_moment(console: Page, quiet: Running, look: Callable[[str], None]) -> None:
    worst = console.locator("#gauge-worst")
    stands, course = held(quiet, STEADINESS), held(quiet, f"{STEADINESS}/current")
    sequence = held(quiet)["sequence"]
    commands, planned = held(quiet, f"/sequences/{sequence}"), held(quiet, f"{STEADINESS}/{sequence}")
    for outline, name in NAMES.items():
        console.get_by_role("radio", name=name, exact=True).check()
        assert number(console, "now") == pytest.approx(stands["margins"][outline], abs=0.0051)
        least = planned["worst"][outline]
        assert number(console, "worst") == pytest.approx(least["margin"], abs=0.0051)
        row = commands["commands"][least["row"]]
        expect(worst).to_contain_text(f"row {least['row'] + 1}, {row['phase']}")
    look("friction")
    # nobody saw the ground under the standing wheels of this session
    expect(console.locator("#gauge-note")).to_have_text("ground under the wheels not seen, taken as level")
    # no telemetry: what stands there is no measurement, and says so
    expect(console.locator("#gauge-now")).to_contain_text("not measured")

    console.keyboard.press(";")
    expect(console.get_by_role("radio", name="polygon", exact=True)).to_be_checked()
    for moment in (0.0, 0.37, 1.0):
        console.locator("#scrub").fill(str(round(1000 * moment)))
        expected = np.interp(moment, course["moments"], course["margins"]["plain"])
        assert number(console, "ghost") == pytest.approx(expected, abs=0.0051)
    console.get_by_role("button", name="Worst", exact=True).click()
    worst_of_plan = course["worst"]["plain"]
    until(lambda: held(quiet)["view"]["scrub"] == pytest.approx(worst_of_plan["moment"]), "the ghost at its worst")
    console.wait_for_function(
        "value => Number(document.getElementById('scrub').value) === value", arg=round(1000 * worst_of_plan["moment"])
    )
    assert number(console, "ghost") == pytest.approx(worst_of_plan["margin"], abs=0.02)
    console.reload()
    expect(console.get_by_role("radio", name="polygon", exact=True)).to_be_checked()


def test_margins_that_were_not_told_are_asked_for_again(console: Page) -> None:
    console.route("**/steadiness/*", lambda one: one.fulfill(status=409, json={"detail": "not now"}))
    console.reload()
    worst = console.locator("#gauge-worst output")
    expect(worst).to_have_text("? not now")
    console.unroute("**/steadiness/*")
    expect(worst).to_contain_text("row")


def test_the_gauge_says_what_it_does_not_know(console: Page, quiet: Running, look: Callable[[str], None]) -> None:
    now, meter = console.locator("#gauge-now"), console.locator("#gauge-now [role=meter]")
    telling(quiet, 1)
    expect(now).not_to_contain_text("not measured")
    expect(now).to_have_attribute("data-level", "good")
    # the link is silent: how the rover stood is not how it stands
    expect(now).to_contain_text("STALE")
    expect(meter).to_have_attribute("aria-valuetext", re.compile("STALE"))
    look("stale")
    # who opens the page now sees the same
    console.reload()
    expect(now).to_contain_text("STALE")
    expect(now).not_to_contain_text("not measured")

    # weight on the two front wheels alone: there is no polygon
    forces = np.zeros((6, 3))
    forces[:2, 2] = 4000.0
    telling(quiet, 2, wheel_forces=forces)
    console.get_by_role("radio", name="polygon", exact=True).check()
    expect(now.locator("output")).to_have_text("✕ nothing holds")
    expect(now).to_have_attribute("data-level", "bad")
    expect(console.locator("#gauge-note")).to_contain_text("2 wheels leave no area; it takes 3")
    look("nothing holds")
    console.locator("#gauge summary").click()
    expect(console.locator("#gauge-sum")).to_contain_text("now ✕ nothing holds")


def test_the_age_of_the_ground_has_a_legend(console: Page, quiet: Running, look: Callable[[str], None]) -> None:
    legend = console.locator("#age-legend")
    expect(legend).to_be_empty()
    console.keyboard.press("-")
    console.get_by_role("checkbox", name="age of the ground").check()
    expect(legend).to_contain_text("measured within 1 min of the newest")
    live = quiet.sessions.current
    assert live is not None
    dem = cast(Dem, live.get(present(live.state.dem, "no terrain")))
    assert dem.time is not None
    older = np.array(dem.time)
    older[:, : older.shape[1] // 2] -= 700.0
    live.terrains.load(replace(dem, time=older), source="half of it older")
    known = np.isfinite(dem.heights)
    share = known[:, : older.shape[1] // 2].sum() / known.sum()
    expect(legend).to_contain_text(f"10 min to 1 h before ({100 * share:.0f} %)")
    look("legend")
    live.terrains.load(replace(dem, time=None, variance=None, count=None, source=None), source="without memory")
    expect(legend).to_contain_text("? age unknown: this terrain does not say when it was measured")
    console.get_by_role("checkbox", name="age of the ground").uncheck()
    expect(legend).to_be_empty()
    until(lambda: held(quiet)["view"]["shown"]["age"] is False, "the switch")


@pytest.mark.scene
def test_outlines_and_hatching_lie_on_the_ground(page: Page, served: Running, look: Callable[[str], None]) -> None:
    live = served.sessions.current
    assert live is not None
    dem = cast(Dem, live.get(present(live.state.dem, "no terrain")))
    assert dem.time is not None
    older = np.array(dem.time)
    older[:, : older.shape[1] // 3] -= 700.0
    live.terrains.load(replace(dem, time=older), source="a third of it older")
    live.choices.set_view(layer=None, shown={"torques": False, "forces": False})
    expect(page.locator("#scene-note")).to_be_hidden()
    expect(page.locator("#gauge-now output")).to_have_text(re.compile(r"\d m"))
    plain = settled(page)
    live.choices.set_view(shown={"age": True})
    until(lambda: changed(plain, picture(page)) > 0.02, "the hatching")
    look("drawn")
    live.choices.set_view(shown={"age": False})
    until(lambda: changed(plain, picture(page)) < 0.002, "the ground without it")


def picture(page: Page) -> np.ndarray:
    """What the scene shows, grey."""
    shot = page.locator("#scene").screenshot()
    return np.asarray(Image.open(BytesIO(shot)).convert("L"), float)


def changed(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the pixels that differ."""
    return float((np.abs(one - other) > 25).mean())


def settled(page: Page) -> np.ndarray:
    """The scene once it is drawn: bright somewhere, and twice the same."""
    seen = [picture(page)]

    def still() -> bool:
        seen.append(picture(page))
        return seen[-1].std() > 20 and changed(seen[-2], seen[-1]) < 0.001

    until(still, "a scene that stands still", period=1.0)
    return seen[-1]
