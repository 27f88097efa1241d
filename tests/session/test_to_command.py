"""What commands are made of next, and what becomes of commands that were carried out, each told from one place."""

import pytest

from footfall.core.errors import CommandRefused
from footfall.session.carried_out import to_command
from footfall.session.log.event import next_event
from footfall.session.log.fold import fold_all
from tests.session.test_commands import Rover


@pytest.fixture
def ready(session, frame_of):
    """A session with commands of leg 2, three rows, and an idle rover where they start."""
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(Rover())
    session.rover.take_telemetry(frame_of(0))
    return session


def carry_out(session) -> None:
    for command in session.commands.send(session.commands.arm()["token"])["commands"]:
        for state in ("received", "started", "done"):
            session.rover.take_acknowledgement(command, state)


def log(*payloads):
    """Events, one a second, of products of those kinds."""
    events = []
    for payload in payloads:
        kind = payload.pop("type", "product")
        events.append(next_event(events[-1] if events else None, float(len(events)), kind, payload))
    return events


def product(kind, digest, parents, **more):
    return {
        "kind": kind,
        "digest": digest,
        "parents": parents,
        "settings": None,
        "status": "found",
        "reason": "",
        **more,
    }


ON = {"dem": "d", "state": "s"}
STEP = ("plan", "p2", ON)
MOVE = ("body_move", "m", ON)


def asked(events, finished=None, found=True):
    """As :func:`to_command`; empty for None."""
    return to_command(fold_all(events), events, finished or {}, lambda digest: found) or {}


def test_nothing_is_commanded_before_something_was_planned(session):
    assert session.summary()["to_command"] is None
    assert session.summary()["commands_carried_out"] is False


def test_it_is_what_was_planned_last():
    step, move = product(*STEP, leg=2), product(*MOVE)
    assert asked(log(dict(step))) == {
        "digest": "p2",
        "kind": "plan",
        "step": "p2",
        "plan": "p2",
        "leg": 2,
        "text": "leg 2",
    }
    assert asked(log(dict(step), dict(move))) == {
        "digest": "m",
        "kind": "body_move",
        "leg": None,
        "step": None,
        "plan": "m",
        "text": "chassis move",
    }
    assert asked(log(dict(move), dict(step)))["digest"] == "p2"
    sagging = product("execution", "e", {"plan": "p2", **ON})
    assert asked(log(dict(step), sagging))["text"] == "leg 2, for sag"
    held = asked(log(dict(step), dict(move), product("held_move", "h", {"plan": "m", **ON})))
    assert (held["digest"], held["plan"], held["step"], held["text"]) == ("h", "m", None, "chassis move, for sag")


def test_a_refused_plan_or_move_is_not_commanded():
    step, move = product(*STEP, leg=2), product(*MOVE)
    assert asked(log(dict(step), dict(move)), found=False)["digest"] == "p2"
    refused = {**product("plan", "p3", ON, leg=3), "status": "no_path"}
    assert asked(log(dict(step), refused)) == {}


def test_what_was_carried_out_is_not_commanded_again_unless_it_is_planned_again():
    step, move = product(*STEP, leg=2), product(*MOVE)
    sequence = product("sequence", "q", {"plan": "p2", "dem": "d", "robot": "r"})
    assert asked(log(dict(move), dict(step), dict(sequence)), {"q": 9.0})["digest"] == "m"
    assert asked(log(dict(step), dict(sequence)), {"q": 9.0}) == {}
    assert asked(log(dict(step), dict(sequence), dict(step)), {"q": 1.5})["digest"] == "p2"


def test_an_execution_that_was_carried_out_takes_its_plan_along():
    step, sagging = product(*STEP, leg=2), product("execution", "e", {"plan": "p2", **ON})
    sequence = product("sequence", "q", {"execution": "e", "dem": "d", "robot": "r"})
    edit = product("edit", "q2", {"sequence": "q", "dem": "d", "robot": "r"})
    assert asked(log(step, sagging, sequence, edit), {"q2": 9.0}) == {}


def test_a_plan_that_was_carried_out_as_commanded_takes_its_execution_along():
    move, held = product(*MOVE), product("held_move", "h", {"plan": "m", **ON})
    sequence = product("sequence", "q", {"plan": "m", "dem": "d", "robot": "r"})
    assert asked(log(dict(move), dict(held), dict(sequence)), {"q": 9.0}) == {}
    assert asked(log(dict(move), dict(held), dict(sequence), dict(held)), {"q": 2.5}) == {}
    assert asked(log(dict(move), dict(held), dict(sequence), dict(move), dict(held)), {"q": 2.5})["digest"] == "h"


def test_a_session_tells_it_until_the_rover_has_carried_it_out(ready, frame_of):
    told = ready.summary()["to_command"]
    assert (told["digest"], told["leg"]) == (ready.state.plan, 2)
    carry_out(ready)
    ready.rover.take_telemetry(frame_of(1, offset=0.5))
    assert ready.summary()["to_command"] is None
    assert ready.summary()["commands_carried_out"] is True
    ready.plans.step(1, (1.0, 0.0)).finish()
    assert ready.summary()["to_command"]["leg"] == 1


def test_a_refusal_of_commands_that_were_carried_out_says_so_first(ready, frame_of):
    carry_out(ready)
    ready.rover.take_telemetry(frame_of(1, offset=0.5))
    with pytest.raises(CommandRefused, match=r"^these commands were carried out; make new ones: .* rad") as caught:
        ready.commands.arm()
    assert caught.value.details["check"] == "start"


def test_a_refusal_of_others_does_not(ready, frame_of):
    ready.rover.take_telemetry(frame_of(1, offset=0.5))
    with pytest.raises(CommandRefused, match=r"^(?!these commands)"):
        ready.commands.arm()


def test_commands_may_be_sent_again_where_the_rover_stands_at_their_start_again(ready, frame_of):
    carry_out(ready)
    ready.rover.take_telemetry(frame_of(1))
    assert ready.summary()["commands_carried_out"] is False
    carry_out(ready)


def test_commands_are_carried_out_only_when_every_row_is_done_in_one_run(ready, frame_of):
    ids = ready.commands.send(ready.commands.arm()["token"])["commands"]
    ready.rover.take_acknowledgement(ids[0], "done")
    ready.rover.take_acknowledgement(ids[1], "refused", "no")
    ready.rover.take_telemetry(frame_of(1, offset=0.5))
    assert ready.summary()["commands_carried_out"] is False
    assert ready.summary()["to_command"]["leg"] == 2
