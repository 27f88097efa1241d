"""Steps and moves of the chassis, planned one after another, become one sequence; nothing joins that does not fit."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput, NotFound
from footfall.io.exports import FORMATS
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.queue.problem import QueueResult
from footfall.planning.step.problem import StepSettings
from footfall.robot.ik import contact_point
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.event import next_event
from footfall.session.log.fold import fold, fold_all
from footfall.session.products.kinds import AFTER, HELD_QUEUE, QUEUE
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.jobs import meanwhile

FIRST, SECOND = 2, 4
LOWER = BodyShift(dx=0.02, dz=-0.08)


def near(live, leg):
    """A point beside the wheel of a leg, as it stands in the state that is planned from."""
    state = live.get(live.state.state)
    x, y, _ = contact_point(live.robot, state.posture, leg, state.T_site_base)
    return float(x + 0.1), float(y + 0.1)


def step(live, leg):
    """A step of a leg, from the state that is planned from."""
    digest = live.plans.step(leg, near(live, leg)).finish()
    assert live.get(digest).status is Status.FOUND
    return digest


def queued(live, plan):
    """The queue with a plan at its end; what is planned then starts from there."""
    digest = live.queues.add(plan).finish()
    assert live.get(digest).status is Status.FOUND, live.get(digest).reason
    live.plans.go_on_after(digest)
    return digest


def of_three(live):
    """A queue of a step, a move of the chassis and a step; with what is in it."""
    plans = [step(live, FIRST)]
    queued(live, plans[-1])
    plans.append(live.stances.plan_body_move(LOWER, as_planned_from=True).finish())
    queued(live, plans[-1])
    plans.append(step(live, SECOND))
    return queued(live, plans[-1]), plans


def test_what_is_planned_one_after_another_joins_to_one_motion(live, standing):
    digest, plans = of_three(live)
    motion = live.get(digest).plan.motion
    each = [live.get(one).plan.motion for one in plans]
    # told anew: every entry's rows but the first, where the one before ends
    np.testing.assert_array_equal(motion.waypoints[1:], np.concatenate([one.waypoints[1:] for one in each]))
    np.testing.assert_array_equal(motion.Ts_site_base[1:], np.concatenate([one.Ts_site_base[1:] for one in each]))
    np.testing.assert_array_equal(motion.waypoints[0], standing.posture)
    for before, after in itertools.pairwise(each):
        np.testing.assert_array_equal(before.waypoints[-1], after.waypoints[0])
    told = live.summary()["queue"]
    assert [(one["number"], one["what"], one["leg"], one["plan"]) for one in told["entries"]] == [
        (1, "leg 2", 2, plans[0]),
        (2, "chassis", None, plans[1]),
        (3, "leg 4", 4, plans[2]),
    ]
    assert all(one["duration"] > 0 for one in told["entries"])
    margins = [[one.margin for one in live.get(plan).checks if "balance" in one.name] for plan in plans]
    assert [one["margin"] for one in told["entries"]] == [min(each) for each in margins]
    assert (told["goes_on"], told["carried_out"]) == (True, False)
    json.dumps(live.summary(), allow_nan=False)


def test_all_of_it_becomes_one_checked_sequence_and_replays(live):
    digest, plans = of_three(live)
    assert live.review.to_command["plan"] == digest
    sequence = live.get(live.sequences.make(digest, as_commanded=True))
    assert sequence.valid, [one for one in sequence.rules if not one.holds]
    rows = [live.get(plan).plan.motion.waypoints[1:] for plan in plans]
    np.testing.assert_array_equal(sequence.predicted, np.concatenate(rows))
    assert {one.rule for one in sequence.rules} >= {"balance", "torque", "terrain-collision", "no-drag"}
    groups = live.queues.foot_moves_in(sequence.digest)
    assert [one.text for one in groups] == ["entry 1 of 3: leg 2", "entries 2–3 of 3: leg 4"]
    assert [one.rows for one in groups] == [len(rows[0]), len(rows[1]) + len(rows[2])]
    assert all(one.rest is None for one in groups)
    for format in FORMATS:
        assert live.sequences.export(sequence.digest, format)
    assert not live.review.commands_of_another_plan
    assert live.review.played == sequence.digest
    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert {one.verdict for one in report.products} == {"same"}
    assert [one.kind for one in report.products].count(QUEUE.name) == 3


def test_a_rover_that_sags_is_commanded_with_the_pose_held_over_all_of_it(live):
    digest, plans = of_three(live)
    made = live.sequences.make(digest)
    sequence, held = live.get(made), live.get(live.state.newest(HELD_QUEUE))
    assert sequence.valid, [one for one in sequence.rules if not one.holds]
    assert sequence.provenance.parents["execution"] == held.execution.digest
    assert live.executions.way_of(made)["mode"] == "pose_held"
    assert live.executions.plan_held_queue().finish() == held.digest
    # each part starts from the rest that the one before ends in
    parts = held.execution.parts
    assert len(parts) == 3
    for before, after in itertools.pairwise(parts):
        np.testing.assert_allclose(before.predicted[-1], after.predicted[0], atol=1e-9)
    groups = live.queues.foot_moves_in(made)
    assert [one.text for one in groups] == ["entry 1 of 3: leg 2", "entries 2–3 of 3: leg 4"]
    # the chassis is held where the plans have it
    assert max(one.rest.off for one in groups) < 0.01
    planned = live.get(plans[2]).plan
    np.testing.assert_allclose(sequence.poses[-1][:3, 3], planned.T_site_base[:3, 3], atol=0.01)
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def test_what_can_not_be_held_is_refused_and_names_its_entry(live):
    with pytest.raises(Conflict, match="no queue yet"):
        live.executions.plan_held_queue()
    digest, _ = of_three(live)
    with pytest.raises(InvalidInput, match=r"the queue can't be commanded pose held: entry 1: .*as commanded"):
        live.sequences.make(digest, ExecutionSettings(least_load=1e5))
    with pytest.raises(InvalidInput, match="a queue can't be commanded droop-aware"):
        live.sequences.make(digest, ExecutionSettings(mode="droop_aware"))
    assert live.state.sequence is None


def test_the_gate_sends_all_of_it_and_then_the_queue_is_over(live, standing):
    digest, _ = of_three(live)
    sequence = live.get(live.sequences.make(digest, as_commanded=True))
    live.rover.connected(lambda text: None)
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    for row, command in enumerate(live.commands.send(live.commands.arm()["token"])["commands"]):
        live.rover.take_acknowledgement(command, "done")
        # between two foot moves the run looks at where the rover stands
        ended = replace(standing, time=1.0 + row, posture=sequence.predicted[row], T_site_base=sequence.poses[row])
        live.rover.take_telemetry(TelemetryFrame(1 + row, ended, ended.posture))
        live.rover.commanding.look()
    assert live.summary()["queue"]["carried_out"], live.commands.run
    assert live.review.to_command is None
    # the rover stands at its end, and what is planned there begins a new one
    assert live.state.what_if is None
    live.queues.add(step(live, 0)).finish()
    assert [one["what"] for one in live.summary()["queue"]["entries"]] == ["leg 0"]


def test_a_plan_that_begins_elsewhere_is_refused_by_how_much(live):
    first = step(live, FIRST)
    execution = live.executions.plan(first).finish()
    queue = live.queues.add(first).finish()
    # the end that knows sag is not where the planned motion ends
    live.plans.go_on_after(execution)
    refused = live.get(live.queues.add(step(live, SECOND)).finish())
    assert (refused.status, refused.plan) == (Status.START_INVALID, None)
    assert "the step of leg 4 does not begin where entry 1 of the queue ends" in refused.reason
    assert "m or rad from there" in refused.reason
    assert "plan it from the queue's end" in refused.reason
    assert live.state.queue == queue
    # nor does the same step again
    again = live.get(live.queues.add(first).finish())
    assert "rad from there" in again.reason
    assert live.state.queue == queue


def test_the_first_begins_where_the_rover_stands(live):
    live.stances.what_if(BodyShift(dz=-0.2))
    with pytest.raises(Conflict, match=r"begins elsewhere: its chassis by 0\.200 m"):
        live.queues.add(step(live, FIRST))
    with pytest.raises(NotFound, match="no step and no move"):
        live.queues.add(live.state.state)
    refused = live.stances.plan_body_move(BodyShift(dx=0.6)).finish()
    with pytest.raises(Conflict, match="there is no plan to queue"):
        live.queues.add(refused)


def test_other_ground_is_refused(live, dem):
    queued(live, step(live, FIRST))
    live.terrains.load(replace(dem, name="another"))
    refused = live.get(live.queues.add(step(live, SECOND)).finish())
    assert refused.status is Status.START_INVALID
    assert "on other ground than the queue" in refused.reason
    assert not live.fits.up_to_date()["queue"]["fits"]


def test_entries_are_taken_from_the_end_and_brought_back(live):
    one = queued(live, step(live, FIRST))
    two = queued(live, step(live, SECOND))
    state = live.state.state
    live.queues.shorten(one)
    assert [entry["what"] for entry in live.queues.answer()["entries"]] == ["leg 2"]
    # it is planned from the end of what is left
    assert live.state.state != state
    assert live.state.products[live.state.state].parents["plan"] == one
    with pytest.raises(Conflict, match="changed since you read it"):
        live.queues.shorten(two)
    assert live.choices.undoable["undo"]["kind"] == "queue"
    live.choices.undo()
    assert live.state.queue == two
    live.choices.redo()
    assert live.state.queue == one
    live.queues.shorten(None)
    assert (live.queues.answer(), live.state.what_if) == (None, None)
    with pytest.raises(Conflict, match="no queue"):
        live.queues.shorten(None)
    live.choices.undo()
    assert live.state.queue == one
    assert fold_all(live.events()).digest == live.state.digest
    assert replay(live.export_bundle()).ok
    with pytest.raises(InvalidBundle, match="not before"):
        fold(live.state, next_event(live.events()[-1], 9e9, "queue_shortened", {"digest": two}))


def test_of_two_entries_that_are_queued_at_once_none_is_lost_silently(live, forgotten):
    """Both follow the same queue, so that only one of them can."""
    begun = queued(live, step(live, FIRST))
    one, other = (
        live.stances.plan_body_move(shift, as_planned_from=True).finish() for shift in (LOWER, BodyShift(dz=-0.02))
    )
    meanwhile(live, QUEUE, lambda: live.queues.add(other).finish())
    with pytest.raises(Conflict, match="the queue has changed") as caught:
        live.queues.add(one).finish()
    assert caught.value.details == {"yours": begun, "present": live.state.queue}
    assert [entry["plan"] for entry in live.queues.answer()["entries"]][1:] == [other]


def test_the_strictest_that_an_entry_was_planned_with_holds_for_all(live):
    digest = live.plans.step(FIRST, near(live, FIRST), StepSettings(clearance=0.01, least_margin=0.02)).finish()
    queued(live, digest)
    whole = queued(live, live.plans.step(SECOND, near(live, SECOND), StepSettings(friction=0.4)).finish())
    asked = live.get(live.sequences.make(whole, as_commanded=True)).provenance.settings
    assert (asked.clearance, asked.least_margin, asked.friction) == (0.01, 0.02, 0.4)


def test_it_is_there_when_the_session_is_opened_again(tmp_path, athlete, dem, standing):
    with Sessions(tmp_path / "again", jobs=InlineJobs(), robot=athlete) as sessions:
        made = sessions.create("again")
        made.terrains.load(dem)
        made.stances.set(standing)
        digest = queued(made, step(made, FIRST))
        told = made.queues.answer()
    with Sessions(tmp_path / "again", jobs=InlineJobs(), robot=athlete) as sessions:
        again = sessions.open(sessions.list()[0]["id"])
        assert again.state.queue == digest
        assert again.queues.answer() == told
        assert again.state.newest(AFTER) is None
        joined = again.typed(QueueResult, queued(again, step(again, SECOND))).plan
        assert joined is not None
        assert joined.legs == (FIRST, SECOND)
