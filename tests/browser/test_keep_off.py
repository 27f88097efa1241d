"""Ground that is kept off: marked around a footfall, drawn on the map, heeded by routes and walks, and forgotten."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from playwright.sync_api import Page, expect

from footfall.planning.body.stand import stand
from tests.browser.test_map import is_there
from tests.support.chassis_ground import wavy
from tests.support.page_steps import held, made, press
from tests.support.server import Running
from tests.support.waiting import until

ROUTE = "/sessions/current/routes/current"
GOAL, MIDDLE, RADIUS = (4.0, 0.0), (2.0, 0.0), 0.8
FORBIDDEN_RGB = (255, 90, 90)


def nearest(route: dict) -> float:
    """How near a route's middle line comes to the marked place [m]."""
    points = np.array(route["plan"]["points"])
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    way = np.concatenate([a + shares * (b - a) for a, b in pairwise(points)])
    return float(np.linalg.norm(way - MIDDLE, axis=1).min())


def areas(product: dict, name: str) -> list[tuple[float, float, float]]:
    """Ground that a product was asked for with: x, y and radius [m]."""
    return [(one["x"], one["y"], one["radius"]) for one in product["provenance"]["settings"][name]]


def drawn(page: Page) -> int:
    """At how many of 40 places around the marked ground the map has the colour of what is forbidden; it is dashed."""
    turns = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    ring = MIDDLE + RADIUS * np.column_stack([np.cos(turns), np.sin(turns)])
    return sum(is_there(page, FORBIDDEN_RGB, at) for at in ring)


def test_routes_and_walks_heed_ground_that_is_kept_off(
    console: Page, quiet: Running, look: Callable[[str], None]
) -> None:
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=6.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill(str(GOAL[0]))
    console.locator("#walk-y").fill(str(GOAL[1]))
    made(quiet, "route", lambda: press(console, "Plan route"))
    assert nearest(held(quiet, ROUTE)) < 0.5 * RADIUS
    expect(console.locator("#route-goal")).to_be_enabled()

    live.maps.choose_footfall(2, *MIDDLE)
    expect(console.locator("#keep-off")).to_be_enabled()
    console.locator("#keep-off-radius").fill("0")
    console.locator("#keep-off").click()
    expect(console.locator("#toast")).to_contain_text("a radius of at least 0.05 m")
    console.locator("#keep-off-radius").fill(str(RADIUS))
    console.locator("#keep-off").click()
    expect(console.locator("#walk-places-text")).to_have_text("Places: 1 forbidden. Plan the walk to heed them.")
    expect(console.locator("#route-doubt")).to_contain_text("ground to keep off was marked since. Plan it again.")
    expect(console.locator("#route-goal")).to_be_disabled()
    console.locator("#map-two").evaluate("box => box.click()")
    console.locator("#area-map").click()
    until(lambda: drawn(console) > 10, "the marked ground on the map")
    look("keep-off")
    # a page that is loaded again still keeps off it
    console.reload()
    expect(console.locator("#walk-places-text")).to_have_text("Places: 1 forbidden. Plan the walk to heed them.")
    console.locator("#map-two").evaluate("box => box.checked && box.click()")
    console.locator("#walk-x").fill(str(GOAL[0]))
    console.locator("#walk-y").fill(str(GOAL[1]))

    console.locator("#area-goal").click()
    made(quiet, "route", lambda: press(console, "Plan route"))
    around = held(quiet, ROUTE)
    assert areas(around, "no_go") == [(*MIDDLE, RADIUS)]
    assert nearest(around) >= RADIUS
    expect(console.locator("#route-doubt")).to_be_hidden()
    expect(console.locator("#route-goal")).to_be_enabled()

    console.locator("#walk-x").fill("0.5")
    made(quiet, "walk", lambda: press(console, "Plan walk"))
    assert areas(held(quiet, "/sessions/current/walks/current"), "forbidden") == [(*MIDDLE, RADIUS)]
    expect(console.locator("#walk-places-text")).to_have_text("Places: 1 forbidden. The latest walk heeds them.")
    console.locator("#area-walk").click()
    console.locator("#walk-places-clear").click()
    expect(console.locator("#walk-places")).to_be_hidden()
    console.locator("#area-map").click()
    until(lambda: drawn(console) == 0, "the map without it")
