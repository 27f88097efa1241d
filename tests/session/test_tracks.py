"""Where wheels were put down: by the rows that the rover said were carried out, and by no others."""

import numpy as np

from footfall.core.frames import apply
from footfall.robot.kinematics import wheel_centers
from footfall.session.log.fold_commands import CommandRecord
from footfall.session.tracks import tracks
from tests.support.sequences import four_kinds, recorded


def record(row, state="done", sequence="a"):
    return CommandRecord(f"{row}", sequence, 1, row, state, "", 0.0)


def test_a_print_is_where_the_last_lowering_row_ends(athlete):
    sequence = recorded()
    lowering = [row for row, one in enumerate(sequence.commands) if one.phase == "lower"]
    leg = sequence.commands[lowering[-1]].leg
    everything = [record(row) for row in range(len(sequence.commands))]
    (print_,) = tracks(everything, {"a": sequence}.__getitem__)
    assert print_.leg == leg
    there = wheel_centers(athlete, sequence.predicted[lowering[-1]])[leg]
    found = apply(print_.T_site_base, wheel_centers(athlete, print_.posture))[leg]
    assert np.array_equal(found, apply(sequence.poses[lowering[-1]], there))
    # without that row there is none, nor where it only began or failed
    assert tracks([one for one in everything if one.row != lowering[-1]], {"a": sequence}.__getitem__) == ()
    assert tracks([record(lowering[-1], "failed"), record(lowering[-1], "started")], {"a": sequence}.__getitem__) == ()


def test_a_step_carried_out_twice_left_two_prints_and_swings_none():
    sequence = recorded()
    row = max(row for row, one in enumerate(sequence.commands) if one.phase == "lower")
    assert len(tracks([record(row), record(row)], {"a": sequence}.__getitem__)) == 2
    swinging = four_kinds()
    assert tracks([record(row) for row in range(len(swinging.commands))], {"a": swinging}.__getitem__) == ()


def test_what_is_no_sequence_and_rows_that_it_has_not_count_for_nothing():
    assert tracks([record(0)], {"a": None}.__getitem__) == ()
    assert tracks([record(10_000)], {"a": recorded()}.__getitem__) == ()
