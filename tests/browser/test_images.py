"""The Images panel: looked through by keys, clicked on the ground, its lines and views, ticks for the next terrain."""

import itertools
import json
import re
from collections.abc import Callable
from typing import cast

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from footfall.core.frames import inverse
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from tests.browser.test_console_access import SMALL, violations
from tests.support.page_steps import figure, held
from tests.support.server import Running
from tests.support.spoken import current, say
from tests.support.waiting import until

Keep = Callable[[str], None]
PAIRS = ["nav0", "nav1", "nav2", "nav3", "nav4", "nav5", "haz0", "haz1", "haz2"]


def opened(console: Page) -> None:
    """The panel, with the keys in the row of its pairs."""
    console.keyboard.press("d")
    expect(console.locator("#picture")).to_have_attribute("aria-busy", "false")
    expect(console.get_by_role("radio", name="nav0", exact=True)).to_be_focused()


def pair_called(quiet: Running, name: str) -> ImagePair:
    live = current(quiet)
    snapshot = cast(Snapshot, live.get(str(live.state.snapshot)))
    return next(pair for pair in snapshot.pairs if pair.name == name)


def pixel(quiet: Running, pair: ImagePair, x: float, y: float) -> tuple[np.ndarray, Dem]:
    """Where OpenCV has a point of the ground in the left image, and the ground."""
    live, camera = current(quiet), pair.camera_left
    dem = cast(Dem, live.get(str(live.state.dem)))
    T = inverse(pair.T_site_base @ camera.T_base_camera)
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    point = np.array([[x, y, float(height_at(dem, x, y))]])
    return cv2.projectPoints(point, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], K, np.zeros(4))[0][0, 0], dem


def click_at(console: Page, pair: ImagePair, at: np.ndarray) -> None:
    """Click on a pixel of the picture, as it lies on the page."""
    picture = console.locator("#picture")
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    assert box is not None
    shares = (at + 0.5) / (pair.camera_left.width, pair.camera_left.height)
    console.mouse.click(box["x"] + shares[0] * box["width"], box["y"] + shares[1] * box["height"])


def test_a_click_on_the_ground_in_an_image_chooses_the_footfall(console: Page, quiet: Running, look: Keep) -> None:
    opened(console)
    console.keyboard.press("ArrowLeft")  # round to the last
    expect(console.get_by_role("radio", name="haz2", exact=True)).to_be_focused()
    expect(console.locator("#picture-about")).to_contain_text("haz2, left: snapshot")
    expect(console.locator("#picture-age")).to_contain_text("not known: the rover has sent no telemetry yet")
    # plan and grid lie over it
    expect(console.locator("#picture-lines path.grid.above")).to_have_attribute("d", re.compile("^M"))
    expect(console.locator("#picture-lines path.way.above")).to_have_count(3)
    expect(console.locator("#picture-lines path.footfall.yes.above")).to_have_count(1)
    expect(console.locator("#picture-seen")).to_have_text("Footfall of leg 2: in sight.")
    assert console.locator("#image-pairs .sees").all_inner_texts() == ["haz0", "haz2"]
    console.get_by_role("button", name="Wide", exact=True).click()
    look("plan-and-grid")

    pair = pair_called(quiet, "haz2")
    at, dem = pixel(quiet, pair, -0.2, 2.2)
    click_at(console, pair, at)
    expect(console.locator("#picture-answer")).to_contain_text("Footfall of leg 2 chosen at")
    chosen = held(quiet)["footfall"]
    assert (chosen["x"], chosen["y"]) == pytest.approx((-0.2, 2.2), abs=0.03)
    assert held(quiet)["footfall_answer"]["known"]
    assert dem.digest == held(quiet)["dem"]
    expect(console.locator("#footfall-answer")).to_contain_text(figure(chosen["x"], 3))
    look("chosen")

    # while the goal of a walk is asked for, it is that which is set
    console.locator("#h-images").click()
    console.keyboard.press("=")
    expect(console.locator("#goal-note")).to_be_visible()
    expect(console.locator("#picture-answer")).to_contain_text("it becomes the goal of the walk")
    click_at(console, pair, at)
    expect(console.locator("#picture-answer")).to_contain_text("Goal of the walk set at")
    assert held(quiet)["view"]["goal"] == pytest.approx((-0.2, 2.2), abs=0.03)
    assert held(quiet)["footfall"] == chosen
    expect(console.locator("#goal-note")).to_be_hidden()

    click_at(console, pair, np.array([320.0, 6.0]))
    expect(console.locator("#picture-answer.no")).to_contain_text("not ground")
    assert held(quiet)["footfall"] == chosen

    # without a pointer: the cross starts at the footfall
    console.locator("#picture").focus()
    for _ in range(3):
        console.keyboard.press("ArrowDown")
    expect(console.locator("#picture-lines path.cross.above")).to_have_count(1)
    console.keyboard.press("Enter")
    until(lambda: held(quiet)["footfall"] != chosen, "another footfall")
    moved = held(quiet)["footfall"]
    expected = pixel(quiet, pair, moved["x"], moved["y"])[0] - pixel(quiet, pair, chosen["x"], chosen["y"])[0]
    assert expected == pytest.approx([0, 24], abs=1)


def test_views_age_and_the_choice_of_cameras(console: Page, quiet: Running, look: Keep) -> None:
    opened(console)
    console.get_by_role("radio", name="Disparity", exact=True).click()
    expect(console.locator("#picture-legend")).to_contain_text("not matched")
    expect(console.locator("#picture-legend")).to_contain_text(" m … ")
    look("disparity")
    console.keyboard.press("ArrowRight")
    expect(console.get_by_role("radio", name="Rover mask", exact=True)).to_be_focused()
    console.get_by_role("radio", name="haz1", exact=True).click()
    expect(console.locator("#picture-legend")).to_contain_text("may be the rover")
    expect(console.locator("#picture-image")).to_have_attribute("alt", "haz1, mask")
    look("mask")

    live = current(quiet)
    snapshot = cast(Snapshot, live.get(str(live.state.snapshot)))
    numbers = itertools.count(1)

    def shown_while_heard(text: str, **changes: np.ndarray) -> None:
        """Telemetry goes on until the page, which looks every two seconds, says so."""

        def heard() -> bool:
            say(quiet, next(numbers), **changes)
            return console.locator("#picture-age").inner_text() == text

        until(heard, text)

    shown_while_heard("The rover stands as in the images.")
    T = snapshot.state.T_site_base.copy()
    T[0, 3] += 0.3
    shown_while_heard("STALE: the chassis has moved by 0.30 m since", T_site_base=T)
    look("stale")

    for name in ("nav3", "haz0"):
        console.get_by_label(f"Next terrain with {name}", exact=True).uncheck()
    without = "The next terrain is built from 7 of 9 camera pairs, without nav3, haz0."
    expect(console.locator("#image-choice")).to_have_text(without)
    expect(console.locator("#next-terrain")).to_have_text(without)
    with console.expect_request("**/terrains") as order, console.expect_response("**/terrains") as answer:
        console.get_by_role("button", name="Build terrain", exact=True).click()
    wanted = [name for name in PAIRS if name not in ("nav3", "haz0")]
    assert json.loads(order.value.post_data or "")["settings"]["pairs"] == wanted
    with quiet.client() as client:
        assert client.delete(f"/jobs/{answer.value.json()['id']}").status_code == 202
    for name in wanted:
        console.get_by_label(f"Next terrain with {name}", exact=True).uncheck()
    expect(console.get_by_role("button", name="Build terrain", exact=True)).to_be_disabled()


def test_without_images_the_panel_says_what_to_do(console: Page, quiet: Running, look: Keep) -> None:
    with quiet.client() as client:
        client.post("/sessions", json={"name": "nothing yet"})
    expect(console.locator("#status-session")).to_have_text("nothing yet")
    console.keyboard.press("d")
    expect(console.locator("#images-note")).to_contain_text("No images yet")
    expect(console.locator("#images-box")).to_be_hidden()
    look("none")


def test_a_wide_image_cuts_nothing_off_the_ghost_s_bar(console: Page, look: Keep) -> None:
    opened(console)
    console.locator("#image-wide").click()
    expect(console.locator("#side")).to_have_class(re.compile(r"\bwide\b"))
    for width in (1280, 1440, 1920):
        console.set_viewport_size({"width": width, "height": 720})
        assert console.evaluate(CUT_OFF) == [], width
    look("wide")


CUT_OFF = """() => {
  const bar = document.getElementById("ghost").getBoundingClientRect();
  const beyond = ({ left, right }) => left < bar.left - 0.5 || right > bar.right + 0.5;
  const parts = [...document.querySelectorAll("#ghost > *")].filter(one => one.checkVisibility());
  return parts.filter(one => beyond(one.getBoundingClientRect())).map(one => one.id || one.tagName);
}"""


def test_anybody_can_use_it(console: Page, look: Keep) -> None:
    opened(console)
    assert violations(console) == []
    small, wide = {}, {}
    for width in (1280, 1024, 820):
        console.set_viewport_size({"width": width, "height": 720 if width == 1280 else 1000})
        small[width] = console.evaluate(
            SMALL.replace("document.query", "document.getElementById('panel-images').query")
        )
        wide[width] = console.evaluate("() => document.documentElement.scrollWidth - innerWidth")
        console.locator("#h-images").evaluate("title => title.scrollIntoView()")
        look(f"at-{width}")
    console.get_by_title("haz0: show in Images").click()  # a small image in Ground
    expect(console.locator("#picture-about")).to_contain_text("haz0, left")
    assert small == {1280: [], 1024: [], 820: []}
    assert wide == {1280: 0, 1024: 0, 820: 0}


def test_lines_that_were_not_told_go_and_are_asked_for_again(console: Page, quiet: Running) -> None:
    opened(console)
    console.keyboard.press("ArrowLeft")  # round to the last
    ways, answer = console.locator("#picture-lines path.way.above"), console.locator("#picture-answer")
    expect(ways).to_have_count(3)
    said = answer.inner_text()
    console.route("**/overlay?*", lambda one: one.fulfill(status=409, json={"detail": "not now"}), times=1)
    current(quiet).maps.choose_footfall(2, -0.2, 2.2)
    expect(answer).to_have_text("Plan and grid can't be drawn over the image: not now")
    expect(ways).to_have_count(0)
    expect(console.locator("#picture-lines path.footfall.above")).to_have_count(1)
    expect(answer).to_have_text(said)
