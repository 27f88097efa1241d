"""The plan panel: planners and settings as served, why this plan, alternatives, points to pass, going on."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, as_shown, held, press
from tests.support.server import Running
from tests.support.waiting import until

Keep = Callable[[str], None]

LATE_POINTS = """() => {
  const ask = window.fetch;
  window.fetch = async (...asked) => {
    if (String(asked[0]).endsWith("/points")) await new Promise((done) => setTimeout(done, 4000));
    return ask(...asked);
  };
}"""
"""Points take four seconds to the server."""


def planned(page: Page, served: Running) -> dict:
    """Plan the step; the new result."""
    before = {job["id"] for job in held(served)["jobs"]}
    press(page, "Plan step")

    def done() -> bool:
        jobs = [job for job in held(served)["jobs"] if job["id"] not in before and job["kind"] == "plan"]
        return bool(jobs) and jobs[-1]["state"] == "done"

    until(done, "the plan")
    return held(served, f"{SESSION}/plans/current")


def test_planner_and_settings_are_those_of_the_server(console: Page, quiet: Running, look: Keep) -> None:
    asked = held(quiet, "/planners")
    options = console.locator("#planner option")
    expect(options).to_have_count(len(asked["planners"]))
    assert options.all_inner_texts() == list(asked["planners"])
    expect(console.locator("#planner-text")).to_have_text(asked["planners"]["auto"])
    console.get_by_text("Settings", exact=True).click()
    assert float(console.locator("#set-lift").input_value()) == asked["settings"]["lift"]
    console.locator("#planner").select_option("astar")
    expect(console.locator("#planner-text")).to_have_text(asked["planners"]["astar"])
    assert console.locator("#set-goals").input_value() == asked["settings"]["goals"]
    assert [one.get_attribute("value") for one in console.locator("#set-goals option").all()] == list(asked["goals"])
    console.get_by_label("Goal posture").select_option("most room")
    console.locator("#set-lift").fill("0.3")
    console.locator("#set-branch").select_option("0")
    result = planned(console, quiet)
    used = result["provenance"]["settings"]
    assert (used["planner"], used["lift"], used["branch"]) == ("astar", 0.3, 0)
    assert used["goals"] == "clearance"
    assert result["status"] == "found", result["reason"]
    console.get_by_text("Why this plan", exact=True).click()
    expect(console.locator("#decisions li")).to_have_count(len(result["decisions"]))
    assert console.locator("#decisions li").all_inner_texts() == [as_shown(one["text"]) for one in result["decisions"]]
    look("why")
    press(console, "As delivered")
    assert float(console.locator("#set-lift").input_value()) == asked["settings"]["lift"]
    assert console.locator("#set-goals").input_value() == asked["settings"]["goals"]
    # what makes no sense is refused in words, and the plan stays
    console.locator("#set-time_limit").fill("0")
    press(console, "Plan step")
    expect(console.locator("#toast")).to_contain_text("time_limit must be above zero")
    assert held(quiet)["plan"]["digest"] == result["digest"]


def test_alternatives_are_compared_and_chosen(console: Page, quiet: Running, look: Keep) -> None:
    first = planned(console, quiet)
    press(console, "Alternatives")
    until(lambda: len(held(quiet)["plan"]["compared"]) == 4, "the alternatives")
    rows = console.locator("#compare tbody tr")
    expect(rows).to_have_count(4)
    listed = held(quiet, f"{SESSION}/plans")
    for row, one in zip(rows.all(), listed, strict=True):
        expect(row).to_contain_text(as_shown(one["text"]))
        expect(row).to_contain_text(f"{one['figures']['length']:.3f}" if one["figures"] else as_shown(one["reason"]))
    look("alternatives")
    higher = next(one for one in listed if one["kind"] == "higher_lift")
    assert higher["figures"], higher["reason"]
    press(console, higher["text"])
    until(lambda: held(quiet)["plan"]["digest"] == higher["digest"], "the chosen plan")
    expect(console.locator("#compare tr.current")).to_contain_text(higher["text"])
    # the key goes round among those that are plans
    console.locator("#h-plan").click()
    visited = {higher["digest"]}
    able = {one["digest"]: one["text"] for one in listed if one["figures"]}
    for _ in range(len(able) - 1):
        before = held(quiet)["plan"]["digest"]
        console.keyboard.press("k")
        until(lambda before=before: held(quiet)["plan"]["digest"] != before, "the next plan")
        chosen = held(quiet)["plan"]["digest"]
        visited.add(chosen)
        expect(console.locator("#compare tr.current")).to_contain_text(able[chosen])
    assert visited == set(able) >= {first["digest"]}


def test_a_point_at_the_ghost_is_moved_and_passed(console: Page, quiet: Running, look: Keep) -> None:
    planned(console, quiet)
    console.locator("#scrub").fill("500")
    until(lambda: abs(held(quiet)["view"]["scrub"] - 0.5) < 1e-9, "the ghost's place")
    console.locator("#h-plan").click()
    console.keyboard.press("j")
    height = console.get_by_label("z of point 1", exact=True)
    expect(height).to_be_visible()
    before = float(height.input_value())
    console.evaluate(LATE_POINTS)
    height.focus()
    console.keyboard.press("ArrowUp")
    assert 0 < float(height.input_value()) - before <= 0.05 + 1e-9
    point = [float(console.get_by_label(f"{axis} of point 1", exact=True).input_value()) for axis in "xyz"]
    console.locator("#h-plan").click()
    console.wait_for_timeout(1500)  # it draws what it knows once a second, while the point is on its way
    result = planned(console, quiet)  # with the point as it was shown
    assert result["through"][0] == pytest.approx(point, abs=1e-3)
    assert result["status"] == "found", result["reason"]
    path = held(quiet, f"{SESSION}/plans/current/wheel-path")["points"]
    assert min(sum((a - b) ** 2 for a, b in zip(one, result["through"][0], strict=True)) for one in path) < 1e-12
    look("through")
    console.get_by_label("Remove point 1", exact=True).click()
    expect(console.locator("#through")).to_be_hidden()
    assert planned(console, quiet)["through"] == []


def test_going_on_is_marked_and_ends(page: Page, served: Running, look: Keep) -> None:
    first = planned(page, served)
    real = held(served)["state"]
    page.locator("#h-plan").click()
    page.keyboard.press("n")
    until(lambda: held(served)["what_if"], "the predicted end")
    assert held(served)["after"] == first["digest"]
    expect(page.locator("#go-on-text")).to_contain_text("once the rover stands there")
    expect(page.locator("#status-what-if-box")).to_be_visible()
    # the next step starts where this one ends
    end = first["plan"]["contact"]
    page.locator("#footfall-x").fill(f"{end[0] - 0.1:.3f}")
    page.locator("#footfall-y").fill(f"{end[1] - 0.1:.3f}")
    press(page, "Choose")
    until(lambda: held(served)["footfall"]["x"] != first["footfall"]["x"], "the footfall")
    second = planned(page, served)
    assert second["provenance"]["parents"]["state"] == held(served)["state"] != real
    assert second["status"] == "found", second["reason"]
    assert second["plan"]["waypoints"][0] == first["plan"]["waypoints"][-1]
    # its commands wait for the rover to stand there
    before = held(served)["sequence"]
    press(page, "Make commands")
    until(lambda: held(served)["sequence"] != before, "the sequence")
    expect(page.locator("#status-match")).to_have_attribute("data-state", "bad")
    look("going-on")
    page.locator("#go-back").click()
    until(lambda: held(served)["what_if"] is None, "the rover as it stands")
    assert held(served)["state"] == real
    expect(page.locator("#go-on-text")).to_be_hidden()


def test_one_key_steps_to_the_nearest_good_place(console: Page, quiet: Running, look: Keep) -> None:
    chosen = held(quiet)["footfall"]
    expect(console.locator("#nearest-place")).to_be_disabled()
    with quiet.client() as client:
        hole = {"center": [chosen["x"], chosen["y"]], "radius": 0.04}
        client.post(f"{SESSION}/terrains/clear", json=hole).raise_for_status()
    refused = planned(console, quiet)
    assert refused["status"] == "unknown_ground"
    expect(console.locator("#plan-answer")).to_contain_text("the nearest good place")
    expect(console.locator("#nearest-place")).to_be_enabled()
    look("instead")
    console.locator("#h-plan").click()
    console.keyboard.press("+")
    there = {"leg": chosen["leg"], "x": refused["instead"]["x"], "y": refused["instead"]["y"]}
    until(lambda: held(quiet)["footfall"] == there, "the offered footfall")
    until(lambda: held(quiet)["plan"]["digest"] != refused["digest"], "the plan to it")
    found = held(quiet, f"{SESSION}/plans/current")["footfall"]
    assert {name: found[name] for name in there} == there
    assert held(quiet)["plan"]["status"] != "unknown_ground"
