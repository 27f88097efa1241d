"""Numbers out of bounds are named, with their unit and in the kind of error that was asked for."""

import math

import pytest

from footfall.core.bounds import require_above_zero, require_distances, require_not_negative
from footfall.core.errors import InvalidInput, InvalidSequence

CHECKS = (require_above_zero, require_not_negative, require_distances)


@pytest.mark.parametrize("check", CHECKS)
def test_numbers_within_bounds_pass(check):
    check()
    check(lift=0.2, friction=1e-12, unit=1e12, error=3)


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize("number", [-0.1, -math.inf, math.inf, math.nan])
def test_the_first_number_out_of_bounds_is_named_with_what_it_is(check, number):
    with pytest.raises(InvalidInput, match=r"^lift (must|can't) be ") as caught:
        check(friction=0.6, lift=number, radius=-1.0)
    assert caught.value.details.keys() == {"lift"}
    assert caught.value.details["lift"] is number
    assert ("finite" in str(caught.value)) == (check is require_distances or not math.isfinite(number))


def test_only_what_must_be_above_zero_refuses_zero():
    require_not_negative(clearance=0.0)
    require_distances(clearance=0.0)
    with pytest.raises(InvalidInput, match=r"^clearance must be above zero$"):
        require_above_zero(clearance=0.0)


@pytest.mark.parametrize(
    ("check", "text"),
    [(require_above_zero, "lift must be above zero [m]"), (require_not_negative, "lift can't be negative [m]")],
)
def test_the_unit_and_the_error_are_the_callers(check, text):
    with pytest.raises(InvalidSequence) as caught:
        check("m", InvalidSequence, lift=-1.0)
    assert str(caught.value) == text
