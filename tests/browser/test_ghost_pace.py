"""The ghost by rows and by seconds of the commands: chosen, typed, stepped through, and played as fast as asked for."""

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.server import Running
from tests.support.waiting import until


def held(quiet: Running, path: str) -> dict:
    with quiet.client() as client:
        return client.get(path).json()


class Pace:
    """Moments and seconds at the ends of the rows, computed from what the server answers."""

    def __init__(self, quiet: Running) -> None:
        self.quiet = quiet
        sequence = held(quiet, "/sequences/current")
        postures = np.vstack([sequence["start"], sequence["predicted"]])
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(postures, axis=0)).max(axis=1))])
        self.moments = along / along[-1]
        self.seconds = np.concatenate([[0.0], np.cumsum([one["duration"] for one in sequence["commands"]])])

    def expect_moment(self, moment: float) -> None:
        def there() -> bool:
            return abs(held(self.quiet, "/sessions/current")["view"]["scrub"] - moment) < 1e-6

        until(there, f"the ghost at {moment}")


def test_a_chosen_row_is_shown_at_its_end_and_keys_go_on_from_it(console: Page, quiet: Running, look) -> None:
    pace = Pace(quiet)
    count = len(pace.moments) - 1
    console.get_by_role("button", name="Row 9", exact=True).click()
    pace.expect_moment(pace.moments[9])
    expect(console.locator("#scrub-read")).to_contain_text(f"row 9 of {count}")
    expect(console.locator("#scrub-time")).to_have_value(f"{pace.seconds[9]:.1f}")
    look("row")
    console.locator("#h-commands").click()
    for key, row in (("}", 10), ("}", 11), ("{", 10), ("{", 9), ("{", 8)):
        console.keyboard.press(key)
        pace.expect_moment(pace.moments[row])
        expect(console.locator("#scrub-read")).to_contain_text(f"row {row} of {count}")
    # from within a row to its end, and to the end of the one before
    console.locator("#scrub-time").fill(f"{(pace.seconds[3] + pace.seconds[4]) / 2:.4f}")
    console.locator("#scrub-time").press("Enter")
    console.locator("#h-commands").click()
    expect(console.locator("#scrub-read")).to_contain_text(f"row 4 of {count}")
    console.keyboard.press("}")
    pace.expect_moment(pace.moments[4])
    for _ in range(6):
        console.keyboard.press("{")
    pace.expect_moment(0.0)


def test_a_time_is_typed_also_within_a_wait(console: Page, quiet: Running) -> None:
    console.get_by_role("button", name="Row 5", exact=True).click()
    console.get_by_role("button", name="Wait before", exact=True).click()
    until(lambda: held(quiet, "/sequences/current")["commands"][4]["name"] == "WAIT", "the wait")
    expect(console.locator("#commands tbody tr").nth(4)).to_contain_text("WAIT")
    pace = Pace(quiet)
    field = console.locator("#scrub-time")
    expect(console.locator("#scrub-whole")).to_have_text(f"of {pace.seconds[-1]:.1f} s")
    for row, share in ((2, 0.25), (4, 0.5), (4, 0.9), (12, 0.6)):
        seconds = round(float(pace.seconds[row] + share * (pace.seconds[row + 1] - pace.seconds[row])), 3)
        field.fill(str(seconds))
        field.press("Enter")
        pace.expect_moment(float(np.interp(seconds, pace.seconds, pace.moments)))
        expect(console.locator("#scrub-read")).to_contain_text(f"row {row + 1} of {len(pace.moments) - 1}")
    assert pace.moments[4] == pace.moments[5]
    field.fill("1e6")
    field.press("Enter")
    pace.expect_moment(1.0)


RECORD = """() => {
    window.ticks = [];
    const field = document.getElementById("scrub-time");
    const tick = () => { window.ticks.push([performance.now() / 1000, Number(field.value)]); };
    window.ticking = setInterval(tick, 20);
}"""


@pytest.mark.parametrize("rate", [1, 5])
def test_it_plays_as_fast_as_asked_for(console: Page, quiet: Running, rate: int) -> None:
    pace = Pace(quiet)
    console.get_by_label("How fast the ghost plays").select_option(str(rate))
    console.locator("#scrub-time").fill("1")
    console.locator("#scrub-time").press("Enter")
    pace.expect_moment(float(np.interp(1.0, pace.seconds, pace.moments)))
    console.evaluate(RECORD)
    console.get_by_role("button", name="Play the ghost").click()
    pace.expect_moment(1.0)
    ticks = np.array(console.evaluate("() => { clearInterval(window.ticking); return window.ticks; }"))
    moving = ticks[(ticks[:, 1] > 1.2) & (ticks[:, 1] < pace.seconds[-1] - 0.2)]
    assert (np.diff(moving[:, 1]) >= 0).all()
    slope = np.polyfit(moving[:, 0], moving[:, 1], 1)[0]
    assert slope == pytest.approx(rate, rel=0.15)


def test_without_commands_there_are_neither_rows_nor_seconds(console: Page, quiet: Running) -> None:
    live = quiet.sessions.current
    assert live is not None
    footfall = live.state.footfall
    assert footfall is not None
    expect(console.locator("#scrub-time")).to_be_visible()
    live.plans.step(footfall.leg, (footfall.x, footfall.y + 0.05)).finish()
    expect(console.locator("#scrub-time")).to_be_hidden()
    expect(console.get_by_label("How fast the ghost plays")).to_be_hidden()
    console.locator("#h-commands").click()
    console.keyboard.press("}")
    expect(console.locator("#toast")).to_contain_text("has no rows yet")
