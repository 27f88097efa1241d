"""Moves of all legs: the chassis follows the standing feet, and every rule fails when, and only when, it is broken."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import footfall
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.core.value import Provenance, flatten, unflatten
from footfall.planning.body.body_shift import PredictedState
from footfall.planning.body.follow import DRIFT
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.sequence.motion import MOTION_RULES
from footfall.sequence.passage import carried, passages
from footfall.sequence.rules import check_rules
from footfall.sequence.sampled import samples
from footfall.telemetry.state import RobotState
from tests.support.chassis_ground import lifted

SHIFT = footfall.BodyShift(dx=0.08, dz=-0.1, dyaw=0.05)
SHIFTS = st.tuples(*(st.floats(-0.08, 0.08) for _ in range(6)))


def state_of(plan) -> RobotState:
    n = len(plan.waypoints[0]) // 6
    forces, torques = np.zeros((n, 3)), np.zeros(6 * n)
    return RobotState("athlete", 0.0, plan.waypoints[0], plan.T_site_base, forces, torques, "idle")


@pytest.fixture(scope="module")
def state(hand_plan):
    return state_of(hand_plan)


@pytest.fixture(scope="module")
def low(athlete, flat, state):
    """The chassis low enough that a leg reaches under the ground."""
    shifted = footfall.shifted_state(athlete, flat, state, footfall.BodyShift(dz=-0.4))
    assert isinstance(shifted, PredictedState)
    return shifted


@pytest.fixture(scope="module")
def move(athlete, flat, state) -> BodyMovePlan:
    result = footfall.plan_body_move(athlete, flat, state, SHIFT, BodyMoveSettings(least_margin=0.1))
    assert result.plan is not None, result.reason
    return result.plan


@pytest.fixture(scope="module")
def made(athlete, flat, move) -> Sequence:
    return make_sequence(move, athlete, flat)


def broken(robot, state, commands, dem) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for result in check_rules(robot, tuple(commands), state.posture, state.T_site_base, dem):
        if not result.holds:
            found.setdefault(result.rule, []).append(result.row)
    return found


def whole(posture, duration: float = 60.0) -> Command:
    return Command("POSTURE_MOVE", None, np.asarray(posture, float), duration)


def test_commands_follow_the_waypoints_and_the_chassis_the_plan(athlete, move, made):
    assert made.valid, made.failures
    assert len(made.commands) == len(move.waypoints) - 1
    for row, command in enumerate(made.commands):
        assert (command.name, command.leg, command.force, command.phase) == ("POSTURE_MOVE", None, None, "shift")
        assert np.array_equal(command.joints, move.waypoints[row + 1])
        speeds = np.abs(move.waypoints[row + 1] - move.waypoints[row]) / command.duration
        assert np.max(speeds / athlete.speed_limits) == pytest.approx(0.8, rel=1e-12)
    assert np.array_equal(made.start, move.waypoints[0])
    assert np.array_equal(made.T_site_base, move.Ts_site_base[0])
    assert np.array_equal(made.predicted, move.waypoints[1:])
    np.testing.assert_allclose(made.poses, move.Ts_site_base[1:], atol=1e-9)
    assert made.provenance.parents["plan"] == move.digest
    assert made.provenance.settings.least_margin == 0.1


def test_every_rule_of_motion_is_asked_of_every_row(made):
    asked = {(rule.rule, rule.row) for rule in made.rules}
    assert {(rule, row) for rule in MOTION_RULES[:-1] for row in range(len(made.commands))} <= asked
    assert ("all-joints", 0) in asked
    assert "ends-on-ground" not in {rule for rule, _ in asked}


def test_the_public_call_needs_no_terrain_for_a_move_of_the_chassis(athlete, move, made):
    alone = footfall.make_sequence(move)
    assert alone.valid
    assert np.array_equal(alone.poses, made.poses)
    with pytest.raises(InvalidSequence, match="robot=robot"):
        footfall.make_sequence(replace(move, provenance=Provenance({"robot": "0" * 32})))


def test_a_sequence_that_moves_the_chassis_survives_its_flat_form(made, sequence):
    again = unflatten(*flatten(made))
    assert again.digest == made.digest
    assert np.array_equal(again.Ts_site_base, made.Ts_site_base)
    # one that does not says nothing of it: what was stored before there were such moves keeps its digest
    assert sequence.Ts_site_base is None
    assert "Ts_site_base" not in str(flatten(sequence)[0])
    assert "force" not in str(flatten(sequence)[0])
    assert np.array_equal(sequence.poses, np.tile(sequence.T_site_base, (len(sequence.commands), 1, 1)))


@settings(max_examples=12)
@given(shift=SHIFTS)
def test_the_chassis_follows_the_feet_wherever_it_is_planned_to_go(athlete, flat, state, shift):
    result = footfall.plan_body_move(athlete, flat, state, footfall.BodyShift(*shift))
    if result.plan is None:
        return
    made = make_sequence(result.plan, athlete, flat)
    assert made.valid, made.failures
    np.testing.assert_allclose(made.poses, result.plan.Ts_site_base[1:], atol=1e-9)
    # between the waypoints the feet stay within what the planner allows them to drift
    stood = apply(state.T_site_base, wheel_centers(athlete, state.posture))
    for row in passages(athlete, made.start, made.T_site_base, made.commands, flat):
        for posture in samples(row.before, row.after, 0.02):
            T, _ = carried(athlete, row.T_before, row.before, posture, row.standing)
            away = apply(T, wheel_centers(athlete, posture)) - stood
            assert np.linalg.norm(away, axis=1).max() < DRIFT


@given(joints=st.lists(st.floats(-0.004, 0.004), min_size=36, max_size=36), legs=st.sets(st.integers(0, 5), min_size=3))
def test_the_pose_is_the_least_squares_one(athlete, state, joints, legs):
    """Against scipy's alignment of vectors about the middles, which weighs the same sum of squares."""
    now, legs = state.posture + np.array(joints), sorted(legs)
    T, holding = carried(athlete, state.T_site_base, state.posture, now, legs)
    if np.array_equal(now, state.posture):
        assert T is state.T_site_base
        return
    stood = apply(state.T_site_base, wheel_centers(athlete, state.posture))[holding]
    centers = wheel_centers(athlete, now)[holding]
    turn = Rotation.align_vectors(stood - stood.mean(axis=0), centers - centers.mean(axis=0))[0]
    np.testing.assert_allclose(T[:3, :3], turn.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(apply(T, centers).mean(axis=0), stood.mean(axis=0), atol=1e-9)


@pytest.mark.parametrize("up", [[0], [2], [0, 2, 4]])
def test_a_leg_that_is_drawn_up_does_not_carry(athlete, flat, state, up):
    raised = lifted(athlete, state, up, height=0.15)
    T, holding = carried(athlete, state.T_site_base, state.posture, raised.posture, range(6))
    np.testing.assert_allclose(T, state.T_site_base, atol=1e-9)
    assert holding == [leg for leg in range(6) if leg not in up]
    down_again = [whole(raised.posture), whole(state.posture)]
    assert broken(athlete, state, down_again, flat) == {}
    assert broken(athlete, state, down_again[:1], flat) == {"ends-on-ground": [0] * len(up)}


def test_fewer_than_three_wheels_carry_nothing(athlete, state):
    now = state.posture + 0.1
    assert carried(athlete, state.T_site_base, state.posture, now, [1, 4])[0] is state.T_site_base


def test_a_wheel_that_is_dragged_is_found(athlete, flat, state):
    turned = state.posture.copy()
    turned[6 * 3] += 0.05
    assert set(broken(athlete, state, [whole(turned)], flat)) == {"no-drag"}


def test_a_leg_that_pushes_the_rover_off_its_other_feet_is_found(athlete, flat, low):
    """On flat ground a leg that is stretched by 0.15 m leaves the rover on it and the two opposite it."""
    stretched = lifted(athlete, low, [1], height=-0.15)
    T, holding = carried(athlete, low.T_site_base, low.posture, stretched.posture, range(6))
    assert holding in ([1, 3, 4], [1, 4, 5])
    tilted = apply(T, wheel_centers(athlete, stretched.posture))[:, 2]
    assert tilted.min() > tilted[holding].min() - 1e-9
    assert np.ptp(tilted[holding]) < 0.02
    found = broken(athlete, low, [whole(stretched.posture)], flat)
    assert {"balance", "ends-on-ground"} <= set(found), found


def test_all_legs_stretched_by_as_much_raise_the_chassis(athlete, flat, low):
    stretched = lifted(athlete, low, range(6), height=-0.05)
    T, holding = carried(athlete, low.T_site_base, low.posture, stretched.posture, range(6))
    assert holding == list(range(6))
    np.testing.assert_allclose(T[:3, 3] - low.T_site_base[:3, 3], [0.0, 0.0, 0.05], atol=1e-9)
    assert broken(athlete, low, [whole(stretched.posture)], flat) == {}


def test_drawing_up_one_side_tips_the_rover(athlete, flat, state):
    one_side = lifted(athlete, state, [0, 1, 5], height=0.15)
    assert "balance" in broken(athlete, state, [whole(one_side.posture), whole(state.posture)], flat)


def test_legs_that_meet_are_found(athlete, flat, state):
    raised = lifted(athlete, state, [2], height=0.15)
    meeting = raised.posture.copy()
    meeting[12] += np.deg2rad(75)
    rows = [whole(raised.posture), whole(meeting), whole(raised.posture), whole(state.posture)]
    assert broken(athlete, state, rows, flat)["self-collision"] == [1, 2]


def test_a_chassis_that_is_let_down_onto_a_rock_is_found(athlete, flat, state, move):
    heights = np.array(flat.heights)
    away = np.linalg.norm(flat.geometry.centers() - state.T_site_base[:2, 3], axis=2)
    clear = athlete.description.clearances.chassis_terrain
    under = float(apply(state.T_site_base, athlete.description.meshes["base"].vertices)[:, 2].min())
    heights[away < 0.3] = under - clear - 0.05
    rock = replace(flat, heights=heights.astype(np.float32))
    commands = make_sequence(move, athlete).commands
    found = broken(athlete, state, commands, rock)
    assert set(found) == {"terrain-collision"}
    # 0.1 m down in all, 0.05 m of it are free
    assert 0 < min(found["terrain-collision"]) < len(commands) - 1


def test_the_rules_of_form(athlete, flat, state):
    beyond = state.posture.copy()
    beyond[13] = athlete.upper[13] + 1e-6
    nan = state.posture.copy()
    nan[7] = np.nan
    quick = state.posture.copy()
    quick[20] += 0.1
    cases = [
        (Command("POSTURE_MOVE", 2, state.posture, 9.0), {"leg-exists"}),
        (Command("POSTURE_MOVE", None, state.posture[:6], 9.0), {"all-joints"}),
        (Command("POSTURE_MOVE", None, None, 9.0), {"all-joints"}),
        (whole(nan), {"finite"}),
        (whole(beyond), {"joint-limits"}),
        (whole(quick, 0.9 * 0.1 / athlete.speed_limits[20]), {"speed"}),
        (Command("POSTURE_MOVE", None, state.posture, 9.0, "", 100.0), {"force"}),
    ]
    for command, rules in cases:
        results = check_rules(athlete, (command,), state.posture, state.T_site_base)
        assert {result.rule for result in results if not result.holds} == rules, command
    results = check_rules(athlete, (whole(beyond),), state.posture, state.T_site_base)
    assert any("leg2_hip_pitch" in result.text for result in results if result.rule == "joint-limits")


def test_what_comes_after_is_checked_where_the_chassis_then_is(athlete, flat, state, made):
    end = made.predicted[-1]
    raised = lifted(athlete, replace(state, posture=end), [2], height=0.2).posture
    step = [Command("LEG_MOVE", 2, raised[12:18], 60.0), Command("LEG_MOVE", 2, end[12:18], 60.0)]
    assert broken(athlete, state, [*made.commands, *step], flat) == {}
    # the joints with which the wheel stood before: the chassis is 0.1 m lower now
    wrong = Command("LEG_MOVE", 2, state.posture[12:18], 60.0)
    assert "terrain-collision" in broken(athlete, state, [*made.commands, step[0], wrong], flat)
    # and the way back is as good
    back = [whole(posture) for posture in [*made.predicted[-2::-1], made.start]]
    there_and_back = [*made.commands, *step, *back]
    assert broken(athlete, state, there_and_back, flat) == {}
    way = passages(athlete, state.posture, state.T_site_base, tuple(there_and_back), flat)
    np.testing.assert_allclose(way[-1].T_after, state.T_site_base, atol=1e-9)


def test_a_move_over_feet_on_unseen_ground_is_not_held_against_it(athlete, flat, state, made):
    """Cameras hardly ever see the ground under a standing wheel; one that never left it still stands."""
    heights = np.array(flat.heights)
    foot = apply(state.T_site_base, wheel_centers(athlete, state.posture)[4])[:2]
    heights[np.linalg.norm(flat.geometry.centers() - foot, axis=2) < 0.6] = np.nan
    assert broken(athlete, state, made.commands, replace(flat, heights=heights)) == {}


@settings(max_examples=10)
@given(row=st.integers(0, 3), fraction=st.floats(0.01, 0.99))
def test_a_split_row_goes_the_same_way(athlete, flat, made, row, fraction):
    split = apply_edit(athlete, made, Edit("split", row, number=fraction), flat)
    assert split.valid, split.failures
    assert split.duration == pytest.approx(made.duration, rel=1e-12)
    assert np.array_equal(split.predicted[row + 1], made.predicted[row])
    np.testing.assert_allclose(split.poses[row + 1], made.poses[row], atol=1e-6)
    np.testing.assert_allclose(split.poses[-1], made.poses[-1], atol=1e-6)


def test_edits_of_a_posture_move(athlete, flat, made):
    slow = apply_edit(athlete, made, Edit("duration", 0, number=9.0), flat)
    assert slow.valid
    assert np.array_equal(slow.poses, made.poses)
    angle = float(made.predicted[0, 13] + 0.2)
    turned = apply_edit(athlete, made, Edit("joint", 0, joint=13, number=angle), flat)
    assert turned.commands[0].joints is not None
    assert turned.commands[0].joints[13] == turned.predicted[0, 13] == angle
    assert not turned.valid
    with pytest.raises(InvalidSequence, match=r"0…35, leg by leg hip_yaw"):
        apply_edit(athlete, made, Edit("joint", 0, joint=36, number=0.0), flat)
    reordered = apply_edit(athlete, made, Edit("move", 0, to=3), flat)
    assert not np.array_equal(reordered.poses, made.poses)
    back = apply_edit(athlete, reordered, Edit("move", 3, to=0), flat)
    assert back.valid
    assert np.array_equal(back.poses, made.poses)


def test_without_the_terrain_nobody_knows_where_the_chassis_goes(athlete, made, sequence):
    with pytest.raises(InvalidSequence, match="needs the terrain"):
        apply_edit(athlete, made, Edit("duration", 0, number=9.0))
    with pytest.raises(InvalidSequence, match="needs the terrain"):
        apply_edit(athlete, sequence, Edit("insert", 0, command=made.commands[0]))
