"""A walk is carried out foot move by foot move: its commands, how far it is, and the way on where it no longer fits."""

import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.planning.walk.excerpt import excerpt, parts_count, start_of
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.session.jobs.requests import WalkRequest
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import WALK
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame

NEAR = WalkRequest(WalkGoal(0.5, 0.1), WalkSettings(seed=1))


class Rover:
    """Stands where it was told to go, at once, unless it is told to stand elsewhere."""

    def __init__(self, live, state) -> None:
        self.live, self.state, self.number, self.sent = live, state, 0, []
        live.rover.connected(self.hears)
        self.tells()

    def hears(self, text: str) -> None:
        message = json.loads(text)
        if message["type"] == "command":
            self.sent.append(message)

    def stands(self, posture, T_site_base) -> None:
        self.state = replace(self.state, posture=posture, T_site_base=T_site_base)
        self.tells()

    def tells(self) -> None:
        self.number += 1
        self.state = replace(self.state, time=self.number * 0.1)
        self.live.rover.take_telemetry(TelemetryFrame(self.number, self.state, self.state.posture))

    def carries_out(self, rows: int) -> None:
        """The next rows of what is being sent."""
        sequence = self.live.get(self.live.commands.gate["sequence"])
        for _ in range(rows):
            message = self.sent[-1]
            self.live.rover.take_acknowledgement(message["id"], "done")
            row = message["row"]
            self.stands(sequence.predicted[row], sequence.poses[row])
            self.live.rover.commanding.look()


def sent(live, rover):
    """All rows of the present sequence, carried out."""
    rover.tells()
    live.commands.send(live.commands.arm()["token"])
    rover.carries_out(len(live.get(live.state.sequence).commands))
    assert live.commands.gate["state"] == "idle"


@pytest.fixture
def walk(live):
    digest = live.stances.ask(WALK, NEAR).finish()
    assert live.get(digest).plan is not None, live.get(digest).reason
    return live.get(digest).plan


def test_foot_moves_are_commanded_one_by_one_and_told(live, standing, walk):
    rover = Rover(live, standing)
    of = parts_count(walk)
    assert of >= walk.foot_moves > 1
    for number in range(of):
        told = live.walks.walking()
        assert (told.done, told.next, told.of, told.against) == (number, number, of, "")
        assert told.commanded == 0
        rover.tells()
        sequence = live.get(live.walks.command(None, number))
        assert live.walks.walking().commanded == 1
        assert sequence.valid, sequence.failures
        [rows] = live.walks.foot_moves_in(sequence.digest)
        assert (rows.first_row, rows.rows) == (0, len(sequence.commands))
        legs = {one.leg for one in sequence.commands} - {None}
        if number < walk.foot_moves:
            assert legs == {walk.legs[number]} == {told.leg}
            assert rows.text == f"foot move {number + 1} of {walk.foot_moves}: leg {told.leg}"
        np.testing.assert_array_equal(sequence.start, start_of(walk, number)[0])
        sent(live, rover)
    told = live.walks.walking()
    assert (told.done, told.next, told.against) == (of, None, "")
    np.testing.assert_allclose(rover.state.posture, walk.waypoints[-1], atol=1e-12)
    np.testing.assert_allclose(rover.state.T_site_base, walk.Ts_site_base[-1], atol=1e-6)
    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, [one.text for one in report.products if not one.ok]


def test_a_rover_that_stands_elsewhere_is_told_by_how_much_and_the_rest_is_planned_anew(live, standing, walk):
    rover = Rover(live, standing)
    live.walks.command(None, 0)
    sent(live, rover)
    posture = rover.state.posture.copy()
    posture[6 * walk.legs[0] + 2] += 0.02
    rover.stands(posture, rover.state.T_site_base)
    with pytest.raises(Conflict, match=r"\+1\.15° from there, at most 0\.57° are accepted: re-plan the walk from here"):
        live.walks.command(None, 1)
    assert live.walks.walking().against
    again = live.get(live.walks.replan().finish())
    assert again.goal.digest == NEAR.goal.digest
    assert again.provenance.settings.digest == NEAR.settings.digest
    np.testing.assert_array_equal(again.plan.waypoints[0], posture)
    assert (live.walks.walking().done, live.walks.walking().against) == (0, "")
    assert live.walks.walking().commanded == 0  # those there are go back to the walk before


def test_pinned_places_that_had_their_foot_are_not_asked_for_again(live, standing, walk):
    """They are footfalls of another walk: of its first foot move and of its last."""
    ends = [(leg, walk.stances[at].contacts[leg]) for leg, at in ((walk.legs[0], 1), (walk.legs[-1], -1))]
    pins = tuple(Place(float(x), float(y), 0.1, leg) for leg, (x, y, _) in ends)
    asked = replace(NEAR, settings=replace(NEAR.settings, pinned=pins))
    plan = live.get(live.stances.ask(WALK, asked).finish()).plan
    to = [(leg, *stance.contacts[leg, :2]) for leg, stance in zip(plan.legs, plan.stances[1:], strict=True)]
    put = [
        next(move for move, at in enumerate(to) if at[0] == pin.leg and np.allclose(at[1:], (pin.x, pin.y)))
        for pin in pins
    ]
    rover = Rover(live, standing)
    for number in range(min(put) + 1):
        live.walks.command(None, number)
        sent(live, rover)
    again = live.get(live.walks.replan().finish())
    left = again.provenance.settings.pinned
    assert [one.digest for one in left] == [pin.digest for pin, move in zip(pins, put, strict=True) if move > min(put)]
    assert len(left) == 1
    # its own walk is what the next one leaves them out by
    assert live.walks.walking().done == 0
    assert live.get(live.walks.replan().finish()).digest == again.digest


def test_between_foot_moves_the_rover_is_looked_at_and_a_run_held_where_it_stands_otherwise(live, standing, walk):
    rover = Rover(live, standing)
    sequence = live.get(live.walks.command(None, 0, walk.foot_moves))
    assert sequence.valid
    assert live.walks.walking().commanded == walk.foot_moves
    first, second, *_ = live.walks.foot_moves_in(sequence.digest)
    rover.tells()
    live.commands.send(live.commands.arm()["token"])
    rover.carries_out(first.rows + second.rows - 1)
    assert live.walks.walking().done == 1
    message = rover.sent[-1]
    assert message["row"] == second.first_row + second.rows - 1
    live.rover.take_acknowledgement(message["id"], "done")
    live.rover.commanding.look()
    assert rover.sent[-1] is message  # nothing goes by telemetry from before the foot was placed
    T_site_base = sequence.poses[message["row"]].copy()
    T_site_base[0, 3] += 0.08
    rover.stands(sequence.predicted[message["row"]], T_site_base)
    live.rover.commanding.look()
    assert rover.sent[-1] is message
    assert live.commands.gate["waiting"]
    assert "held between foot moves: the chassis has moved by 0.08" in live.commands.gate["why"]
    assert live.walks.walking().done == 2
    rover.stands(sequence.predicted[message["row"]], sequence.poses[message["row"]])
    live.commands.resume()
    assert rover.sent[-1]["row"] == message["row"] + 1


def test_an_excerpt_begins_where_the_rover_is(walk, standing):
    for number in range(parts_count(walk)):
        posture, pose = start_of(walk, number)
        off = posture + 0.004
        part = excerpt(walk, number, 1, replace(standing, posture=off, T_site_base=pose))
        np.testing.assert_array_equal(part.waypoints[0], off)
        own = walk.waypoints[1:][walk.moves[1:] == number]
        np.testing.assert_array_equal(part.waypoints[-len(own) :], own)
        assert part.legs == walk.legs[number : number + 1]


def test_what_is_no_walk_and_no_foot_move_is_refused(live, standing, walk):
    of = parts_count(walk)
    with pytest.raises(InvalidInput, match=f"{of} parts, counted from 0"):
        live.walks.command(None, of)
    with pytest.raises(InvalidInput):
        live.walks.command(None, 0, 0)
    with pytest.raises(NotFound):
        live.walks.command("0" * 32, 0)
    with pytest.raises(NotFound):
        live.walks.replan("0" * 32)
    with pytest.raises(Conflict, match=r"the wheel of leg 0 .* from where it starts: re-plan the walk from here"):
        live.walks.command(None, 1)
