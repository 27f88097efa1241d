"""A route on the page: planned to the walk's goal, told, taken in parts; a refusal with its reason."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from footfall.planning.body.stand import stand
from tests.support.chassis_ground import wavy
from tests.support.page_steps import held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]
ROUTE = "/sessions/current/routes/current"


def along(points: np.ndarray, metres: float) -> np.ndarray:
    """The place so far along a line, by interpolation over its length."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.array([np.interp(metres, lengths, points[:, axis]) for axis in (0, 1)])


def test_a_route_is_planned_told_and_taken_in_parts(console: Page, quiet: Running, look: Keep) -> None:
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=6.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill("3")
    console.locator("#walk-y").fill("1")
    press(console, "Plan route")
    told = console.locator("#route-answer p")
    expect(told).to_have_class("yes")
    made = held(quiet, ROUTE)
    points = np.array(made["plan"]["points"])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    expect(told).to_contain_text(
        f"Route of {length:.1f} m; it costs as much as {made['plan']['cost']:.1f} m of the best ground"
    )
    assert made["goal"] == [3.0, 1.0]
    look("route")

    expect(console.locator("#route-part")).to_have_value("5")
    for metres in (1.5, 99.0):
        console.locator("#route-part").fill(str(metres))
        console.locator("#route-goal").click()
        wanted = along(points, metres)
        until(lambda w=wanted: held(quiet)["view"]["goal"] == pytest.approx(w, abs=1e-9), "the goal along the route")
    expect(console.locator("#walk-x")).to_have_value("3.000")

    console.locator("#walk-x").fill("900")
    press(console, "Plan route")
    expect(told).to_have_class("no")
    expect(told).to_contain_text("No route (off the map): ")
    expect(console.locator("#route-way")).to_be_hidden()

    live.terrains.load(wavy(half=5.0, seed=1), "made for the test")
    expect(console.locator("#route-doubt")).to_contain_text("The route is out of date: the terrain has changed since")
