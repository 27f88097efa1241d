"""The ghost over a whole walk: every foot move told and stepped to, its worst places a press away."""

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect

from footfall.planning.body.stand import stand
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.session.jobs.requests import WalkRequest
from footfall.session.products.kinds import WALK
from footfall.terrain.dem import Dem
from tests.support.chassis_ground import wavy
from tests.support.page_steps import SESSION, held
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]


def walked(quiet: Running, dem: Dem | None = None) -> dict[str, Any]:
    """A walk of the session, as the interface tells it."""
    live = quiet.sessions.current
    assert live is not None
    dem = dem or wavy(half=4.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))
    live.stances.ask(WALK, WalkRequest(WalkGoal(1.5, 0.1, 0.0), WalkSettings(seed=4))).finish()
    made = held(quiet, f"{SESSION}/walks/current")
    assert made["plan"], made["reason"]
    return made


def moments_of(plan: dict[str, Any]) -> np.ndarray:
    """0…1 at each waypoint, by the joint that travels most."""
    steps = np.abs(np.diff(np.array(plan["waypoints"]), axis=0)).max(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()


def test_the_ghost_plays_a_whole_walk_foot_move_by_foot_move(console: Page, quiet: Running, look: Keep) -> None:
    made = walked(quiet)
    plan, moments = made["plan"], moments_of(made["plan"])
    assert held(quiet)["played"] == made["digest"]
    moves = np.array(plan["moves"])
    ends = [float(moments[np.flatnonzero(moves == number).max()]) for number in range(len(plan["legs"]))]
    read, strip = console.locator("#scrub-read"), console.locator("#strip")
    expect(strip).to_be_visible()
    expect(console.locator("#strip-ticks i")).to_have_count(len(set(moves.tolist())))

    def shows(moment: float) -> None:
        until(lambda: abs(held(quiet)["view"]["scrub"] - moment) < 1e-9, f"the ghost at {moment}")

    console.locator("#scrub").fill("0")
    shows(0.0)
    console.locator("#h-plan").click()
    for number, end in enumerate(ends):
        console.keyboard.press("}")
        shows(end)
        expect(read).to_contain_text(f"foot move {number + 1} of {len(ends)}, leg {plan['legs'][number]}, lower")
    console.keyboard.press("{")
    shows(ends[-2])
    look("stepped")

    worst = {"margin": int(np.argmin(plan["margins"])), "torque": int(np.argmax(plan["torques"]))}
    told = {
        "margin": f"▼ least margin {plan['margins'][worst['margin']]:.2f} m",
        "torque": f"▲ most torque {100 * plan['torques'][worst['torque']]:.0f} %",
    }
    for name, waypoint in worst.items():
        button = console.locator(f"#strip-{name}")
        expect(button).to_have_text(told[name])
        button.click()
        shows(float(moments[waypoint]))
        number = int(moves[waypoint])
        expect(read).to_contain_text(f"foot move {number + 1} of" if number < len(ends) else "to its goal")
        look(name)
    along = held(quiet, f"{SESSION}/walks/current/along")
    nearest = min(along["parts"], key=lambda part: part["spare"])
    button = console.locator("#strip-spare")
    expect(button).to_have_text(f"◆ at least {nearest['spare']:.2f} m to spare")
    said = re.compile(re.escape(nearest["between"]))
    expect(console.locator("#strip-spare-mark")).to_have_attribute("title", said)
    button.click()
    shows(float(moments[nearest["waypoint"]]))
    # nobody said when the ground that the test made was seen
    assert along["newest"] is None
    expect(console.locator("#strip-age")).to_have_text("◷ age of the ground not known")
    expect(console.locator("#strip-age")).to_have_attribute("title", "age of the ground not known")
    look("nearest")
    box = console.locator("#strip-picture").bounding_box()
    assert box is not None
    console.locator("#strip-picture").click(position={"x": 0.25 * box["width"], "y": box["height"] / 2})
    until(lambda: held(quiet)["view"]["scrub"] == pytest.approx(0.25, abs=2 / box["width"]), "a quarter of the walk")
    # the margin there, judged by the session along the walk, is the one of the planner
    at = float(np.interp(held(quiet)["view"]["scrub"], moments, plan["margins"]))
    expect(console.locator("#gauge-ghost output")).to_contain_text(f"{at:.2f} m, foot move")


def test_what_was_not_told_of_a_walk_is_asked_for_again(console: Page, quiet: Running) -> None:
    asked: list[Route] = []

    def answer(route: Route) -> None:
        asked.append(route)
        if len(asked) > 1:
            route.continue_()
        else:
            route.fulfill(status=409, json={"detail": "not now"})

    console.route("**/along", answer)
    walked(quiet)
    expect(console.locator("#strip-spare")).to_have_text("◆ not now")
    expect(console.locator("#strip-spare")).to_contain_text("m to spare")


def test_what_smoothing_changed_is_told(console: Page, quiet: Running, look: Keep) -> None:
    made = walked(quiet)
    before, after = made["smoothed"]["before"], made["smoothed"]["after"]
    console.locator("#area-walk").click()
    told = console.locator("#walk-smoothed")
    expect(told).to_contain_text(f"{before['foot_moves']} → {after['foot_moves']} foot moves")
    expect(told).to_contain_text(f"{before['chassis_way']:.2f} → {after['chassis_way']:.2f} m of the chassis' way")
    expect(told).to_contain_text(f"{before['turning']:.1f} → {after['turning']:.1f} rad")
    told.scroll_into_view_if_needed()
    look("smoothed")


def test_step_or_walk_is_played_as_chosen_until_something_newer_is_made(console: Page, quiet: Running) -> None:
    step = held(quiet)["sequence"]  # these hold the pose, so they are looked at before their plan
    made = walked(quiet)
    live = quiet.sessions.current
    assert live is not None
    plays = console.get_by_label("What the ghost plays")
    expect(plays).to_have_value("walk")
    plays.select_option("step")
    until(lambda: held(quiet)["played"] == step, "the step")
    expect(console.locator("#strip")).to_be_hidden()
    expect(console.locator("#scrub-read")).to_contain_text("of the commands")
    plays.select_option("walk")
    until(lambda: held(quiet)["played"] == made["digest"], "the walk")
    # what would be sent is looked at before what is only planned
    commands = live.walks.command(made["digest"], 0)
    assert held(quiet)["played"] == commands
    expect(plays).to_have_value("step")
    expect(console.locator("#scrub-read")).to_contain_text("of the commands")
    plays.select_option("walk")
    until(lambda: held(quiet)["played"] == made["digest"], "the walk, over its commands")
    expect(console.locator("#strip")).to_be_visible()


def test_the_footfall_on_the_oldest_ground_is_a_press_away(console: Page, quiet: Running) -> None:
    dem = wavy(half=4.0)
    # by the clock of a rover that counts from when it was started
    seen = np.where(np.arange(dem.geometry.cols) > dem.geometry.cols // 2, 9000.0, 1800.0)
    made = walked(quiet, replace(dem, time=np.tile(seen, (dem.geometry.rows, 1))))
    along = held(quiet, f"{SESSION}/walks/current/along")
    oldest = int(np.argmax(along["seen_before"]))
    assert along["seen_before"][oldest] == pytest.approx(7200.0)
    assert along["newest"] == held(quiet)["terrain"]["seen"]
    button = console.locator("#strip-age")
    expect(button).to_have_text("◷ oldest ground 2 h")
    button.click()
    end = moments_of(made["plan"])[np.flatnonzero(np.array(made["plan"]["moves"]) == oldest).max()]
    until(lambda: abs(held(quiet)["view"]["scrub"] - end) < 1e-9, "the ghost at that footfall")

    def three_hours_on(route: Route) -> None:
        answer = route.fetch()
        then = format_datetime(datetime.now(UTC) + timedelta(hours=3), usegmt=True)
        route.fulfill(response=answer, headers={**answer.headers, "date": then})

    console.route("**/sessions/current", three_hours_on)
    expect(button).to_have_text("◷ oldest ground 5 h")
