"""No way to a valid sequence whose motion is not good: dragging, holes, overload, feet in the air, no terrain given."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidSequence
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import leg_wheel_pose
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.sequence.motion import MOTION_RULES
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights

LEG = 2
OWN = slice(6 * LEG, 6 * LEG + 6)


def broken(robot, plan, commands, dem, settings=None) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for result in check_rules(robot, tuple(commands), plan.waypoints[0], plan.T_site_base, dem, settings):
        if not result.holds:
            found.setdefault(result.rule, []).append(result.row)
    return found


def around(dem: Dem, xy, radius: float, height: float) -> Dem:
    heights = np.array(dem.heights)
    heights[np.hypot(*(dem.geometry.centers() - np.asarray(xy)).transpose(2, 0, 1)) < radius] = height
    return from_heights(heights, dem.geometry.resolution, dem.geometry.x0, dem.geometry.y0, "changed")


def wheel(robot, plan, row: int) -> np.ndarray:
    return (plan.T_site_base @ leg_wheel_pose(robot, plan.waypoints[row, OWN], LEG))[:3, 3]


def test_every_rule_of_motion_is_asked_of_every_row_and_the_end_once(athlete, hand_plan, flat):
    made = make_sequence(hand_plan, athlete, flat)
    assert made.valid, made.failures
    rows = range(len(made.commands))
    asked = {(rule.rule, rule.row) for rule in made.rules}
    assert {(rule, row) for rule in MOTION_RULES[:-1] for row in rows} <= asked
    assert {row for rule, row in asked if rule == "ends-on-ground"} == {rows[-1]}


def test_the_swing_without_its_lift_drags_the_wheel(athlete, hand_plan, flat):
    made = make_sequence(hand_plan, athlete, flat)
    goal = made.commands[-1]
    along = []
    before = hand_plan.waypoints[0, OWN]
    # on the ground all the way: neither in it nor out of balance
    T_start, T_goal = (leg_wheel_pose(athlete, hand_plan.waypoints[row, OWN], LEG) for row in (0, -1))
    for t in np.linspace(0.1, 1.0, 10):
        T = T_start.copy()
        T[:3, 3] = T_start[:3, 3] + t * (T_goal[:3, 3] - T_start[:3, 3])
        found = solve_leg(athlete, LEG, T[None])
        near = found.q[0][found.valid[0]]
        before = near[np.argmin(np.abs(near - before).max(axis=1))]
        along.append(Command("LEG_MOVE", LEG, before, 60.0))
    failed = broken(athlete, hand_plan, along, flat)
    assert set(failed) == {"no-drag"}, failed
    # remembered from row to row: no single row moves it far
    assert len(failed["no-drag"]) == 10
    assert broken(athlete, hand_plan, [*made.commands[:-1], goal], flat) == {}


def test_unseen_ground_is_not_free_for_an_edited_motion(athlete, hand_plan, flat):
    middle = wheel(athlete, hand_plan, 4)[:2]
    # a wall of 0.7 m was seen behind a hole: what is in the hole may be as high
    out = middle / np.linalg.norm(middle)
    walled = around(flat, middle + 1.0 * out, 0.6, 0.7)
    commands = make_sequence(hand_plan, athlete).commands
    assert "terrain-collision" not in broken(athlete, hand_plan, commands, walled)
    assert "terrain-collision" in broken(athlete, hand_plan, commands, around(walled, middle, 0.5, np.nan))


def test_a_sequence_that_ends_in_the_air_says_how_high(athlete, hand_plan, flat):
    made = make_sequence(hand_plan, athlete, flat)
    cut = made
    for _ in range(3):
        cut = apply_edit(athlete, cut, Edit("delete", len(cut.commands) - 1), flat)
    assert [failure.rule for failure in cut.failures] == ["ends-on-ground"]
    assert cut.failures[0].row == len(cut.commands) - 1
    assert cut.failures[0].margin == pytest.approx(-0.15, abs=0.01)
    assert f"leg {LEG} ends 0.2" in cut.failures[0].text


def test_ending_over_unseen_ground_is_not_standing(athlete, hand_plan, flat):
    goal = wheel(athlete, hand_plan, -1)[:2]
    failed = broken(athlete, hand_plan, make_sequence(hand_plan, athlete).commands, around(flat, goal, 0.6, np.nan))
    assert "ends-on-ground" in failed


def test_feet_that_never_moved_but_hang_in_the_air_carry_nothing(athlete, hand_plan, flat):
    start = hand_plan.waypoints[0].copy()
    for leg in (1, 3):
        start[6 * leg + 1] -= 0.2
    commands = make_sequence(hand_plan, athlete).commands
    results = check_rules(athlete, commands, start, hand_plan.T_site_base, flat)
    assert any(result.rule == "balance" and not result.holds for result in results)
    assert any("of 3 feet" in result.text for result in results if result.rule == "balance")


def test_torque_and_friction_are_rules_too(athlete, hand_plan, flat):
    commands = make_sequence(hand_plan, athlete).commands
    weak = athlete.torque_limits.copy()
    weak[OWN] *= 0.15
    from footfall.robot.model import Robot

    tired = Robot(replace(athlete.description, torque_limits=weak))
    failed = broken(tired, hand_plan, commands, flat)
    assert set(failed) == {"torque"}
    # the leg in the air hangs on its own motors, whatever the ground does
    assert set(failed["torque"]) >= {1, 2, 3, 4, 5}


@pytest.mark.parametrize(
    "wrong",
    [{"sample": 3.0}, {"sample": 1e-9}, {"least_margin": -0.1}, {"least_margin": float("nan")}, {"friction": 0.0}],
)
def test_settings_that_check_nothing_are_refused(wrong):
    with pytest.raises(InvalidSequence, match=next(iter(wrong))):
        SequenceSettings(**wrong)


def test_without_a_terrain_an_edit_can_not_make_a_changed_motion_valid(athlete, hand_plan, flat, sequence):
    assert sequence.valid
    deeper = Edit("joint", 2, joint=1, number=float(sequence.commands[2].joints[1] + 0.05))
    slow = [Edit("duration", row, number=60.0) for row in range(len(sequence.commands))]
    for edits in ([deeper, *slow], [*slow, deeper, slow[0]]):
        changed = sequence
        for edit in edits:
            changed = apply_edit(athlete, changed, edit)
        assert [failure.rule for failure in changed.failures] == ["terrain-given"], edits
        assert not changed.valid
        # with the terrain it is known again
        assert apply_edit(athlete, changed, slow[0], flat).valid
    for edit in (slow[1], Edit("split", 2), Edit("insert", 2, command=Command("WAIT", None, None, 2.0))):
        assert apply_edit(athlete, sequence, edit).valid


def test_a_motion_found_bad_over_terrain_stays_bad_without_it(athlete, hand_plan, flat):
    high = around(flat, wheel(athlete, hand_plan, 4)[:2], 0.15, 0.5)
    bad = make_sequence(hand_plan, athlete, high)
    assert "terrain-collision" in {failure.rule for failure in bad.failures}
    again = apply_edit(athlete, bad, Edit("duration", 0, number=60.0))
    assert not again.valid
    assert "terrain" in again.failures[0].text


def test_reversed_rows_are_refused(athlete, hand_plan, flat):
    commands = [replace(one, duration=200.0) for one in make_sequence(hand_plan, athlete).commands]
    assert broken(athlete, hand_plan, commands, flat) == {}
    assert broken(athlete, hand_plan, commands[::-1], flat) != {}
