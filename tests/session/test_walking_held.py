"""Walks of a session are carried out with the chassis held in its pose, from predicted rest to predicted rest."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import footfall.session.walking as walking_module
from footfall.core.errors import Conflict, InvalidInput
from footfall.planning.answers import Status
from footfall.planning.compliance.from_telemetry import holding
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.walk.excerpt import end_of, parts_count
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.foot_moves import foot_moves
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import follow
from footfall.session.jobs.requests import FootMovesRequest
from footfall.session.products.kinds import WALK
from footfall.session.replay.recompute import replay
from tests.support.yielding_rover import YieldingRover

GOAL, SEED = WalkGoal(0.4, 0.1), WalkSettings(seed=1)


@pytest.fixture
def rover(live, standing):
    return YieldingRover(live, standing)


@pytest.fixture
def walk(live, rover):
    live.stances.freeze()
    result = live.get(live.walks.plan(GOAL, SEED).finish())
    assert result.plan is not None, result.reason
    assert parts_count(result.plan) > 1
    return result.plan


def asked_with(live, sequence) -> FootMovesRequest:
    return live.get(live.state.products[sequence].settings)


def test_a_walk_is_carried_out_with_the_pose_held_and_ends_where_it_was_planned_to(live, rover, walk):
    for number in range(parts_count(walk)):
        assert (live.walks.walking().next, live.walks.walking().against) == (number, "")
        rover.tells()
        sequence = live.get(live.walks.command(None, number))
        assert sequence.valid, sequence.failures
        assert np.array_equal(sequence.at_rest.set_points, rover.rest.commanded)
        assert live.executions.way_of(sequence.digest)["mode"] == "pose_held"
        assert (
            asked_with(live, sequence.digest).digest
            == FootMovesRequest(number, 1, ExecutionSettings(), rover.rest.commanded).digest
        )
        [told] = live.walks.foot_moves_in(sequence.digest)
        rover.carries_out_all()
        # what was predicted of its rest is how it stands
        away = rover.state.T_site_base[:3, 3] - told.rest.T_site_base[:3, 3]
        assert np.linalg.norm(away) < 1e-3
        planned = end_of(walk, number)[:3, 3]
        assert told.rest.sag == pytest.approx(planned[2] - rover.state.T_site_base[2, 3], abs=1e-3)
        assert told.rest.off == pytest.approx(np.linalg.norm(planned - rover.state.T_site_base[:3, 3]), abs=1e-3)
        assert told.rest.off < 0.01
    assert live.walks.walking().next is None
    assert np.linalg.norm(rover.state.T_site_base[:3, 3] - walk.Ts_site_base[-1, :3, 3]) < 0.01
    report = replay(live.export_bundle())
    assert report.ok, [one.text for one in report.products if not one.ok]


def test_the_torque_that_is_told_is_that_of_the_forces_on_the_wheels(live, rover, walk, athlete):
    """Second method: statics of the predicted forces, without the springs."""
    sequence = live.get(live.walks.command(None, 0))
    [told] = live.walks.foot_moves_in(sequence.digest)
    assert isinstance(sequence.provenance.settings, SequenceSettings)
    way = follow(athlete, sequence.at_rest, sequence.commands, rover.dem, sequence.provenance.settings)
    shares = []
    for row in way.rows:
        rest = row.rests[-1]
        torques = holding(way.rover, rest.posture, rest.T_site_base, rest.hubs, rest.normals, rest.forces)
        shares.append(np.abs(torques) / athlete.torque_limits)
    worst = np.max(shares, axis=0)
    assert told.rest.torque == pytest.approx(worst.max(), rel=0.02)
    assert told.rest.joint == athlete.description.joint_names[int(np.argmax(worst))]


def test_the_order_says_otherwise(live, rover, walk):
    drooping = live.get(live.walks.command(None, 0, settings=ExecutionSettings(mode="droop_aware")))
    assert live.executions.way_of(drooping.digest)["mode"] == "droop_aware"
    # the standing legs are left alone
    steps = [one for one in drooping.commands if one.phase in ("unload", "lift", "swing", "lower", "load")]
    assert {one.leg for one in steps} == {walk.legs[0]}
    rigid = live.get(live.walks.command(None, 0, as_commanded=True))
    assert rigid.at_rest is None
    assert live.executions.way_of(rigid.digest)["mode"] == "rigid"
    assert asked_with(live, rigid.digest).settings is None
    assert [one.rest for one in live.walks.foot_moves_in(rigid.digest)] == [None]
    with pytest.raises(InvalidInput, match="leave out one of them"):
        live.walks.command(None, 0, settings=ExecutionSettings(), as_commanded=True)
    with pytest.raises(InvalidInput, match="pose_held, droop_aware"):
        live.walks.command(None, 0, settings=ExecutionSettings(mode="as_commanded"))


def test_what_cannot_be_commanded_so_makes_nothing(live, rover, walk):
    live.walks.command(None, 0)
    before = live.state.sequence
    with pytest.raises(
        InvalidInput, match=r"can't be commanded pose held: foot move 1: .*load on the supporting"
    ) as no:
        live.walks.command(None, 0, settings=ExecutionSettings(least_load=3000.0))
    assert (no.value.details["failed_at"], no.value.details["mode"]) == (0, "pose_held")
    assert live.state.sequence == before


def test_the_weight_that_it_was_planned_with_is_that_of_its_settings(live, rover, walk):
    light = live.walks.command(None, 0)
    assert live.commands._weight(light) == pytest.approx(live.robot.mass * 9.81)
    assert live.executions.executed_with(live.walks.command(None, 0, as_commanded=True)) is None


def test_between_foot_moves_every_wheel_is_where_it_is_predicted_to_rest(live, rover, walk):
    rover.tells()
    sequence = live.get(live.walks.command(None, 0, parts_count(walk)))
    assert sequence.valid, sequence.failures
    first, *_ = live.walks.foot_moves_in(sequence.digest)
    rover.tells()
    live.commands.send(live.commands.arm()["token"])
    rover.carries_out(first.rows - 1)
    # set points and chassis are as they should be, a wheel is not
    q = rover.state.posture
    moved = q.copy()
    moved[6 * walk.legs[0] + 1] += 0.06
    rover.shift = moved - q
    hubs = [wheel_centers(live.robot, one)[walk.legs[0]] for one in (q, moved)]
    assert 0.07 < np.linalg.norm(hubs[1] - hubs[0]) < 0.2
    rover.carries_out(1)
    assert live.commands.gate["waiting"]
    assert f"held between foot moves: the wheel of leg {walk.legs[0]} is" in live.commands.gate["why"]
    assert f"predicted to rest after row {first.rows}" in live.commands.gate["why"]
    with pytest.raises(Conflict, match="predicted to rest"):
        live.commands.resume()
    rover.shift = np.zeros_like(q)
    rover.tells()
    live.commands.resume()
    assert rover.sent[-1]["row"] == first.rows
    rover.carries_out(len(sequence.commands) - first.rows)
    assert live.walks.walking().next is None


def test_a_rover_off_the_walk_is_told_and_one_that_sags_on_it_is_not(live, rover, walk):
    start = walk.waypoints[0]
    # softer than a rigid rover may be off, as its wheels are pressed in
    assert np.abs(rover.state.posture - start).max() > 0.01
    assert live.walks.walking().against == ""
    rover.rest = rover.springs.let_down(rover.rest.commanded, rover.rest.T_site_base + np.eye(4, k=3) * 0.05)
    rover.tells()
    with pytest.raises(Conflict, match=r"foot move 1 of .* begins: the chassis is 0\.0\d\d m and the wheel of leg"):
        live.walks.command(None, 0)


def test_wheels_pressed_in_deeper_than_wheels_sink_are_taken_out_before_a_walk_is_planned(live, standing):
    rover = YieldingRover(live, standing, wheel_scale=0.7)
    pressed_in = np.linalg.norm(rover.state.wheel_forces, axis=1) / (0.7 * live.robot.description.wheel_stiffness)
    assert pressed_in.min() > live.robot.description.clearances.wheel_sink
    live.stances.freeze()
    digest = live.walks.plan(GOAL, SEED).finish()
    found = live.get(digest)
    assert found.status is Status.FOUND, found.reason
    # what it is a product of is what telemetry says
    assert live.get(live.state.products[digest].parents["state"]).posture.tolist() == rover.state.posture.tolist()
    again = live.get(live.walks.replan().finish())
    assert again.digest == digest
    report = replay(live.export_bundle())
    assert report.ok, [one.text for one in report.products if not one.ok]


def test_a_walk_goes_on_on_a_newer_map_where_its_feet_are_on_the_ground_and_on_no_other(live, rover, walk):
    ground = live.get(live.state.dem)

    def raised(by):
        return live.terrains.load(replace(ground, heights=ground.heights + np.float32(by)))

    raised(0.05)
    with pytest.raises(
        Conflict, match=r"the terrain has changed since the walk was planned: the ground is 0\.050 m above"
    ):
        live.walks.command(None, 0)
    newer = raised(0.002)
    sequence = live.walks.command(None, 0)
    assert live.state.products[sequence].parents["dem"] == newer != walk.parents["dem"]
    rover.carries_out_all()
    assert live.walks.walking().done == 1
    report = replay(live.export_bundle())
    assert report.ok, [one.text for one in report.products if not one.ok]


def test_several_foot_moves_are_commanded_only_where_the_ground_of_each_is_known(live, rover, walk):
    ground, last = live.get(live.state.dem), walk.foot_moves - 1
    x, y = walk.stances[-1].contacts[walk.legs[last], :2]
    away = np.hypot(ground.geometry.xs - x, (ground.geometry.ys - y)[:, None])
    live.terrains.load(replace(ground, heights=np.where(away <= 0.15, np.float32(np.nan), ground.heights)))
    with pytest.raises(
        Conflict, match=rf"unknown ground is .* from where foot move {last + 1} puts the foot of leg {walk.legs[last]} "
    ):
        live.walks.command(None, 0, walk.foot_moves)
    assert live.get(live.walks.command(None, 0)).valid


def test_a_state_that_was_made_up_is_planned_from_as_it_is(live, standing):
    assert standing.wheel_forces.any()
    found = live.get(live.walks.plan(GOAL, SEED).finish())
    assert np.array_equal(found.plan.waypoints[0], standing.posture)


def counted(live, walk: str) -> int:
    """Foot moves done, by the log alone: the sends and ends of rows in its events."""
    rows: dict[str, tuple[str, int, int]] = {}
    done: dict[tuple[str, int], set[int]] = {}
    for event in live.events():
        told: Any = event.payload
        if event.type == "command_sent":
            rows[told["id"]] = (told["sequence"], told["run"], told["row"])
        if event.type == "command_done":
            sequence, run, row = rows[told["id"]]
            done.setdefault((sequence, run), set()).add(row)
    numbers = set()
    for (sequence, _), over in done.items():
        made = live.state.products[sequence]
        if made.parents["plan"] != walk:
            continue
        moves = foot_moves(live.get(sequence).commands)
        for i, rows_of in enumerate(moves):
            if set(range(rows_of.first, rows_of.first + rows_of.count)) <= over:
                numbers.add(asked_with(live, sequence).first + i)
    return 1 + max(numbers, default=-1)


def test_how_far_it_is_is_counted_when_something_changed_and_is_right(live, rover, walk, monkeypatch):
    counts = []
    count = walking_module.carried_out_of
    monkeypatch.setattr(walking_module, "carried_out_of", lambda *args: counts.append(1) or count(*args))
    digest = live.state.newest(WALK)
    live.walks.command(None, 0)
    rover.tells()
    live.commands.send(live.commands.arm()["token"])
    for _ in live.get(live.state.sequence).commands:
        rover.carries_out(1)
        assert live.walks.walking().done == counted(live, digest)
    assert live.walks.walking().done == 1
    before = len(counts)
    for _ in range(3):
        rover.tells()
        live.add_note("nothing of the walk")
        assert live.summary()["walking"]["done"] == 1
    assert len(counts) == before
    # another walk is another count; and the first is still as far
    live.stances.freeze()
    other = live.walks.plan(WalkGoal(0.6, 0.1), SEED).finish()
    assert live.get(other).plan is not None
    assert live.walks.walking().done == counted(live, other) == 0
    assert len(counts) == before + 1


def test_commands_start_from_the_telemetry_that_was_judged_however_old(live, rover, walk, monkeypatch):
    frozen = live.state.state
    rover.goes(rover.rest.commanded + np.eye(36)[13] * 0.008)
    clock = live.rover.link._clock
    monkeypatch.setattr(live.rover.link, "_clock", lambda: clock() + 100.0)
    assert live.rover.link.age > 99.0
    sequence = live.get(live.walks.command(None, 0))
    assert live.state.state != frozen
    assert np.abs(sequence.start - rover.state.posture).max() < 1e-9
    assert np.array_equal(sequence.at_rest.set_points, rover.rest.commanded)
    with pytest.raises(Conflict, match="the latest telemetry is 1"):
        live.commands.arm()
