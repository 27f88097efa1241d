"""Edits give new sequences, checked again; what can't be done is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidSequence
from footfall.core.value import digest
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence


def test_an_edit_leaves_the_old_sequence_alone(athlete, sequence):
    before = sequence.digest
    edited = apply_edit(athlete, sequence, Edit("duration", 0, number=30.0))
    assert edited.commands[0].duration == 30.0
    assert edited.valid
    assert edited.digest != before
    assert sequence.commands[0].duration != 30.0
    assert edited.provenance.parents["sequence"] == before
    assert digest(edited.provenance.settings) == digest(sequence.provenance.settings)


def test_a_joint_is_set_and_the_prediction_follows(athlete, sequence):
    angle = float(sequence.predicted[2, 13]) + 0.01
    edited = apply_edit(athlete, sequence, Edit("joint", 2, joint=1, number=angle))
    joints = edited.commands[2].joints
    assert joints is not None
    assert joints[1] == angle
    assert edited.predicted[2][13] == angle
    assert np.array_equal(edited.predicted[3:], sequence.predicted[3:])


def test_a_broken_rule_shows_at_its_row(athlete, sequence, flat):
    edited = apply_edit(athlete, sequence, Edit("joint", 2, joint=1, number=9.0), flat)
    assert not edited.valid
    assert {failure.row for failure in edited.failures} <= {2, 3}
    assert ("joint-limits", 2) in {(failure.rule, failure.row) for failure in edited.failures}
    mended = apply_edit(athlete, edited, Edit("set", 2, command=sequence.commands[2]), flat)
    assert mended.valid
    assert all(a.digest == b.digest for a, b in zip(mended.commands, sequence.commands, strict=True))


def test_deleting_a_middle_row_breaks_the_speed_of_the_next(athlete, sequence, flat):
    edited = apply_edit(athlete, sequence, Edit("delete", 2), flat)
    assert len(edited.commands) == len(sequence.commands) - 1
    assert [(failure.rule, failure.row) for failure in edited.failures] == [("speed", 2)]


def test_deleting_everything_is_an_invalid_value(athlete, sequence):
    edited = sequence
    for _ in sequence.commands:
        edited = apply_edit(athlete, edited, Edit("delete", 0))
    assert edited.commands == ()
    assert edited.predicted.shape == (0, 36)
    assert [failure.rule for failure in edited.failures] == ["not-empty"]


def test_rows_are_inserted_and_moved(athlete, sequence):
    wait = Command("WAIT", None, None, 2.0)
    count = len(sequence.commands)
    appended = apply_edit(athlete, sequence, Edit("insert", count, command=wait))
    assert appended.commands[-1].name == "WAIT"
    assert appended.valid
    moved = apply_edit(athlete, appended, Edit("move", count, to=1))
    assert [c.name for c in moved.commands][:3] == ["LEG_MOVE", "WAIT", "LEG_MOVE"]
    assert moved.valid
    back = apply_edit(athlete, moved, Edit("move", 1, to=count))
    assert [c.digest for c in back.commands] == [c.digest for c in appended.commands]


@given(row=st.integers(0, 5), fraction=st.floats(0.001, 0.999))
def test_a_split_row_goes_the_same_way(athlete, sequence, row, fraction):
    edited = apply_edit(athlete, sequence, Edit("split", row, number=fraction))
    assert len(edited.commands) == len(sequence.commands) + 1
    assert edited.valid, edited.failures
    assert edited.duration == pytest.approx(sequence.duration, rel=1e-12)
    assert np.array_equal(edited.predicted[row + 1], sequence.predicted[row])
    before = sequence.predicted[row - 1] if row else sequence.start
    expected = before + fraction * (sequence.predicted[row] - before)
    assert np.abs(edited.predicted[row] - expected).max() < 1e-12


def test_a_row_at_full_speed_can_be_split(athlete, hand_plan):
    from footfall.sequence.sequence_settings import SequenceSettings

    full = make_sequence(hand_plan, athlete, settings=SequenceSettings(speed_fraction=1.0))
    for fraction in (0.1, 1 / 3, 0.7):
        assert apply_edit(athlete, full, Edit("split", 3, number=fraction)).valid


def test_over_terrain_the_motion_is_checked_again(athlete, hand_plan, flat):
    made = make_sequence(hand_plan, athlete, flat)
    angle = float(made.predicted[-1, 13]) + np.deg2rad(8)
    edited = apply_edit(athlete, made, Edit("joint", len(made.commands) - 1, joint=1, number=angle), flat)
    assert "terrain-collision" in {failure.rule for failure in edited.failures}
    assert edited.provenance.parents["dem"] == flat.digest


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda: Edit("delete", 6), "0…5"),
        (lambda: Edit("delete", -1), "0…5"),
        (lambda: Edit("insert", 7, command=Command("WAIT", None, None, 1.0)), "0…6"),
        (lambda: Edit("move", 0, to=6), "to 6"),
        (lambda: Edit("split", 0, number=1.0), "between 0 and 1"),
        (lambda: Edit("rename", 0), "one of"),
        (lambda: Edit("set", 0), "command"),
        (lambda: Edit("joint", 0, number=0.0), "joint"),
        (lambda: Edit("joint", 0, joint=6, number=0.0), "hip_yaw"),
        (lambda: Edit("move", 0), "to"),
    ],
)
def test_what_can_not_be_done_is_refused(athlete, sequence, edit, says):
    with pytest.raises(InvalidSequence, match=says):
        apply_edit(athlete, sequence, edit())


def test_a_wait_has_no_joint_to_set_but_can_be_split(athlete, sequence):
    waiting = apply_edit(athlete, sequence, Edit("insert", 0, command=Command("WAIT", None, None, 4.0)))
    with pytest.raises(InvalidSequence, match="six joints"):
        apply_edit(athlete, waiting, Edit("joint", 0, joint=0, number=0.0))
    halves = apply_edit(athlete, waiting, Edit("split", 0)).commands[:2]
    assert [(half.name, half.duration) for half in halves] == [("WAIT", 2.0), ("WAIT", 2.0)]
