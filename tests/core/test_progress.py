"""Progress handed down in parts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Cancelled
from footfall.core.progress import no_progress, part

UNIT = st.floats(0, 1)


def told(start, end, fraction):
    seen = []
    part(lambda f, text: seen.append((f, text)), start, end)(fraction, "matching")
    return seen


@given(UNIT, UNIT, UNIT)
def test_a_part_stays_between_its_ends(a, b, fraction):
    start, end = sorted((a, b))
    ((got, text),) = told(start, end, fraction)
    assert text == "matching"
    assert start - 1e-12 <= got <= end + 1e-12


def test_ends_map_to_ends():
    assert told(0.25, 0.75, 0.0) == [(0.25, "matching")]
    assert told(0.25, 0.75, 1.0) == [(0.75, "matching")]


def test_parts_nest():
    seen = []
    outer = part(lambda f, text: seen.append(f), 0.5, 1.0)
    part(outer, 0.5, 1.0)(0.5, "")
    assert seen == [0.875]


def test_the_wish_to_stop_passes_through():
    def stop(fraction, text):
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        part(part(stop, 0, 0.5), 0, 0.5)(0.1, "")
    assert no_progress(0.5, "nobody listens") is None
