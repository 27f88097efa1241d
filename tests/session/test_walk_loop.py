"""A session walks to a goal by itself: decisions in the log, through the gate, held, ended, stopped by the operator."""

import json
import threading
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import LineString, Point

import footfall.session.walking as walking_module
from footfall.core.errors import CommandRefused, Conflict, InvalidInput
from footfall.core.frames import apply, inverse, rotation, transform
from footfall.planning.answers import Status
from footfall.planning.looking.how_to_see import LIFTED
from footfall.planning.route.problem import NoGo, RouteSettings
from footfall.planning.walk import plan as planning
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk_execution import stage
from footfall.planning.walk_execution.decision import WayOnSettings
from footfall.planning.walk_execution.firmer import MORE_CLEARANCE, firmer
from footfall.planning.watch import OutOfTime, Watch
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import wait
from footfall.sequence.edit import Edit
from footfall.session.access.identity import Identity, Role
from footfall.session.gate.lease import CONN_FOR
from footfall.session.gate.machine import ARMED_FOR
from footfall.session.jobs.local import InlineJobs
from footfall.session.loop_pieces import Pieces
from footfall.session.loop_settings import LoopSettings
from footfall.session.loop_ways import WaysOn
from footfall.session.products.kinds import FOOT_MOVES, ROUTE, WALK
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.session.walk_loop import WalkLoop
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import TelemetryFrame
from tests.support.drifted import looked_twice
from tests.support.waiting import BOUND, joined, until

GOAL = WalkGoal(0.4, 0.1)
UNSEEN = LoopSettings(
    way_on=WayOnSettings(look_every=0), walk=WalkSettings(seed=1, smoothing=Smoothing(rounds=0)), farthest=3.0
)


class RigidRover:
    """At once where each row is predicted to leave it; carries out what it is sent in a thread of its own.

    before_row: called before each row, with how many were carried out. takes_images: called when they are asked for.
    slips: (3,) [m], by which it is found away from
    where the next row leaves it, once. correction: (4, 4) that moves its odometry to where it is.
    """

    def __init__(self, live, state, correction=None):
        self.live, self.state = live, state
        self.correction = np.eye(4) if correction is None else correction
        self.number, self.rows, self.sent = 0, 0, []
        self.before_row, self.slips = lambda rows: None, None
        self.takes_images = lambda: None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rover")
        live.rover.link._clock = lambda: (
            0.1 * self.number
        )  # telemetry is as old as the rover says, however slow the machine
        live.rover.connected(self._hears)
        self._tells()

    def _hears(self, text):
        message = json.loads(text)
        if message["type"] == "command":
            self.sent.append(message)
        elif message["type"] == "image_request":
            self.takes_images()

    def _tells(self):
        self.number += 1
        told = replace(self.state, T_site_base=inverse(self.correction) @ self.state.T_site_base)
        self.live.rover.take_telemetry(TelemetryFrame(self.number, told, told.posture))

    def _run(self):
        while not self._closing.wait(0.05):
            if len(self.sent) > self.rows:
                self.before_row(self.rows)
                message = self.sent[self.rows]
                self.rows += 1
                self._carries_out(message)
            self._tells()

    def _carries_out(self, message):
        sequence = self.live.get(message["sequence"])
        T = np.array(sequence.poses[message["row"]])
        if self.slips is not None:
            T[:3, 3] += self.slips
            self.slips = None
        self.state = replace(self.state, posture=sequence.predicted[message["row"]], T_site_base=T)
        self.live.rover.take_acknowledgement(message["id"], "done")
        self._tells()
        self.live.rover.commanding.look()

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._closing.set()
        joined(self._thread)


@pytest.fixture
def rover(live, standing):
    # nothing is known of what it bears: it is taken as rigid
    bare = replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))
    live.stances.set(bare)
    with RigidRover(live, bare) as made:
        yield made


def decided(live):
    return [event.payload["act"] for event in live.events() if event.type == "walk_decided"]


def ended(loop):
    assert loop.wait(BOUND), loop.as_dict()
    return loop.outcome, loop.reason


def test_it_arrives_by_decisions_that_the_log_has_and_a_replay_finds_the_same(live, rover):
    loop = live.walk_to(GOAL, UNSEEN)
    with pytest.raises(Conflict, match="already"):
        live.walk_to(GOAL, UNSEEN)
    assert ended(loop)[0] == "arrived"
    acts = decided(live)
    assert acts[0] == "replan"
    assert acts[-2:] == ["arrived", "end"]
    assert set(acts[1:-2]) <= {"go", "replan"}
    assert loop.foot_moves == acts.count("go") == loop.as_dict()["decided"]["go"]
    assert np.hypot(*(rover.state.T_site_base[:2, 3] - (GOAL.x, GOAL.y))) <= GOAL.within
    report = replay(live.export_bundle())
    assert report.ok, [one.text for one in report.products if not one.ok]


def test_held_it_sends_nothing_more_and_goes_on_where_it_was(live, rover):
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    loop.hold()
    go_on.set()
    until(lambda: live.commands.gate["waiting"], "the hold")
    assert (loop.state, len(rover.sent)) == ("held", rover.rows)
    number = rover.number
    until(lambda: rover.number > number + 5, "more telemetry")
    assert len(rover.sent) == rover.rows == 2
    until(lambda: loop.as_dict()["waits_for"] == "somebody to let it go on: held by local", "what it waits for")
    assert loop.as_dict()["part"] == live.walks.walking().text.split("next: ")[1] == name_of_first(live)
    loop.go_on()
    assert ended(loop)[0] == "arrived"
    assert (loop.as_dict()["part"], loop.as_dict()["waits_for"]) == ("", "")


def name_of_first(live):
    plan = live.get(live.state.newest(WALK)).plan
    return f"foot move 1 of {plan.foot_moves}: leg {plan.legs[0]}"


@pytest.mark.parametrize("act", ["hold", "cancel"])
def test_what_steers_it_just_as_its_commands_end_counts_all_the_same(live, rover, monkeypatch, act):
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == len(live.get(live.state.sequence).commands) - 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    steer = {"hold": "hold", "cancel": "abort"}[act]
    late = getattr(live.commands, steer)

    def after_the_end(who):
        go_on.set()
        until(lambda: live.commands.gate["run"] is None, "the end of the run")
        late(who)

    monkeypatch.setattr(live.commands, steer, after_the_end)
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    getattr(loop, act)()
    if act == "hold":
        until(lambda: loop.as_dict()["waits_for"] == "somebody to let it go on", "what it waits for")
        assert (loop.state, loop.foot_moves) == ("held", 1)
        loop.go_on()
    assert ended(loop)[0] == {"hold": "arrived", "cancel": "cancelled"}[act]


def test_let_go_on_before_the_row_has_ended_it_walks_as_if_it_was_not_held(live, rover):
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    loop.hold()
    loop.go_on()
    told = live.summary()["walk_loop"]
    assert (told["state"], told["act"], live.commands.gate["mode"]) == ("going", "go", "whole")
    go_on.set()
    assert ended(loop)[0] == "arrived"
    assert live.summary()["walk_loop"]["outcome"] == "arrived"


def test_where_its_run_is_let_go_on_it_goes_on_itself(live, rover):
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    loop.hold()
    go_on.set()
    until(lambda: loop.as_dict()["waits_for"] == "somebody to let it go on: held by local", "what it waits for")
    live.commands.next_row()
    until(lambda: live.commands.gate["waiting"], "the end of the row")
    assert loop.state == "held"
    live.commands.resume()
    until(lambda: loop.state != "held", "the walk that goes on")
    assert ended(loop)[0] == "arrived"


def test_a_run_of_somebody_else_just_after_its_own_is_not_taken_for_it(live, rover):
    """That one is aborted after its first row, which waits; its own was carried out."""
    loop, carries_out, others = live.walk_to(GOAL, UNSEEN), rover._carries_out, []

    def then(message):
        last = message["row"] == len(live.get(message["sequence"]).commands) - 1
        if not last or others:
            return carries_out(message)
        # the walk hears of nothing until the other run has ended, too
        with loop._sending:
            carries_out(message)
            waits = live.sequences.edit(live.walks.command(None, 1), Edit("insert", 0, command=wait(1.0)))
            others.append(live.commands.send(live.commands.arm(waits)["token"])["run"])
            live.commands.abort()
            rover.rows += 1
            carries_out(rover.sent[-1])
        return None

    rover._carries_out = then
    assert ended(loop)[0] == "arrived"
    assert len(others) == 1
    assert live.commands.end_of_run(others[0]) == ("aborted", "aborted")
    assert live.commands.end_of_run(others[0] - 1) == ("done", "")
    assert live.commands.end_of_run(live.state.runs + 1) is None


def test_a_walk_that_has_ended_is_not_steered_and_nobody_s_run_is_aborted_for_it(live, rover, monkeypatch):
    loop = live.walk_to(GOAL, UNSEEN)
    loop.cancel()
    ended(loop)
    aborted = []
    monkeypatch.setattr(live.commands, "abort", lambda *who: aborted.append(who))
    for act in (loop.hold, loop.go_on, loop.cancel):
        with pytest.raises(Conflict, match="has ended"):
            act()
    assert (loop.state, aborted) == ("ended", [])


def test_an_arming_that_ran_out_is_made_anew(live, rover, monkeypatch):
    """As on a machine so busy that what was armed is sent too late."""
    gate, send, tried = live.rover.commanding.gate, live.commands.send, []
    clock = gate._clock

    def too_late(token, sequence, who, row_by_row):
        if not tried:
            monkeypatch.setattr(gate, "_clock", lambda: clock() + ARMED_FOR + 1.0)
        tried.append(sequence)
        return send(token, sequence, who, row_by_row)

    monkeypatch.setattr(live.commands, "send", too_late)
    loop = live.walk_to(GOAL, UNSEEN)
    assert ended(loop)[0] == "arrived"
    assert decided(live).count("go") == loop.foot_moves
    assert tried[0] == tried[1]
    assert len(tried) == loop.foot_moves + 1


def at_fault(live, loop):
    """Of the rover, which carries its row out all the same."""
    frame = live.rover.frame
    live.rover.take_telemetry(TelemetryFrame(frame.number + 1, replace(frame.state, mode="fault"), frame.commanded))
    ended(loop)


@pytest.mark.parametrize(
    ("act", "outcome", "reason"),
    [
        (lambda live, loop: loop.cancel(), "cancelled", "ended by local"),
        (lambda live, loop: live.commands.stop("a dust devil"), "stopped", "the rover was stopped"),
        (lambda live, loop: live.commands.abort(), "stopped", "not carried out to their end"),
        (lambda live, loop: live.rover.disconnected(), "stopped", "the rover is not connected"),
        (lambda live, loop: at_fault(live, loop), "stopped", "the rover reports a fault"),
    ],
    ids=["cancelled", "stopped", "run aborted", "link lost", "fault"],
)
def test_it_leaves_the_rover_to_whoever_takes_over(live, rover, act, outcome, reason):
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    act(live, loop)
    go_on.set()
    found = ended(loop)
    assert (found[0], reason in found[1]) == (outcome, True), found
    assert decided(live)[-1] == "end"
    until(lambda: live.commands.gate["state"] == "idle", "the end of the run")
    assert len(rover.sent) == 2
    with pytest.raises(Conflict, match="has ended"):
        loop.go_on()


@pytest.fixture
def making(live, monkeypatch):
    """Stops the loop where it has just made commands: waits for ``reached``, and goes on with ``go_on``."""
    reached, go_on, make = threading.Event(), threading.Event(), live.walks.command

    def made(*asked):
        sequence = make(*asked)
        reached.set()
        assert go_on.wait(BOUND)
        return sequence

    monkeypatch.setattr(live.walks, "command", made)
    yield reached, go_on
    go_on.set()


def stopped_for_a_moment(live):
    live.commands.stop("a dust devil")
    live.rover.take_stop_acknowledgement()
    live.commands.clear_stop()


def test_held_while_commands_are_made_it_sends_none_until_it_goes_on(live, rover, making):
    reached, go_on = making
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    loop.hold()
    go_on.set()
    number = rover.number
    until(lambda: rover.number > number + 10, "more telemetry")
    assert (loop.state, rover.sent, live.commands.gate["state"]) == ("held", [], "idle")
    loop.go_on()
    assert ended(loop)[0] == "arrived"


@pytest.mark.parametrize(
    ("act", "outcome", "reason"),
    [
        (lambda live, loop: loop.cancel(), "cancelled", "ended by local"),
        (lambda live, loop: stopped_for_a_moment(live), "stopped", "was stopped"),
    ],
    ids=["cancelled", "stopped and cleared"],
)
def test_what_ends_it_while_commands_are_made_lets_none_go(live, rover, making, act, outcome, reason):
    reached, go_on = making
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    act(live, loop)
    go_on.set()
    found = ended(loop)
    assert (found[0], reason in found[1]) == (outcome, True), found
    assert rover.sent == []


def test_without_the_conn_it_is_neither_held_nor_ended(live, rover, making):
    reached, go_on = making
    other = Identity("another", Role.COMMANDER, page="elsewhere")
    loop = live.walk_to(GOAL, UNSEEN)
    assert reached.wait(BOUND)
    live.commands.conn_act("take", other)
    for act in (loop.hold, loop.cancel):
        with pytest.raises(CommandRefused, match="another"):
            act()
    assert loop.state == "going"
    go_on.set()
    found = ended(loop)
    assert (found[0], "another" in found[1]) == ("stopped", True), found
    assert rover.sent == []


def test_a_rover_that_is_not_where_its_walk_has_it_plans_anew(live, rover):
    def before(rows):
        # in the last row of its first part everything slips
        if live.walk_loop.foot_moves == 0 and rows == len(live.get(live.state.sequence).commands) - 1:
            rover.slips = (0.04, 0.0, 0.0)

    rover.before_row = before
    ended(live.walk_to(GOAL, UNSEEN))
    told = [event.payload for event in live.events() if event.type == "walk_decided"]
    anew = [one["reason"] for one in told if one["act"] == "replan"]
    assert anew[0] == "there is no walk yet"
    assert anew[1].startswith("the rover is off its walk: the chassis is 0.040 m")


def footfall(live, goal, settings, pick):
    """A place that a walk to a goal has, pinned for its leg; pick: of those in their order."""
    plan = live.get(live.walks.plan(goal, settings).finish()).plan
    leg, stance = pick(list(zip(plan.legs, plan.stances[1:], strict=True)))
    return Place(float(stance.contacts[leg, 0]), float(stance.contacts[leg, 1]), 0.1, leg)


def put_on(plan, pin):
    """Numbers of the foot moves that put a pinned place's foot on it."""
    put = enumerate(zip(plan.legs, plan.stances[1:], strict=True))
    at = (pin.x, pin.y)
    return [move for move, (leg, to) in put if leg == pin.leg and np.allclose(to.contacts[leg, :2], at)]


def walks_of(live, since):
    """Those that were planned after so many events."""
    made = [event.payload for event in live.events()[since:] if event.type == "product"]
    return [live.get(one["digest"]) for one in made if one["kind"] == WALK.name]


def test_a_pinned_place_that_had_its_foot_is_not_asked_for_again(live, rover):
    pin = footfall(live, GOAL, UNSEEN.walk, lambda put: put[0])
    pinned = replace(UNSEEN, walk=replace(UNSEEN.walk, pinned=(pin,)))
    [met, *_] = put_on(live.get(live.walks.plan(GOAL, pinned.walk).finish()).plan, pin)
    since = len(live.events())

    def before(rows):
        # in the last row of that part everything slips: the rest is planned anew
        last = len(live.get(live.state.sequence).commands) - 1
        if live.walk_loop.foot_moves == met and rover.sent[rows]["row"] == last:
            rover.slips = (0.04, 0.0, 0.0)

    rover.before_row = before
    assert ended(live.walk_to(GOAL, pinned))[0] == "arrived"
    asked = [len(one.provenance.settings.pinned) for one in walks_of(live, since)]
    assert len(asked) > 1
    assert asked == [1] + (len(asked) - 1) * [0]


def test_a_pinned_place_beyond_a_piece_is_asked_for_in_a_later_one(live, rover):
    goal = WalkGoal(1.4, 0.1)
    pin = footfall(live, goal, UNSEEN.walk, lambda put: max(put, key=lambda one: one[1].contacts[one[0], 0]))
    pin = replace(pin, x=pin.x - 0.03, y=pin.y + 0.02)  # where no foot comes unless it is asked for
    pinned = replace(UNSEEN, walk=replace(UNSEEN.walk, pinned=(pin,)), farthest=0.5)
    since = len(live.events())
    assert ended(live.walk_to(goal, pinned))[0] == "arrived"
    found = walks_of(live, since)
    assert [one.status for one in found] == len(found) * [Status.FOUND]
    assert not found[0].provenance.settings.pinned
    assert [put_on(one.plan, pin) != [] for one in found].count(True) == 1


DRIFT = transform(rotation("z", np.array(0.005)), (0.06, -0.02, 0.0))


class EndsHalfWay(Watch):
    """A time limit that passes where the first search has come half the way, however fast the machine is."""

    searches = 0

    def __init__(self, *asked):
        super().__init__(*asked)
        EndsHalfWay.searches += 1
        self._first, self._far = EndsHalfWay.searches == 1, 0.0

    def phase(self, fraction, text):
        super().phase(fraction, text)
        self._far = fraction

    def tick(self, looks=1):
        super().tick(looks)
        if self._first and self._far > 0.5:
            raise OutOfTime


@pytest.mark.usefixtures("forgotten")
def test_where_a_search_runs_out_of_time_it_goes_first_where_that_came(live, rover, monkeypatch):
    monkeypatch.setattr(EndsHalfWay, "searches", 0)
    monkeypatch.setattr(planning, "Watch", EndsHalfWay)
    goal = WalkGoal(1.2, 0.1)
    loop = live.walk_to(goal, UNSEEN)
    assert ended(loop)[0] == "arrived"
    walks = [live.get(digest) for digest, made in live.state.products.items() if made.kind == WALK.name]
    first, second, third = walks[:3]
    assert (first.status, second.status, third.status) == (Status.TIME_LIMIT, Status.FOUND, Status.FOUND)
    assert (second.goal.x, second.goal.y) == pytest.approx(first.partial.Ts_site_base[-1, :2, 3])
    assert 0.0 < second.goal.x < goal.x
    assert (third.goal.x, third.goal.y) == (goal.x, goal.y)
    acts = decided(live)
    assert acts[:3] == ["replan", "replan", "go"]
    assert "look" not in acts
    told = [event.payload["reason"] for event in live.events() if event.type == "walk_decided"]
    assert "where the latest search came nearest" in told[1]


def test_a_walk_whose_commands_are_refused_is_planned_as_far_and_more_firmly(live, rover, monkeypatch):
    """The rover would not stand firmly by the first plan, nor after a look, nor by the second; by the third it does."""
    plain, refusals = live.walks.command, iter(range(3))

    def command(walk, first, *asked, **more):
        if next(refusals, None) is not None:
            raise InvalidInput("foot move 1: nothing holds the rover in balance")
        return plain(walk, first, *asked, **more)

    monkeypatch.setattr(live.walks, "command", command)
    monkeypatch.setattr(WalkLoop, "_look", lambda _, so_far: replace(so_far, looked=True, refused=""))
    far = WalkGoal(1.2, 0.1)
    loop = live.walk_to(far, replace(UNSEEN, farthest=0.7, way_on=WayOnSettings(look_every=0)))
    rover.before_row = lambda rows: loop.leave() if loop.foot_moves else None
    ended(loop)
    assert decided(live)[:7] == ["replan", "go", "look", "go", "replan", "go", "replan"]
    made = [one for one in live.state.products.values() if one.kind == WALK.name]
    asked = [live.get(one.settings).settings for one in made]
    assert [one.digest for one in asked] == [
        replace(firmer(UNSEEN.walk, times), seed=UNSEEN.walk.seed + times).digest for times in range(3)
    ]
    goals = [live.get(digest).goal for digest, one in live.state.products.items() if one.kind == WALK.name]
    assert all(goal.x == pytest.approx(goals[0].x, abs=0.05) for goal in goals)


def test_a_walk_on_which_bodies_come_too_near_is_planned_with_more_clearance(live, rover, monkeypatch):
    """After a search that finds none with as much it is planned with as much as was asked for."""
    plain, refusals = live.walks.command, iter(("wheel clearance", "self collision", "torque", "self collision"))

    def command(walk, first, *asked, **more):
        if fails := next(refusals, None):
            raise InvalidInput(f"foot move 1: {fails} fails", fails=[fails])
        return plain(walk, first, *asked, **more)

    def finds_none(ways, goal, asked, anew):
        walk, found = plans(ways, goal, asked, anew)
        if asked.clearance > UNSEEN.walk.clearance + 1.5 * MORE_CLEARANCE:
            found = replace(found, status=Status.NO_PATH, plan=None, reason="it has less clearance where it stands")
        return walk, found

    plans = WaysOn.plan
    monkeypatch.setattr(WaysOn, "plan", finds_none)
    monkeypatch.setattr(live.walks, "command", command)
    monkeypatch.setattr(WalkLoop, "_look", lambda _, so_far: replace(so_far, looked=True, refused=""))
    loop = live.walk_to(WalkGoal(1.2, 0.1), replace(UNSEEN, way_on=WayOnSettings(look_every=0)))
    rover.before_row = lambda rows: loop.leave() if loop.foot_moves else None
    ended(loop)
    made = [one for one in live.state.products.values() if one.kind == WALK.name]
    added = [live.get(one.settings).settings.clearance - UNSEEN.walk.clearance for one in made]
    # the first refusal is followed by a look alone
    assert added == pytest.approx([0.0, MORE_CLEARANCE, MORE_CLEARANCE, 2 * MORE_CLEARANCE, 0.0])


AROUND = replace(UNSEEN, farthest=0.9, route=RouteSettings(no_go=(NoGo(0.8, 0.0, 0.25),)))


def test_it_follows_a_route_piece_by_piece_around_what_is_no_go(live, rover):
    goal = WalkGoal(1.6, 0.0)
    loop = live.walk_to(goal, AROUND)
    assert ended(loop)[0] == "arrived"
    made = [(one.kind, live.get(digest)) for digest, one in live.state.products.items()]
    routes = [LineString(found.plan.points) for kind, found in made if kind == ROUTE.name and found.plan is not None]
    walks = [found.goal for kind, found in made if kind == WALK.name]
    assert len(walks) > 1
    assert min(route.distance(Point(0.8, 0.0)) for route in routes) >= 0.25 - 1e-9
    for piece in walks:
        assert min(route.distance(Point(piece.x, piece.y)) for route in routes) <= piece.within
    assert (walks[-1].x, walks[-1].y) == (goal.x, goal.y)
    assert max(abs(one.y) for one in walks) > 0.1
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def test_no_foot_of_a_walk_along_a_route_is_put_on_its_no_go_areas(live, rover):
    """They are forbidden once, whoever else forbade them."""
    assert AROUND.route is not None
    [area] = AROUND.route.no_go
    own = Place(area.x, area.y, area.radius)
    for said in ((), (own,)):
        loop = live.walk_to(WalkGoal(1.6, 0.0), replace(AROUND, walk=replace(AROUND.walk, forbidden=said)))
        until(lambda loop=loop: loop.act == "go", "the first foot move", seen=loop.as_dict)
        loop.cancel()
        ended(loop)
    walks = [live.get(one.settings).settings for one in live.state.products.values() if one.kind == WALK.name]
    assert walks
    assert {tuple((one.x, one.y, one.radius, one.leg) for one in walk.forbidden) for walk in walks} == {
        ((own.x, own.y, own.radius, None),)
    }


def test_a_walk_that_leads_through_a_no_go_area_is_not_gone(live, rover, monkeypatch):
    """The planner keeps off as far as feet do: between them the chassis would go over the area."""
    monkeypatch.setattr(stage, "kept_off_between", lambda _, ends, __: np.zeros(len(ends)))
    monkeypatch.setattr(Pieces, "_with_no_foot_where_it_keeps_off", lambda pieces: pieces._settings.walk)
    settings = replace(AROUND, farthest=3.0, route=RouteSettings(no_go=(NoGo(0.8, 0.1, 0.6),)))
    loop = live.walk_to(WalkGoal(1.6, 0.0), settings)
    until(lambda: "no-go area" in loop.reason, "a walk that leads there", seen=loop.as_dict)
    assert "leads through a no-go area or out of the corridors: at (0." in loop.reason
    assert loop.reason.endswith("0.30 m are allowed")
    assert rover.sent == []
    loop.cancel()
    ended(loop)


def test_where_no_route_leads_on_it_goes_nowhere_and_says_why(live, rover):
    ring = tuple(NoGo(1.2 + 0.5 * np.cos(a), 0.5 * np.sin(a), 0.25) for a in np.linspace(0.0, 2.0 * np.pi, 13)[:-1])
    loop = live.walk_to(WalkGoal(1.2, 0.0), replace(AROUND, route=RouteSettings(no_go=ring)))
    until(lambda: loop.act == "look", "the look that may help", seen=loop.as_dict)
    assert loop.reason.startswith("no route leads on: no way leads to the goal: it ends at (")
    assert rover.sent == []
    loop.cancel()
    assert ended(loop)[0] == "cancelled"


def test_it_arrives_by_where_images_have_the_rover_though_its_odometry_has_drifted(live, dem, standing):
    bare = replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))
    looked_twice(live, dem, bare, DRIFT)
    with RigidRover(live, bare, DRIFT) as rover:
        loop = live.walk_to(GOAL, UNSEEN)
        assert ended(loop)[0] == "arrived", loop.reason
        assert np.hypot(*(rover.state.T_site_base[:2, 3] - (GOAL.x, GOAL.y))) <= GOAL.within


def test_it_looks_before_it_moves_where_it_is_not_sure_where_it_is(live, dem, standing):
    bare = replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))
    looked_twice(live, dem, bare, DRIFT)
    with RigidRover(live, replace(bare, time=bare.time + 4 * 3600.0), DRIFT) as rover:
        loop = live.walk_to(GOAL, UNSEEN)
        until(lambda: decided(live), "a decision")
        loop.cancel()
        ended(loop)
        assert decided(live)[0] == "look"
        [first, *_] = [event.payload for event in live.events() if event.type == "walk_decided"]
        assert "images of 240 min ago" in first["reason"]
        assert rover.sent == []


def given_up(live, who):
    live.commands.conn_act("release", who)


def lapsed(live, who):
    gate = live.rover.commanding.gate
    clock = gate._clock
    gate._clock = lambda: clock() + CONN_FOR + 1.0


@pytest.mark.parametrize(
    ("goes", "reason"),
    [(given_up, "the conn was given up"), (lapsed, "was not heard for 90 s")],
    ids=["given up", "lapsed"],
)
def test_without_the_conn_it_ends_while_its_row_is_out_and_sends_no_more(live, rover, goes, reason):
    """The row never ends before the walk does: nothing is learnt of the conn between rows."""
    who = Identity("operator", Role.COMMANDER, client="10.0.0.7", page="one")
    reached, go_on = threading.Event(), threading.Event()

    def before(rows):
        if rows == 1:
            reached.set()
            assert go_on.wait(BOUND)

    rover.before_row = before
    loop = live.walk_to(GOAL, UNSEEN, who)
    try:
        assert reached.wait(BOUND)
        goes(live, who)
        found = ended(loop)
    finally:
        go_on.set()
    assert (found[0], reason in found[1]) == ("stopped", True), found
    [*_, last] = [event.payload for event in live.events() if event.type == "walk_decided"]
    assert (last["act"], reason in last["reason"]) == ("end", True)
    # the clock that ends the conn ends the time of the row that is out, too: then its run is over
    until(lambda: live.commands.gate["waiting"] or live.commands.gate["run"] is None, "the end of the row that was out")
    number = rover.number
    until(lambda: rover.number > number + 5, "more telemetry")
    assert len(rover.sent) == rover.rows == 2


def test_a_conn_given_up_before_the_first_row_is_not_taken_again(live, rover, making):
    who = Identity("operator", Role.COMMANDER, client="10.0.0.7", page="one")
    reached, go_on = making
    live.commands.conn_act("take", who)
    loop = live.walk_to(GOAL, UNSEEN, who)
    assert reached.wait(BOUND)
    live.commands.conn_act("release", who)
    go_on.set()
    found = ended(loop)
    assert (found[0], "the conn was given up" in found[1]) == ("stopped", True), found
    assert (rover.sent, live.commands.conn["holder"]) == ([], None)


@pytest.mark.parametrize(("heard", "outcome"), [(True, "arrived"), (False, "stopped")], ids=["heard", "not heard"])
def test_a_walk_that_goes_on_is_no_sign_of_whoever_began_it(live, rover, monkeypatch, heard, outcome):
    """It arms and sends as them, each foot move well within the time that the conn is kept for."""
    who = Identity("operator", Role.COMMANDER, client="10.0.0.7", page="one")
    gate, make, past = live.rover.commanding.gate, live.walks.command, []
    clock = gate._clock
    monkeypatch.setattr(gate, "_clock", lambda: clock() + sum(past))

    def make_later(*asked):
        past.append(0.4 * CONN_FOR)
        if heard:
            joined(started(lambda: live.commands.conn_act("heartbeat", who)))
        return make(*asked)

    monkeypatch.setattr(live.walks, "command", make_later)
    live.commands.conn_act("take", who)
    found = ended(live.walk_to(GOAL, UNSEEN, who))
    assert (found[0], "was not heard for 90 s" in found[1]) == (outcome, not heard), found
    assert (live.commands.conn["holder"] is None) == (not heard)
    assert len(past) > 3 if heard else len(past) == 3


def started(call):
    """A thread of its own, as of a request."""
    thread = threading.Thread(target=call)
    thread.start()
    return thread


class NoFootMoves(InlineJobs):
    """Foot moves are never made, until their job is cancelled."""

    def __init__(self):
        super().__init__()
        self.asked = threading.Event()

    def _take_on(self, job, parents, settings, urgent):
        if job.kind != FOOT_MOVES.name:
            return super()._take_on(job, parents, settings, urgent)
        self._records.add(job)
        job.unqueue = lambda: True
        self.asked.set()
        return None


def test_a_session_closes_while_its_walk_waits_for_a_job(tmp_path, athlete, dem, standing, monkeypatch):
    monkeypatch.setattr(walking_module, "SHORT_JOB", 1e6)
    bare = replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))
    jobs = NoFootMoves()
    with Sessions(tmp_path / "sessions", jobs=jobs, robot=athlete) as opened:
        live = opened.create("on waves")
        live.terrains.load(dem)
        live.stances.set(bare)
        with RigidRover(live, bare):
            loop = live.walk_to(GOAL, UNSEEN)
            assert jobs.asked.wait(BOUND)
            closing = threading.Thread(target=live.close, name="closing", daemon=True)
            closing.start()
            joined(closing)
            assert loop.outcome == "cancelled"
            with pytest.raises(Conflict, match="closed"):
                live.walks.plan(GOAL)


def test_what_the_rover_carries_counts_in_whether_it_stands_steadily(live, rover):
    laden = replace(UNSEEN.walk, payload_mass=300.0, payload_position=np.array([0.0, 9.0, 0.3]))
    found = ended(live.walk_to(GOAL, replace(UNSEEN, walk=laden)))
    assert (found[0], found[1].startswith("the centre of mass is")) == ("stopped", True), found
    assert rover.sent == []


HOPELESS = replace(UNSEEN, walk=replace(UNSEEN.walk, least_margin=3.0))
"""No walk keeps such a margin, so that every plan is in vain."""


@pytest.fixture
def hidden(live, rover, dem):
    """Ground with a hole at the wheel of leg 2, which hides it."""
    x, y, _ = apply(rover.state.T_site_base, wheel_centers(live.robot, rover.state.posture))[2]
    east, north = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    out = np.array([x, y]) / np.hypot(x, y)
    hole = np.hypot(east - x - 0.1 * out[0], north - y - 0.1 * out[1]) <= 0.3
    live.terrains.load(replace(dem, heights=np.where(hole, np.float32(np.nan), dem.heights)))
    return rover


def heights_of_wheels(live, state):
    return apply(state.T_site_base, wheel_centers(live.robot, state.posture))[:, 2]


def looks_of(live, rover, monkeypatch, before=lambda: None):
    """Takes the place of images and of the maps made of them; how high each wheel is over where it stood, at each."""
    first, found = heights_of_wheels(live, rover.state), []

    def take(_):
        before()
        found.append(heights_of_wheels(live, rover.state) - first)

    monkeypatch.setattr(WalkLoop, "_take_images", take)
    nothing_new(monkeypatch)
    return found


def nothing_new(monkeypatch):
    """Maps made of images show what was known."""
    monkeypatch.setattr(
        WalkLoop, "_map_anew", lambda _, so_far: replace(so_far, moved=0, looked=True, refused="", nearest=None)
    )


def test_where_plans_are_in_vain_it_lifts_the_leg_that_hides_ground_and_looks(live, hidden, monkeypatch):
    looks, stood = looks_of(live, hidden, monkeypatch), hidden.state.posture
    loop = live.walk_to(GOAL, HOPELESS)
    assert ended(loop)[0] == "stopped"
    acts = decided(live)
    # the hole stays, as nothing is seen here: the leg is not lifted again
    assert acts == ["replan", "look", "replan", "lift", *["replan"] * 5, "stop", "end"]
    plain, up = looks
    np.testing.assert_array_equal(plain, 0.0)
    np.testing.assert_allclose(up, [0, 0, LIFTED, 0, 0, 0], atol=2e-3)
    np.testing.assert_allclose(hidden.state.posture, stood, atol=1e-9)
    [told] = [event.payload["reason"] for event in live.events() if event.payload.get("act") == "lift"]
    assert told.startswith(f"images with leg 2 {LIFTED:g} m up show ")
    assert live.commands.run["outcome"] == "done"
    assert replay(live.export_bundle()).ok


def images_of(state, at):
    """A pair that shows nothing, taken where the rover stands as ``state`` says."""
    grey = np.full((4, 4), 127, np.uint8)
    left, right = (
        Camera(one, 4, 4, 5.0, 5.0, 2.0, 2.0, transform(translation=(x, 0.0, 0.0)))
        for one, x in (("l", 0.0), ("r", 0.3))
    )
    return Snapshot(state, (ImagePair("haz0", at, grey, grey, left, right, state.T_site_base),))


def test_images_from_before_it_moved_are_no_look(live, rover, monkeypatch):
    """Somebody asked for them meanwhile, and the rover takes one request at a time."""
    nothing_new(monkeypatch)
    before, asked = rover.state, []

    def take():
        asked.append(rover.rows)
        # the first that are asked for after it moved come from before
        late = rover.rows > 0 and len(asked) == 1
        live.rover.take_images(images_of(before if late else rover.state, float(len(asked))))

    rover.takes_images = take
    loop = live.walk_to(GOAL, replace(UNSEEN, way_on=WayOnSettings(look_every=1)))
    assert ended(loop)[0] == "arrived"
    assert asked[0] == asked[1] > 0
    assert len(asked) == decided(live).count("look") + 1


def test_with_a_payload_that_no_step_knows_it_lifts_no_leg(live, hidden, monkeypatch):
    looks_of(live, hidden, monkeypatch)
    laden = replace(HOPELESS.walk, payload_mass=20.0, payload_position=np.array([0.0, 0.0, 0.3]))
    assert ended(live.walk_to(GOAL, replace(HOPELESS, walk=laden)))[0] == "stopped"
    assert "lift" in decided(live)
    assert hidden.sent == []
    told = [event.payload["reason"] for event in live.events() if event.type == "walk_decided"]
    assert any("leg 2 can't be lifted to look: no step knows the 20 kg that its walk carries" in one for one in told)


def test_a_leg_that_somebody_lets_down_before_the_look_is_carried_out_to_its_end(live, hidden, monkeypatch):
    looks = looks_of(live, hidden, monkeypatch)
    loop = live.walk_to(GOAL, HOPELESS)

    def lets_all_go(rows):
        if rows == 2:
            loop.hold()
            loop.go_on()

    hidden.before_row = lets_all_go
    assert ended(loop)[0] == "stopped"
    assert len(looks) == 1
    assert live.commands.run["outcome"] == "done"
    assert decided(live).count("lift") == 1


def test_held_with_the_leg_up_it_looks_and_waits_until_it_goes_on(live, hidden, monkeypatch):
    holds = []
    looks = looks_of(live, hidden, monkeypatch, before=lambda: holds and holds.pop()())
    loop = live.walk_to(GOAL, HOPELESS)
    hidden.before_row = lambda rows: rows == 1 and holds.append(loop.hold)
    until(lambda: loop.state == "held" and len(looks) == 2, "the hold", seen=loop.as_dict)
    sent = len(hidden.sent)
    assert looks[1][2] == pytest.approx(LIFTED, abs=2e-3)
    loop.go_on()
    assert ended(loop)[0] == "stopped"
    assert len(hidden.sent) > sent
    np.testing.assert_allclose(hidden.state.posture, live.get(live.state.sequence).predicted[-1])
