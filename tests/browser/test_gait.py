"""A gait on the page: chosen beside the walk, told with its figures, or at which step which check fails by how much."""

from collections.abc import Callable

from playwright.sync_api import Page, expect

from footfall.planning.body.stand import stand
from tests.support.chassis_ground import wavy
from tests.support.page_steps import as_shown, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]
WALL = (2.6, 0.0, 0.9, 1.2)
"""A dome in the way: x, y, radius, height [m]."""


def gone(console: Page, served: Running) -> dict:
    """Plan the gait; the new answer."""
    before = held(served)["gait"]
    press(console, "Plan gait")
    until(lambda: held(served)["gait"] != before, "the gait")
    return held(served, "/sessions/current/gaits/current")


def test_a_gait_is_compared_with_the_walk(console: Page, quiet: Running, look: Keep) -> None:
    live = quiet.sessions.current
    assert live is not None
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    console.locator("#area-goal").click()
    console.locator("#walk-x").fill("0.4")
    console.locator("#walk-y").fill("0.1")
    console.locator("#walk-gait").select_option("tripod")
    walk = held(quiet)["walk"]
    made = gone(console, quiet)
    assert made["status"] == "found", made["reason"]
    steps, feet = len(made["plan"]["groups"]), sum(len(group) for group in made["plan"]["groups"])
    told = console.locator("#gait-answer")
    expect(told.locator("p.yes")).to_contain_text(f"Gait tripod: {steps} steps, {feet} feet moved")
    expect(console.locator("#gait-doubt")).to_be_hidden()
    assert held(quiet)["walk"] == walk
    button = console.locator("#next-act")
    expect(button).to_have_text("Choose another goal")
    expect(console.locator("#verdict")).to_contain_text("Gait tripod:")
    look("tripod")
    console.locator("#walk-gait").select_option("")
    expect(button).to_have_text("Plan walk")

    blocked = wavy([WALL], half=4.0)
    live.terrains.load(blocked, "made for the test")
    expect(console.locator("#gait-doubt")).to_contain_text("The gait is out of date: the terrain has changed since: ")
    live.stances.set(stand(live.robot, blocked))
    console.locator("#walk-x").fill("2")
    console.locator("#walk-gait").select_option("wave")
    refused = gone(console, quiet)
    assert refused["failure"] is not None
    expect(told.locator("p.no")).to_contain_text(as_shown(refused["reason"]))
    expect(told.locator("p.no")).to_contain_text(f"step {refused['failure']['move'] + 1}")
    look("fails")

    console.locator("#walk-tether summary").click()
    console.locator("#tether-on").check()
    for field, text in (("tether-x", "-3"), ("tether-y", "2"), ("tether-z", "2")):
        console.locator(f"#{field}").fill(text)
    press(console, "Plan gait")
    expect(console.locator("#toast")).to_contain_text("No gait hangs on a tether")
