"""The map from above: the ground, north up, with rover, route and scale; moved, zoomed and made large."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect

from footfall.planning.body.stand import stand
from tests.browser.test_choosing import coloured
from tests.browser.test_console_access import violations
from tests.support.chassis_ground import wavy
from tests.support.page_steps import held, made, press
from tests.support.server import Running
from tests.support.spoken import say
from tests.support.waiting import until

Keep = Callable[[str], None]
ROUTE = "/sessions/current/routes/current"
PIXEL_OF = "async at => (await import('/js/page.js')).modules['panels/map.js'].pixelOf(at)"
SIZE = "canvas => [canvas.clientWidth, canvas.clientHeight]"
COLOURS_NEAR = """(canvas, [right, down]) => {
  const [left, top] = [right, down].map(one => Math.round(one * (window.devicePixelRatio || 1)) - 2);
  const data = canvas.getContext("2d").getImageData(left, top, 5, 5).data;
  return Array.from({ length: 25 }, (_, i) => [...data.slice(4 * i, 4 * i + 3)]);
}"""
ROUTE_RGB, CHASSIS_RGB = (190, 140, 255), (255, 255, 255)


@pytest.fixture
def mapped(console: Page, quiet: Running) -> Page:
    """The map of ground that was made for the test, with a stance on it; no rover speaks."""
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=6.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    console.locator("#map-two").evaluate("box => box.click()")
    console.locator("#area-map").click()
    expect(console.locator("#map-left")).to_be_visible()
    expect(console.locator("#map-note")).to_contain_text("Show where leg 2 can stand")
    return console


def pixel_of(page: Page, at: np.ndarray) -> np.ndarray:
    return np.array(page.evaluate(PIXEL_OF, [float(at[0]), float(at[1])]))


def is_there(page: Page, colour: tuple[int, ...], at: np.ndarray) -> bool:
    """Whether something of that colour is drawn at a place of the site [m]."""
    found = np.array(page.locator("#map-left").evaluate(COLOURS_NEAR, pixel_of(page, at).tolist()))
    return bool((np.abs(found - colour).max(axis=1) < 12).any())


def test_north_is_up_and_the_rover_is_where_it_is(mapped: Page, quiet: Running, look: Keep) -> None:
    width, height = mapped.locator("#map-left").evaluate(SIZE)
    west, south, east, north = held(quiet)["terrain"]["bounds"]
    # a second way: the whole ground fills 92 % of the picture, about its middle
    scale = 0.92 * min(width / (east - west), height / (north - south))
    middle = [(west + east) / 2, (south + north) / 2]
    place = np.array([2.0, 1.0])
    expected = np.array([width / 2, height / 2]) + scale * (place - middle) * [1, -1]
    assert pixel_of(mapped, place) == pytest.approx(expected, abs=0.01)

    state = say(quiet, 1)
    mapped.locator("#map-rover").click()
    with quiet.client() as client:
        robot = client.get("/robot").json()
    T = state.T_site_base
    hip = T[:2, 3] + T[:2, :2] @ np.array(robot["T_base_hips"][2])[:2, 3]
    assert pixel_of(mapped, T[:2, 3]) == pytest.approx([width / 2, height / 2])
    until(lambda: is_there(mapped, CHASSIS_RGB, hip), "a corner of the chassis")
    mapped.locator("#map-all").click()
    ahead = T.copy()
    ahead[1, 3] += 4.0  # to the north, farther than it is wide
    say(quiet, 2, T_site_base=ahead)
    until(lambda: is_there(mapped, CHASSIS_RGB, np.add(hip, (0, 4.0))), "the rover that has moved north")
    until(lambda: not is_there(mapped, CHASSIS_RGB, hip), "its place of before without it")
    look("rover")


def test_it_is_moved_zoomed_and_made_large_and_a_click_chooses(mapped: Page, quiet: Running, look: Keep) -> None:
    canvas = mapped.locator("#map-left")
    canvas.evaluate("one => one.scrollIntoView({ block: 'center' })")
    box = canvas.bounding_box()
    assert box is not None
    corner = np.array([box["x"] + 1, box["y"] + 1])  # inside of its rim

    def at(pixel: np.ndarray) -> tuple[float, float]:
        return float(corner[0] + pixel[0]), float(corner[1] + pixel[1])

    place = np.array([1.0, 2.0])
    before = pixel_of(mapped, place)
    mapped.mouse.move(*at(before))
    mapped.mouse.wheel(0, -600)
    until(lambda: pixel_of(mapped, place + 1)[0] - before[0] > 30, "a larger picture")
    assert pixel_of(mapped, place) == pytest.approx(before, abs=3)  # a wheel tells whole pixels
    mapped.mouse.down()
    mapped.mouse.move(*at(np.add(before, (25, 10))), steps=3)
    mapped.mouse.up()
    assert pixel_of(mapped, place) == pytest.approx(np.add(before, (25, 10)), abs=4)
    assert held(quiet)["footfall"] is None or held(quiet)["footfall"]["x"] != pytest.approx(place[0], abs=0.05)

    canvas.focus()
    mapped.keyboard.press("ArrowLeft")
    assert pixel_of(mapped, place) == pytest.approx(np.add(before, (65, 10)), abs=4)
    mapped.keyboard.press("Home")
    assert pixel_of(mapped, place) == pytest.approx(before, abs=0.01)
    metre = pixel_of(mapped, place + 1)[0] - before[0]
    mapped.keyboard.press("+")
    assert pixel_of(mapped, place + 1)[0] - pixel_of(mapped, place)[0] == pytest.approx(1.5 * metre)
    mapped.keyboard.press("Home")

    mapped.mouse.click(*at(before))
    until(lambda: held(quiet)["footfall"]["x"] == pytest.approx(1.0, abs=0.05), "the footfall that was clicked on")
    assert held(quiet)["footfall"]["y"] == pytest.approx(2.0, abs=0.05)

    mapped.locator("#map-large").click()
    room = mapped.locator(".scene").bounding_box()
    large = canvas.bounding_box()
    assert room is not None
    assert large is not None
    assert large["width"] > 0.9 * room["width"]
    assert large["height"] > 0.3 * room["height"]
    assert violations(mapped) == []
    look("large")
    mapped.locator("#map-large").click()
    expect(mapped.locator("#side #panel-map")).to_be_visible()


def test_the_route_lies_where_it_was_planned(mapped: Page, quiet: Running, look: Keep) -> None:
    mapped.locator("#area-goal").click()
    mapped.locator("#walk-x").fill("3")
    mapped.locator("#walk-y").fill("1")
    made(quiet, "route", lambda: press(mapped, "Plan route"))
    expect(mapped.locator("#route-answer p")).to_have_class("yes")
    points = np.array(held(quiet, ROUTE)["plan"]["points"])
    ends = (points[0], points[-1])  # a flag lies over it there
    along = [at for at in (points[1:] + points[:-1]) / 2 if min(np.hypot(*(at - end)) for end in ends) > 1.0]
    assert along
    for at in along:
        until(lambda at=at: is_there(mapped, ROUTE_RGB, at), f"the route at {at}")
    look("route")


def test_nothing_is_read_of_the_maps_before_while_others_come(console: Page, quiet: Running) -> None:
    coloured(console, quiet, 2)
    console.locator("#area-map").click()
    read, canvas = console.locator("#map-read"), console.locator("#map-left")
    canvas.hover()
    expect(read.locator("li").first).to_be_visible()
    held_back: list[Route] = []
    console.route("**/maps/*", lambda one: held_back.append(one))
    asked: list[str] = []
    console.on("request", lambda one: asked.append(one.url) if "/at?" in one.url else None)
    console.locator("#conservative").check()
    digest = coloured(console, quiet, 2)
    until(lambda: console.title() and any(digest in one.request.url for one in held_back), "a question about the new")
    expect(read).to_contain_text("Point at the map")
    canvas.hover(position={"x": 40, "y": 40})
    canvas.hover(position={"x": 60, "y": 60})
    # the first answer is lost, and it is asked again
    for one in held_back:
        one.fulfill(status=409, json={"detail": "not now"})
    console.unroute("**/maps/*")

    def is_read() -> bool:
        canvas.hover(position={"x": 50, "y": 50})
        canvas.hover(position={"x": 70, "y": 70})
        return read.locator("li").count() > 0

    until(is_read, "what the new maps say")
    assert asked
    assert all(digest in one for one in asked)
