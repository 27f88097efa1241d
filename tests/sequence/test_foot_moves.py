"""Which rows belong to one foot move: waits, guarded lowering and loading stay with the foot that is placed."""

import numpy as np
import pytest

from footfall.sequence.commands import Command
from footfall.sequence.foot_moves import Rows, begins_a_foot_move, foot_moves


def rows(*phases, leg=None):
    kind, joints = ("WAIT", None) if leg is None else ("LEG_MOVE", np.zeros(6))
    return tuple(Command(name=kind, leg=leg, joints=joints, duration=1.0, phase=phase) for phase in phases)


STEP = ("unload", "", "lift", "", "swing", "", "lower", "lower", "", "load", "load", "")
WALK = ("body", "lift", "swing", "lower")


def test_a_step_with_waits_is_one_foot_move_and_nothing_in_it_begins_one():
    commands = rows(*STEP)
    assert foot_moves(commands) == (Rows(0, len(STEP), None),)
    assert not any(begins_a_foot_move(commands, row) for row in range(len(STEP)))


@pytest.mark.parametrize("one", [STEP, WALK])
def test_one_begins_where_the_foot_before_was_placed(one):
    commands = rows(*one, *one, "body")
    n = len(one)
    assert [(found.first, found.count) for found in foot_moves(commands)] == [(0, n), (n, n), (2 * n, 1)]
    assert [row for row in range(len(commands)) if begins_a_foot_move(commands, row)] == [n, 2 * n]


def test_its_leg_is_the_one_that_is_moved():
    commands = (*rows("body"), *rows("lift", "swing", "lower", leg=3), *rows("body"), *rows("lift", "lower", leg=1))
    assert [found.leg for found in foot_moves(commands)] == [3, 1]
