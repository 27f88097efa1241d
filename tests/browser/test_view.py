"""The view menu: what the scene shows and where it is looked at from, by mouse, key and palette."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from tests.support.server import Running
from tests.support.waiting import until


def view(quiet: Running) -> dict:
    with quiet.client() as client:
        return client.get("/sessions/current/view").json()


def asked(page: Page, held: list[Route]) -> Route:
    """The change that the page has asked for; the wait lets the browser tell of it."""
    until(lambda: page.wait_for_timeout(50) or held, "the page's question")
    return held.pop()


def test_switches_and_looks_are_the_session_s(console: Page, quiet: Running, look: Callable[[str], None]) -> None:
    menu, cameras = console.locator("#view"), console.get_by_role("checkbox", name="camera views")
    expect(cameras).to_be_hidden()
    console.keyboard.press("-")
    expect(cameras).not_to_be_checked()
    expect(console.get_by_role("checkbox", name="joint torques")).to_be_checked()
    cameras.check()
    until(lambda: view(quiet)["shown"]["cameras"], "the switch")
    console.get_by_role("button", name="Along the leg", exact=True).click()
    until(lambda: view(quiet)["look"] == "leg", "the look")
    expect(console.locator("#look-leg")).to_have_attribute("aria-pressed", "true")
    # another page's change is seen here
    with quiet.client() as client:
        client.put("/sessions/current/view", json={"shown": {"cameras": False}, "look": "top"})
    expect(cameras).not_to_be_checked()
    expect(console.locator("#look-top")).to_have_attribute("aria-pressed", "true")

    console.keyboard.press("z")
    tape = console.locator("#view-tape")
    expect(tape).to_have_text("Click on two points of the ground.")
    with quiet.client() as client:
        client.put("/sessions/current/view", json={"tape": [[0, 0, 0], [3, 4, -12]]})
    expect(tape).to_have_text("13.000 m, level 5.000 m, height −12.000 m")
    look("menu")
    console.keyboard.press("z")
    until(lambda: view(quiet)["shown"]["tape"] is False and view(quiet)["tape"] == [], "the tape put away")
    expect(tape).to_be_hidden()

    console.keyboard.press("Control+k")
    console.locator("#palette-input").fill("swept volume")
    console.keyboard.press("Enter")
    until(lambda: view(quiet)["shown"]["swept"], "the switch by the palette")
    console.keyboard.press("-")
    expect(menu).not_to_have_attribute("open", "")


@pytest.mark.scene
def test_a_look_is_no_longer_chosen_once_the_view_was_turned_by_hand(page: Page, served: Running) -> None:
    page.keyboard.press("-")
    above = page.locator("#look-top")
    above.click()
    expect(above).to_have_attribute("aria-pressed", "true")
    box = page.locator("#scene").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def turned() -> bool:
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 80, y - 60, steps=4)
        page.mouse.up()
        return view(served)["look"] == "free"

    until(turned, "the view that is the operator's")
    expect(above).to_have_attribute("aria-pressed", "false")


def test_colours_are_made_fainter_with_a_slider(console: Page, quiet: Running) -> None:
    console.keyboard.press("-")
    slider, read = console.get_by_role("slider", name="Colours over images"), console.locator("#view-opacity-read")
    expect(read).to_have_text("100 %")
    slider.press("ArrowLeft")
    slider.press("ArrowLeft")
    expect(read).to_have_text("90 %")
    until(lambda: view(quiet)["opacity"] == 0.9, "the opacity")
    # colours that mean something can't be taken away while their legend is shown
    slider.press("Home")
    until(lambda: view(quiet)["opacity"] == 0.2, "the least opacity")
    slider.blur()
    with quiet.client() as client:
        assert client.put("/sessions/current/view", json={"opacity": 0.1}).status_code == 422
        client.put("/sessions/current/view", json={"opacity": 0.5})
    expect(read).to_have_text("50 %")


def test_a_switch_stays_as_set_until_the_server_has_answered(console: Page, quiet: Running) -> None:
    held: list[Route] = []
    console.route("**/view", lambda route: held.append(route))
    cameras = console.get_by_role("checkbox", name="camera views")
    console.keyboard.press("-")
    cameras.check()
    console.wait_for_timeout(2500)  # the page draws itself once a second
    expect(cameras).to_be_checked()
    assert not view(quiet)["shown"]["cameras"]
    asked(console, held).continue_()
    until(lambda: view(quiet)["shown"]["cameras"], "the switch")
    expect(cameras).to_be_checked()
    # refused, it is as it was
    cameras.uncheck()
    asked(console, held).fulfill(status=409, json={"detail": "not now"})
    expect(console.locator("#toast")).to_contain_text("not now")
    expect(cameras).to_be_checked()
