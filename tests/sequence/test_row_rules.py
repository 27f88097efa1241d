"""The rules that are asked of a row alone: which are asked, whether they hold to the edge, and by how much."""

from math import inf, isnan, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from footfall.balance.balance_settings import GRAVITY
from footfall.core.errors import InvalidSequence
from footfall.sequence import rules
from footfall.sequence.commands import Command, RuleResult
from footfall.sequence.rules import SPEED_TOLERANCE, check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.telemetry.command_kinds import KINDS
from footfall.terrain.from_arrays import from_heights

LEG = 2
OWN = slice(6 * LEG, 6 * LEG + 6)
UNITS = {"duration": "s", "speed": "s", "joint-limits": "rad", "force": "N"}
FORM = {"known-command", "leg-exists", "finite", "duration"}
MOVES = {*FORM, "six-joints", "joint-limits", "speed"}


@pytest.fixture(scope="module")
def start(athlete):
    return np.array(athlete.posture("stand"))


def asked(robot, start, *commands, **told) -> dict[str, RuleResult]:
    """Rule → its result at the last row."""
    results = check_rules(robot, commands, start, np.eye(4), **told)
    assert [result.row for result in results] == sorted(result.row for result in results)
    assert (results[0].rule, results[0].row) == ("not-empty", -1)
    last = [result for result in results if result.row == len(commands) - 1]
    assert len({result.rule for result in last}) == len(last)
    return {result.rule: result for result in last}


def one(robot, start, *args, **told) -> dict[str, RuleResult]:
    return asked(robot, start, Command(*args, **told))


def broken(results: dict[str, RuleResult]) -> set[str]:
    return {name for name, result in results.items() if not result.holds}


def test_no_command_at_all_is_told_as_that(athlete, start):
    (only,) = check_rules(athlete, (), start, np.eye(4))
    assert (only.rule, only.row, only.holds, only.unit, only.text) == ("not-empty", -1, False, "", "0 commands")
    assert isnan(only.margin)
    first = check_rules(athlete, (Command("WAIT", None, None, 1.0),), start, np.eye(4))[0]
    assert (first.rule, first.holds, first.text) == ("not-empty", True, "1 commands")


@pytest.mark.parametrize("index", [0, 35])
@pytest.mark.parametrize("number", [nan, inf])
def test_a_start_of_other_numbers_is_refused(athlete, start, index, number):
    wrong = start.copy()
    wrong[index] = number
    with pytest.raises(InvalidSequence, match="36 finite"):
        check_rules(athlete, (), wrong, np.eye(4))
    for shape in ((35,), (37,), (1, 36)):
        with pytest.raises(InvalidSequence) as caught:
            check_rules(athlete, (), np.zeros(shape), np.eye(4))
        assert caught.value.details["shape"] == list(shape)


def test_a_start_in_degrees_or_beyond_the_world_is_refused(athlete, start):
    with pytest.raises(InvalidSequence, match="degrees"):
        check_rules(athlete, (), np.degrees(start), np.eye(4))
    away = np.eye(4)
    away[0, 3] = 1e300
    with pytest.raises(InvalidSequence, match="origin"):
        check_rules(athlete, (), start, away)


@pytest.mark.parametrize("far", [40.0, -1e308])
@pytest.mark.parametrize("name", ["LEG_MOVE", "LEG_LOWER", "POSTURE_MOVE"])
def test_what_a_move_to_degrees_meets_is_not_asked(athlete, start, name, far):
    alone = name != "POSTURE_MOVE"
    joints = (start[OWN] if alone else start).copy()
    joints[1] = far
    force = 50.0 if name == "LEG_LOWER" else None
    command = Command(name, LEG if alone else None, joints, 9.0, force=force)
    ground = from_heights(np.full((20, 20), -1.9), 0.5, -5.0, -5.0)
    results = asked(athlete, start, command, dem=ground)
    assert broken(results) == {"joint-limits"}
    assert not {"speed", "no-drag"} & results.keys()
    back = asked(athlete, start, command, Command("POSTURE_MOVE", None, start, 9.0))
    assert broken(back) == set()


def test_every_kind_of_command_is_asked_its_own_rules_and_they_have_units(athlete, start):
    q = start[OWN] + 0.1
    every = {
        "WAIT": (one(athlete, start, "WAIT", None, None, 1.0), {*FORM, "six-joints"}),
        "LEG_MOVE": (one(athlete, start, "LEG_MOVE", LEG, q, 9.0), MOVES),
        "LEG_LOWER": (one(athlete, start, "LEG_LOWER", LEG, q, 9.0, force=50.0), {*MOVES, "force"}),
        "POSTURE_MOVE": (
            one(athlete, start, "POSTURE_MOVE", None, start + 0.01, 9.0),
            {*FORM, "all-joints", "joint-limits", "speed"},
        ),
    }
    assert every.keys() == set(KINDS)
    for name, (results, expected) in every.items():
        assert results.keys() == expected, name
        assert broken(results) == set(), name
        for rule, result in results.items():
            assert result.unit == UNITS.get(rule, "")
            assert isnan(result.margin) == (rule not in UNITS), rule


def test_an_unknown_name_is_told_with_those_that_there_are_and_asked_nothing_else(athlete, start):
    results = one(athlete, start, "FLY", LEG, start[OWN], 9.0)
    assert results.keys() == {"known-command"}
    assert not results["known-command"].holds
    assert results["known-command"].text == "'FLY' is none of LEG_MOVE, WAIT, POSTURE_MOVE, LEG_LOWER"
    assert one(athlete, start, "WAIT", None, None, 1.0)["known-command"].text == "WAIT"


@pytest.mark.parametrize("name", ["LEG_MOVE", "LEG_LOWER"])
def test_the_leg_of_a_move_is_one_that_the_rover_has(athlete, start, name):
    force = 50.0 if name == "LEG_LOWER" else None
    for leg, holds in ((-1, False), (0, True), (1, True), (5, True), (6, False), (None, False)):
        results = one(athlete, start, name, leg, start[:6], 9.0, force=force)
        assert results["leg-exists"].holds is holds, leg
        assert results["leg-exists"].text == f"leg {leg} of 0…5"
        assert broken(results) == (set() if holds else {"leg-exists"})
        assert ("speed" in results) is holds


def test_what_moves_no_leg_or_all_names_none(athlete, start):
    for name, joints in (("WAIT", None), ("POSTURE_MOVE", start)):
        for leg in (0, LEG):
            assert broken(one(athlete, start, name, leg, joints, 9.0)) == {"leg-exists"}


def test_the_number_of_joints_is_that_of_what_moves(athlete, start):
    for count in (0, 5, 7, 36):
        results = one(athlete, start, "LEG_MOVE", LEG, start[:count], 9.0)
        assert broken(results) == {"six-joints"}
        assert results["six-joints"].text == f"{count} joints of 6"
        assert "speed" not in results
    for count in (0, 6, 35, 37, 42):
        results = one(athlete, start, "POSTURE_MOVE", None, np.resize(start, count), 9.0)
        assert broken(results) == {"all-joints"}
        assert results["all-joints"].text == f"{count} joints of 36"
    assert one(athlete, start, "LEG_MOVE", LEG, None, 9.0)["six-joints"].text == "0 joints of 6"
    assert broken(one(athlete, start, "WAIT", None, start[:6], 9.0)) == {"six-joints"}


@pytest.mark.parametrize("number", [nan, inf, -inf])
def test_a_number_that_is_none_is_told_and_what_needs_it_is_left_out(athlete, start, number):
    q = start[OWN].copy()
    q[3] = number
    for results in (
        one(athlete, start, "LEG_MOVE", LEG, q, 9.0),
        one(athlete, start, "LEG_LOWER", LEG, start[OWN], 9.0, force=number),
    ):
        assert broken(results) == {"finite"}
        assert not results.keys() & {"joint-limits", "speed", "force"}
        assert results["duration"].holds
        assert "not finite" in results["finite"].text
    results = one(athlete, start, "LEG_MOVE", LEG, start[OWN], number)
    assert broken(results) == {"finite"}
    assert not results.keys() & {"joint-limits", "speed", "duration"}
    assert one(athlete, start, "WAIT", None, None, 1.0)["finite"].text == "all numbers are finite"


@pytest.mark.parametrize("seconds", [-1.0, -1e-9, 0.0, 1e-9, 2.0])
def test_a_duration_is_not_negative(athlete, start, seconds):
    result = one(athlete, start, "WAIT", None, None, seconds)["duration"]
    assert (result.holds, result.margin) == (seconds >= 0, seconds)
    assert result.text == f"{seconds:z.3f} s"


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_joint_may_be_at_its_limit_but_not_beyond(athlete, start, joint, side):
    limit, inwards = getattr(athlete, side)[6 * LEG + joint], 1.0 if side == "lower" else -1.0
    for spare in (-1e-3, 0.0, 1e-3):
        q = start[OWN].copy()
        q[joint] = limit + inwards * spare
        result = one(athlete, start, "LEG_MOVE", LEG, q, 99.0)["joint-limits"]
        assert result.holds == (spare >= 0)
        least = min(np.min(q - athlete.lower[OWN]), np.min(athlete.upper[OWN] - q))
        assert result.margin == pytest.approx(least, abs=1e-12)
        assert result.margin == pytest.approx(spare, abs=1e-12)
        name = athlete.joint_names[6 * LEG + joint]
        assert result.text.split(" at ")[0] in name
        assert f"{athlete.lower[6 * LEG + joint]:.4f}" in result.text
        whole = start.copy()
        whole[OWN] = q
        of_all = one(athlete, start, "POSTURE_MOVE", None, whole, 99.0)["joint-limits"]
        assert of_all.holds == result.holds
        assert of_all.margin == pytest.approx(result.margin, abs=1e-12)
        assert of_all.text.startswith(f"{name} at ")


def test_no_joint_is_faster_than_its_limit_from_where_the_row_before_left_it(athlete, start):
    """Against seconds that are added up joint by joint."""
    first, second = start[OWN] + 0.05, start[OWN] + np.array([0.3, -0.2, 0.1, 0.4, -0.1, 0.2])
    needed = max(abs(second[i] - first[i]) / athlete.speed_limits[6 * LEG + i] for i in range(6))
    for spare, holds in ((0.0, True), (0.5, True), (-0.9 * SPEED_TOLERANCE, True), (-1e-8, False), (-0.1, False)):
        rows = Command("LEG_MOVE", LEG, first, 9.0), Command("LEG_MOVE", LEG, second, needed + spare)
        result = asked(athlete, start, *rows)["speed"]
        assert result.holds is holds, spare
        assert result.margin == pytest.approx(spare, abs=1e-12)
        assert result.text == f"takes {needed + spare:.3f} s, the speed limits need {needed:.3f} s"


def test_a_row_that_moves_nothing_may_miss_the_least_time_by_rounding(athlete, start):
    result = one(athlete, start, "LEG_MOVE", LEG, start[OWN], -SPEED_TOLERANCE)["speed"]
    assert (result.holds, result.margin) == (True, -SPEED_TOLERANCE)


@pytest.mark.parametrize("over", ["check_motion", "check_yielding"])
def test_what_is_asked_over_a_terrain_is_asked_with_the_settings_or_with_those_that_there_are(
    athlete, start, monkeypatch, over
):
    asked_with = []

    def check(*args):
        asked_with.append(args[-1])
        return [RuleResult("balance", 0, True, 1.0, "m", "")]

    monkeypatch.setattr(rules, over, check)
    monkeypatch.setattr(rules, "passages", lambda *args: [SimpleNamespace(after=start)])
    ground: Any = "a terrain" if over == "check_motion" else None
    sags: Any = None if ground else "a prediction"
    own = SequenceSettings(speed_fraction=0.5)
    for settings in (own, None):
        told = {"dem": ground, "yielding": sags, "settings": settings}
        results = asked(athlete, start, Command("LEG_MOVE", LEG, start[OWN], 9.0), **told)
        assert results["balance"].holds
    given, default = asked_with
    assert given is own
    assert default.digest == SequenceSettings().digest


def test_where_set_points_are_told_the_speed_counts_from_them(athlete, start):
    q = start[OWN] + 0.2
    points = np.array([start, start])
    points[0, OWN] = q
    result = asked(athlete, start, Command("LEG_MOVE", LEG, q, 0.0), set_points=points)["speed"]
    assert (result.holds, result.margin) == (True, 0.0)
    assert not asked(athlete, start, Command("LEG_MOVE", LEG, q, 0.0))["speed"].holds


def test_a_lowering_ends_by_a_force_above_zero_and_up_to_the_weight(athlete, start):
    weight = athlete.mass * GRAVITY
    for force, holds in (
        (-1.0, False),
        (0.0, False),
        (1e-6, True),
        (0.6 * weight, True),
        (weight, True),
        (weight + 1e-6, False),
    ):
        result = one(athlete, start, "LEG_LOWER", LEG, start[OWN], 9.0, force=force)["force"]
        assert result.holds is holds, force
        assert result.margin == pytest.approx(min(force, weight - force), abs=1e-9)
        assert f"{force:.1f} N" in result.text
        assert f"{weight:.0f} N" in result.text
    needs = one(athlete, start, "LEG_LOWER", LEG, start[OWN], 9.0)["force"]
    assert (needs.holds, isnan(needs.margin)) == (False, True)
    assert "needs the force" in needs.text
    for name, leg, joints in (("LEG_MOVE", LEG, start[OWN]), ("WAIT", None, None), ("POSTURE_MOVE", None, start)):
        result = one(athlete, start, name, leg, joints, 9.0, force=5.0)["force"]
        assert (result.holds, isnan(result.margin), result.unit) == (False, True, "N")
        assert result.text == f"{name} waits for no force: its force is None"
