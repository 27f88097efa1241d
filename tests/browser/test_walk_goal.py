"""The goal of a walk by a click on the ground, while that is asked for and not else."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import held
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]


@pytest.mark.scene
def test_a_click_on_the_ground_is_the_goal_only_while_it_is_asked_for(page: Page, served: Running, look: Keep) -> None:
    expect(page.locator("#scene-note")).to_be_hidden()
    page.frame_locator("#scene").locator("canvas").first.wait_for()
    box = page.locator("#scene").bounding_box()
    assert box is not None
    note = page.locator("#goal-note")

    def view() -> dict:
        return held(served)["view"]

    def click(right: float, down: float) -> None:
        page.mouse.click(box["x"] + right * box["width"], box["y"] + down * box["height"])

    def footfall_chosen(right: float, down: float) -> None:
        before = held(served)["events"]
        click(right, down)
        until(lambda: held(served)["events"] > before, "the footfall of a click")

    footfall_chosen(0.4, 0.65)
    assert view()["goal"] is None
    page.locator("#h-plan").click()
    page.keyboard.press("=")
    expect(note).to_be_visible()
    page.keyboard.press("Escape")
    expect(note).to_be_hidden()
    footfall_chosen(0.42, 0.65)
    assert view()["goal"] is None

    page.locator("#h-plan").click()
    page.keyboard.press("=")
    expect(note).to_be_visible()
    footfall = held(served)["footfall"]
    click(0.35, 0.6)
    until(lambda: view()["goal"], "the goal of a click")
    goal = view()["goal"]
    assert held(served)["footfall"] == footfall
    expect(note).to_be_hidden()
    expect(page.locator("#walk-x")).to_have_value(f"{goal[0]:.3f}")
    expect(page.locator("#walk-y")).to_have_value(f"{goal[1]:.3f}")
    live = served.sessions.current
    assert live is not None
    assert live.rover.frame is not None
    T = np.array(live.rover.frame.state.T_site_base)
    ahead = np.linalg.inv(T) @ np.array([*goal, T[2, 3], 1.0])
    assert float(page.locator("#walk-ahead").input_value()) == pytest.approx(np.hypot(*ahead[:2]), abs=0.01)
    toward = np.degrees(np.arctan2(ahead[1], ahead[0]))
    assert float(page.locator("#walk-toward").input_value()) == pytest.approx(toward, abs=1.0)
    expect(page.locator("#walk-yaw")).to_have_value("")
    look("goal")
    footfall_chosen(0.4, 0.65)
    assert view()["goal"] == goal


def test_what_is_typed_is_the_goal_and_another_page_s_goal_is_in_the_fields(console: Page, quiet: Running) -> None:
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill("1.25")
    console.locator("#walk-y").fill("-0.5")
    console.locator("#walk-y").press("Tab")
    until(lambda: held(quiet)["view"]["goal"] == [1.25, -0.5], "the goal as typed")
    console.locator("#h-plan").click()
    with quiet.client() as client:
        client.put("/sessions/current/view", json={"goal": [0.5, 2.0]}).raise_for_status()
    expect(console.locator("#walk-x")).to_have_value("0.500")
    expect(console.locator("#walk-y")).to_have_value("2.000")
    # what somebody is typing stays
    console.locator("#walk-x").fill("7")
    with quiet.client() as client:
        client.put("/sessions/current/view", json={"goal": [0.75, 2.0], "scrub": 0.25}).raise_for_status()
    expect(console.locator("#scrub")).to_have_value("250")
    expect(console.locator("#walk-x")).to_have_value("7")


@pytest.mark.parametrize(("width", "height"), [(1024, 768), (1280, 720)])
def test_what_is_asked_for_over_the_scene_covers_no_legend(console: Page, width: int, height: int) -> None:
    console.set_viewport_size({"width": width, "height": height})
    console.locator("#h-plan").click()
    console.keyboard.press("=")
    note, layers = console.locator("#goal-note"), console.locator(".layers")
    expect(note).to_be_visible()
    console.evaluate("() => { document.querySelector('.layers').style.width = '292px'; }")  # as wide as it ever is
    left, right = note.bounding_box(), layers.bounding_box()
    assert left is not None
    assert right is not None
    assert left["x"] + left["width"] <= right["x"]
