"""Footfalls of a walk are moved on the map and with keys: pinned there, forbidden where they were, not planned yet."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.test_map import PIXEL_OF
from tests.browser.test_next_thing import of_page
from tests.support.chassis_ground import wavy
from tests.support.laid_sample import lay_sample
from tests.support.page_steps import held, lay_out
from tests.support.server import running_server

PLACES = "async () => (await import('/js/page.js')).modules['panels/places.js'].placesSaid()"
BORDER = "canvas => [canvas.clientLeft, canvas.clientTop]"
SCRIPT = """
    const moves = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(([name, ...given]) => moves[name](...given))));
"""


def of_module(asked: list[list]) -> list:
    return of_page(SCRIPT, "footfallmoves.js", asked)


def test_a_moved_footfall_is_pinned_outside_of_what_is_forbidden():
    """By the page's own module, over many moves; no browser."""
    rng = np.random.default_rng(3)
    nothing = {"forbidden": [], "pinned": []}
    ways = [(rng.uniform(-3, 3, 2), rng.uniform(-0.6, 0.6, 2)) for _ in range(40)]
    moves = [[{"number": 1, "leg": 4, "from": at.tolist(), "to": (at + by).tolist()}] for at, by in ways]
    for (at, by), places in zip(ways, of_module([["withMoves", nothing, one] for one in moves]), strict=True):
        [forbidden], [pinned] = places["forbidden"], places["pinned"]
        assert (forbidden["x"], forbidden["y"], forbidden["leg"]) == (*at, 4)
        assert (pinned["x"], pinned["y"], pinned["leg"]) == (*(at + by), 4)
        assert 0 < forbidden["radius"] <= 0.2
        assert forbidden["radius"] < np.hypot(*by)


def test_a_footfall_that_is_moved_again_is_said_once_and_a_pin_goes_along():
    first = {"number": 0, "leg": 2, "from": [0.0, 0.0], "to": [0.3, 0.0]}
    again, back = {**first, "to": [0.0, 0.4]}, {**first, "to": [0.0, 0.0]}
    said = {"forbidden": [], "pinned": [{"x": 0.05, "y": 0.0, "leg": 2}, {"x": 0.05, "y": 0.0, "leg": 3}]}
    others = {"number": 1, "leg": 3, "from": [5.0, 0.0], "to": [5.1, 0.0]}
    twice, home, places = of_module(
        [["movedTo", [first, others], again], ["movedTo", [first], back], ["withMoves", said, [again]]]
    )
    assert twice == [others, again]
    assert home == []
    # what was pinned where the footfall was is meant by the move; another leg's stays
    assert [(one["x"], one["y"], one["leg"]) for one in places["pinned"]] == [(0.05, 0.0, 3), (0.0, 0.4, 2)]


def test_a_walk_heeds_what_was_said_where_it_was_asked_for_with_all_of_it():
    place, pin = {"x": 1.0, "y": 0.5}, {"x": 1.0, "y": 0.5, "leg": 2}
    asked_for = {"forbidden": [{**place, "radius": 0.2, "leg": None}], "pinned": [{"x": 1.0, "y": 0.5, "leg": 2}]}
    cases = [  # what was said, what the walk was asked for with, whether it heeds all
        ({"forbidden": [], "pinned": []}, None, True),
        ({"forbidden": [place], "pinned": []}, None, False),
        ({"forbidden": [place], "pinned": []}, {}, False),
        ({"forbidden": [place], "pinned": [pin]}, asked_for, True),
        ({"forbidden": [], "pinned": [pin]}, asked_for, True),
        ({"forbidden": [place, {"x": 1.1, "y": 0.5}], "pinned": []}, asked_for, False),
        ({"forbidden": [], "pinned": [{**pin, "leg": 3}]}, asked_for, False),
    ]
    assert of_module([["areHeeded", *given] for *given, _ in cases]) == [heeded for *_, heeded in cases]


def test_a_pin_is_met_once_the_foot_move_is_made_that_puts_its_leg_there():
    falls = [{"leg": 2, "at": [0.0, 0.0]}, {"leg": 3, "at": [1.0, 0.0]}, {"leg": 2, "at": [1.03, 0.0]}]
    pins = [{"x": 1.03, "y": 0.0, "leg": 2}, {"x": 1.0, "y": 0.0}, {"x": 1.0, "y": 0.0, "leg": None}, {"x": 3, "y": 0}]
    found = of_module([["metBy", pins, falls, done] for done in range(4)])
    assert found == [[], [], pins[1:3], pins[:3]]


def test_the_nearest_footfall_is_taken_and_none_that_is_far():
    falls = [{"at": [0, 0]}, {"at": [10, 0]}, {"at": [10, 0], "later": True}]
    script = SCRIPT.replace("moves[name](...given)", "moves[name](given[0], (at) => at, given[1], given[2])")
    found = of_page(script, "footfallmoves.js", [["nearest", falls, at, 4] for at in ([1, 1], [8, 0], [5, 0])])
    assert found == [falls[0], falls[2], None]


def test_a_walk_that_is_being_walked_is_on_the_map():
    """Its footfalls, though the rover no longer stands where the walk begins; of one that can't go on none."""
    walk = {"plan": {"legs": [2], "stances": [{}, {"contacts": {"2": [1.0, 2.0, 0.1]}}]}}
    moved = {"up_to_date": {"walk": {"fits": False, "reason": "the rover has moved"}}, "gate": {"state": "idle"}}
    walking = [{"next": 1, "done": 1, "against": ""}, {"next": None, "done": 2, "against": ""}]
    walking += [{"next": 1, "done": 1, "against": "the chassis is 0.3 m off"}, {"next": 0, "done": 0, "against": ""}]
    facts = [{"summary": {**moved, "walking": one, "run": None}, "sequence": None, "walk": walk} for one in walking]
    script = SCRIPT.replace("([name, ...given]) => moves[name](...given)", "(facts) => moves.footfallsOf(facts)")
    there = [{"leg": 2, "at": [1.0, 2.0]}]
    assert of_page(script, "abovemarks.js", facts) == [there, there, [], []]


@pytest.fixture
def walked(tmp_path: Path, chromium: Browser):
    """The page of the sample whose walk is planned already, its map in sight; no rover, no scene."""
    session = lay_sample("rock-walk", tmp_path)
    with running_server(tmp_path, prepare=lambda s: s.open(session)) as running:
        context = chromium.new_context(viewport={"width": 1280, "height": 900})
        lay_out(context)
        page = context.new_page()
        faults: list[str] = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(f"{running.url}/?scene=off")
        expect(page.locator("#walk-answer ol li")).not_to_have_count(0)
        page.locator("#area-walk").click()
        page.locator("#area-map").click()
        expect(page.locator("#map-left")).to_be_visible()
        yield page, running
        context.close()
        assert not faults


def footfall(running, number: int) -> tuple[int, list[float]]:
    """Leg and place of a foot move of the session's walk."""
    plan = held(running, "/sessions/current/walks/current")["plan"]
    leg = plan["legs"][number]
    return leg, plan["stances"][number + 1]["contacts"][leg][:2]


def drag(page: Page, start: list[float], by: tuple[int, int]) -> None:
    """Press on a place of the map [m], and go so many pixels; the button stays down."""
    box = page.locator("#map-left").bounding_box()
    assert box is not None
    x, y = np.add(page.evaluate(PIXEL_OF, start), page.locator("#map-left").evaluate(BORDER)).tolist()
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.down()
    page.mouse.move(box["x"] + x + by[0], box["y"] + y + by[1], steps=4)


def test_a_drag_on_the_map_pins_the_foot_there_and_escape_leaves_it(walked: tuple) -> None:
    page, running = walked
    number = 1
    leg, at = footfall(running, number)
    drag(page, at, (0, -40))
    expect(page.locator("#walk-places-text")).to_contain_text(f"Foot move {number + 1} to")
    page.keyboard.press("Escape")
    page.mouse.up()
    assert page.evaluate(PLACES) == {"forbidden": [], "pinned": []}
    expect(page.locator("#walk-places")).to_be_hidden()

    before = np.array(page.evaluate(PIXEL_OF, [0.0, 0.0]))
    drag(page, at, (0, -40))
    page.mouse.up()
    # the map stays where it is
    np.testing.assert_allclose(page.evaluate(PIXEL_OF, [0.0, 0.0]), before)
    expect(page.locator("#walk-places-text")).to_contain_text("1 forbidden, 1 pinned. Plan the walk to heed them.")
    expect(page.locator("#walk-answer ol li").nth(number)).to_contain_text("not planned yet")
    expect(page.locator("#next-act")).to_have_text("Plan walk")
    expect(page.locator("#next-about")).to_have_text("Places: 1 forbidden, 1 pinned. Plan the walk to heed them.")
    for button in ("#walk-next", "#walk-rest", "#walk-again"):
        expect(page.locator(button)).to_be_disabled()
        expect(page.locator(button)).to_have_attribute("title", re.compile("Plan the walk to heed them"))
    [forbidden], [pinned] = (page.evaluate(PLACES)[what] for what in ("forbidden", "pinned"))
    assert (forbidden["x"], forbidden["y"], forbidden["leg"]) == (*at, leg)
    assert pinned["leg"] == leg
    put = page.evaluate(PIXEL_OF, [pinned["x"], pinned["y"]])
    np.testing.assert_allclose(put, np.add(page.evaluate(PIXEL_OF, at), [0, -40]), atol=1.0)
    # and it can be taken there again
    drag(page, [pinned["x"], pinned["y"]], (30, 0))
    page.mouse.up()
    [pinned] = page.evaluate(PLACES)["pinned"]
    put = page.evaluate(PIXEL_OF, [pinned["x"], pinned["y"]])
    np.testing.assert_allclose(put, np.add(page.evaluate(PIXEL_OF, at), [30, -40]), atol=1.0)
    page.locator("#walk-places-clear").click()
    assert page.evaluate(PLACES) == {"forbidden": [], "pinned": []}
    expect(page.locator("#walk-answer ol li").nth(number)).not_to_contain_text("not planned yet")


def test_keys_move_it_and_the_plan_is_asked_for_with_it(walked: tuple) -> None:
    page, running = walked
    leg, at = footfall(running, 0)
    page.get_by_role("button", name="Move the footfall of foot move 1", exact=True).focus()
    for key in ("ArrowUp", "ArrowUp", "ArrowRight", "Shift+ArrowLeft"):
        page.keyboard.press(key)
    assert page.evaluate(PLACES) == {"forbidden": [], "pinned": []}
    page.keyboard.press("Enter")
    [pinned] = page.evaluate(PLACES)["pinned"]
    assert (pinned["x"], pinned["y"]) == pytest.approx((at[0] + 0.04, at[1] + 0.10))
    # what the page would ask for, off the map so that the answer comes at once
    page.locator("#area-goal").click()
    for field, value in (("x", "900"), ("y", "0")):
        page.locator(f"#walk-{field}").fill(value)
    page.locator("#walk-x").press("Enter")
    expect(page.locator("#walk-answer p.no")).to_contain_text("off the map")
    asked = held(running, "/sessions/current/walks/current")["provenance"]["settings"]
    assert [(one["x"], one["y"], one["leg"]) for one in asked["pinned"]] == [(pinned["x"], pinned["y"], leg)]
    assert [one["leg"] for one in asked["forbidden"]] == [leg]


def test_footfalls_of_a_walk_that_is_out_of_date_are_not_moved(walked: tuple) -> None:
    page, running = walked
    running.sessions.current.terrains.load(wavy(half=4.0), "made for the test")
    expect(page.locator("#walk-doubt")).to_contain_text("Out of date")
    move = page.get_by_role("button", name="Move the footfall of foot move 1", exact=True)
    move.click()
    expect(page.locator("#toast")).to_contain_text("Plan the walk again")
    move.focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    assert page.evaluate(PLACES) == {"forbidden": [], "pinned": []}
