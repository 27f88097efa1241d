"""Plans become commands; every rule fails when, and only when, it is broken."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance, flatten, unflatten
from footfall.planning.step.problem import StepPlan
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.make import make_sequence
from footfall.sequence.predict import predict
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from tests.support.wheel_depth import require_depth, rim_depth

MOTION_RULES = {"self-collision", "terrain-collision", "balance"}


def altered(plan: StepPlan, **changes) -> StepPlan:
    return StepPlan(**{name: getattr(plan, name) for name in plan.__dataclass_fields__} | changes)


def failing(robot, plan, commands, dem=None, settings=None) -> list[tuple[str, int]]:
    rules = check_rules(robot, tuple(commands), plan.waypoints[0], plan.T_site_base, dem, settings)
    return [(rule.rule, rule.row) for rule in rules if not rule.holds]


def test_commands_follow_the_waypoints(athlete, hand_plan, sequence):
    assert sequence.valid
    assert len(sequence.commands) == len(hand_plan.waypoints) - 1
    leg = slice(6 * hand_plan.leg, 6 * hand_plan.leg + 6)
    for row, command in enumerate(sequence.commands):
        assert command.name == "LEG_MOVE"
        assert command.leg == hand_plan.leg
        assert command.phase == hand_plan.phases[row + 1]
        assert np.array_equal(command.joints, hand_plan.waypoints[row + 1][leg])
    assert np.array_equal(sequence.predicted, hand_plan.waypoints[1:])
    assert sequence.provenance.parents["plan"] == hand_plan.digest


def test_durations_use_four_fifths_of_the_slowest_joint(athlete, hand_plan, sequence):
    leg = slice(6 * hand_plan.leg, 6 * hand_plan.leg + 6)
    for row, command in enumerate(sequence.commands):
        speeds = np.abs(hand_plan.waypoints[row + 1] - hand_plan.waypoints[row])[leg] / command.duration
        assert np.max(speeds / athlete.speed_limits[leg]) == pytest.approx(0.8, rel=1e-12)
    full = make_sequence(hand_plan, athlete, settings=SequenceSettings(speed_fraction=1.0))
    assert full.valid
    assert full.duration == pytest.approx(0.8 * sequence.duration, rel=1e-12)


def test_public_call_needs_the_plan_only(hand_plan, sequence):
    assert footfall.make_sequence(hand_plan).digest == sequence.digest
    foreign = altered(hand_plan, provenance=Provenance({"robot": "0" * 32}))
    with pytest.raises(InvalidSequence, match="robot=robot"):
        footfall.make_sequence(foreign)


def test_made_with_the_wrong_robot_is_refused(athlete, hand_plan):
    with pytest.raises(InvalidSequence, match="another robot"):
        make_sequence(altered(hand_plan, provenance=Provenance({"robot": "0" * 32})), athlete)


def test_a_plan_that_moves_two_legs_is_refused(athlete, hand_plan):
    waypoints = hand_plan.waypoints.copy()
    waypoints[3, 0] += 0.1
    with pytest.raises(InvalidSequence, match="more than its leg"):
        make_sequence(altered(hand_plan, waypoints=waypoints), athlete)


def test_plan_settings_carry_over(hand_plan, sequence):
    assert sequence.provenance.settings.least_margin == hand_plan.provenance.settings.least_margin


def test_a_sequence_survives_its_flat_form(sequence):
    again = unflatten(*flatten(sequence))
    assert isinstance(again, Sequence)
    assert again.digest == sequence.digest


def test_each_rule_finds_its_fault(athlete, hand_plan, sequence):
    good = list(sequence.commands)
    assert failing(athlete, hand_plan, good) == []
    assert failing(athlete, hand_plan, []) == [("not-empty", -1)]
    joints = good[1].joints
    beyond = joints.copy()
    beyond[0] = athlete.upper[12] + 1e-6
    nan = joints.copy()
    nan[3] = np.nan
    cases = [
        (Command("ARM_MOVE", 2, joints, 9.0), {"known-command"}),
        (Command("LEG_MOVE", 6, joints, 9.0), {"leg-exists"}),
        (Command("LEG_MOVE", -1, joints, 9.0), {"leg-exists"}),
        (Command("LEG_MOVE", None, joints, 9.0), {"leg-exists"}),
        (Command("LEG_MOVE", 2, joints[:5], 9.0), {"six-joints"}),
        (Command("LEG_MOVE", 2, None, 9.0), {"six-joints"}),
        (Command("LEG_MOVE", 2, nan, 9.0), {"finite"}),
        (Command("LEG_MOVE", 2, joints, np.inf), {"finite"}),
        (Command("LEG_MOVE", 2, beyond, 99.0), {"joint-limits"}),
        (Command("LEG_MOVE", 2, joints, good[1].duration / 2), {"speed"}),
        (Command("LEG_MOVE", 2, joints, -1.0), {"speed", "duration"}),
        (Command("WAIT", None, None, -0.5), {"duration"}),
        (Command("WAIT", 2, None, 1.0), {"leg-exists"}),
        (Command("WAIT", None, joints, 1.0), {"six-joints"}),
    ]
    for command, rules in cases:
        found = failing(athlete, hand_plan, [good[0], command])
        assert {row for _, row in found} == {1}, command
        assert {rule for rule, _ in found} == rules, command
    assert failing(athlete, hand_plan, [good[0], Command("WAIT", None, None, 2.0), *good[1:]]) == []


def test_wrong_types_are_no_command():
    for wrong in (
        lambda: Command("LEG_MOVE", True, None, 1.0),
        lambda: Command("LEG_MOVE", 1, [0.0] * 6, 1.0),  # type: ignore[arg-type]
        lambda: Command("WAIT", None, None, "2"),  # type: ignore[arg-type]
        lambda: Command("WAIT", None, None, False),
    ):
        with pytest.raises(InvalidSequence):
            wrong()


def test_start_must_fit_the_robot(athlete, hand_plan):
    with pytest.raises(InvalidSequence, match="36"):
        check_rules(athlete, (), hand_plan.waypoints[0][:30], hand_plan.T_site_base)


def test_the_step_keeps_the_rules_of_motion(athlete, hand_plan, flat):
    sequence = make_sequence(hand_plan, athlete, flat)
    assert sequence.valid, sequence.failures
    rows = {(rule.rule, rule.row) for rule in sequence.rules if rule.rule in MOTION_RULES}
    assert rows == {(rule, row) for rule in MOTION_RULES for row in range(len(sequence.commands))}
    assert sequence.provenance.parents["dem"] == flat.digest


def test_a_wheel_into_the_ground_is_found(athlete, hand_plan, flat):
    # straight from the start to the goal, but 8 degrees deeper at the hip
    joints = hand_plan.waypoints[-1][12:18].copy()
    joints[1] += np.deg2rad(8)
    found = failing(athlete, hand_plan, [Command("LEG_MOVE", 2, joints, 60.0)], flat)
    assert ("terrain-collision", 0) in found


@pytest.mark.parametrize("hip", [0.1, 0.14, 0.3])
def test_how_deep_a_wheel_gets_is_told_where_it_is_deepest(athlete, hand_plan, flat, hip):
    command = Command("LEG_MOVE", 2, hand_plan.waypoints[0][12:18] + np.array([0, hip, 0, 0, 0, 0]), 60.0)
    start, T_site_base = hand_plan.waypoints[0], hand_plan.T_site_base
    (found,) = [
        one
        for one in check_rules(athlete, (command,), start, T_site_base, flat)
        if one.rule == "terrain-collision" and not one.holds
    ]
    words = r"leg2_wheel cuts (\d\.\d{3}) m into terrain \(0\.030 m is allowed\) at 100% of the row, first at (\d+)% of"
    told = re.match(words, found.text)
    assert told, found.text
    after = start.copy()
    after[13] += hip
    require_depth(float(told[1]), athlete, flat, after, T_site_base, 2)
    assert found.margin == pytest.approx(0.03 - float(told[1]), abs=6e-4)
    # straight down from where it stands: it has sunk as far as it may when it first collides
    at = start.copy()
    at[13] += hip * int(told[2]) / 100
    assert rim_depth(athlete, flat, at, T_site_base, 2) == pytest.approx(0.03, abs=0.012)


def test_legs_that_meet_are_found(athlete, hand_plan, flat):
    joints = hand_plan.waypoints[2][12:18].copy()
    joints[0] += np.deg2rad(75)
    found = failing(athlete, hand_plan, [Command("LEG_MOVE", 2, joints, 60.0)], flat)
    assert ("self-collision", 0) in found


def test_lifting_every_second_leg_keeps_balance_but_two_neighbours_do_not(athlete, hand_plan, flat):
    def lift(leg: int) -> Command:
        joints = hand_plan.waypoints[0][6 * leg : 6 * leg + 6].copy()
        joints[1] -= np.deg2rad(10)
        return Command("LEG_MOVE", leg, joints, 60.0)

    assert ("balance", 2) not in failing(athlete, hand_plan, [lift(0), lift(2), lift(4)], flat)
    assert ("balance", 1) not in failing(athlete, hand_plan, [lift(0), lift(3)], flat)
    assert ("balance", 2) in failing(athlete, hand_plan, [lift(0), lift(1), lift(2)], flat)
    conservative = SequenceSettings(conservative=True)
    assert ("balance", 2) in failing(athlete, hand_plan, [lift(0), lift(2), lift(4)], flat, conservative)


@given(
    rows=st.lists(
        st.tuples(st.integers(0, 5), st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6)), min_size=1, max_size=6
    )
)
def test_prediction_is_what_was_last_told_each_leg(athlete, rows):
    start = athlete.posture("stand")
    commands = tuple(Command("LEG_MOVE", leg, np.array(joints), 60.0) for leg, joints in rows)
    predicted = predict(start, commands)
    for n in range(len(rows)):
        last = dict(rows[: n + 1])
        for leg in range(6):
            told = np.array(last[leg]) if leg in last else start[6 * leg : 6 * leg + 6]
            assert np.array_equal(predicted[n, 6 * leg : 6 * leg + 6], told)
