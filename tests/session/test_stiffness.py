"""The measured stiffness is taken over into what is planned next, and that starts where the sag ends."""

import numpy as np
import pytest

from footfall.core.errors import Conflict, InvalidInput
from footfall.core.frames import apply
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.fold import fold_all
from footfall.session.products.sag import Sag, calibration_of
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.sagging import stepped

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
        made = sessions.create("stiffness")
        made.terrains.load(dem)
        made.stances.set(state)
        made.rover.connected(lambda _: None)
        x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
        made.plans.step(LEG, (x + 0.1, y - 0.3)).finish()
        yield made


def assumed(live, digest):
    return live.get(digest).provenance.settings.compliance.joint_scale


def test_it_is_taken_over_undone_and_made_again(live, state, rest):
    with pytest.raises(Conflict, match="nothing was sent"):
        live.executions.take_over_stiffness()
    stepped(live, state, rest.commanded, 1.25)
    found = live.executions.sag().calibration
    assert (found.was, found.steps) == (1.0, 1)
    assert found.now == pytest.approx(1 / 1.25)
    with pytest.raises(Conflict, match=r"0\.8000 times the described by now"):
        live.executions.take_over_stiffness(0.7)
    assert live.state.joint_scale == 1.0
    assert live.executions.take_over_stiffness(found.now) == found
    assert live.state.joint_scale == live.summary()["joint_scale"] == found.now
    with pytest.raises(Conflict, match="as stiff as described already"):
        live.executions.take_over_stiffness()
    event = live.events()[-1]
    assert event.type == "stiffness_taken_over"
    assert {name: event.payload[name] for name in ("was", "steps")} == {"was": 1.0, "steps": 1}
    # what is planned next takes it, unless it is told otherwise
    live.rover.take_telemetry(TelemetryFrame(900, state, rest.commanded))
    assert assumed(live, live.executions.plan().finish()) == found.now
    told = ExecutionSettings(compliance=ComplianceSettings(joint_scale=0.9))
    assert assumed(live, live.executions.plan(settings=told).finish()) == 0.9
    assert live.summary()["undo"]["kind"] == "stiffness"
    live.choices.undo()
    assert live.state.joint_scale == 1.0
    assert assumed(live, live.executions.plan().finish()) == 1.0
    live.choices.redo()
    assert live.state.joint_scale == found.now
    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.as_dict()
    assert report.state is not None
    assert report.state.joint_scale == found.now


def test_steps_that_were_predicted_alike_count_together(live, state, rest):
    stepped(live, state, rest.commanded, 1.3)
    stepped(live, state, rest.commanded, 1.1)
    sag = live.executions.sag()
    assert sag.ratio == pytest.approx(1.1)
    assert sag.calibration.steps == 2
    assert sag.calibration.ratio == pytest.approx(1.2)
    live.executions.take_over_stiffness()
    # those before were predicted with other joints
    stepped(live, state, rest.commanded, 1.0)
    found = live.executions.sag().calibration
    assert (found.steps, found.was) == (1, pytest.approx(1 / 1.2))
    assert found.now == pytest.approx(found.was)


def test_no_spring_yields_upwards():
    one = Sag("", -0.2, (1,), ComplianceSettings())
    with pytest.raises(InvalidInput, match="above zero"):
        calibration_of([one], 1.0)
    assert calibration_of([one, Sag("", 1.2, (1,), ComplianceSettings())], 1.0).now == pytest.approx(1 / 0.5)


def test_the_next_step_starts_where_the_sag_ends(live, athlete, state, rest):
    def ends():
        return {name: end and (end["of"], end["sags"]) for name, end in live.summary()["ends"].items()}

    plan = live.state.plan
    assert live.plans.planned_end() == plan
    assert ends() == {"go_on": ("plan", False), "after": None}
    live.rover.take_telemetry(TelemetryFrame(0, state, rest.commanded))
    rigid = live.sequences.make(plan, as_commanded=True)
    assert live.plans.planned_end() == rigid
    assert ends()["go_on"] == ("commands", False)
    execution = live.executions.plan().finish()
    done = live.get(execution).execution
    assert live.plans.planned_end() == execution
    assert ends()["go_on"] == ("execution", True)
    after = live.get(live.plans.go_on_after(live.plans.planned_end()))
    assert np.array_equal(after.posture, done.predicted[-1])
    assert np.array_equal(after.T_site_base, done.Ts_site_base[-1])
    assert not np.array_equal(after.posture, done.plan.waypoints[-1])
    assert ends()["after"] == ("execution", True)
    live.stances.end_what_if()
    sequence = live.sequences.make(execution)
    assert live.plans.planned_end() == sequence
    assert ends() == {"go_on": ("commands", True), "after": None}
    # the next step goes on from there: sag is predicted from the strain that is left
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[4]
    live.plans.step(4, (x, y + 0.2), after=live.plans.planned_end()).finish()
    assert live.state.plan_status == "found", live.state.plan_reason
    assert live.plans.planned_end() == live.state.plan
    assert live.get(live.executions.plan().finish()).execution is not None
    report = replay(live.export_bundle())
    assert report.ok, report.as_dict()


def test_what_fails_its_checks_is_no_end(live):
    refused = live.executions.plan(settings=ExecutionSettings(least_clearance=0.4)).finish()
    assert live.state.execution_status == "no_path"
    assert live.plans.planned_end() == live.state.plan
    with pytest.raises(InvalidInput, match="no execution to make commands of"):
        live.plans.go_on_after(refused)
