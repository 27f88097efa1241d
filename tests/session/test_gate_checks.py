"""What is checked before rows go, each check at the edge of its bound, in the order in which they are asked."""

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from footfall.core.errors import CommandRefused
from footfall.core.frames import rotation, transform
from footfall.core.value import Provenance
from footfall.sequence.commands import Command, RuleResult, Sequence
from footfall.session.gate.checks import (
    CARRIED_OUT,
    MOVED_ON,
    POSE_TOLERANCE,
    STALE_AFTER,
    START_TOLERANCE,
    WEIGHT_TOLERANCE,
    Facts,
    pose_difference,
    require_fit,
    require_fit_to_go_on,
    worst_joint,
)
from footfall.telemetry.state import RobotState, TelemetryFrame

NAMES = tuple(f"joint{i}" for i in range(36))
START = np.linspace(-0.4, 0.5, 36)
T_SITE_BASE = transform(rotation("z", np.array(0.3)), (2.0, -1.0, 1.5))
WEIGHT = 5000.0
MOVE = Command("LEG_MOVE", 0, START[:6] + 0.1, 1.0)
AFTER = np.array([np.concatenate([START[:6] + 0.1 * (i + 1), START[6:]]) for i in range(3)])
SEQUENCE = Sequence("r", (MOVE,) * 3, START, AFTER, T_SITE_BASE, (), Provenance({}))
OFF = 1e-6
"""Beyond a bound."""


def frame(posture=START, T=T_SITE_BASE, borne=WEIGHT, mode="idle", robot="r", commanded=None) -> TelemetryFrame:
    forces = np.zeros((6, 3))
    forces[:, 2] = borne / 6
    state = RobotState(robot, 0.0, posture, T, forces, np.zeros(36), mode)
    return TelemetryFrame(0, state, posture if commanded is None else commanded)


FACTS = Facts(True, frame(), 0.5, "dem", "dem", WEIGHT)


def fits(facts: Facts = FACTS, sequence: Any = SEQUENCE) -> None:
    require_fit(sequence, facts, NAMES)


def goes_on(row: int, facts: Facts, sequence: Any = SEQUENCE) -> None:
    require_fit_to_go_on(sequence, row, facts, NAMES)


def refusal(check, act, *args) -> CommandRefused:
    with pytest.raises(CommandRefused) as caught:
        act(*args)
    assert caught.value.details["check"] == check
    return caught.value


def told(**changes) -> Facts:
    return replace(FACTS, frame=frame(**changes))


def test_a_sequence_that_fits_is_let_through():
    fits()
    goes_on(0, FACTS)
    for row in (1, 2):
        goes_on(row, told(posture=AFTER[row - 1]))


def test_a_broken_rule_and_an_empty_sequence_are_refused_by_name():
    for row, whose in ((-1, "the sequence"), (0, "row 1"), (2, "row 3")):
        rule = RuleResult("speed", row, False, -1.0, "s", "too fast")
        error = refusal("rules", fits, FACTS, replace(SEQUENCE, rules=(rule,)))
        assert error.message == f"{whose} breaks speed: too fast"
        assert (error.details["row"], error.details["rule"]) == (row, "speed")
    nothing = Sequence("r", (), START, np.zeros((0, 36)), T_SITE_BASE, (), Provenance({}))
    assert "no commands" in refusal("rules", fits, FACTS, nothing).message


def test_no_rover_none_that_was_heard_and_none_that_was_heard_lately():
    refusal("link", fits, replace(FACTS, connected=False))
    refusal("telemetry", fits, replace(FACTS, frame=None))
    refusal("telemetry", fits, replace(FACTS, age=None))
    fits(replace(FACTS, age=STALE_AFTER))
    error = refusal("telemetry", fits, replace(FACTS, age=STALE_AFTER + OFF))
    assert (error.details["age"], error.details["limit"]) == (STALE_AFTER + OFF, STALE_AFTER)


def test_what_is_fresh():
    assert FACTS.fresh
    assert replace(FACTS, age=STALE_AFTER).fresh
    assert not replace(FACTS, age=STALE_AFTER + OFF).fresh
    assert not replace(FACTS, age=None).fresh
    assert not replace(FACTS, connected=False).fresh


@pytest.mark.parametrize("act", [fits, lambda facts: goes_on(1, replace(facts, frame=_moved(facts.frame)))])
def test_another_rover_one_that_is_busy_and_another_ground_are_refused(act):
    assert "the rover is s" in refusal("robot", act, told(robot="s")).message
    assert "clear the stop" in refusal("mode", act, told(mode="stopped")).message
    moving = refusal("mode", act, told(mode="moving"))
    assert moving.message == "the rover is moving; it must be idle"
    for dem, planned_on in (("later", "dem"), (None, "dem"), ("dem", None), (None, None)):
        error = refusal("terrain", act, replace(FACTS, dem=dem, planned_on=planned_on))
        assert (error.details["planned_on"], error.details["present"]) == (planned_on, dem)


def _moved(of: TelemetryFrame | None) -> TelemetryFrame:
    assert of is not None
    return replace(of, state=replace(of.state, posture=AFTER[0]))


@pytest.mark.parametrize("joint", [0, 17, 35])
@pytest.mark.parametrize("sign", [-1, 1])
def test_every_joint_stands_where_the_rows_before_left_it(joint, sign):
    for row, expected in ((0, START), (1, AFTER[0]), (2, AFTER[1])):
        near, far = (expected.copy() for _ in range(2))
        near[joint] += sign * (START_TOLERANCE - OFF)
        far[joint] += sign * (START_TOLERANCE + OFF)
        goes_on(row, told(posture=near))
        error = refusal("start", goes_on, row, told(posture=far))
        assert error.details["joint"] == NAMES[joint]
        assert error.details["difference"] == pytest.approx(sign * (START_TOLERANCE + OFF))
        assert error.details["limit"] == START_TOLERANCE
        where = f"where row {row + 1} starts" if row else "where the sequence starts"
        assert error.message.startswith(f"{NAMES[joint]} of the rover is {sign * 0.01:+.4f} rad from {where}; ")
        assert error.message.endswith("rad are accepted")


def test_a_joint_that_is_no_number_and_another_number_of_joints_do_not_pass():
    broken = START.copy()
    broken[3] = nan
    unknown: Any = SimpleNamespace(frame=SimpleNamespace(state=SimpleNamespace(posture=broken)))
    assert np.isnan(worst_joint(START, unknown.frame.state, NAMES)[1])
    for number in (nan, inf):
        state: Any = replace(FACTS, frame=_with_posture(START * 0 + number))
        refusal("start", fits, state)
    error = refusal("start", fits, replace(FACTS, frame=_with_posture(START[:30])))
    assert error.message.startswith("the number of joints of the rover is +inf rad")
    assert worst_joint(START, _with_posture(START[:30]).state, NAMES) == ("the number of joints", inf)
    moved = START.copy()
    moved[[4, 9]] += (0.2, -0.3)
    assert worst_joint(START, _with_posture(moved).state, NAMES) == ("joint9", pytest.approx(-0.3))


def _with_posture(posture) -> Any:
    """A frame such as a rover may send that does not keep to what it says it is."""
    state = SimpleNamespace(
        robot="r", mode="idle", posture=posture, T_site_base=T_SITE_BASE, wheel_forces=np.zeros((6, 3))
    )
    return SimpleNamespace(state=state, commanded=posture)


def resting(set_points) -> Any:
    """A sequence of a rover that sags."""
    return SimpleNamespace(
        robot="r",
        commands=SEQUENCE.commands,
        failures=(),
        start=START,
        predicted=AFTER,
        poses=np.array([T_SITE_BASE] * 3),
        T_site_base=T_SITE_BASE,
        at_rest=SimpleNamespace(set_points=set_points),
        set_points_before=lambda row: AFTER[row - 1] + 0.3,
    )


def test_of_a_rover_that_sags_the_set_points_are_asked():
    """Where it stands besides, as it starts; where it is told to be alone, once it moved."""
    points = START + 0.2
    sags = resting(points)
    fits(told(commanded=points), sags)
    error = refusal("set-points", fits, told(commanded=points - 2 * START_TOLERANCE), sags)
    assert error.message.startswith("the set point of joint")
    assert error.message.endswith("plan the execution again")
    assert "of the rover" not in error.message
    refusal("start", fits, told(posture=START + 0.02, commanded=points), sags)
    anywhere = START + 0.7
    goes_on(2, told(posture=anywhere, commanded=AFTER[1] + 0.3), sags)
    error = refusal("start", goes_on, 2, told(posture=anywhere, commanded=AFTER[1] + 0.32), sags)
    assert error.message.startswith("the set point of joint")
    assert "where row 3 starts" in error.message


def test_a_leg_that_was_lowered_until_it_touched_is_not_asked_where_it_is():
    lower = Command("LEG_LOWER", 2, START[12:18], 1.0, force=50.0)
    sequence = replace(SEQUENCE, commands=(MOVE, lower, MOVE))
    leg2 = AFTER[1].copy()
    leg2[12:18] += 0.4
    goes_on(2, told(posture=leg2), sequence)
    # before it was lowered it is asked, and so are the others
    refusal("start", goes_on, 1, told(posture=np.concatenate([AFTER[0][:12], leg2[12:18], AFTER[0][18:]])), sequence)
    for joint in (11, 18):
        wrong = leg2.copy()
        wrong[joint] += 0.02
        assert refusal("start", goes_on, 2, told(posture=wrong), sequence).details["joint"] == NAMES[joint]
    error = refusal("start", goes_on, 2, replace(FACTS, frame=_with_posture(START[:30])), sequence)
    assert "the number of joints" in error.message


@pytest.mark.parametrize(
    "again", [Command("LEG_MOVE", 2, AFTER[2][12:18], 1.0), Command("POSTURE_MOVE", None, AFTER[2], 1.0)]
)
def test_a_leg_that_was_lowered_is_asked_again_once_it_was_moved_again(again):
    lower = Command("LEG_LOWER", 2, START[12:18], 1.0, force=50.0)
    commands = (lower, again, Command("WAIT", None, None, 1.0), MOVE)
    sequence = replace(SEQUENCE, commands=commands, predicted=np.vstack([AFTER, AFTER[2:]]))
    for row in (2, 3):
        posture = sequence.predicted[row - 1].copy()
        goes_on(row, told(posture=posture), sequence)
        posture[14] += 0.02
        assert refusal("start", goes_on, row, told(posture=posture), sequence).details["joint"] == NAMES[14]


def test_the_chassis_may_have_moved_by_its_tolerance_in_all_directions_and_turns():
    for row, posture in ((0, START), (1, AFTER[0])):
        for along in np.vstack([np.eye(3), -np.eye(3)]):
            for far in (POSE_TOLERANCE - OFF, POSE_TOLERANCE + OFF):
                T = T_SITE_BASE.copy()
                T[:3, 3] += far * along
                facts = told(posture=posture, T=T)
                if far < POSE_TOLERANCE:
                    goes_on(row, facts)
                else:
                    error = refusal("pose", goes_on, row, facts)
                    assert error.details["difference"] == pytest.approx(far)
                    assert error.details["limit"] == POSE_TOLERANCE
    for axis in "xyz":
        for angle, holds in ((0.045, True), (0.055, False), (-0.055, False)):
            turned = T_SITE_BASE @ transform(rotation(axis, np.array(angle)))
            if holds:
                fits(told(T=turned))
            else:
                refusal("pose", fits, told(T=turned))


def test_the_pose_is_that_of_the_row_that_is_due():
    moved = T_SITE_BASE.copy()
    moved[0, 3] += 0.3
    later: Any = SimpleNamespace(
        robot="r",
        commands=SEQUENCE.commands,
        predicted=AFTER,
        at_rest=None,
        poses=np.array([moved, T_SITE_BASE, T_SITE_BASE]),
    )
    goes_on(1, told(posture=AFTER[0], T=moved), later)
    refusal("pose", goes_on, 1, told(posture=AFTER[0]), later)
    goes_on(2, told(posture=AFTER[1]), later)


def test_how_far_a_pose_is_from_another_bounds_every_point_within_a_metre(rng):
    for _ in range(50):
        T = T_SITE_BASE @ transform(
            rotation("x", rng.normal(0, 0.3)) @ rotation("y", rng.normal(0, 0.3)), rng.normal(0, 0.2, 3)
        )
        points = rng.normal(size=(200, 3))
        points /= np.maximum(1.0, np.linalg.norm(points, axis=1))[:, None]
        moved = (points @ T[:3, :3].T + T[:3, 3]) - (points @ T_SITE_BASE[:3, :3].T + T_SITE_BASE[:3, 3])
        bound = pose_difference(T_SITE_BASE, T)
        farthest = np.linalg.norm(moved, axis=1).max()
        assert farthest <= bound + 1e-9
        assert bound <= 2.5 * farthest
    assert pose_difference(T_SITE_BASE, T_SITE_BASE) == 0.0


def test_the_wheels_bear_what_was_planned_with_or_say_nothing():
    for row, posture in ((0, START), (2, AFTER[1])):
        for share in (1 - WEIGHT_TOLERANCE + OFF, 1.0, 1 + WEIGHT_TOLERANCE - OFF):
            goes_on(row, told(posture=posture, borne=share * WEIGHT))
        for share in (1 - WEIGHT_TOLERANCE - OFF, 1 + WEIGHT_TOLERANCE + OFF, 2.0, 0.2):
            error = refusal("load", goes_on, row, told(posture=posture, borne=share * WEIGHT))
            assert error.details["borne"] == pytest.approx(share * WEIGHT)
            assert (error.details["planned_with"], error.details["limit"]) == (WEIGHT, WEIGHT_TOLERANCE)
    assert "+100% against the 5000 N" in refusal("load", fits, told(borne=2 * WEIGHT)).message
    fits(told(borne=0.0))
    fits(replace(told(borne=2 * WEIGHT), weight=None))


def test_forces_count_in_whatever_direction_the_site_has_them():
    tilted = np.zeros((6, 3))
    tilted[:, 0], tilted[:, 2] = 0.6 * WEIGHT / 6, 0.8 * WEIGHT / 6
    state = replace(frame().state, wheel_forces=tilted)
    fits(replace(FACTS, frame=replace(frame(), state=state)))


def test_commands_that_were_carried_out_are_told_as_that_where_it_explains_the_refusal():
    done = replace(told(posture=AFTER[2]), carried_out=True)
    error = refusal("start", fits, done)
    assert error.message.startswith(f"{CARRIED_OUT}: joint")
    assert error.details["difference"] == pytest.approx(0.3)
    assert not refusal("start", fits, replace(done, carried_out=False)).message.startswith(CARRIED_OUT)
    heavier = replace(told(borne=2 * WEIGHT), carried_out=True)
    assert not refusal("load", fits, heavier).message.startswith(CARRIED_OUT)
    assert MOVED_ON == ("terrain", "start", "set-points", "pose")
    fits(replace(FACTS, carried_out=True))


def test_the_chassis_of_a_small_robot_may_have_moved_by_the_same_share_of_its_legs():
    small = replace(FACTS, reach=0.1)
    for far, angle in ((POSE_TOLERANCE - OFF, 0.045), (POSE_TOLERANCE + OFF, 0.055)):
        shifted, turned = T_SITE_BASE.copy(), T_SITE_BASE @ transform(rotation("z", np.array(angle)))
        shifted[0, 3] += 0.1 * far
        for T in (shifted, turned):
            facts = replace(small, frame=frame(T=T))
            if far < POSE_TOLERANCE:
                fits(facts)
                continue
            error = refusal("pose", fits, facts)
            assert error.details["limit"] == pytest.approx(0.1 * POSE_TOLERANCE)
            assert "at most 0.005 m are accepted" in error.message


def test_joints_that_slide_are_compared_by_their_way_and_told_in_metres():
    small, posture = replace(FACTS, reach=0.1, sliding=(NAMES[4],)), START.copy()
    posture[[3, 4]] += 0.5 * START_TOLERANCE, 0.09 * START_TOLERANCE
    fits(replace(small, frame=frame(posture=posture)))
    posture[4] = START[4] + 0.2 * START_TOLERANCE
    error = refusal("start", fits, replace(small, frame=frame(posture=posture)))
    assert error.message.startswith("joint4 of the rover is +0.0020 m from where the sequence starts; at most 0.001 m")
