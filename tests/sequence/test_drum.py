"""The drum of a tether along commands: its length and speed row by row, and that no edit makes it forgotten."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.balance.tether import EDGE, Tether
from footfall.core.errors import InvalidSequence
from footfall.planning.walk.problem import Tethered
from footfall.sequence.commands import wait
from footfall.sequence.drum import LENGTH, SPEED, TETHER
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.telemetry.command_kinds import POSTURE_MOVE
from tests.support.chassis_ground import wavy
from tests.support.short_walks import short_walk

ANCHOR = np.array([-3.2, 1.9, 2.0])


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def walk(athlete, ground):
    return short_walk(athlete, ground, footfall.stand(athlete, ground))


def hung(walk, **drum):
    """The walk on a tether, whose pulls are of no account here."""
    tether = Tether(ANCHOR, np.array(EDGE), **drum)
    lengths = tether.lengths(walk.Ts_site_base)
    return replace(walk, tethered=Tethered(tether, np.array([0.0, 0.0, 1.0]), lengths, np.zeros(len(lengths))))


@pytest.fixture(scope="module")
def sequence(athlete, walk):
    return make_sequence(hung(walk), athlete)


def lengths_of(sequence):
    assert sequence.tether_lengths is not None
    return sequence.tether_lengths


def of(sequence, rule):
    return [one for one in sequence.rules if one.rule == rule]


def test_every_row_tells_what_is_paid_out_after_it(sequence, walk):
    lengths = lengths_of(sequence)
    for T, length in zip([sequence.T_site_base, *sequence.poses], lengths, strict=True):
        assert length == pytest.approx(np.linalg.norm(ANCHOR - (T @ [*EDGE, 1.0])[:3]))
    planned = hung(walk).tethered.lengths
    assert lengths[[0, -1]] == pytest.approx(planned[[0, -1]], abs=1e-3)
    still = [row for row, one in enumerate(sequence.commands) if one.kind is not POSTURE_MOVE]
    assert still
    assert np.abs(np.diff(lengths)[still]).max() < 1e-3
    moved = [one.row for one in of(sequence, LENGTH)]
    assert moved == [one.row for one in of(sequence, SPEED)] != []


def test_without_a_tether_nothing_is_told_or_forbidden(athlete, walk, sequence):
    alone = make_sequence(walk, athlete)
    assert alone.tether_lengths is None
    assert not [one for one in alone.rules if one.rule in (TETHER, LENGTH, SPEED)]
    # a drum that is fast enough changes no command
    assert [one.digest for one in alone.commands] == [one.digest for one in sequence.commands]


def test_commands_take_as_long_as_a_slow_drum_needs(athlete, walk, sequence):
    slow = make_sequence(hung(walk, speed=0.002), athlete)
    assert all(one.holds for one in of(slow, SPEED))
    rates = np.abs(np.diff(lengths_of(slow))) / [one.duration for one in slow.commands]
    assert 0.9 * 0.002 < rates.max() <= 0.002
    for fast, own in zip(sequence.commands, slow.commands, strict=True):
        assert own.duration >= fast.duration
        if own.kind is not POSTURE_MOVE:
            assert own.digest == fast.digest


def test_what_its_drum_can_not_do_fails_at_its_row(athlete, ground, walk, sequence):
    longest = float(lengths_of(sequence).max())
    short = make_sequence(hung(walk, free_length=longest - 0.01), athlete)
    failing = {one.row for one in of(short, LENGTH) if not one.holds}
    too_long = {row for row, length in enumerate(lengths_of(short)[1:]) if length > longest - 0.01}
    assert failing == too_long & {one.row for one in of(short, LENGTH)} != set()
    row = of(sequence, SPEED)[0].row
    hurried = apply_edit(athlete, sequence, Edit("duration", row, number=0.01), ground)
    [rule] = [one for one in of(hurried, SPEED) if one.row == row]
    change = abs(float(np.diff(lengths_of(sequence))[row]))
    assert not rule.holds
    assert rule.margin == pytest.approx(0.05 - change / 0.01, abs=1e-3)
    assert f"give it {change / 0.05:.2f} s" in rule.text


@pytest.mark.parametrize("kind", ["duration", "delete", "insert", "split"])
def test_no_edit_makes_commands_forget_the_tether(athlete, ground, sequence, kind):
    row = len(sequence.commands) - 1
    edit = {
        "duration": Edit("duration", row, number=60.0),
        "delete": Edit("delete", row),
        "insert": Edit("insert", row, wait(1.0)),
        "split": Edit("split", row),
    }[kind]
    made = apply_edit(athlete, sequence, edit, ground)
    assert made.tether is not None
    assert made.tether.digest == sequence.tether.digest
    [rule] = of(made, TETHER)
    assert not rule.holds
    assert len(lengths_of(made)) == len(made.commands) + 1
    with pytest.raises(InvalidSequence, match="none drives its drum"):
        footfall.export(made, "csv")
