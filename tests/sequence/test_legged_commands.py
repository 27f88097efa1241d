"""A walk of a robot that others described as commands: where they lead, what breaks a rule, and every file of them."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.io.exports import SUFFIXES, TITLES, export, formats_for
from footfall.io.imports import sequence_of
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.legged.touching import touching
from footfall.sequence import legged_passage
from footfall.sequence.commands import Command, Sequence, by_leg, leg_lower, posture_move, wait
from footfall.sequence.of_legged import RAMP, legged_sequence, ramped
from footfall.sequence.predict import FARTHEST
from footfall.sequence.sequence_settings import COARSEST, SequenceSettings
from footfall.telemetry.joint_layout import JointLayout
from footfall.terrain.generate import fractal
from tests.io.test_export_fprime import require_compiles
from tests.io.test_export_ros2 import messages
from tests.support.described import sprung
from tests.support.legged_recheck import Recheck, faults
from tests.support.robot_data import described
from tests.support.sequences import bits, require_same_commands
from tests.support.walkers import ring

FORMATS = ("json", "csv", "seqjson", "fprime", "ros2")


@pytest.fixture(scope="module")
def urdf(tmp_path_factory):
    path = tmp_path_factory.mktemp("quadruped") / "robot.urdf"
    path.write_text(ring(4), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def made(urdf):
    """A robot of four legs, rough ground, the state it starts from, a plan of one step, and its commands."""
    model = legged_model(read_urdf(urdf))
    robot = LeggedRobot(model, always=touching(model.tree, 20).always)
    dem = fractal(4.0, 0.1, roughness=0.02, seed=3)
    state = stand(robot, dem)
    target = state.soles[1, :2] + (0.05, 0.02)
    result = plan_step(robot, dem, state, 1, tuple(target), LeggedSettings(time_limit=1e6))
    assert result.plan is not None, result.reason
    return robot, dem, state, result.plan, footfall.make_sequence(result.plan, robot, dem)


@pytest.fixture(scope="module")
def sequence(made) -> Sequence:
    """The commands with a WAIT among them and one that moves the chassis."""
    robot, dem, state, _, step = made
    commands = (posture_move(step.start, 0.5, "shift"), wait(1 / 3), *step.commands)
    document = json.loads(export(step, "json"))
    document["commands"] = [
        {"name": one.name, "leg": one.leg, "duration": one.duration, "phase": one.phase}
        | {"row": row, "joints": None if one.joints is None else one.joints.tolist()}
        for row, one in enumerate(commands, 1)
    ]
    return sequence_of("step.json", json.dumps(document).encode(), robot, dem, state)


def failing(made, commands: tuple[Command, ...]) -> set[tuple[int, str]]:
    robot, dem, _, _, step = made
    changed = replace(step, commands=commands, rules=(), predicted=np.tile(step.start, (len(commands), 1)))
    changed = replace(changed, Ts_site_base=None)
    return {(one.row, one.rule) for one in sequence_of("x.json", export(changed, "json"), robot, dem).failures}


def test_commands_lead_where_the_plan_does(made):
    robot, _, _, plan, step = made
    assert step.valid, step.failures
    assert len(step.commands) == len(plan.waypoints) - 1
    np.testing.assert_allclose(step.predicted, plan.waypoints[1:], atol=1e-6)
    # the planner chose these poses; here they follow from the feet that stand
    np.testing.assert_allclose(step.poses, plan.Ts_site_base[1:], atol=1e-6)
    soles = apply(step.poses[-1], placed(robot, step.predicted[-1]).soles)
    np.testing.assert_allclose(soles, plan.end.soles, atol=1e-6)
    assert {one.name for one in step.commands} == {"LEG_MOVE", "POSTURE_MOVE"}
    assert np.linalg.norm(step.poses[-1][:2, 3] - step.T_site_base[:2, 3]) > 0.02, "the weight goes over three feet"


def test_another_judge_finds_nothing_wrong_with_where_they_lead(made, urdf):
    robot, dem, _, plan, step = made
    waypoints, Ts = np.vstack([step.start, step.predicted]), np.concatenate([step.T_site_base[None], step.poses])
    assert faults(Recheck(urdf, robot, []).walk(dem, replace(plan, waypoints=waypoints, Ts_site_base=Ts), 3)) == []


@pytest.mark.parametrize(("share", "fastest"), [(0.8, 0.5), (0.05, 0.05 * 6.0)])
def test_no_joint_is_faster_than_its_share_of_the_limit_and_statics_allow(made, share, fastest):
    robot, dem, _, plan, _ = made
    step = footfall.make_sequence(plan, robot, dem, SequenceSettings(speed_fraction=share, sample=0.02))
    before, speeds = step.start, []
    for command, after in zip(step.commands, step.predicted, strict=True):
        speeds.append(np.abs(after - before).max() / command.duration)
        before = after
    assert max(speeds) <= fastest * (1 + 1e-9)
    assert max(speeds) > 0.5 * fastest, "long motions come near their full speed"


def test_every_motion_begins_and_ends_slowly(made):
    _, _, _, plan, step = made
    before, needed = step.start, []
    for after in step.predicted:
        needed.append(np.abs(after - before).max() / 0.5)
        before = after
    kinds = [(command.leg, command.phase) for command in step.commands]
    motions = [[k for k, kind in enumerate(kinds) if kind == one] for one in dict.fromkeys(kinds)]
    assert len(motions) == 4
    assert len(plan.moves) == 1
    for rows in motions:
        durations = np.array([step.commands[row].duration for row in rows])
        np.testing.assert_allclose(durations, ramped(np.array(needed)[rows], RAMP), rtol=1e-6)
        for end in (rows[0], rows[-1]):
            share = needed[end] / step.commands[end].duration
            assert share <= step.commands[end].duration / (2 * RAMP) + 1e-6


@given(st.lists(st.floats(0.001, 1.0), min_size=1, max_size=12), st.floats(0.05, 2.0))
def test_a_ramp_changes_speed_no_faster_than_it_says(needed, ramp):
    needed = np.array(needed)
    took = ramped(needed, ramp)
    speed = needed / took
    assert (speed <= 1 + 1e-9).all()
    between = (took[1:] + took[:-1]) / 2
    assert (np.abs(np.diff(speed)) <= between / ramp + 1e-6).all()
    assert speed[0] <= took[0] / (2 * ramp) + 1e-6
    assert speed[-1] <= took[-1] / (2 * ramp) + 1e-6
    # the way under a trapezoid, or under a triangle, added up in small steps of time
    total = took.sum()
    t = (np.arange(20000) + 0.5) * total / 20000
    under = np.minimum(np.minimum(t, total - t) / ramp, 1.0).sum() * total / 20000
    assert under == pytest.approx(needed.sum(), rel=1e-4)


@pytest.mark.parametrize("format", FORMATS)
def test_every_file_reads_back_as_the_same_commands(made, sequence, format):
    robot, dem, state, _, _ = made
    data = export(sequence, format)
    found = sequence_of(f"step{SUFFIXES[format]}", data, robot, dem, state if format == "csv" else None)
    assert found.valid, found.failures
    require_same_commands(found.commands, sequence.commands)
    assert bits(found.predicted.ravel()) == bits(sequence.predicted.ravel())
    assert found.described is not None
    assert found.described.digest == robot.layout.digest
    assert export(found, "csv").splitlines()[0] == export(sequence, "csv").splitlines()[0]


def test_a_table_has_a_column_for_each_joint_by_its_name(made, sequence):
    robot = made[0]
    header, *rows = csv.reader(io.StringIO(export(sequence, "csv").decode(), newline=""))
    assert header[7:] == [f"{name}_rad" for name in robot.joint_names]
    for row, command in zip(rows, sequence.commands, strict=True):
        told = {robot.joint_names[k]: float(cell) for k, cell in enumerate(row[7:]) if cell}
        moved = [own for leg, _ in by_leg(command, robot.layout) for own in robot.model.legs[leg].joints]
        assert list(told) == moved
        assert list(told.values()) == ([] if command.joints is None else command.joints.tolist())
        assert row[4] == ("" if command.leg is None else robot.leg_names[command.leg])


def test_ros_hears_the_joints_by_name(made, sequence):
    robot = made[0]
    told = messages(export(sequence, "ros2"))
    for row, command in enumerate(sequence.commands):
        expected = {
            f"/footfall/leg_{robot.leg_names[leg]}/joint_trajectory": (robot.model.legs[leg].joints, places.tolist())
            for leg, places in by_leg(command, robot.layout)
        }
        heard = {
            topic: (tuple(one.joint_names), list(one.points[0].positions)) for topic, _, _, one in told.get(row, [])
        }
        assert heard == expected


def test_f_prime_compiles_commands_of_three_joints_a_leg(sequence, tmp_path):
    require_compiles(sequence, tmp_path)
    sizes = {
        one["qualifiedName"]: one["size"]
        for one in json.loads(export(sequence, "fprime-dictionary"))["typeDefinitions"]
    }
    assert sizes == {"FootFall.LegJoints": 3, "FootFall.Posture": 12}


def test_f_prime_says_which_joints_slide_and_which_leg_is_which(made, sequence, tmp_path):
    """The dictionary called all of them angles in rad."""
    layout = made[0].layout
    slid = replace(sequence, described=replace(layout, sliding=(layout.joints[1][2],)))
    require_compiles(slid, tmp_path)
    assert "Angles in rad, ways of joints that slide in m, durations in s" in export(slid, "fprime").decode()
    document = json.loads(export(slid, "fprime-dictionary"))
    assert {one["annotation"] for one in document["typeDefinitions"]} == {
        "joint angles [rad], of joints that slide ways [m]"
    }
    said = {
        one["name"]: {param["name"]: param["annotation"] for param in one["formalParams"]}
        for one in document["commands"]
    }
    named = ", ".join(f"{number} {name}" for number, name in enumerate(layout.legs))
    assert said["FootFall.LEG_MOVE"]["leg"] == f"leg, counted from 0: {named}"
    first, second, slides = layout.joints[1]
    of_leg = f"; leg 1 {layout.legs[1]}: {first} [rad], {second} [rad], {slides} [m]; leg 2 {layout.legs[2]}: "
    assert of_leg in said["FootFall.LEG_MOVE"]["joints"]
    assert said["FootFall.POSTURE_MOVE"]["joints"].count(" [m]") == 1
    assert said["FootFall.POSTURE_MOVE"]["joints"].count(" [rad]") == 11
    plain = export(sequence, "fprime-dictionary").decode()
    assert "[m]" not in plain
    assert " in m," not in export(sequence, "fprime").decode()


def test_what_is_offered_can_be_exported_and_nothing_else(sequence):
    offered = formats_for(sequence)
    assert list(offered) == list(TITLES)
    assert {one for one, lack in offered.items() if lack} == {"yamcs", "html"}
    for format, lack in offered.items():
        if lack:
            with pytest.raises(InvalidSequence, match=lack):
                export(sequence, format)
        else:
            assert export(sequence, format)


def test_what_a_format_can_not_carry_is_refused_by_name(made, sequence):
    for format, why in (("yamcs", "Yamcs stack.*names no joints"), ("html", "Sheet for print.*pictures")):
        with pytest.raises(InvalidSequence, match=f"{why}.*; export them as JSON, CSV, SeqJSON, F Prime sequence"):
            export(sequence, format)
    layout = made[0].layout
    unlike = JointLayout(("a", "b"), (layout.joint_names[:4], layout.joint_names[4:]))
    with pytest.raises(InvalidSequence, match="the legs have 4, 8"):
        export(replace(sequence, described=unlike), "fprime-dictionary")
    spaced = JointLayout(("front left", *layout.legs[1:]), layout.joints)
    with pytest.raises(InvalidSequence, match="a topic of ROS 2 can't be called 'leg_front left'"):
        export(replace(sequence, described=spaced), "ros2")


def test_files_of_another_robot_are_refused(made, athlete, sequence):
    robot, dem, state, _, _ = made
    document = json.loads(export(sequence, "json"))
    document["layout"]["legs"][0]["joints"][0] = "another"
    with pytest.raises(InvalidSequence, match="its legs and joints are not those of ring"):
        sequence_of("step.json", json.dumps(document).encode(), robot, dem)
    with pytest.raises(InvalidSequence, match="it is for 'ring', not for athlete"):
        sequence_of("step.json", export(sequence, "json"), athlete, dem)
    with pytest.raises(InvalidSequence, match="its columns must be"):
        sequence_of("step.csv", export(sequence, "csv").replace(b"l0_yaw_rad", b"l9_yaw_rad", 1), robot, dem, state)
    with pytest.raises(InvalidSequence, match="need the terrain"):
        sequence_of("step.json", export(sequence, "json"), robot)


def test_a_row_of_a_table_with_joints_of_another_leg_is_refused(made, sequence):
    robot, dem, state, _, _ = made
    text = export(sequence, "csv").decode()
    lines = text.splitlines()
    at = next(k for k, line in enumerate(lines) if ",LEG_MOVE,1," in line)
    lines[at] = lines[at].replace(",LEG_MOVE,1,", ",LEG_MOVE,2,")
    with pytest.raises(InvalidSequence, match=f"row {at}: the joints of this LEG_MOVE are l2_yaw, l2_hip, l2_knee"):
        sequence_of("step.csv", "\r\n".join(lines).encode(), robot, dem, state)


def test_what_breaks_a_rule_fails_its_row(made):
    robot, _, _, _, step = made
    commands = step.commands
    swing = next(row for row, one in enumerate(commands) if one.phase == "swing")
    hasty = (*commands[:swing], replace(commands[swing], duration=1e-4), *commands[swing + 1 :])
    assert failing(made, hasty) == {(swing, "speed")}
    assert (len(commands) - 3, "ends-on-ground") in failing(made, commands[:-2])
    own = robot.slices[0]
    beyond = Command("LEG_MOVE", 0, robot.upper[own] + 0.1, 5.0)
    assert (0, "joint-limits") in failing(made, (beyond,))
    turned = step.start[own] + (0.1, 0.0, 0.0)
    assert (0, "no-drag") in failing(made, (Command("LEG_MOVE", 0, turned, 5.0),))
    pressed = step.start[own] + (0.0, 0.2, 0.0)
    assert (0, "terrain-collision") in failing(made, (Command("LEG_MOVE", 0, pressed, 5.0),))
    lifted = [Command("LEG_MOVE", leg, step.start[robot.slices[leg]] - (0.0, 0.4, 0.0), 5.0) for leg in (0, 1, 2)]
    assert {rule for row, rule in failing(made, tuple(lifted)) if row == 2} >= {"balance"}
    assert (0, "known-command") in failing(made, (leg_lower(0, step.start[own], 1.0, 50.0),))
    assert (0, "own-joints") in failing(made, (Command("LEG_MOVE", 0, step.start, 1.0),))
    assert (0, "leg-exists") in failing(made, (Command("LEG_MOVE", 6, step.start[own], 1.0),))


@pytest.mark.parametrize("far", [40.0, 1e308])
def test_a_row_that_goes_to_degrees_breaks_its_limits(made, sequence, far):
    turned = sequence.start.copy()
    turned[0] = far
    command = posture_move(turned, 1e3, "")
    assert (0, "joint-limits") in failing(made, (command,))


@pytest.mark.parametrize("far", [40.0, 1e9])
def test_springs_are_not_followed_to_degrees(made, far, monkeypatch):
    robot, dem, state, _, step = made
    sags = sprung(robot, 300.0)
    followed = legged_passage.gives_way_to

    def no_farther(robot, dem, set_points, before, stood, down):
        assert np.abs(set_points - before.set_points).max() <= FARTHEST
        return followed(robot, dem, set_points, before, stood, down)

    monkeypatch.setattr(legged_passage, "gives_way_to", no_farther)
    lifted = step.start[robot.slices[1]] - (0.0, 0.1, 0.0)
    rows = (
        Command("LEG_MOVE", 1, np.add(lifted, (0.0, 0.0, far)), 1e3),
        Command("LEG_MOVE", 2, step.start[robot.slices[2]], 1e3),
        Command("LEG_MOVE", 1, lifted, 1e3),
    )
    found = legged_sequence(sags, rows, state.q, state.T_site_base, dem, SequenceSettings(sample=COARSEST), {})
    assert (0, "joint-limits") in {(one.row, one.rule) for one in found.failures}
    np.testing.assert_array_equal(found.predicted[:2], [state.q, state.q])


def test_loads_change_legs_no_faster_than_slow_joints_go(made):
    """Rows that only move the load took half a second whatever the joints' speeds: they broke the rule of these."""
    _, dem, state, _, _ = made
    soft = sprung(made[0], 200.0)
    model, *others = soft.__reduce__()[1]
    joints = tuple(replace(one, velocity=0.03) for one in model.tree.joints)
    slow = LeggedRobot(replace(model, tree=replace(model.tree, joints=joints)), *others)
    target = state.soles[1, :2] + (0.05, 0.02)
    result = plan_step(slow, dem, stand(slow, dem), 1, tuple(target), LeggedSettings(time_limit=1e6))
    assert result.plan is not None, result.reason
    step = footfall.make_sequence(result.plan, slow, dem)
    assert "speed" in {one.rule for one in step.rules}
    assert [one.text for one in step.failures if one.rule == "speed"] == []
    shifted = next(one for one in step.commands if one.phase == "unload")
    assert shifted.duration > RAMP
    fast = footfall.make_sequence(result.plan, soft, dem)
    assert next(one for one in fast.commands if one.phase == "unload").duration == RAMP


def test_a_real_robot_steps_by_commands_of_its_own_joints():
    model = legged_model(read_urdf(described("A1")))
    robot = LeggedRobot(model, always=touching(model.tree, 20).always)
    dem = fractal(3.0, 0.05, roughness=0.02, seed=2)
    state = stand(robot, dem)
    target = state.soles[2, :2] + (0.06, 0.0)
    result = plan_step(robot, dem, state, 2, tuple(target), LeggedSettings(time_limit=1e6))
    assert result.plan is not None, result.reason
    step = footfall.make_sequence(result.plan, robot, dem)
    assert step.valid, step.failures
    assert {"FL_hip_joint_rad", "RR_calf_joint_rad"} <= set(export(step, "csv").decode().splitlines()[0].split(","))


def test_plans_and_robots_of_unlike_kinds_are_refused(made, athlete):
    robot, dem, _, plan, _ = made
    with pytest.raises(InvalidSequence, match="need its description"):
        footfall.make_sequence(plan, athlete, dem)
    with pytest.raises(InvalidSequence, match="need its description"):
        footfall.make_sequence(plan, robot)
