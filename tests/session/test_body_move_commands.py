"""A move of the chassis becomes commands, passes the gate from where the rover stands, and replays the same."""

import json

import numpy as np
import pytest

from footfall import BodyShift, shifted_state
from footfall.core.errors import CommandRefused, Conflict, InvalidInput, NotFound
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.robot.ik import contact_point
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit
from footfall.session.products.kinds import HELD_MOVE
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.chassis_ground import wavy

LEG = 2
ASIDE = BodyShift(dx=0.05, dz=-0.1)


def connected(live, state):
    """What the rover is sent."""
    heard: list[dict] = []
    live.rover.connected(lambda text: heard.append(json.loads(text)))
    live.rover.take_telemetry(TelemetryFrame(0, state, state.posture))
    return heard


def test_every_row_goes_out_and_a_what_if_does_not_stand_in_the_way(live, standing):
    move = live.stances.plan_body_move(ASIDE).finish()
    sequence = live.get(live.sequences.make(move, as_commanded=True))
    assert sequence.valid
    assert live.review.played == live.state.sequence == sequence.digest
    heard = connected(live, standing)
    # planned from elsewhere in thought; the sequence starts where the rover stands
    live.stances.what_if(BodyShift(dz=-0.2))
    ids = live.commands.send(live.commands.arm()["token"])["commands"]
    for row, command_id in enumerate(ids):
        message = [one for one in heard if one["type"] == "command"][-1]
        command = sequence.commands[row]
        assert (message["id"], message["name"], message["leg"], message["force"]) == (
            command_id,
            "POSTURE_MOVE",
            None,
            None,
        )
        assert message["joints"] == command.joints.tolist()
        live.rover.take_acknowledgement(command_id, "done")
    assert [one.state for one in live.state.commands] == ["done"] * len(ids)
    assert live.commands.gate["state"] == "idle"


def test_from_elsewhere_it_is_refused(live, athlete, dem, standing):
    live.sequences.make(live.stances.plan_body_move(ASIDE).finish(), as_commanded=True)
    moved = shifted_state(athlete, dem, standing, BodyShift(dz=-0.05))
    connected(live, moved)
    with pytest.raises(CommandRefused) as caught:
        live.commands.arm()
    assert caught.value.details["check"] == "start"


def test_after_another_terrain_it_is_refused(live, standing):
    live.sequences.make(live.stances.plan_body_move(ASIDE).finish(), as_commanded=True)
    connected(live, standing)
    live.terrains.load(wavy(rocks=((1.0, 3.4, 0.3, 0.2),), half=4.0))
    with pytest.raises(CommandRefused) as caught:
        live.commands.arm()
    assert caught.value.details["check"] == "terrain"


def test_the_move_that_a_search_found_becomes_commands_too(live, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    found = live.stances.find_shift(LEG, (float(x) - 0.5, float(y) + 0.4)).finish()
    sequence = live.get(live.sequences.make(found, as_commanded=True))
    assert sequence.valid
    plan = live.get(found).plan
    assert [one.joints.tolist() for one in sequence.commands] == plan.waypoints[1:].tolist()
    needless = live.stances.find_shift(LEG, (float(x + 0.1), float(y + 0.1))).finish()
    with pytest.raises(InvalidInput, match="no shift is needed"):
        live.sequences.make(needless)


def test_what_is_no_plan_becomes_no_commands(live):
    refused = live.stances.plan_body_move(BodyShift(dx=0.6)).finish()
    with pytest.raises(InvalidInput, match="too short"):
        live.sequences.make(refused)
    with pytest.raises(NotFound, match="holds no plan"):
        live.sequences.make(live.stances.what_if(ASIDE))


def test_edits_exports_and_a_replay(live):
    first = live.sequences.make(live.stances.plan_body_move(ASIDE).finish(), as_commanded=True)
    edited = live.sequences.edit(first, Edit("insert", 0, Command("WAIT", None, None, 1.0)))
    split = live.sequences.edit(edited, Edit("split", 2))
    assert live.get(split).valid
    assert live.review.played == split
    for format in ("json", "csv", "seqjson"):
        assert live.sequences.export(split, format)
    live.sequences.undo()
    assert live.review.played == edited
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    kinds = ["body_move", "sequence", "edit", "edit", "export", "export", "export"]
    assert [(product.kind, product.verdict) for product in report.products] == [(kind, "same") for kind in kinds]


def test_a_ghost_plays_the_newer_of_plan_and_move(live, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    assert live.review.played is None
    live.sequences.make(live.stances.plan_body_move(ASIDE).finish(), as_commanded=True)
    assert live.summary()["played"] == live.state.sequence
    live.plans.step(LEG, (float(x + 0.1), float(y + 0.1))).finish()
    assert live.review.played == live.state.plan
    live.sequences.make(as_commanded=True)
    assert live.review.played == live.state.plan


def test_a_move_is_commanded_with_the_pose_held_where_the_rover_sags(live):
    move = live.stances.plan_body_move(ASIDE).finish()
    made = live.sequences.make(move)
    held = live.get(live.state.newest(HELD_MOVE))
    sequence = live.get(made)
    assert sequence.valid
    assert sequence.provenance.parents["execution"] == held.execution.digest
    assert sequence.at_rest is not None
    # by springs, which the planner's set points are found without: the chassis rests on the planned pose
    planned = live.get(move).plan
    np.testing.assert_allclose(sequence.poses[-1], planned.Ts_site_base[-1], atol=1e-3)
    # where as commanded the set points are the planned posture, held they are beyond it
    assert np.abs(sequence.commanded[-1] - planned.waypoints[-1]).max() > 1e-3
    assert live.executions.way_of(made)["mode"] == "pose_held"
    assert live.fits.up_to_date()[HELD_MOVE.name]["fits"]
    assert live.review.to_command["plan"] == move
    # asked for again as it was, it is there
    events = len(live.events())
    assert live.sequences.make(move) == made
    assert [one.payload["kind"] for one in live.events()[events:]] == ["sequence"]
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    kinds = ["body_move", "held_move", "sequence", "sequence"]
    assert [(product.kind, product.verdict) for product in report.products] == [(kind, "same") for kind in kinds]


def test_as_commanded_says_that_the_rover_sags(live):
    made = live.sequences.make(live.stances.plan_body_move(ASIDE).finish(), as_commanded=True)
    told = live.executions.way_of(made)
    assert (told["mode"], told["doubt"]) == ("rigid", True)
    assert "the rover sags" in told["text"]


def test_another_mode_than_pose_held_is_refused_for_a_move(live):
    move = live.stances.plan_body_move(ASIDE).finish()
    for ask in (live.sequences.make, live.executions.plan_held_move):
        with pytest.raises(InvalidInput, match="a move of the chassis can't be commanded droop-aware"):
            ask(move, ExecutionSettings(mode="droop_aware"))


def test_a_held_move_that_fails_a_check_names_it_and_offers_as_commanded(live):
    move = live.stances.plan_body_move(ASIDE).finish()
    with pytest.raises(InvalidInput, match=r"pose held: .* then sags, and where the chassis ends is not predicted"):
        live.sequences.make(move, ExecutionSettings(least_load=1e5))
    assert live.state.sequence is None


def test_a_held_move_needs_a_move(live):
    with pytest.raises(Conflict, match="no move of the chassis yet"):
        live.executions.plan_held_move()
    refused = live.stances.plan_body_move(BodyShift(dx=0.6)).finish()
    with pytest.raises(Conflict, match="no move of the chassis was found"):
        live.executions.plan_held_move(refused)
    with pytest.raises(NotFound, match="holds no move of the chassis"):
        live.executions.plan_held_move(live.stances.what_if(ASIDE))
