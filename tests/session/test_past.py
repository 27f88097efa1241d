"""What the rover said before a page was loaded: bounded, no peak lost, nothing where nothing was heard."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.session.rover import past
from footfall.session.rover.past import FRAMES, KEPT_FOR, Past
from footfall.telemetry.quantities import QUANTITIES
from tests.support.frames import any_frames, moving_frames

NOW = 5000.0
HEARD = st.lists(st.floats(0, KEPT_FOR), min_size=0, max_size=60).map(lambda ages: sorted(ages, reverse=True))


def filled(ages, frames):
    held = Past()
    for age, frame in zip(ages, frames, strict=True):
        held.take(frame, NOW - age)
    return held


@given(HEARD, st.floats(1, KEPT_FOR), st.floats(0, 0.9), st.integers(1, 40), st.sampled_from(sorted(QUANTITIES)))
def test_every_part_has_its_extremes_and_silent_parts_have_nothing(ages, since, share, parts, quantity):
    until = share * since
    frames = moving_frames(len(ages))
    told = filled(ages, frames).looked_at(quantity, 1, 2, since, until, parts, NOW)
    heard = [NOW - (NOW - age) for age in ages]
    inside = [
        (age, QUANTITIES[quantity](frame)) for age, frame in zip(heard, frames, strict=True) if until <= age <= since
    ]
    groups: dict[int, list] = {}
    for age, numbers in inside:
        groups.setdefault(min(int((since - age) / (since - until) * parts), parts - 1), []).append((age, numbers))
    ends = [[group[0][0], group[-1][0]][: len(group)] for group in groups.values()]
    assert list(told.ages) == [age for pair in ends for age in pair]
    assert len(told.ages) <= 2 * parts
    at = 0
    for group, pair in zip(groups.values(), ends, strict=True):
        for channel, column in enumerate(told.numbers, 1):
            own = np.array([numbers[channel] for _, numbers in group], np.float32)
            assert sorted(column[at : at + len(pair)]) == sorted([own.min(), own.max()] if len(pair) > 1 else own)
            if len(pair) > 1:
                assert (column[at] == own.min()) == (own.argmin() <= own.argmax())
        at += len(pair)


@given(st.lists(any_frames(), min_size=1, max_size=5))
def test_any_finite_numbers_of_a_rover_are_told_as_finite_ones(frames):
    held = filled(np.linspace(9, 0, len(frames)), frames)
    for quantity in QUANTITIES:
        assert np.isfinite(held.looked_at(quantity, 0, 99, KEPT_FOR, 0.0, 50, NOW).numbers).all()


def test_only_the_newest_are_kept(monkeypatch):
    monkeypatch.setattr(past, "FRAMES", 20)
    ages = np.linspace(50, 1, 50)
    frames = moving_frames(50)
    told = filled(ages, frames).looked_at("position", 0, 1, KEPT_FOR, 0.0, 1000, NOW)
    assert told.ages == pytest.approx(ages[-20:])
    assert told.numbers[0] == pytest.approx([frame.state.posture[0] for frame in frames[-20:]])


def test_one_peak_among_thousands_is_told():
    held, (still, peak) = Past(), moving_frames(2)
    peak.state.joint_torques.max()
    for number in range(FRAMES + 100):
        held.take(peak if number == 3000 else still, NOW - 0.09 * (FRAMES + 99 - number))
    top = int(np.argmax(peak.state.joint_torques - still.state.joint_torques))
    told = held.looked_at("torque", top, 1, KEPT_FOR, 0.0, 30, NOW)
    assert max(told.numbers[0]) == np.float32(peak.state.joint_torques[top])
    assert len(told.ages) == 2 * 28  # 558 s of 600, in parts of 20 s


def test_before_any_frame_there_is_nothing():
    assert Past().looked_at("lean", 0, 3, 60.0, 0.0, 10).ages == ()


@pytest.mark.parametrize(("quantity", "since", "until"), [("speed", 60, 0), ("torque", 60, 60), ("torque", 601, 0)])
def test_what_is_no_question_is_refused(quantity, since, until):
    with pytest.raises(InvalidInput):
        Past().looked_at(quantity, 0, 1, since, until, 10)
