"""A move of the chassis becomes commands, passes the gate from where the rover stands, and replays the same."""

import json

import pytest

from footfall import BodyShift, shifted_state
from footfall.core.errors import CommandRefused, InvalidInput, NotFound
from footfall.robot.ik import contact_point
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.chassis_ground import wavy

LEG = 2
ASIDE = BodyShift(dx=0.05, dz=-0.1)


def connected(live, state):
    """What the rover is sent."""
    heard: list[dict] = []
    live.rover_connected(lambda text: heard.append(json.loads(text)))
    live.take_telemetry(TelemetryFrame(0, state, state.posture))
    return heard


def test_every_row_goes_out_and_a_what_if_does_not_stand_in_the_way(live, standing):
    move = live.plan_body_move(ASIDE).finish()
    sequence = live.get(live.make_sequence(move))
    assert sequence.valid
    assert live.played == live.state.sequence == sequence.digest
    heard = connected(live, standing)
    # planned from elsewhere in thought; the sequence starts where the rover stands
    live.what_if(BodyShift(dz=-0.2))
    ids = live.send(live.arm()["token"])["commands"]
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
        live.take_acknowledgement(command_id, "done")
    assert [one.state for one in live.state.commands] == ["done"] * len(ids)
    assert live.gate["state"] == "idle"


def test_from_elsewhere_it_is_refused(live, athlete, dem, standing):
    live.make_sequence(live.plan_body_move(ASIDE).finish())
    moved = shifted_state(athlete, dem, standing, BodyShift(dz=-0.05))
    connected(live, moved)
    with pytest.raises(CommandRefused) as caught:
        live.arm()
    assert caught.value.details["check"] == "start"


def test_after_another_terrain_it_is_refused(live, standing):
    live.make_sequence(live.plan_body_move(ASIDE).finish())
    connected(live, standing)
    live.load_terrain(wavy(rocks=((1.0, 3.4, 0.3, 0.2),), half=4.0))
    with pytest.raises(CommandRefused) as caught:
        live.arm()
    assert caught.value.details["check"] == "terrain"


def test_the_move_that_a_search_found_becomes_commands_too(live, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    found = live.find_shift(LEG, (float(x) - 0.5, float(y) + 0.4)).finish()
    sequence = live.get(live.make_sequence(found))
    assert sequence.valid
    plan = live.get(found).plan
    assert [one.joints.tolist() for one in sequence.commands] == plan.waypoints[1:].tolist()
    needless = live.find_shift(LEG, (float(x + 0.1), float(y + 0.1))).finish()
    with pytest.raises(InvalidInput, match="no shift is needed"):
        live.make_sequence(needless)


def test_what_is_no_plan_becomes_no_commands(live):
    refused = live.plan_body_move(BodyShift(dx=0.6)).finish()
    with pytest.raises(InvalidInput, match="too short"):
        live.make_sequence(refused)
    with pytest.raises(NotFound, match="holds no plan"):
        live.make_sequence(live.what_if(ASIDE))


def test_edits_exports_and_a_replay(live):
    first = live.make_sequence(live.plan_body_move(ASIDE).finish())
    edited = live.edit_sequence(first, Edit("insert", 0, Command("WAIT", None, None, 1.0)))
    split = live.edit_sequence(edited, Edit("split", 2))
    assert live.get(split).valid
    assert live.played == split
    for format in ("json", "csv", "seqjson"):
        assert live.export_sequence(split, format)
    live.undo_sequence()
    assert live.played == edited
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    kinds = ["body_move", "sequence", "edit", "edit", "export", "export", "export"]
    assert [(product.kind, product.verdict) for product in report.products] == [(kind, "same") for kind in kinds]


def test_a_ghost_plays_the_newer_of_plan_and_move(live, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    assert live.played is None
    live.make_sequence(live.plan_body_move(ASIDE).finish())
    assert live.summary()["played"] == live.state.sequence
    live.plan_step(LEG, (float(x + 0.1), float(y + 0.1))).finish()
    assert live.played == live.state.plan
    live.make_sequence(as_commanded=True)
    assert live.played == live.state.plan
