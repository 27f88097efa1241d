"""The operator's page of a robot that others described: legs, what it has not, a step and a walk carried out, STOP."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from footfall.core.frames import apply
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.terrain.generate import fractal
from tests.support.browsers import kill_browsers
from tests.support.described import robot_of, seeing
from tests.support.page_steps import SESSION, held, keep_pressed, lay_out, made
from tests.support.server import Running, running_server
from tests.support.waiting import BOUND, else_after, until

LEGS = 6
WALK = "walk"
"""The layout that the page is delivered with."""
OFF = """async (unit) => {
    const { known, changed } = (await import("/js/page.js")).modules["store.js"];
    const [[joint], [before]] = [known.robot.joint_names, known.robot.joint_units];
    known.robot.joint_units[0] = unit;
    const reason = `${joint} is not where the plan starts`;
    const plan_matches_rover = { ok: false, joint, difference: -0.1, reason, older_ground: false };
    known.summary = { ...known.summary, plan_matches_rover };
    changed();
    known.robot.joint_units[0] = before;
    return document.querySelector("#status-match").textContent.replace(joint, "JOINT");
}"""
"""What the status bar says where the first joint, in that unit, is not where the plan starts."""


@pytest.fixture
def legs() -> int:
    """How many the robot has."""
    return LEGS


@pytest.fixture
def robot(legs: int, request: pytest.FixtureRequest) -> LeggedRobot:
    """What it is; asked for with a parameter, one of six legs with cameras."""
    return seeing(robot_of(legs)[1], side=180) if hasattr(request, "param") else robot_of(legs)[1]


@pytest.fixture
def robot_served(tmp_path: Path, robot: LeggedRobot) -> Iterator[Running]:
    """A session about a made robot on small ground, its rover connected."""

    def prepare(sessions) -> None:
        live = sessions.create("made robot", robot)
        live.terrains.load(fractal(2.4, 0.2, roughness=0.01, seed=3), "made for the tests")

    with running_server(tmp_path, prepare=prepare) as running:
        running.rover.start()
        current = running.sessions.current
        until(lambda: current is not None and current.rover.frame, "the first telemetry")
        yield running


@pytest.fixture
def other(chromium: Browser, robot_served: Running) -> Iterator[Page]:
    """Its page; whatever the browser's console is told as an error fails."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720})
    lay_out(context, WALK)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda told: faults.append(f"{told.text} {told.location}") if told.type == "error" else None)
    page.goto(f"{robot_served.url}/?scene=off")
    page.get_by_text("made robot", exact=True).wait_for()
    yield page
    with else_after(BOUND / 4, kill_browsers):
        context.close()
    assert not faults


def send(page: Page, served: Running) -> None:
    """Arm, send and wait until every row is done, as the page says what comes next."""
    page.locator("#next-act", has_text="Arm").click()
    expect(page.locator("#next-hold")).to_have_text("Send to rover")
    keep_pressed(page, "#next-hold")
    until(lambda: held(served)["commands_carried_out"], "the end of the run")


@pytest.mark.parametrize("legs", [6, 4])
def test_a_walk_is_planned_commanded_and_carried_out(other: Page, robot_served: Running, legs: int) -> None:
    expect(other.locator("#legs button")).to_have_count(legs)
    for leg in (3, 0):
        other.keyboard.press(str(leg))
        expect(other.locator(f"#leg-{leg}")).to_have_attribute("aria-checked", "true")
    expect(other.locator("#next-act")).to_have_text("Walk to…")

    other.locator("#area-goal").click()
    begin = held(robot_served, f"{SESSION}/telemetry")["T_site_base"]
    other.locator("#walk-ahead").fill("0.05")
    expect(other.locator("#next-act")).to_have_text("Plan walk")
    made(robot_served, "described_walk", lambda: other.locator("#next-act").click())
    expect(other.locator("#walk-answer")).to_contain_text("Walk found")
    expect(other.locator("#job-said")).to_have_text("Walk found")
    walk = held(robot_served, f"{SESSION}/described-walks/{held(robot_served)['described_walk']}")
    expect(other.locator("#walk-answer ol li")).to_have_count(len(walk["plan"]["moves"]))

    other.keyboard.press("{")
    expect(other.locator("#scrub-read")).to_contain_text(f"foot move {len(walk['plan']['moves'])} of")
    expect(other.locator("#next-act")).to_have_text("Make commands: the walk")
    other.locator("#next-act").click()
    until(lambda: held(robot_served)["sequence"], "the commands")
    expect(other.locator("#commands tbody tr")).not_to_have_count(0)
    assert other.evaluate(OFF, "rad") == "JOINT off −5.7°"
    assert other.evaluate(OFF, "m") == "JOINT off −0.100 m"
    send(other, robot_served)
    end = held(robot_served, f"{SESSION}/telemetry")["T_site_base"]
    assert end[0][3] > begin[0][3]
    expect(other.locator("#next-act")).to_have_text("Walk to…")
    expect(other.locator("#status-match")).to_have_text("carried out as commanded")
    expect(other.locator("#outcome-text")).to_have_text("Run 1: it moved as commanded.")
    expect(other.locator("#outcome-table tbody tr")).to_have_count(2 * legs + 2)


@pytest.mark.parametrize("legs", [8])
def test_legs_whose_number_is_the_key_of_something_else_have_no_key(other: Page, legs: int) -> None:
    expect(other.locator("#legs button")).to_have_count(legs)
    expect(other.locator("#leg-5")).to_have_text("Leg 5key 5")
    expect(other.locator("#leg-6")).to_have_text("Leg 6")
    other.locator("#leg-7").click()
    expect(other.locator("#leg-7")).to_have_attribute("aria-checked", "true")
    other.locator("#h-ground").click()
    other.keyboard.press("5")
    expect(other.locator("#leg-5")).to_have_attribute("aria-checked", "true")
    other.keyboard.press("7")
    expect(other.locator("#layout")).to_have_value("plan a step")
    other.keyboard.press("6")
    expect(other.locator("#layout")).to_have_value(WALK)


def test_a_route_is_taken_in_parts_of_the_robots_size(other: Page, robot: LeggedRobot) -> None:
    assert robot.length < 1.0
    assert float(other.locator("#route-part").input_value()) == pytest.approx(2.15 * robot.length, rel=0.05)


def test_a_step_by_keys_and_stop(other: Page, robot_served: Running) -> None:
    frame = held(robot_served, f"{SESSION}/telemetry")
    other.locator("#area-footfall").click()
    other.keyboard.press("1")
    expect(other.locator("#leg-1")).to_have_attribute("aria-checked", "true")
    x, y = sole_of(robot_of(LEGS)[1], frame, 1)
    other.keyboard.press("F")
    other.locator("#footfall-x").fill(f"{x + 0.03:.3f}")
    other.locator("#footfall-y").fill(f"{y + 0.02:.3f}")
    other.keyboard.press("Enter")
    expect(other.locator("#footfall-answer")).to_contain_text("leg 1")
    other.locator("#h-footfall").click()
    made(robot_served, "described_step", lambda: other.keyboard.press("P"))
    expect(other.locator("#job-said")).to_have_text("Plan found")
    expect(other.locator("#next-act")).to_have_text("Make commands: leg 1")
    other.keyboard.press("S")
    until(lambda: held(robot_served)["sequence"], "the commands")
    expect(other.locator("#commands tbody tr")).not_to_have_count(0)
    yamcs = other.locator("#export-format option[value=yamcs]")
    expect(yamcs).to_be_disabled()
    expect(yamcs).to_have_attribute("title", "a stack names no joints")
    expect(other.locator("#export-format option:checked")).to_be_enabled()
    send(other, robot_served)
    other.locator("#stop").click()
    until(lambda: held(robot_served)["stop"]["latched"], "the stop")
    expect(other.locator("#next-act")).to_have_text("A stop is in force")


def sole_of(robot, frame: dict, leg: int) -> tuple[float, float]:
    """Where a leg's foot is, seen from above, in site [m]."""
    x, y, _ = apply(frame["T_site_base"], placed(robot, frame["posture"]).soles[leg])
    return float(x), float(y)


def test_what_it_has_not_is_said_once_and_gauges_show_what_it_has(other: Page, robot_served: Running) -> None:
    expect(other.locator("#panel-loop")).to_contain_text("does not walk by itself")
    expect(other.locator("#loop-begin")).to_be_hidden()
    expect(other.locator("#take-images")).to_be_hidden()
    other.keyboard.press("I")
    expect(other.locator("#toast")).to_contain_text("This robot has no cameras")
    other.locator("#area-legs").click()
    expect(other.locator("#legs-table tbody tr")).to_have_count(LEGS)
    expect(other.locator("#legs-table tbody tr").first).to_contain_text(re.compile(r"stands.*l0 "))
    other.locator("#area-telemetry").click()
    other.locator("#plot-quantity").select_option("position")
    expect(other.locator("#plot-series li")).to_have_count(3)
    expect(other.locator("#plot-series li b").first).to_have_text(re.compile(r"\d"))


@pytest.mark.parametrize("robot", [pytest.param(None, id="with cameras")], indirect=True)
def test_one_that_sees_takes_images_and_builds_its_ground(other: Page, robot_served: Running) -> None:
    loaded = held(robot_served)["dem"]
    expect(other.locator("#panel-images")).not_to_contain_text("no cameras")
    other.locator("#area-ground").click()
    expect(other.locator("#take-images")).to_be_visible()
    expect(other.locator("#next-act")).to_have_text("Walk to…")
    other.keyboard.press("I")
    expect(other.locator("#next-act")).to_have_text("Build terrain")
    other.locator("#next-act").click()
    until(lambda: held(robot_served)["dem"] not in (None, loaded), "ground that is built of its images")
    expect(other.locator("#next-act")).to_have_text("Walk to…")
    other.locator("#area-images").click()
    expect(other.locator("#panel-images")).to_contain_text("out0")
    expect(other.locator("#panel-loop")).to_contain_text("does not walk by itself")


def test_a_page_that_is_not_told_the_robot_waits_for_another_answer(chromium: Browser, quiet: Running) -> None:
    context = chromium.new_context()
    page = context.new_page()
    loads: list[str] = []
    asked: list[str] = []
    page.on("load", lambda loaded: loads.append(loaded.url))

    def refuse(route: Route) -> None:
        asked.append(route.request.url)
        body = json.dumps({"title": "Server fault", "detail": "nobody can tell this robot"})
        route.fulfill(status=500, content_type="application/problem+json", body=body)

    page.route("**/api/v1/robot", refuse)
    page.goto(f"{quiet.url}/?scene=off")
    expect(page.locator("#toast")).to_contain_text("nobody can tell this robot")
    until(lambda: page.evaluate("1") and len(asked) >= 5, "the page's asking again")
    assert len(loads) == 1
    page.unroute("**/api/v1/robot")
    expect(page.locator("#legs button")).to_have_count(6)
    assert len(loads) == 2
    context.close()


def test_a_route_is_planned_and_the_walk_goes_along_it(other: Page, robot_served: Running) -> None:
    other.locator("#area-goal").click()
    other.locator("#walk-ahead").fill("0.06")
    made(robot_served, "route", lambda: other.locator("#plan-route").click())
    expect(other.locator("#route-answer")).to_contain_text("plan a walk along it")
    expect(other.locator("#walk-along")).to_be_checked()
    made(robot_served, "described_walk", lambda: other.locator("#plan-walk").click())
    expect(other.locator("#walk-answer")).to_contain_text("Walk found")
    digest = held(robot_served)["described_walk"]
    walk = held(robot_served, f"{SESSION}/described-walks/{digest}")
    route = held(robot_served, f"{SESSION}/routes/{held(robot_served)['route']}")
    assert walk["provenance"]["parents"]["route"] == route["plan"]["digest"]

    other.locator("#walk-ahead").fill("-0.2")
    other.locator("#plan-walk").click()
    expect(other.locator("#toast")).to_contain_text("The route leads to another goal")
    assert held(robot_served)["described_walk"] == digest
    other.locator("#walk-along").uncheck()
    other.locator("#walk-ahead").fill("0.2")
    made(robot_served, "described_walk", lambda: other.locator("#plan-walk").click())
    straight = held(robot_served, f"{SESSION}/described-walks/{held(robot_served)['described_walk']}")
    assert "route" not in straight["provenance"]["parents"]
    assert len(straight["plan"]["moves"]) > len(walk["plan"]["moves"])
    expect(other.locator("#walk-answer ol li")).to_have_count(len(straight["plan"]["moves"]))
