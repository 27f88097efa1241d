"""Random operators, links, rovers, disks and clocks against the gate: what must never happen does not."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from footfall.core.errors import Conflict
from footfall.core.value import Provenance
from footfall.robot.description import athlete_layout
from footfall.sequence.commands import Command, Sequence
from footfall.session.access.identity import Identity, Role
from footfall.session.commanding import Commanding
from footfall.session.gate.checks import STALE_AFTER, Facts
from footfall.session.gate.lease import ANSWER_WITHIN, CONN_FOR
from footfall.session.gate.machine import ARMED_FOR
from footfall.session.log.event import next_event
from footfall.session.log.fold import SessionState, fold
from footfall.session.log.fold_commands import OPEN_STATES
from footfall.sim.orders import OrderedRover
from footfall.telemetry.link import (
    AckMessage,
    ClearStopMessage,
    CommandMessage,
    EpochMessage,
    HelloMessage,
    QueryMessage,
    StopMessage,
    decode,
)
from footfall.telemetry.state import RobotState, TelemetryFrame

ROWS = 3
JOINTS = tuple(f"joint{i}" for i in range(36))
NAMES = tuple(f"joint_{number}" for number in range(36))
BODY: Any = SimpleNamespace(
    layout=athlete_layout(6), lower=np.full(36, -4.0), upper=np.full(36, 4.0), joint_names=NAMES
)
MOVE = Command("LEG_MOVE", 0, np.zeros(6), 1.0)
SEQUENCE = Sequence("r", (MOVE,) * ROWS, np.zeros(36), np.zeros((ROWS, 36)), np.eye(4), (), Provenance({}))
IDLE = RobotState("r", 0.0, np.zeros(36), np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")
PLANNED_WEIGHT = 6000.0
"""Of the rover and its payload, as the sequence was planned with [N]."""
AS_PLANNED = {"terrain": "dem", "load": 1.0, "joint": 0.0, "pose": 0.0}
"""Digest of the terrain, weight as a share of the planned one, how far a joint [rad] and the chassis [m] are off."""
OTHERWISE = [("terrain", "later"), ("load", 0.8), ("load", 1.3), ("joint", 0.02), ("joint", -0.5), ("pose", 0.1)]
TOLERATED = [*AS_PLANNED.items(), ("load", 1.05), ("joint", 0.005), ("pose", 0.01)]
PEOPLE = (
    Identity("mary", Role.COMMANDER, "10.0.0.1", "page-a"),
    Identity("mary", Role.COMMANDER, "10.0.0.1", "page-b"),
    Identity("john", Role.ADMIN, "10.0.0.2"),
    Identity("eve", Role.VIEWER, "10.0.0.3"),
)
person = st.sampled_from((PEOPLE[0], *PEOPLE))
which = st.integers(0, 5)


def frame_of(mode: str, about: dict[str, Any]) -> TelemetryFrame:
    """What a rover says that stands as ``about`` tells."""
    posture, T_site_base, forces = np.zeros(36), np.eye(4), np.zeros((6, 3))
    posture[7], T_site_base[0, 3] = about["joint"], about["pose"]
    forces[:, 2] = about["load"] * PLANNED_WEIGHT / 6
    state = replace(IDLE, mode=mode, posture=posture, T_site_base=T_site_base, wheel_forces=forces)
    return TelemetryFrame(0, state, posture)


class ModelRover(OrderedRover):
    """Takes orders as both simulated rovers do; a motion ends when it is told to."""

    @property
    def time(self):
        return 0.0

    @property
    def fault(self):
        return "it never is"

    def __init__(self):
        super().__init__(BODY)
        self.moved = []

    def _begin(self, command):
        assert self.mode == "idle"
        self.moved.append(command.id)
        return SimpleNamespace(command=command, share=0.5)

    def arrive(self):
        if self._motion is None:
            return []
        motion, self._motion, self.mode = self._motion, None, "idle"
        return [self._ack(motion.command.id, "done")]


class World(RuleBasedStateMachine):
    """The gate with its log on one side of a bad link, a rover on the other."""

    def __init__(self):
        super().__init__()
        self.now = 0.0
        self.events, self.pending, self.state, self.disk_full = [], [], SessionState(), False
        self.rover, self.moved_before = ModelRover(), []
        self.down, self.up = [], []
        # what a gateway holds back, for as long as it likes: over stops, clearings, connections and restarts
        self.held = []
        # messages down are numbered: which commands each makes too late, and which those are that the rover has heard
        self.said, self.too_late, self.never = 0, {}, set()
        self.stopped_at, self.greetings, self.answered, self.sent_before = 0, 0, False, frozenset()
        self.confirmed = 0  # the newest epoch that the rover on this connection is known to have heard
        self.connected, self.heard_at, self.frame = False, None, None
        # what there is, and what of it the latest telemetry told
        self.about: dict[str, Any] = dict(AS_PLANNED)
        self.told: dict[str, Any] = dict(AS_PLANNED)
        self.sent, self.tokens, self.used = [], {}, set()
        self.stops = False
        # the lease once more, as simply as it can be said
        self.number, self.renewed = 0, 0.0
        self.holder: Any = None
        self.asking: Any = None
        self.light_time = SimpleNamespace(round_trip=0.0)

    @initialize()
    def begin(self):
        self.gate = self.started()
        self.connect()

    # -- what the gate sees: a link, a log ---------------------------------------------------

    @property
    def age(self):
        return None if self.heard_at is None else self.now - self.heard_at

    @property
    def age_since_connected(self):
        """Of a rover that is heard as soon as it is there; test_gate.py has the others."""
        return self.age

    def said_again(self):
        """The link counts what tells nothing new."""

    def send(self, text):
        if not self.connected:
            raise Conflict("no rover is connected")
        self.said += 1
        given_up = {one.id for one in self.state.commands if one.state == "unknown"}
        match decode(text):
            case CommandMessage(id=command_id, epoch=epoch):
                self.released(command_id)
                assert epoch == self.gate.gate.epoch <= self.confirmed, "sent before the rover confirmed the epoch"
                self.too_late[self.said] = given_up
            case StopMessage():
                self.too_late[self.said] = {*self.sent}
            case EpochMessage():
                self.too_late[self.said] = self.sent_before | given_up
            case _:
                self.too_late[self.said] = set()
        self.down.append((self.said, text))

    def released(self, command_id):
        self.settle()
        assert command_id not in self.sent, "sent twice"
        assert not self.stops, "sent after a stop"
        assert self.age is not None
        assert self.age <= STALE_AFTER, "sent on stale telemetry"
        run = self.gate.gate.run
        assert self.holder is not None
        assert run is not None
        assert run.by.is_same(self.holder), "sent for somebody who does not hold the conn"
        assert run.fence == self.number, "sent under an older number of the conn"
        assert any(e.type == "command_sent" and e.payload["id"] == command_id for e in self.events), "not in the log"
        self.sent.append(command_id)

    def record(self, type, payload):
        if self.disk_full:
            raise OSError("no space left")
        for event in [*self.pending, (type, payload)]:
            self.events.append(next_event(self.events[-1] if self.events else None, self.now, *event))
            self.state = fold(self.state, self.events[-1])
        self.pending = []

    def record_anyway(self, type, payload):
        try:
            self.record(type, payload)
        except OSError:
            self.pending.append((type, payload))

    def started(self):
        link: Any = self
        made = Commanding(link, self.record, self.record_anyway, lambda: self.state, clock=lambda: self.now)
        made._start_watch = lambda: None  # time passes in rules
        return made

    def facts(self):
        return Facts(self.connected, self.frame, self.age, self.about["terrain"], "dem", PLANNED_WEIGHT)

    def as_planned(self):
        """Whether all is as the sequence was planned with, as far as is known."""
        load = 0.9 <= self.told["load"] <= 1.1
        stands = abs(self.told["joint"]) <= 0.01 and self.told["pose"] <= 0.05
        return self.about["terrain"] == "dem" and stands and load

    # -- the lease, once more ------------------------------------------------------------------

    def settle(self):
        ran_out = self.holder is not None and self.now >= self.renewed + CONN_FOR
        if self.asking and (ran_out or self.now - self.asking[1] >= ANSWER_WITHIN):
            self.hand(self.asking[0])
        elif ran_out:
            self.holder = None

    def hand(self, to):
        self.number, self.holder, self.renewed, self.asking = self.number + 1, to, self.now, None

    def may(self, who):
        """Whether ``who`` holds the conn, or nobody does and it may be taken."""
        self.settle()
        return who.role >= Role.COMMANDER and (self.holder is None or self.holder.is_same(who))

    def take(self, who):
        if self.holder is None:
            self.hand(who)
        self.renewed = self.now

    # -- people --------------------------------------------------------------------------------

    @rule(who=person, act=st.sampled_from(["take", "release", "request", "grant", "deny", "heartbeat"]))
    def conn(self, who, act):
        self.settle()
        mine = self.holder is not None and self.holder.is_same(who)
        commander = who.role >= Role.COMMANDER
        allowed = {
            "take": commander and (mine or self.holder is None),
            "request": commander and (mine or self.holder is None or not self.asking or self.asking[0].is_same(who)),
            "grant": mine and self.asking is not None,
            "deny": mine and self.asking is not None,
        }.get(act, mine)
        try:
            self.gate.conn(act, who)
        except Conflict:
            assert not allowed
            return
        assert allowed
        if act in ("release", "grant") and self.asking is not None:
            self.hand(self.asking[0])
        elif act == "release":
            self.holder = None
        elif act == "deny":
            self.asking, self.renewed = None, self.now
        elif act == "request" and self.holder is not None and not mine:
            self.asking = self.asking or (who, self.now)
        else:
            self.take(who)

    @rule(who=person)
    def arm(self, who):
        may = self.may(who)
        open_ = not self.gate.gate.stopped and self.gate.gate.run is None
        known, refused = self.confirmed >= self.gate.gate.epoch, ""
        try:
            token = self.gate.arm("d" * 32, SEQUENCE, self.facts(), JOINTS, who)
            assert may
            assert open_
            assert self.as_planned()
            assert known
            self.tokens[token] = (self.now, self.number + (self.holder is None))
        except Conflict as err:
            refused = err.details["check"]
        except OSError:
            assert self.disk_full
        assert refused != "epoch" or not known, "refused though the rover had confirmed the epoch"
        if may and open_:
            self.take(who)

    @precondition(lambda self: self.tokens)
    @rule(pick=which, who=person, steps=st.booleans())
    def send_armed(self, pick, who, steps):
        token = list(self.tokens)[-1 - pick % len(self.tokens)]
        may = self.may(who)
        armed_at, under = self.tokens[token]
        good = may and token not in self.used and self.now - armed_at <= ARMED_FOR and under == self.number
        good = good and self.holder is not None
        runs = self.gate.gate.run
        if good:
            self.renewed = self.now
        try:
            self.gate.gate.armed_sequence(token)
            self.gate.send(token, SEQUENCE, self.facts(), JOINTS, who, steps)
        except Conflict:
            return
        except OSError:
            assert self.disk_full
        assert good
        assert runs is None
        assert self.as_planned(), "sent though it was planned with something else"
        assert self.confirmed >= self.gate.gate.epoch, "begun before the rover confirmed the epoch"
        self.used.add(token)

    @rule(who=person, act=st.sampled_from(["hold", "resume", "next", "next", "abort"]))
    def steer(self, who, act):
        may = self.may(who)
        run = self.gate.gate.run
        waits = None if run is None or run.phase != "waiting" else run.row
        if may and run is not None:
            self.take(who)
        try:
            if act == "hold":
                self.gate.hold(who)
            elif act == "abort":
                self.gate.abort(who)
            else:
                self.gate.go_on(who, self.facts(), JOINTS, act == "resume")
        except Conflict:
            return
        assert may
        if act in ("resume", "next") and waits is not None:
            assert self.as_planned(), "gone on with though something had changed"
            assert self.confirmed >= self.gate.gate.epoch, "gone on with before the rover confirmed the epoch"

    @rule(who=person)
    def stop(self, who):
        self.stops = True
        self.gate.stop("", self.now, who)
        assert self.gate.gate.run is None

    @rule(who=person)
    def clear(self, who):
        may = self.may(who)
        try:
            self.gate.clear_stop(who)
        except (Conflict, OSError):
            return
        assert may
        self.stops = False

    # -- link, rover, disk, clock, processes -----------------------------------------------

    @rule(seconds=st.sampled_from([0.1, 0.1, 1.0, 3.5, 12.0, 25.0, 100.0]), looks=st.booleans())
    def wait(self, seconds, looks):
        self.now += seconds
        if looks:
            self.gate.look()
            self.settle()

    @precondition(lambda self: self.connected)
    @rule()
    def telemetry(self):
        self.frame, self.heard_at, self.told = frame_of(self.rover.mode, self.about), self.now, dict(self.about)

    @rule(what=st.sampled_from(TOLERATED))
    def changes(self, what):
        self.about |= dict([what])

    @precondition(lambda self: self.connected)
    @rule(who=person, what=st.sampled_from(OTHERWISE), armed=st.booleans())
    def changes_before_it_is_sent(self, who, what, armed):
        """Something becomes other than planned, before or after arming: no row goes until it is as it was again."""
        who = self.made_ready(who)
        if armed:
            self.arm(who)
        was, sent = self.about[what[0]], len(self.sent)
        self.about |= dict([what])
        self.telemetry()
        if not armed:
            self.arm(who)
        if self.tokens:
            self.send_armed(0, who, steps=False)
        assert len(self.sent) == sent, "a row went though something had changed"
        self.about[what[0]] = was
        self.telemetry()

    @precondition(lambda self: self.connected and self.gate.gate.as_dict()["waiting"])
    @rule(who=person, what=st.sampled_from(OTHERWISE), act=st.sampled_from(["resume", "next"]))
    def changes_before_it_goes_on(self, who, what, act):
        """The same while a run waits, at whatever row."""
        was, sent = self.about[what[0]], len(self.sent)
        self.about |= dict([what])
        self.telemetry()
        self.steer(who, act)
        assert len(self.sent) == sent, "a row went though something had changed"
        self.about[what[0]] = was
        self.telemetry()

    @precondition(lambda self: self.connected)
    @rule(who=person, what=st.sampled_from(OTHERWISE), act=st.sampled_from(["resume", "next"]), rows=st.integers(1, 2))
    def changes_between_rows(self, who, what, act, rows):
        """Step by step from the beginning: some rows are done, then something becomes other than planned."""
        self.send_at_once(who, steps=True, reach=False)
        self.all_goes_well(1)
        if rows == 2 and self.gate.gate.as_dict()["waiting"]:
            self.steer(self.holder or who, "next")
            self.all_goes_well(1)
        if self.gate.gate.as_dict()["waiting"]:
            self.changes_before_it_goes_on(self.holder or who, what, act)

    @precondition(lambda self: self.down)
    @rule(pick=which, fate=st.sampled_from(["arrives", "arrives", "arrives", "comes twice", "is held back", "is lost"]))
    def downlink(self, pick, fate):
        barrier = next((i for i, (_, one) in enumerate(self.down) if '"command"' not in one), len(self.down) - 1)
        place = min(pick, barrier)  # as on a WebSocket, nothing overtakes a stop
        said, text = self.down[place] if fate == "comes twice" else self.down.pop(place)
        if fate in ("is held back", "comes twice"):
            self.held.append((said, text))
        if fate not in ("is lost", "is held back"):
            self.reaches(said, text)

    @precondition(lambda self: self.held)
    @rule(pick=which)
    def comes_after_all(self, pick):
        """What was held back reaches whatever rover is there, whenever the gateway likes, linked or not."""
        self.reaches(*self.held.pop(pick % len(self.held)))

    def reaches(self, said, text):
        moved = len(self.rover.moved)
        match decode(text):
            case CommandMessage() as message:
                self.up += self.rover.command(message)
                if isinstance(said_last := self.up[-1], AckMessage) and said_last.state == "outdated":
                    self.up.append(EpochMessage(message.id, self.rover.epoch or 0))
            case QueryMessage(id=command_id):
                self.up.append(self.rover.became(command_id))
            case EpochMessage(id=greeting, epoch=epoch):
                self.rover.hear_epoch(greeting, epoch)
                self.up.append(EpochMessage(greeting, self.rover.epoch or 0))
                self.answered |= greeting == f"hello {self.greetings}"
            case StopMessage(id=stop_id, epoch=epoch):
                self.up += [*self.rover.stop(epoch), stop_id]
                self.stopped_at = max(self.stopped_at, said)
            case ClearStopMessage(epoch=epoch):
                before = self.rover.mode
                self.rover.clear_stop(epoch)
                assert said > self.stopped_at or self.rover.mode == before, "cleared a stop that came after it"
        self.never |= self.too_late[said]
        begun = {*self.rover.moved[moved:]}
        assert not self.never & begun, "held back, and carried out after all"
        assert self.answered or not begun, "carried out though the ground had not answered the rover yet"

    @precondition(lambda self: self.connected and self.up)
    @rule(pick=which, fate=st.sampled_from(["arrives", "arrives", "comes twice", "is lost"]))
    def uplink(self, pick, fate):
        place = pick % len(self.up)
        said = self.up[place] if fate == "comes twice" else self.up.pop(place)
        if fate == "is lost":
            return
        if isinstance(said, EpochMessage):
            if said.id == f"hello {self.greetings}":
                self.confirmed = max(self.confirmed, said.epoch)
            self.gate.epoch_heard(said.id, said.epoch)
        elif not isinstance(said, AckMessage):
            self.gate.stop_acknowledged(said)
        elif any(one.id == said.id for one in self.state.commands):
            self.gate.heard(said.id, "refused" if said.state == "outdated" else said.state, said.reason)

    @rule()
    def arrive(self):
        self.up += self.rover.arrive()

    @rule(rows=st.integers(1, ROWS))
    def all_goes_well(self, rows):
        """The link does its best, the rover arrives, and says so."""
        if not self.connected:
            self.connect()
        for _ in range(rows):
            if not self.gate.gate.epoch_known:
                self.wait(1.1, looks=True)  # it may have been lost: told again
            self.telemetry()
            while self.down:
                self.downlink(0, "arrives")
            self.arrive()
            while self.up:
                self.uplink(0, "arrives")
            self.now += 0.1
        self.telemetry()

    @rule(who=person, steps=st.booleans(), reach=st.booleans())
    def send_at_once(self, who, steps, reach):
        """Whatever is in the way of a new run is put out of it. reach: the command arrives, its answers don't."""
        who = self.made_ready(who)
        self.arm(who)
        if self.tokens:
            self.send_armed(0, who, steps)
        if reach and self.down:
            self.downlink(0, "comes twice")
            self.up.clear()

    def made_ready(self, who):
        """What is in the way of a new run is put out of it by whoever holds the conn, else by ``who``; who that was."""
        self.settle()
        who = self.holder or who
        self.all_goes_well(ROWS)
        if self.stops:
            self.clear(who)
            self.all_goes_well(1)
        return who

    @precondition(lambda self: self.connected)
    @rule(
        who=person,
        early=st.booleans(),
        over=st.sampled_from(["a stop", "its being given up", "a connection", "a restart", "all restart"]),
    )
    def held_back(self, who, over, early):
        """A command is held back over something that ends its run, and comes when all is well again."""
        self.send_at_once(who, steps=False, reach=False)
        self.held += [one for one in self.down if '"command"' in one[1]]
        self.down = []
        clearings: list[Any] = []
        if over == "a stop":
            self.stop(who)
            self.all_goes_well(1)
            self.clear(self.holder or who)
            clearings = [one for one in self.down if '"clear_stop"' in one[1]]
        elif over == "its being given up":
            self.wait(3.5, looks=True)
        elif over == "a connection":
            self.disconnect()
        else:
            self.server_dies() if over == "all restart" else None
            self.rover_restarts()
        if early and self.held:
            self.comes_after_all(0)
        self.all_goes_well(1)
        while self.held:
            self.comes_after_all(0)
        self.held = clearings

    @precondition(lambda self: self.connected)
    @rule(who=person, picks=st.lists(which, max_size=4))
    def stopped_again(self, who, picks):
        """Whatever was held back comes while a stop is in force that the rover has heard of."""
        self.stop(who)
        self.all_goes_well(1)
        for pick in picks:
            if self.held:
                self.comes_after_all(pick)

    @precondition(lambda self: self.connected)
    @rule()
    def disconnect(self):
        self.connected, self.down = False, []
        self.gate.lost("the rover disconnected")

    @precondition(lambda self: not self.connected)
    @rule()
    def connect(self):
        self.connected = True
        self.greetings += 1
        greeting, self.sent_before = f"hello {self.greetings}", frozenset(self.sent)
        self.answered, self.confirmed = False, 0
        self.rover.greets(greeting)
        epoch = self.gate.connected(HelloMessage("r", 6, id=greeting, epoch=self.rover.epoch))
        self.record_anyway("link_connected", {"epoch": epoch})

    @precondition(lambda self: self.rover.epoch is not None)
    @rule(later=st.integers(1, 3))
    def another_session_tells_the_rover(self, later):
        """Of an epoch beyond those of this one."""
        self.rover.hear_epoch("of another session", max(self.rover.epoch or 0, self.gate.gate.epoch) + later)

    @precondition(lambda self: self.connected)
    @rule(who=person, steps=st.booleans())
    def another_session_between_rows(self, who, steps):
        """The ground hears of that while a row is out: the next one waits, and goes on when the rover has confirmed."""
        self.send_at_once(who, steps, reach=False)
        while self.down:
            self.downlink(0, "arrives")
        if self.rover.epoch is not None:
            self.another_session_tells_the_rover(2)
            self.up.insert(0, EpochMessage("asked by nobody", self.rover.epoch))
        self.arrive()
        while self.up:
            self.uplink(0, "arrives")
        who = self.holder or who
        self.steer(who, "next")
        self.all_goes_well(1)
        self.steer(who, "resume")

    @precondition(lambda self: self.connected)
    @rule(who=person, steps=st.booleans())
    def sent_too_soon(self, who, steps):
        """A rover comes back, and somebody is quicker than its answer."""
        who = self.made_ready(who)
        self.disconnect()
        self.connect()
        self.telemetry()
        sent = len(self.sent)
        self.arm(who)
        if self.tokens:
            self.send_armed(0, who, steps)
        assert len(self.sent) == sent, "sent to a rover that has not answered"
        self.all_goes_well(1)

    @precondition(lambda self: self.sent)
    @rule()
    def rover_restarts(self):
        if self.connected:
            self.disconnect()
        self.moved_before += self.rover.moved
        self.rover, self.up, self.stopped_at, self.answered = ModelRover(), [], 0, False
        self.rover.greets("not heard by the ground yet")

    @precondition(lambda self: self.sent)
    @rule()
    def server_dies(self):
        """As by kill −9: what was not written is gone, and so is every connection, token and lease."""
        self.connected, self.down, self.pending, self.disk_full = False, [], [], False
        self.tokens, self.used, self.holder, self.asking = {}, set(), None, None
        if self.events:
            self.record("session_opened", {})
        self.number = 0 if self.state.conn is None else self.state.conn.number
        self.stops = self.state.stop.latched
        self.gate = self.started()
        self.heard_at = None

    @precondition(lambda self: self.sent)
    @rule(full=st.booleans())
    def disk(self, full):
        self.disk_full = full

    # -- what must hold ------------------------------------------------------------------------

    @invariant()
    def each_command_moves_the_rover_at_most_once_and_only_when_released(self):
        moved = self.moved_before + self.rover.moved
        assert len(set(moved)) == len(moved)
        assert set(moved) <= set(self.sent)

    @invariant()
    def nothing_runs_while_stopped(self):
        if hasattr(self, "gate"):
            assert self.gate.gate.stopped == self.stops
            assert not (self.stops and self.gate.gate.run)

    @invariant()
    def the_log_and_the_gate_agree_on_the_conn(self):
        if hasattr(self, "gate") and not self.pending:
            number = 0 if self.state.conn is None else self.state.conn.number
            assert number == self.gate.gate.conn_number

    @invariant()
    def no_row_of_an_ended_run_goes_on(self):
        run = self.state.run
        if run is not None and run.state == "ended":
            assert not [one for one in self.state.commands if one.run == run.number and one.state in OPEN_STATES]

    def teardown(self):
        """Once the rover is heard again, what it remembers of the latest run is what the log says."""
        if not hasattr(self, "gate"):
            return
        self.disk_full = False
        self.record("note", {"text": "the disk is back"})
        if self.connected:
            self.disconnect()
        self.gate.abort(self.holder or PEOPLE[0]) if self.gate.gate.run else None
        self.arrive()
        self.up.clear()  # all of it lost
        self.connect()
        while self.down or self.up:
            while self.down:
                self.downlink(0, "arrives")
            while self.up:
                self.uplink(0, "arrives")
        for command in self.state.commands:
            remembered = self.rover._last.get(command.id)
            if command.run == self.state.runs and command.id in self.sent and remembered is not None:
                known = "refused" if remembered.state == "outdated" else remembered.state
                # a rover that was restarted knows only that the command came to it again, and too late
                before = remembered.state == "outdated" and command.id in self.moved_before
                assert command.state == known or (before and command.state == "done")


World.TestCase.settings = settings(max_examples=300, stateful_step_count=40, deadline=None, derandomize=True)
TestWorld = World.TestCase
