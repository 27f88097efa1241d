"""Sequences that know how the rover sags: rows of an execution, predicted anew, checked where the rover will be."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.errors import InvalidInput, InvalidSequence
from footfall.core.frames import apply
from footfall.core.value import flatten
from footfall.io.artifacts import decode, encode
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.predict import advanced
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import AtRest, Command
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import follow
from footfall.sequence.yielding_rules import SLIP, check_yielding, stepping_legs
from tests.support.chassis_ground import wavy

LEG = 2
OWN = slice(6 * LEG, 6 * LEG + 6)
MODES = ("droop_aware", "pose_held")


@pytest.fixture(scope="module")
def dem():
    return wavy()


@pytest.fixture(scope="module")
def stood(athlete, dem):
    """State and set points of a rover that sags at rest."""
    state = footfall.stand(athlete, dem)
    rover = CompliantRover(athlete, dem)
    rest = rover.let_down(state.posture, state.T_site_base)
    return rover.state(rest), rest.commanded


@pytest.fixture(scope="module")
def plan(athlete, dem, stood):
    state, _ = stood
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.1, y - 0.3)).plan
    assert plan is not None
    return plan


@pytest.fixture(scope="module")
def executions(athlete, dem, stood, plan):
    found = {}
    for mode in (*MODES, "as_commanded"):
        result = footfall.plan_execution(athlete, dem, stood[0], plan, ExecutionSettings(mode=mode), stood[1])
        assert result.execution is not None, result.reason
        found[mode] = result.execution
    return found


@pytest.fixture(scope="module")
def made(athlete, dem, executions):
    return {mode: make_sequence(executions[mode], athlete, dem) for mode in MODES}


def results(robot, sequence, commands, dem):
    """Rules of motion of other commands from the same rest, as {rule: [result]}."""
    way = follow(robot, sequence.at_rest, tuple(commands), dem, SequenceSettings())
    told = {}
    for one in check_yielding(robot, tuple(commands), way, SequenceSettings()):
        told.setdefault(one.rule, []).append(one)
    return told


def of(name, sequence):
    return [row for row, command in enumerate(sequence.commands) if command.name == name]


@pytest.mark.parametrize("mode", MODES)
def test_rows_are_the_executions_set_points(athlete, executions, made, mode):
    done, sequence = executions[mode], made[mode]
    assert sequence.valid, sequence.failures[0]
    (lowering,) = of("LEG_LOWER", sequence)
    command = sequence.commands[lowering]
    assert np.array_equal(command.joints, done.lowest)
    assert (command.leg, command.force, command.phase) == (LEG, done.stop_force, "lower")
    kept = [at for at in range(1, len(done.phases)) if not done.guarded_from < at < done.stopped_at]
    moves = [row for row, one in enumerate(sequence.commands) if one.joints is not None]
    assert len(moves) == len(kept)
    for row, at in zip(moves, kept, strict=True):
        one = sequence.commands[row]
        assert one.phase == done.phases[at]
        assert np.array_equal(sequence.commanded[row], done.commanded[at])
        if row != lowering:
            assert one.duration == done.durations[at]
            asked = done.commanded[at] if one.name == "POSTURE_MOVE" else done.commanded[at, OWN]
            assert np.array_equal(one.joints, asked)
    assert [sequence.commands[row].duration for row in of("WAIT", sequence)] == done.pauses[done.pauses > 0].tolist()
    # the lowering alone may take longer than predicted, by what is left of its way where the wheel touches
    left = sequence.duration - done.seconds
    whole = np.abs(done.lowest - done.commanded[done.guarded_from, OWN]).max()
    rest = np.abs(done.lowest - done.commanded[done.stopped_at, OWN]).max()
    assert left == pytest.approx(command.duration * rest / whole)
    assert bool(of("POSTURE_MOVE", sequence)) == (mode == "pose_held")
    assert np.array_equal(sequence.at_rest.set_points, done.commanded[0])
    assert np.array_equal(sequence.start, done.predicted[0])
    assert sequence.provenance.settings.compliance == done.provenance.settings.compliance


@pytest.mark.parametrize("mode", MODES)
def test_the_prediction_from_commands_alone_is_the_executions(athlete, executions, made, mode):
    done, sequence = executions[mode], made[mode]
    from_execution = footfall.make_sequence(done)
    assert from_execution.valid
    assert [one.digest for one in from_execution.commands] == [one.digest for one in sequence.commands]
    assert np.abs(sequence.predicted - from_execution.predicted).max() < 1e-6
    assert np.abs(sequence.poses - from_execution.poses).max() < 1e-6
    assert np.abs(sequence.commanded - from_execution.commanded).max() < 1e-9
    # set points and joints are apart by what the joints yield
    assert 0.01 < np.abs(sequence.commanded - sequence.predicted).max() < 0.2
    assert decode(encode(sequence)).digest == sequence.digest
    again = make_sequence(done, athlete, wavy())
    assert again.digest == sequence.digest


def test_a_rigid_sequence_is_stored_as_before(athlete, plan, dem):
    structure, _ = flatten(make_sequence(plan, athlete))
    assert not {"at_rest", "commanded"} & set(structure["of"])
    assert "compliance" not in str(structure["of"]["provenance"])


@pytest.mark.parametrize("mode", MODES)
def test_margins_are_what_the_prediction_shows(athlete, made, mode):
    sequence = made[mode]
    for one in sequence.rules:
        if one.rule == "torque":
            yielded = athlete.stiffness * (sequence.commanded[one.row] - sequence.predicted[one.row])
            assert one.margin <= 1.0 - np.abs(yielded / athlete.torque_limits).max() + 1e-3
        elif one.rule == "predicted-limits":
            q = sequence.predicted[one.row]
            assert one.margin <= np.minimum(q - athlete.lower, athlete.upper - q).min() + 1e-12
    rows = {rule: [one.row for one in sequence.rules if one.rule == rule] for rule in ("torque", "no-drag", "balance")}
    moves = [row for row, one in enumerate(sequence.commands) if one.joints is not None]
    assert all(asked == moves for asked in rows.values())
    (off,) = [one for one in sequence.rules if one.rule == "lift-off"]
    assert sequence.commands[off.row].phase == "lift"
    assert sequence.commands[off.row + 2].phase == "swing"
    assert off.margin == pytest.approx(0.177, abs=0.01)
    (end,) = [one for one in sequence.rules if one.rule == "ends-on-ground"]
    assert 1000 < end.margin < 2000
    assert set(stepping_legs(sequence.commands)) == {LEG, None}


def test_a_wheel_that_will_not_leave_the_ground_is_told(athlete, dem, executions, made):
    sequence = make_sequence(executions["as_commanded"], athlete, dem)
    lifts = [row for row, command in enumerate(sequence.commands) if command.phase == "lift"]
    told = results(athlete, sequence, sequence.commands[: lifts[5] + 1], dem)
    (off,) = told["lift-off"]
    assert not off.holds
    assert off.row == lifts[5]
    assert "will not leave the ground" in off.text
    lacking = float(off.text.split(" N, ")[1].split(" m below")[0])
    assert lacking == pytest.approx(0.05 - off.margin, abs=6e-4)
    assert off.margin < 0
    # all of the lift: off the ground, told by how much
    (off,) = results(athlete, sequence, sequence.commands[: lifts[-1] + 1], dem)["lift-off"]
    assert off.holds
    assert off.margin > 0.05
    # a rover that sags under one leg drags its wheel: the plan's own joint angles don't lift it straight
    dragged = [one for one in sequence.failures if one.rule == "no-drag"]
    assert dragged
    assert sequence.failures[0].rule == "no-drag"
    assert f"wheel of leg {LEG} slips" in dragged[0].text
    stood = results(athlete, sequence, sequence.commands[: lifts[5] + 1], dem)["ends-on-ground"]
    assert [one.holds for one in stood] == [True]


def test_each_rule_can_fail(athlete, dem, made):
    sequence = made["droop_aware"]
    stand = sequence.at_rest.set_points

    def moved(leg, joint, by, name="LEG_MOVE", phase=""):
        q = stand.copy()
        q[6 * leg + joint] += by
        return [Command(name, leg if name == "LEG_MOVE" else None, q[6 * leg : 6 * leg + 6], 9.0, phase)]

    def failing(commands, over=dem):
        return {rule for rule, told in results(athlete, sequence, commands, over).items() if not told[-1].holds}

    assert failing([Command("LEG_MOVE", 3, stand[18:24], 1.0)]) == set()
    # a standing leg turned about its hip drags its wheel
    assert "no-drag" in failing(moved(3, 0, 0.5))
    # a whole posture that draws up a leg which is to stand
    q = stand.copy()
    q[1] -= 0.4
    drawn_up = results(athlete, sequence, [Command("POSTURE_MOVE", None, q, 9.0)], dem)
    assert "leg 0 is predicted to bear nothing" in drawn_up["balance"][0].text
    assert "ends bearing 0 N" in drawn_up["ends-on-ground"][0].text
    # pressed hard against the ground
    assert "torque" in failing(moved(2, 1, 0.5) + moved(2, 1, 0.9))
    rows = [row for row, one in enumerate(sequence.commands) if one.phase == "swing"]
    inwards = sequence.commands[rows[4]].joints.copy()
    inwards[0] -= 2.0
    into_leg_1 = [*sequence.commands[: rows[4]], Command("LEG_MOVE", LEG, inwards, 20.0, "swing")]
    met = next(one for one in results(athlete, sequence, into_leg_1, dem)["self-collision"] if not one.holds)
    assert "leg1_" in met.text
    assert "leg2_" in met.text
    # four legs drawn up: it tips, and what comes after is not asked for its motion
    q = stand.copy()
    q[[1, 7, 25, 31]] -= 0.6
    tips = results(athlete, sequence, [Command("POSTURE_MOVE", None, q, 9.0), *sequence.commands[:2]], dem)
    assert "nothing holds the rover" in tips["balance"][-1].text
    assert [one.row for told in tips.values() for one in told] == [0]
    beyond = results(athlete, sequence, moved(2, 1, 9.0), dem)
    assert "beyond the limits" in beyond["balance"][0].text


def test_a_rock_on_the_way_is_hit(athlete, dem, stood):
    """Planned on ground without it."""
    state, set_points = stood
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.25, y - 0.7)).plan
    assert plan is not None
    done = footfall.plan_execution(athlete, dem, state, plan, commanded=set_points).execution
    assert done is not None
    rocky = wavy(rocks=[(x + 0.125, y - 0.35, 0.1, 0.3)], resolution=0.05)
    assert make_sequence(done, athlete, wavy(resolution=0.05)).valid
    sequence = make_sequence(done, athlete, rocky)
    hit = sequence.failures[0]
    assert hit.rule == "terrain-collision"
    assert sequence.commands[hit.row].phase == "swing"
    assert f"leg{LEG}_wheel and the terrain" in hit.text


def test_standing_wheels_hold(made):
    for sequence in made.values():
        drags = [one for one in sequence.rules if one.rule == "no-drag"]
        assert min(one.margin for one in drags) > 0.9 * SLIP


def test_a_lowering_ends_where_the_force_has_risen(athlete, dem, made):
    sequence = made["droop_aware"]
    (row,) = of("LEG_LOWER", sequence)
    way = follow(athlete, sequence.at_rest, sequence.commands, dem, sequence.provenance.settings)
    rests = way.rows[row].rests
    forces = [rest.forces[LEG, 2] for rest in rests]
    force = sequence.commands[row].force
    assert forces[-1] - min(forces) >= force > forces[-2] - min(forces)
    # a finer way along the same line gets there at most 2 mm before
    line = sequence.commands[row].joints - rests[0].commanded[OWN]
    share = np.abs(rests[-1].commanded[OWN] - rests[0].commanded[OWN]).max() / np.abs(line).max()
    rest = rests[0]
    for part in np.linspace(0.0, 1.0, 200)[1:]:
        target = rest.commanded.copy()
        target[OWN] = rests[0].commanded[OWN] + part * line
        rest = advanced(way.rover, rest, target)
        if rest.forces[LEG, 2] >= force:
            break
    assert share - 1.01 / (len(rests) - 1) * share < part <= share + 0.005

    # one that asks for more than what the wheel bears before counts from there
    def pressed(seconds):
        pressing = Command("LEG_LOWER", LEG, sequence.commands[row].joints, seconds, "lower", 400.0)
        further = follow(athlete, sequence.at_rest, (*sequence.commands[: row + 1], pressing), dem, SequenceSettings())
        return np.array([rest.forces[LEG, 2] for rest in further.rows[-1].rests]) - rests[-1].forces[LEG, 2]

    risen = pressed(3.0)
    assert risen[0] == 0.0
    assert risen[-1] >= 400.0 > risen[-2]
    # so slowly that the baseline goes along: to its end, with all that there is
    slow = pressed(600.0)
    assert len(slow) > len(risen)
    assert slow[-1] > risen[-1]


def test_edits_predict_from_the_same_rest(athlete, dem, made):
    sequence = made["droop_aware"]
    (lowering,) = of("LEG_LOWER", sequence)
    slow = apply_edit(athlete, sequence, Edit("duration", 0, number=9.0), dem)
    assert slow.valid
    assert slow.at_rest is not None
    assert slow.at_rest.digest == sequence.at_rest.digest
    assert np.array_equal(slow.predicted, sequence.predicted)
    loading = next(
        row for row in range(lowering + 1, len(sequence.commands)) if sequence.commands[row].joints is not None
    )
    split = apply_edit(athlete, sequence, Edit("split", loading, number=0.3), dem)
    assert split.valid, split.failures[0]
    before, end = sequence.commanded[loading - 1, OWN], sequence.commands[loading].joints
    assert split.commands[loading].joints == pytest.approx(before + 0.3 * (end - before))
    assert np.abs(split.predicted[-1] - sequence.predicted[-1]).max() < 1e-3
    lift = next(row for row, one in enumerate(sequence.commands) if one.phase == "lift") + 4
    pushed = apply_edit(athlete, sequence, Edit("joint", lift, joint=0, number=float(athlete.upper[OWN][0]) + 0.1), dem)
    assert {one.rule for one in pushed.failures} >= {"joint-limits", "balance"}
    assert len(pushed.predicted) == len(pushed.commands)
    with pytest.raises(InvalidSequence, match="give the terrain"):
        apply_edit(athlete, sequence, Edit("duration", 0, number=9.0))


def test_misuse_is_named(athlete, dem, made, executions):
    done = executions["droop_aware"]
    of_another = replace(done, provenance=replace(done.provenance, parents={**done.parents, "robot": "0" * 32}))
    with pytest.raises(InvalidSequence, match="planned for another robot"):
        make_sequence(of_another, athlete, dem)
    at_rest = made["droop_aware"].at_rest
    with pytest.raises(InvalidSequence, match="as many finite angles"):
        AtRest(at_rest.state, at_rest.set_points[:5])
    hanging = AtRest(replace(at_rest.state, wheel_forces=np.eye(6)[:, :3] * 2000.0), at_rest.set_points)
    with pytest.raises(InvalidInput, match="three legs must be pressed"):
        follow(athlete, hanging, (), dem, SequenceSettings())
