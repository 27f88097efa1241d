"""Plans side by side, going on from the end of one, and a worker that is killed in the middle of one."""

import json
import multiprocessing
import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import CommandRefused, Conflict, InvalidInput, NotFound, WorkerLost
from footfall.planning.step.alternatives import CLEARER, HIGHER, KINDS
from footfall.planning.step.problem import StepSettings
from footfall.session.jobs.local import Jobs
from footfall.session.log.fold import fold_all
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.chassis_ground import wavy
from tests.support.waiting import BOUND, until


@pytest.fixture
def planned(session):
    """A session with a plan of leg 2."""
    session.plans.step(2, (1.0, 0.0), StepSettings(seed=5)).finish()
    return session


def test_a_plan_records_what_it_was_asked_with(session):
    digest = session.plans.step(2, (1.0, 0.0), through=[(1, 2, 3)]).finish()
    request = session.get(session.state.products[digest].settings)
    assert request.through == ((1.0, 2.0, 3.0),)
    assert request.explain
    assert session.plans.shown()[0]["kind"] == "asked"


def test_alternatives_are_listed_and_replace_nothing(planned):
    first = planned.state.plan
    jobs = planned.plans.alternatives()
    digests = [job.finish() for job in jobs]
    assert planned.state.plan == first
    listed = planned.plans.shown()
    assert [one["digest"] for one in listed] == [first, *digests]
    assert [one["kind"] for one in listed] == ["asked", *KINDS]
    assert [one["chosen"] for one in listed] == [True, False, False, False]
    asked = [planned.get(planned.state.products[digest].settings).settings for digest in digests]
    base = StepSettings(seed=5)
    assert [one.digest for one in asked] == [
        replace(base, lift=base.lift + HIGHER).digest,
        replace(base, branch=2).digest,
        replace(base, clearance=CLEARER, lift=base.lift + CLEARER).digest,
    ]
    # one that can't be made is listed with its reason
    with pytest.raises(Conflict, match=r"the knee down \(branch 2\): there is no such plan: not with that knee"):
        planned.plans.choose(digests[1])
    refused = listed[2]
    assert (refused["status"], refused["reason"], refused["figures"]) == ("goal_invalid", "not with that knee", None)
    json.dumps(planned.summary(), allow_nan=False)
    assert planned.summary()["plan"]["compared"] == [one["digest"] for one in listed]


def test_figures_are_those_of_the_commands(planned):
    figures = planned.plans.shown()[0]["figures"]
    sequence = planned.get(planned.sequences.make())
    assert figures["duration"] == pytest.approx(sequence.duration)
    assert figures["waypoints"] == 4
    # 0.15 rad of hip yaw on a circle about the hip's axis
    hip = planned.description.legs[2].T_base_hip[:2, 3]
    from footfall.robot.kinematics import wheel_centers

    before, after = (wheel_centers(planned.robot, q)[2, :2] for q in (sequence.start, sequence.predicted[-1]))
    assert figures["length"] == pytest.approx(0.15 * np.linalg.norm(before - hip), rel=1e-3)
    assert np.linalg.norm(before - hip) == pytest.approx(np.linalg.norm(after - hip))


def test_another_plan_is_chosen_and_becomes_the_sequence(planned, sessions):
    first = planned.state.plan
    other = planned.plans.alternatives(kinds=["higher_lift"])[0].finish()
    planned.plans.choose(other)
    assert planned.state.plan == other
    assert planned.state.plan_status == "found"
    assert [one["chosen"] for one in planned.plans.shown()] == [False, True]
    sequence = planned.sequences.make()
    assert planned.state.products[sequence].parents["plan"] == other
    planned.plans.choose(first)
    assert planned.state.plan == first
    planned.plans.choose(first)  # harmless
    assert fold_all(planned.events()).digest == planned.state.digest
    # a new plan ends the comparison
    planned.plans.step(1, (1.0, 0.0)).finish()
    assert len(planned.plans.shown()) == 1
    with pytest.raises(NotFound, match="none of the plans"):
        planned.plans.choose(first)


def test_misuse_of_alternatives(session, planned):
    with pytest.raises(InvalidInput, match="higher_lift"):
        planned.plans.alternatives(kinds=["prettier"])
    with pytest.raises(NotFound):
        planned.plans.alternatives("nothing")
    planned.plans.step(2, (2.5, 0.0)).finish()
    with pytest.raises(Conflict, match="the leg can't reach it"):
        planned.plans.alternatives()


def test_an_alternative_of_a_plan_that_is_past_is_not_listed(planned):
    past = planned.state.plan
    planned.plans.step(1, (1.0, 0.5)).finish()
    planned.plans.alternatives(past, ["higher_lift"])[0].finish()
    assert [one["kind"] for one in planned.plans.shown()] == ["asked"]


# --- going on -------------------------------------------------------------------------------------------------------


def stands(session, frame_of, number, posture):
    frame = frame_of(number)
    state = replace(frame.state, posture=posture, time=float(number))
    session.rover.take_telemetry(TelemetryFrame(number, state, posture))


@pytest.mark.parametrize("made", [False, True])
def test_ground_that_was_changed_since_is_told_beside_the_match(planned, frame_of, made):
    planned.rover.connected(lambda text: None)
    stands(planned, frame_of, 0, planned.get(planned.state.plan).plan.waypoints[0])
    if made:
        planned.sequences.make()
    match = planned.review.plan_matches_rover()
    assert (match["ok"], match["older_ground"]) == (True, False)
    planned.terrains.load(wavy(half=2.0), "another")
    match = planned.review.plan_matches_rover()
    assert (match["ok"], match["older_ground"]) == (True, True)
    if made:
        with pytest.raises(CommandRefused) as caught:
            planned.commands.arm()
        assert caught.value.details["check"] == "terrain"
    planned.terrains.undo()
    assert planned.review.plan_matches_rover()["older_ground"] is False


def test_a_plan_that_is_near_enough_tells_the_gates_tolerance_beside_that_of_colours(planned, frame_of):
    planned.rover.connected(lambda text: None)
    start = planned.get(planned.state.plan).plan.waypoints[0]
    for number, turned in enumerate((0.0, 5e-4)):
        stands(planned, frame_of, number, start + turned)
        assert (planned.review.plan_matches_rover()["ok"], planned.review.plan_matches_rover()["reason"]) == (True, "")
    stands(planned, frame_of, 2, start + 5e-3)
    match = planned.review.plan_matches_rover()
    assert match["ok"] is True
    assert "0.0050 rad from where the plan starts" in match["reason"]
    assert "within 0.05 m and 0.01 rad; colours hold within 0.005 m and 0.001 rad" in match["reason"]
    stands(planned, frame_of, 3, start + 0.02)
    match = planned.review.plan_matches_rover()
    assert match["ok"] is False
    assert "colours" not in match["reason"]


@pytest.mark.parametrize("what", ["plan", "sequence"])
def test_the_next_step_is_planned_from_the_end_but_not_sent_before(planned, frame_of, what):
    real, first = planned.state.state, planned.state.plan
    sequence = planned.sequences.make()
    end = planned.get(first).plan.waypoints[-1]
    planned.rover.connected(lambda text: None)
    stands(planned, frame_of, 0, planned.get(first).plan.waypoints[0])
    planned.plans.step(1, (1.0, 0.0), after=first if what == "plan" else sequence).finish()
    assert planned.state.what_if == real
    assert planned.summary()["after"] == (first if what == "plan" else sequence)
    second = planned.get(planned.state.plan).plan
    assert np.array_equal(second.waypoints[0], end)
    # the commands there are still the first plan's: what was planned last counts
    assert planned.review.plan_matches_rover()["ok"] is False
    assert planned.summary()["up_to_date"]["plan"]["fits"]  # it is of the what-if
    stands(planned, frame_of, 1, end)
    assert planned.review.plan_matches_rover()["ok"] is True
    # the rover stands there: what would be, is
    assert planned.state.what_if is None
    assert planned.summary()["up_to_date"]["plan"]["fits"]
    stands(planned, frame_of, 2, planned.get(first).plan.waypoints[0])
    planned.sequences.make()
    # the rover has not made the first step yet
    with pytest.raises(CommandRefused) as caught:
        planned.commands.arm()
    assert caught.value.details["check"] == "start"
    assert caught.value.details["joint"] == planned.robot.joint_names[12]
    assert caught.value.details["difference"] == pytest.approx(-0.15)
    assert planned.review.plan_matches_rover()["ok"] is False
    # now it has
    stands(planned, frame_of, 3, end)
    assert planned.review.plan_matches_rover()["ok"] is True
    assert planned.commands.arm()["token"]
    assert np.array_equal(planned.get(planned.state.state).posture, end)
    assert fold_all(planned.events()).digest == planned.state.digest


def test_a_chain_of_three_goes_back_to_the_rover(planned):
    real = planned.state.state
    for leg in (1, 3):
        planned.plans.step(leg, (1.0, 0.0), after=planned.state.plan).finish()
    assert planned.state.what_if == real
    moved = planned.get(planned.state.plan).plan.waypoints[-1] - planned.get(real).posture
    assert sorted(np.flatnonzero(moved)) == [6, 12, 18]
    planned.stances.end_what_if()
    assert planned.state.state == real


def test_going_on_needs_something_to_go_on_from(planned):
    with pytest.raises(NotFound, match="no plan and no sequence"):
        planned.plans.go_on_after("nothing")
    planned.plans.step(2, (2.5, 0.0)).finish()
    before = planned.state.state
    with pytest.raises(Conflict, match="the leg can't reach it"):
        planned.plans.go_on_after(planned.state.plan)
    assert planned.state.state == before
    assert planned.state.what_if is None


def test_all_of_it_replays(planned, tiny):
    planned.plans.alternatives(kinds=["higher_lift"])[0].finish()
    planned.plans.step(1, (1.0, 0.0), after=planned.state.plan).finish()
    report = replay(planned.export_bundle(), recipes=tiny.RECIPES)
    assert report.ok, report.as_dict()
    assert [one.kind for one in report.products] == ["plan", "plan", "after", "plan"]


# --- a worker is killed ---------------------------------------------------------------------------------------------


def test_a_worker_killed_in_mid_plan_fails_that_job_and_loses_nothing_else(tmp_path, tiny, athlete, state_of):
    """SIGKILL, as the kernel sends it when memory runs out."""
    others = set(multiprocessing.active_children())
    with Sessions(tmp_path, jobs=Jobs("tiny_recipes", workers=1), robot=athlete) as sessions:
        session = sessions.create("killed")
        session.stances.set(state_of())
        session.terrains.load(tiny.dem())
        first = session.plans.step(2, (1.0, 0.0)).finish(BOUND)
        session.terrains.load(replace(tiny.dem(), name="slow"))
        before = session.state
        job = session.plans.step(2, (1.0, 0.5))
        waiting = session.maps.compute(1)
        until(lambda: job.text == "planning slowly", "the planning", seen=lambda: job.state)
        (worker,) = set(multiprocessing.active_children()) - others
        assert worker.pid is not None
        os.kill(worker.pid, signal.SIGKILL)
        with pytest.raises(WorkerLost, match="the worker process died while it made the plan") as caught:
            job.finish(BOUND)
        assert caught.value.details["exit_code"] == -signal.SIGKILL
        assert job.state == "failed"
        error = job.as_dict()["error"]
        assert error is not None
        assert "died" in error["message"]
        # the log says so, and all that was there is there
        failed = [event for event in session.events() if event.type == "job_failed"]
        assert "died" in failed[0].payload["reason"]
        assert (session.state.plan, session.state.dem, session.state.state) == (first, before.dem, before.state)
        # what waited behind it is made by the next worker, and so is the next plan
        waiting.cancel()
        session.terrains.load(tiny.dem(0.1))
        session.plans.step(2, (1.0, 0.5)).finish(BOUND)
        assert session.state.plan != first
