"""Executions in a session: made by a job, folded, turned into commands, let through the gate, replayed."""

import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.errors import CommandRefused, Conflict, InvalidInput, NotFound
from footfall.core.frames import apply
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.step.problem import StepSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.edit import Edit
from footfall.session.jobs.local import InlineJobs
from footfall.session.products.executions import set_points_at
from footfall.session.products.sag import sag_of
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame

LEG = 2


@pytest.fixture(scope="module")
def rest(athlete, dem, standing):
    return CompliantRover(athlete, dem).let_down(standing.posture, standing.T_site_base)


@pytest.fixture(scope="module")
def state(athlete, dem, rest):
    return CompliantRover(athlete, dem).state(rest)


@pytest.fixture
def live(tmp_path, athlete, dem, state):
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as sessions:
        made = sessions.create("execution")
        made.terrains.load(dem)
        made.stances.set(state)
        yield made


def connected(live, state, commanded):
    """What the rover is sent."""
    heard: list[dict] = []
    live.rover.connected(lambda text: heard.append(json.loads(text)))
    live.rover.take_telemetry(TelemetryFrame(0, state, commanded))
    return heard


def planned(live, state, dy=-0.3):
    x, y, _ = apply(state.T_site_base, wheel_centers(live.robot, state.posture))[LEG]
    return live.plans.step(LEG, (x + 0.1, y + dy)).finish()


def test_from_a_plan_to_commands_and_back_from_the_log(live, state, rest):
    heard = connected(live, state, rest.commanded)
    plan = planned(live, state)
    digest = live.executions.plan().finish()
    assert live.state.execution == digest == live.executions.found()
    assert live.summary()["execution"] == {"digest": digest, "status": "found", "reason": ""}
    result = live.get(digest)
    assert result.provenance.parents["plan"] == live.get(plan).plan.digest
    # the present set points of the rover, bit for bit
    assert np.array_equal(result.execution.commanded[0], rest.commanded)
    assert live.state.products[digest].parents.keys() == {"robot", "dem", "state", "plan"}
    sequence = live.get(live.sequences.make(digest))
    assert sequence.valid
    assert np.array_equal(sequence.at_rest.set_points, rest.commanded)
    assert live.state.plan_behind(sequence.digest) == live.state.products[digest]
    assert live.review.played == sequence.digest
    live.rover.take_telemetry(TelemetryFrame(1, state, rest.commanded))
    ids = live.commands.send(live.commands.arm()["token"])["commands"]
    assert len(ids) == len(sequence.commands)
    for number, command_id in enumerate(ids):
        live.rover.take_telemetry(TelemetryFrame(2 + number, state, rest.commanded))
        live.rover.take_acknowledgement(command_id, "done")
    sent = [one for one in heard if one["type"] == "command"]
    assert [one["name"] for one in sent] == [one.name for one in sequence.commands]
    assert [one["force"] for one in sent if one["name"] == "LEG_LOWER"] == [result.execution.stop_force]
    edited = live.get(live.sequences.edit(sequence.digest, Edit("duration", 0, number=8.0)))
    assert edited.at_rest.digest == sequence.at_rest.digest
    assert live.state.plan_behind(edited.digest) == live.state.products[digest]
    after = live.get(live.plans.go_on_after(edited.digest))
    assert np.array_equal(after.posture, edited.predicted[-1])
    live.sequences.export(sequence.digest, "json")
    report = replay(live.export_bundle())
    assert report.ok, report.as_dict()
    assert {one.verdict for one in report.products} == {"same"}
    assert report.state is not None
    assert report.state.execution == digest


def test_another_plan_leaves_no_execution(live, state):
    with pytest.raises(Conflict, match="there is no plan yet"):
        live.executions.plan()
    with pytest.raises(Conflict, match="no execution of the present plan"):
        live.executions.found()
    first = planned(live, state)
    digest = live.executions.plan(settings=ExecutionSettings(mode="pose_held")).finish()
    # no telemetry: set points as the torques of the planning state tell
    torques = live.get(live.state.state).joint_torques
    told = state.posture + torques / live.robot.stiffness
    assert np.abs(live.get(digest).execution.commanded[0] - told).max() < 1e-12
    planned(live, state, dy=-0.2)
    assert live.state.execution is None
    assert live.summary()["execution"] == {"digest": None, "status": None, "reason": ""}
    # of the plan before: made, but not that of the present one
    again = live.executions.plan(first).finish()
    assert live.state.execution is None
    assert live.executions.found(again) == again
    with pytest.raises(NotFound, match="holds no execution"):
        live.executions.found(first)
    with pytest.raises(NotFound, match="holds no plan"):
        live.executions.plan(again)


def test_what_fails_a_check_is_shown_and_not_made_into_commands(live, state):
    planned(live, state)
    digest = live.executions.plan(settings=ExecutionSettings(least_clearance=0.4)).finish()
    shown = live.summary()["execution"]
    assert (shown["digest"], shown["status"]) == (digest, "no_path")
    assert "wheel clearance by" in shown["reason"]
    assert live.get(digest).execution is not None
    with pytest.raises(InvalidInput, match=r"no execution to make commands of.*wheel clearance"):
        live.sequences.make(digest)


def test_the_gate_asks_for_the_set_points_too(live, athlete, state, rest):
    connected(live, state, rest.commanded)
    planned(live, state)
    live.sequences.make(live.executions.plan().finish())
    live.rover.take_telemetry(TelemetryFrame(1, state, rest.commanded))
    assert live.commands.arm()["token"]
    away = rest.commanded.copy()
    away[13] += 0.012
    live.rover.take_telemetry(TelemetryFrame(2, state, away))
    with pytest.raises(CommandRefused, match=r"the set point of leg 2 hip pitch is \+0.0120 rad") as caught:
        live.commands.arm()
    assert caught.value.details["check"] == "set-points"
    assert caught.value.details["joint"] == athlete.joint_names[13]
    assert caught.value.details["difference"] == pytest.approx(0.012)
    near = rest.commanded.copy()
    near[13] += 0.009
    live.rover.take_telemetry(TelemetryFrame(3, state, near))
    assert live.commands.arm()["token"]


def test_sag_is_compared_at_the_pauses(live, state):
    with pytest.raises(Conflict, match="nothing was sent to the rover"):
        live.executions.sag()
    planned(live, state)
    sequence = live.get(live.sequences.make(live.executions.plan().finish()))
    start = sequence.start - sequence.at_rest.set_points
    softer = {}
    for row in range(len(sequence.commands)):
        yielded = sequence.predicted[row] - sequence.commanded[row] - start
        # three tenths more than predicted; what was seen while it moved counts for nothing
        softer[row] = sequence.commanded[row] + start + 1.3 * yielded
        if sequence.commands[row].name != "WAIT":
            softer[row] = softer[row] + 0.1
    found = sag_of(sequence, softer)
    assert found.ratio == pytest.approx(1.3)
    assert [sequence.commands[row].name for row in found.rows] == ["WAIT"] * 5
    assert found.assumed == sequence.provenance.settings.compliance
    with pytest.raises(Conflict, match="no pause of the sequence is done yet"):
        sag_of(sequence, {0: sequence.predicted[0]})
    rigid = live.get(live.sequences.make(as_commanded=True))
    with pytest.raises(Conflict, match="takes the rover as rigid"):
        sag_of(rigid, softer)


def test_a_step_is_commanded_with_the_pose_held_unless_asked_otherwise(live, state, rest):
    plan = planned(live, state)
    assert live.executions.way_of_commands().mode == "pose_held"
    sequence = live.sequences.make()
    done = live.get(live.state.execution)
    assert done.execution.mode == "pose_held"
    assert live.get(sequence).provenance.parents["execution"] == done.execution.digest
    assert live.executions.way_of(sequence) == {
        "mode": "pose_held",
        "text": live.executions.way_of(sequence)["text"],
        "doubt": False,
    }
    # asked again, the execution that is there serves
    count = len(live.events())
    assert live.sequences.make(plan) == sequence
    assert [event.payload["kind"] for event in live.events()[count:]] == ["sequence"]
    droop = live.sequences.make(plan, ExecutionSettings(mode="droop_aware"))
    assert live.executions.way_of(droop)["mode"] == "droop_aware"
    rigid = live.sequences.make(plan, as_commanded=True)
    assert live.get(rigid).at_rest is None
    told = live.executions.way_of(rigid)
    assert (told["mode"], told["doubt"]) == ("rigid", True)
    assert told["text"] == "as commanded: the rover sags; touch-down is not predicted"
    with pytest.raises(InvalidInput, match="take no settings"):
        live.sequences.make(plan, ExecutionSettings(), as_commanded=True)


def test_commands_are_asked_for_the_friction_and_the_polygon_that_their_plan_was_asked_for(live, state):
    x, y, _ = apply(state.T_site_base, wheel_centers(live.robot, state.posture))[LEG]
    result = live.get(live.plans.step(LEG, (x + 0.1, y - 0.3), StepSettings(friction=0.5)).finish())
    made = live.get(live.sequences.make()).provenance.settings
    assert (made.friction, made.compliance.balance.friction, made.conservative) == (0.5, 0.5, False)
    # an order says of the ground what it means; that any leg may be lost is the plan's
    slippery = ComplianceSettings(balance=BalanceSettings(friction=0.45))
    ordered = ExecutionSettings(compliance=slippery)
    assert live.get(live.sequences.make(settings=ordered)).provenance.settings.friction == 0.45
    strict = replace(result.plan.provenance, settings=StepSettings(friction=0.5, conservative=True))
    plan = replace(result.plan, provenance=strict)
    assert live.executions.settings_for(plan, ordered).digest == replace(ordered, conservative=True).digest
    assert live.executions.settings_for(plan, None).conservative
    assert not live.executions.settings_for(result.plan, None).conservative


def test_the_conservative_polygon_is_a_rule_of_commands_for_a_rover_that_sags(live, state):
    planned(live, state)
    plain = live.get(live.sequences.make())
    strict = live.get(live.sequences.make(settings=ExecutionSettings(conservative=True)))
    kept = []
    for sequence, kind in ((plain, "support polygon"), (strict, "conservative support polygon")):
        rules = [one for one in sequence.rules if one.rule == "balance"]
        assert rules
        assert all(f"m to the {kind} of" in one.text for one in rules)
        kept.append([one.margin for one in rules])
    assert (np.array(kept[1]) < kept[0]).all()
    # a step from an even stance leaves five feet, whose conservative polygon ends at its middle
    assert not strict.valid


def test_a_step_that_can_not_be_held_is_not_commanded_otherwise(live, state):
    plan = planned(live, state)
    with pytest.raises(InvalidInput, match=r"can't be commanded pose held: .*wheel clearance by.*as commanded"):
        live.sequences.make(plan, ExecutionSettings(least_clearance=0.4))
    assert live.state.sequence is None


@pytest.mark.parametrize(
    ("softness", "torques", "mode"),
    [
        (1.0, 1.0, "pose_held"),
        (0.0, 1.0, "rigid"),
        (0.2, 1.0, "rigid"),
        (0.3, 1.0, "pose_held"),
        (0.0, 0.0, "pose_held"),
    ],
)
def test_telemetry_tells_whether_joints_give_way(live, state, rest, softness, torques, mode):
    planned(live, state)
    told = replace(state, joint_torques=torques * state.joint_torques)
    live.rover.take_telemetry(TelemetryFrame(0, told, state.posture + softness * (rest.commanded - state.posture)))
    # where telemetry tells nothing, the state that is planned from does
    assert live.executions.way_of_commands().mode == mode
    # a joint on its way is no joint that gives way
    live.rover.take_telemetry(TelemetryFrame(1, replace(told, mode="moving"), state.posture + 0.5))
    assert live.executions.way_of_commands().mode == mode
    if mode == "rigid":
        sequence = live.sequences.make()
        assert live.get(sequence).at_rest is None
        assert live.executions.way_of(sequence) == {
            "mode": "rigid",
            "text": "as commanded: telemetry shows that the rover's joints do not give way",
            "doubt": False,
        }


def test_without_any_load_known_sag_is_not_known(live, state):
    nothing = replace(state, joint_torques=0 * state.joint_torques, wheel_forces=0 * state.wheel_forces)
    live.stances.set(nothing)
    assert live.executions.way_of_commands().mode == "rigid"
    planned(live, state)
    assert live.executions.way_of(live.sequences.make())["text"] == (
        "as commanded: whether the rover sags is not known; touch-down is not predicted"
    )


def test_set_points_are_those_of_a_rover_that_stands_so(standing, state, rest):
    assert set_points_at(None, state) is None
    frame = TelemetryFrame(0, state, rest.commanded)
    assert set_points_at(frame, state) is frame.commanded
    assert set_points_at(frame, standing) is None
