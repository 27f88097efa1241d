"""A leg that is lowered until it meets the ground: what is predicted, and what its rules refuse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.maps.standing import wheel_gaps
from footfall.planning.body.body_shift import PredictedState
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.sequence.motion import DEEPEST
from footfall.sequence.passage import passages
from footfall.sequence.rules import check_rules
from tests.sequence.test_posture_move import state_of
from tests.support.chassis_ground import lifted

LEG = 2
OWN = slice(6 * LEG, 6 * LEG + 6)


@pytest.fixture(scope="module")
def state(athlete, flat, hand_plan):
    """The chassis low enough that a leg reaches well under the ground."""
    low = footfall.shifted_state(athlete, flat, state_of(hand_plan), footfall.BodyShift(dz=-0.4))
    assert isinstance(low, PredictedState)
    return low


def height_of(robot, state, height: float) -> np.ndarray:
    """Joints of the leg with its wheel straight above (or below) where it stands."""
    return lifted(robot, state, [LEG], height).posture[OWN]


def lower(robot, state, height: float, force: float | None = 300.0) -> Command:
    return Command("LEG_LOWER", LEG, height_of(robot, state, height), 60.0, "lower", force)


def joints_of(command: Command) -> np.ndarray:
    assert command.joints is not None
    return command.joints


def up(robot, state, height: float = 0.06) -> Command:
    return Command("LEG_MOVE", LEG, height_of(robot, state, height), 60.0, "lift")


def broken(robot, state, commands, dem) -> set[tuple[str, int]]:
    results = check_rules(robot, tuple(commands), state.posture, state.T_site_base, dem)
    return {(result.rule, result.row) for result in results if not result.holds}


def raised(dem, by: float):
    return replace(dem, heights=np.asarray(dem.heights) + np.float32(by))


def test_it_ends_where_the_wheel_meets_the_ground(athlete, flat, state):
    commands = (up(athlete, state), lower(athlete, state, -0.08))
    assert broken(athlete, state, commands, flat) == set()
    _, row = passages(athlete, state.posture, state.T_site_base, commands, flat)
    gap = wheel_gaps(athlete, flat, row.after, state.T_site_base, [LEG])[0]
    assert -1e-6 < gap <= 0
    assert np.array_equal(row.target[OWN], joints_of(commands[1]))
    assert np.abs(row.after - state.posture).max() < 0.02
    # without a terrain nothing is met
    assert np.array_equal(
        passages(athlete, state.posture, state.T_site_base, commands)[1].after[OWN], joints_of(commands[1])
    )


@settings(max_examples=10)
@given(ground=st.floats(-0.05, 0.12), deep=st.floats(0.0, 0.1))
def test_no_place_before_it_is_on_the_ground(athlete, flat, state, ground, deep):
    """Against a dense look along the way, and the height of the ground itself."""
    here = raised(flat, ground)
    start = state.posture.copy()
    start[OWN] = height_of(athlete, state, 0.2)
    command = lower(athlete, state, ground - deep)
    (row,) = passages(athlete, start, state.T_site_base, (command,), here)
    shares = np.linspace(0.0, 1.0, 400)
    way = start + shares[:, None] * (row.target - start)
    gaps = np.array([wheel_gaps(athlete, here, posture, state.T_site_base, [LEG])[0] for posture in way])
    reached = np.linalg.norm(row.after - start) / np.linalg.norm(row.target - start)
    assert (gaps[shares < reached - 1e-9] > 0).all()
    if (gaps <= 0).any():
        assert wheel_gaps(athlete, here, row.after, state.T_site_base, [LEG])[0] == pytest.approx(0.0, abs=1e-6)
    else:
        assert np.array_equal(row.after, row.target)


def test_the_next_row_starts_where_the_wheel_met_the_ground(athlete, flat, state):
    higher = raised(flat, 0.1)
    again = up(athlete, state)
    commands = (up(athlete, state), lower(athlete, state, 0.02), again)
    way = passages(athlete, state.posture, state.T_site_base, commands, higher)
    assert np.array_equal(way[2].before, way[1].after)
    travel = np.abs(way[2].before[OWN] - joints_of(again))
    needed = float((travel / athlete.speed_limits[OWN]).max())
    results = check_rules(athlete, commands, state.posture, state.T_site_base, higher)
    (speed,) = [result for result in results if (result.rule, result.row) == ("speed", 2)]
    assert speed.margin == pytest.approx(again.duration - needed, abs=1e-9)
    # the row itself may take as long as its whole way needs
    (own,) = [result for result in results if (result.rule, result.row) == ("speed", 1)]
    whole = np.abs(way[1].target - way[1].before)[OWN]
    assert own.margin == pytest.approx(60.0 - float((whole / athlete.speed_limits[OWN]).max()), abs=1e-9)


def test_its_set_point_lies_at_most_a_little_under_the_ground(athlete, flat, state):
    good = [up(athlete, state), lower(athlete, state, 0.01 - DEEPEST)]
    deep = [good[0], lower(athlete, state, -0.01 - DEEPEST)]
    assert ("terrain-collision", 1) not in broken(athlete, state, good, flat)
    results = check_rules(athlete, tuple(deep), state.posture, state.T_site_base, flat)
    (told,) = [result for result in results if (result.rule, result.row) == ("terrain-collision", 1)]
    assert not told.holds
    assert told.margin == pytest.approx(-0.01, abs=0.002)
    assert "set point" in told.text


def test_it_drags_no_wheel_along_the_ground(athlete, flat, state):
    aside = lower(athlete, state, -0.05)
    joints = joints_of(aside).copy()
    joints[0] += 0.1
    # 0.1 rad at the hip while the wheel is lowered from 0.2 m: where it is in the air that is no dragging
    assert broken(athlete, state, [up(athlete, state), replace(aside, joints=joints)], flat) <= {("no-drag", 1)}
    assert broken(athlete, state, [replace(aside, joints=joints)], flat) == {("no-drag", 0)}


def test_a_leg_that_meets_nothing_ends_in_the_air(athlete, flat, state):
    commands = [up(athlete, state), lower(athlete, state, 0.1)]
    assert broken(athlete, state, commands, flat) == {("ends-on-ground", 1)}
    # where the ground is missing under this wheel alone
    heights = np.array(flat.heights)
    foot = apply(state.T_site_base, wheel_centers(athlete, state.posture)[LEG])[:2]
    heights[np.linalg.norm(flat.geometry.centers() - foot, axis=2) < 0.6] = -0.2
    onto_nothing = [commands[0], lower(athlete, state, -0.02)]
    assert broken(athlete, state, onto_nothing, replace(flat, heights=heights)) == {("ends-on-ground", 1)}


def test_the_force_is_a_rule(athlete, flat, state):
    weight = athlete.mass * 9.81
    for force, holds in [
        (1e-3, True),
        (weight, True),
        (0.0, False),
        (-1.0, False),
        (1.01 * weight, False),
        (None, False),
    ]:
        found = broken(athlete, state, [up(athlete, state), lower(athlete, state, -0.05, force)], flat)
        assert found == (set() if holds else {("force", 1)}), force
    assert broken(athlete, state, [replace(up(athlete, state), force=5.0)], None) == {("force", 0)}
    assert broken(athlete, state, [lower(athlete, state, -0.05, float("nan"))], None) == {("finite", 0)}
    assert broken(athlete, state, [Command("WAIT", None, None, 1.0, "", 5.0)], None) == {("force", 0)}
    with pytest.raises(InvalidSequence, match="newtons"):
        lower(athlete, state, 0.0, "300")  # type: ignore[arg-type]


def test_edits_of_a_lowering_keep_its_force(athlete, flat, state, hand_plan):
    made = make_sequence(hand_plan, athlete, flat)
    last = len(made.commands) - 1
    joints = joints_of(made.commands[last]).copy()
    joints[1] += 0.01
    seen = apply_edit(athlete, made, Edit("set", last, command=Command("LEG_LOWER", LEG, joints, 9.0, "", 250.0)), flat)
    assert seen.valid, seen.failures
    assert not np.array_equal(seen.predicted[last][OWN], joints)
    slower = apply_edit(athlete, seen, Edit("duration", last, number=20.0), flat)
    halves = apply_edit(athlete, slower, Edit("split", last), flat)
    turned = apply_edit(athlete, halves, Edit("joint", last, joint=1, number=float(joints[1])), flat)
    for edited in (slower, halves, turned):
        assert {one.force for one in edited.commands[last:]} == {250.0}
        assert {one.name for one in edited.commands[last:]} == {"LEG_LOWER"}
    assert halves.valid, halves.failures
    np.testing.assert_allclose(halves.predicted[-1], seen.predicted[-1], atol=1e-6)
