"""A walk on the page: its goal taken from the footfall or typed, its foot moves told, a refusal with its reason."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from footfall.planning.body.stand import stand
from tests.support.chassis_ground import wavy
from tests.support.page_steps import as_shown, figure, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]
WALK = "/sessions/current/walks/current"


def test_a_walk_is_asked_for_and_told(console: Page, quiet: Running, look: Keep) -> None:
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    console.locator("#area-walk").click()
    console.locator("#area-goal").click()
    place = held(quiet)["footfall"]
    press(console, "Goal at the footfall")
    expect(console.locator("#walk-x")).to_have_value(f"{place['x']:.3f}")
    expect(console.locator("#walk-y")).to_have_value(f"{place['y']:.3f}")

    console.locator("#walk-x").fill("0.4")
    console.locator("#walk-y").fill("0.1")
    console.locator("#walk-yaw").fill("5")
    console.locator("#seed").fill("4")
    press(console, "Plan walk")
    until(lambda: held(quiet)["walk"], "the walk")
    made = held(quiet, WALK)
    assert (made["status"], made["provenance"]["settings"]["seed"]) == ("found", 4), made["reason"]
    assert made["goal"]["yaw"] == pytest.approx(np.radians(5.0))
    told = console.locator("#walk-answer")
    plan = made["plan"]
    at = np.array(plan["Ts_site_base"])[:, :3, 3]
    way = np.linalg.norm(np.diff(at, axis=0), axis=1).sum()
    expect(told.locator("p.yes")).to_contain_text(f"Walk found: {len(plan['legs'])} foot move")
    expect(told.locator("p.yes")).to_contain_text(f"the chassis goes {way:.2f} m")
    expect(told.locator("ol li")).to_have_count(len(plan["legs"]))
    leg = plan["legs"][0]
    x, y, _ = plan["stances"][1]["contacts"][leg]
    expect(told.locator("ol li").first).to_contain_text(f"leg {leg} to ({figure(x, 2)}, {figure(y, 2)}) m, margin ")
    least, most = min(plan["margins"]), max(plan["torques"])
    worst = told.locator("ol li span[title]:not([title=''])")
    expect(worst.filter(has_text=f"margin {least:.2f} m (least)")).to_have_count(1)
    expect(worst.filter(has_text=f"torque {100 * most:.0f} % (most)")).to_have_count(1)
    told.get_by_role("button", name="Forbid the place of foot move 1", exact=True).click()
    expect(console.locator("#walk-places-text")).to_have_text("Places: 1 forbidden. Plan the walk to heed them.")
    expect(console.locator("#walk-doubt")).to_be_hidden()
    look("walk")

    console.locator("#walk-x").fill("900")
    console.locator("#walk-yaw").fill("")
    console.locator("#walk-x").press("Enter")
    expect(told.locator("p.no")).to_contain_text("off the map")
    refused = held(quiet, WALK)
    assert refused["goal"]["yaw"] is None
    [forbidden] = refused["provenance"]["settings"]["forbidden"]
    assert (forbidden["x"], forbidden["y"]) == pytest.approx((x, y))
    expect(told.locator("p.no")).to_contain_text(as_shown(refused["reason"]))
    look("refused")

    live.terrains.load(wavy(half=4.0, seed=1), "made for the test")
    expect(console.locator("#walk-doubt")).to_contain_text(
        "Out of date: the terrain has changed since: by up to 0.02 m on "
    )
