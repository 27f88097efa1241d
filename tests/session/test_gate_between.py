"""What lets a run go on from one foot move to the next: the look at the rover, its wheels, what the gate answers."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root_scalar

from footfall.core.errors import CommandRefused, InvalidBundle
from footfall.core.value import Provenance
from footfall.planning.walk_execution.off_walk import FOOT_MOVED
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Command, Sequence
from footfall.session.access.identity import Identity, Role
from footfall.session.gate import machine
from footfall.session.gate.between import SETTLES, Between
from footfall.session.gate.checks import Facts, require_fit_to_go_on
from footfall.session.gate.gate import Gate
from footfall.telemetry.state import RobotState, TelemetryFrame

MARY = Identity("mary", Role.COMMANDER, "10.0.0.1", "page-a")
JOHN = Identity("john", Role.ADMIN, "10.0.0.2", "page-c")
NAMES = tuple(f"joint{i}" for i in range(36))
ROWS = tuple(Command("LEG_MOVE", 0, np.zeros(6), 1.0, phase=phase) for phase in ("lift", "lower", "lift"))
SEQUENCE = Sequence("r", ROWS, np.zeros(36), np.zeros((3, 36)), np.eye(4), (), Provenance({}))
BEGINS = 2
"""The row that begins the second foot move."""
LEG, KNEE = 3, 2


def standing(posture=SEQUENCE.start, mode="idle", commanded=None) -> Facts:
    state = RobotState("r", 0.0, posture, np.eye(4), np.zeros((6, 3)), np.zeros(36), mode)
    return Facts(True, TelemetryFrame(0, state, posture if commanded is None else commanded), 0.5, "dem", "dem")


def at(row: int) -> Any:
    return SimpleNamespace(sequence=SEQUENCE, row=row)


def looked(*facts: Facts) -> tuple[Between, list[str | None]]:
    """A look at each of the frames, which come after the row before the second foot move was done."""
    present = iter(facts)
    between = Between(lambda: next(present), NAMES)
    between.row_done(at(BEGINS), 10.0)
    assert between.waits
    return between, [between.look(at(BEGINS), 11.0 + i) for i in range(len(facts))]


def test_a_run_waits_before_a_foot_move_and_nowhere_else():
    between = Between(standing, NAMES)
    assert not between.waits
    for row in range(3):
        between.row_done(at(row), 10.0)
        assert between.waits == (row == BEGINS)
    between.passed()
    assert not between.waits
    assert between.look(at(BEGINS), 11.0) is None


def test_only_telemetry_that_came_since_tells_anything():
    between = Between(standing, NAMES)
    between.row_done(at(BEGINS), 10.0)
    for heard in (None, 10.0):
        assert between.look(at(BEGINS), heard) is None
        assert between.waits
    assert between.look(at(BEGINS), 11.0) == ""
    assert not between.waits
    assert between.look(at(BEGINS), 12.0) is None


def test_a_rover_that_is_elsewhere_holds_the_run_and_is_told_of():
    between, (why,) = looked(standing(SEQUENCE.start + 0.02))
    assert why is not None
    assert why.startswith("held between foot moves: joint0 of the rover is +0.0200 rad from where row 3 starts")
    assert not between.waits


def test_a_rover_may_still_be_moving_for_so_many_frames():
    moving = standing(mode="moving")
    between, told = looked(*[moving] * (SETTLES - 1), standing())
    assert told == [None] * (SETTLES - 1) + [""]
    between, told = looked(*[moving] * SETTLES)
    assert told[:-1] == [None] * (SETTLES - 1)
    assert told[-1] == "held between foot moves: the rover is moving; it must be idle"
    assert not between.waits
    _, told = looked(replace(standing(), frame=None))
    assert told == ["held between foot moves: the rover has sent no telemetry yet"]


@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), InvalidBundle("artifacts/x.npz is damaged")])
def test_where_nobody_can_tell_how_the_rover_stands_the_run_is_held(error):
    def unread() -> Facts:
        raise error

    between = Between(unread, NAMES)
    between.row_done(at(BEGINS), 10.0)
    why = between.look(at(BEGINS), 11.0)
    assert why is not None
    assert why.startswith("held between foot moves: nobody can tell how the rover stands: ")
    assert str(error) in why
    assert not between.waits


def test_a_look_is_not_taken_twice_at_one_frame():
    between, told = looked(standing(mode="moving"))
    assert told == [None]
    assert between.look(at(BEGINS), 11.0) is None  # the facts would be used up
    assert between.waits


def test_wheels_of_a_rover_that_sags_rest_where_they_are_predicted(athlete):
    posture = np.array(athlete.posture("stand"))
    sags: Any = SimpleNamespace(
        robot="r",
        commands=ROWS,
        predicted=np.array([posture] * 3),
        poses=np.array([np.eye(4)] * 3),
        at_rest=object(),
        set_points_before=lambda row: posture,
    )

    def bent(angle: float):
        turned = posture.copy()
        turned[6 * LEG + KNEE] += angle
        return turned

    def moved(angle: float) -> float:
        return float(np.linalg.norm(wheel_centers(athlete, bent(angle)) - wheel_centers(athlete, posture), axis=1)[LEG])

    edge = root_scalar(lambda angle: moved(angle) - FOOT_MOVED, bracket=(0.0, 0.5), xtol=1e-12).root
    for share, row, known, held in (
        (0.999, BEGINS, True, False),
        (1.001, BEGINS, True, True),
        (1.001, BEGINS, False, False),
        (1.001, BEGINS - 1, True, False),
    ):
        facts = replace(standing(bent(share * edge), commanded=posture), robot=athlete if known else None)
        if not held:
            require_fit_to_go_on(sags, row, facts, NAMES)
            continue
        with pytest.raises(CommandRefused) as caught:
            require_fit_to_go_on(sags, row, facts, NAMES)
        details = caught.value.details
        assert (details["check"], details["leg"], details["limit"]) == ("rest", LEG, FOOT_MOVED)
        assert details["difference"] == pytest.approx(moved(share * edge), abs=1e-12)
        assert (
            f"the wheel of leg {LEG} is 0.060 m from where it was predicted to rest after row 2" in caught.value.message
        )


def test_a_place_needs_telemetry():
    with pytest.raises(CommandRefused) as caught:
        _ = replace(standing(), frame=None).place
    assert caught.value.details["check"] == "telemetry"
    seen = standing().place
    assert all(np.array_equal(one.T_site_base, np.eye(4)) for one in seen.possible)
    assert replace(standing(), frame=None, on_map=seen).place is seen


# -- the gate ----------------------------------------------------------------------------------


@pytest.fixture
def gate():
    return Gate(clock=lambda: 100.0)


@pytest.fixture
def run(gate):
    return gate.begin(gate.arm("d" * 32, MARY), SEQUENCE, MARY)


def test_who_holds_the_conn(gate):
    assert gate.conn_holder is None
    assert not gate.holds_conn(MARY)
    gate.act("take", MARY)
    assert gate.conn_holder == MARY
    assert gate.holds_conn(MARY)
    assert not gate.holds_conn(JOHN)


def test_a_run_is_held_before_the_row_that_is_due_only(gate, run):
    held = gate.hold_for(run, "the wheel sinks")
    assert (held.phase, held.why, held.going) == ("waiting", "the wheel sinks", False)
    assert gate.run == held
    assert gate.hold_for(run, "again") is None
    assert gate.run == held
    gate.end()
    assert gate.hold_for(run, "too late") is None


@pytest.mark.parametrize("change", [{"row": 1}, {"number": 9}, {"phase": "claimed"}, {"phase": "out"}])
def test_a_run_that_is_elsewhere_is_not_held(change):
    state = machine.arm(machine.State(), MARY, "d" * 32, "token", 100.0)
    state = machine.begin(state, MARY, "token", SEQUENCE, "m", 100.0, False)
    run = state.run
    assert run is not None
    assert machine.held_for(replace(state, run=replace(run, **change)), run, "why") is None
    held = machine.held_for(state, run, "why")
    assert held == replace(state, run=run.held("why"))


def test_a_stop_between_claim_and_release_lets_nothing_go(gate, run):
    sent = []
    claimed, hindered = gate.claim(run.number, True)
    assert (claimed.row, hindered) == (0, "")
    gate.latch()
    assert not gate.release(claimed, lambda: sent.append("row"), True)
    assert sent == []


def test_a_clearing_is_told_again_where_no_stop_is_in_force_only(gate):
    sent = []
    gate.remind_of_clearing(lambda: sent.append("clear"))
    gate.latch()
    gate.remind_of_clearing(lambda: sent.append("clear"))
    assert sent == ["clear"]
    gate.remind(lambda: sent.append("stop"))
    gate.stop_acknowledged()
    gate.remind(lambda: sent.append("stop"))
    assert sent == ["clear", "stop"]


def test_a_later_stop_is_not_cleared_and_a_cleared_one_is_not_acknowledged(gate):
    sent = []
    first, new, _ = gate.latch()
    assert (first, new) == (1, True)
    name = gate.stop_id
    assert gate.latch()[:2] == (2, False)
    assert not gate.unlatch(first, lambda: sent.append("clear"))
    assert (gate.stopped, sent) == (True, [])
    gate.stop_acknowledged(gate.stop_id)
    assert gate.unlatch(2, lambda: sent.append("clear"))
    assert (gate.stopped, sent) == (False, ["clear"])
    gate.latch()
    assert gate.stop_acknowledged(name) is None
    assert not gate.acknowledged
    assert gate.stop_acknowledged("stop of another process") is None
    assert gate.stop_acknowledged(gate.stop_id) == 3
    assert gate.acknowledged
