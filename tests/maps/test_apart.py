"""What sets places apart is true, its own, and comes with the number that was compared."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from footfall.maps.set_apart import MEASURES, set_apart
from footfall.maps.spoken import spoken

COARSE = st.integers(0, 6).map(lambda step: step / 10)
"""So coarse that ties are frequent."""
PLACE = st.fixed_dictionaries(dict.fromkeys(("margin", "away", "slope", "certainty"), COARSE))
UNKNOWN = st.just(np.nan)


def better(name, one, other):
    return one > other if MEASURES[name].most else one < other


@given(st.lists(PLACE, min_size=2, max_size=9))
def test_a_place_is_first_in_what_it_is_said_to_be(places):
    found = set_apart(places)
    told = [(one.measure, one.rank) for one in found if one is not None]
    assert len(set(told)) == len(told), "no two places are told alike"
    for place, one in zip(places, found, strict=True):
        if one is None:
            continue
        others = [other[one.measure] for other in places if other is not place]
        assert one.amount == place[one.measure]
        assert sum(better(one.measure, other, one.amount) for other in others) == one.rank - 1
        assert one.amount not in others
        assert one.text.endswith(f": {spoken(one.amount, MEASURES[one.measure].unit)}")
        assert MEASURES[one.measure].words in one.text
        assert (one.rank == 1) == (re.match(r"\d", one.text) is None)


@given(st.lists(PLACE, min_size=2, max_size=9))
def test_only_a_place_that_shares_every_amount_is_set_apart_by_none(places):
    for place, one in zip(places, set_apart(places), strict=True):
        alone = any(sum(other[name] == place[name] for other in places) == 1 for name in place)
        assert (one is not None) == alone


@given(st.lists(PLACE, min_size=2, max_size=6), st.data())
def test_what_is_not_known_of_every_place_compares_none(places, data):
    name = data.draw(st.sampled_from(sorted(places[0])))
    places[0][name] = data.draw(UNKNOWN)
    assert all(one is None or one.measure != name for one in set_apart(places))


def test_whoever_is_first_in_two_measures_is_told_by_the_first_of_them():
    here = {"margin": 0.41, "away": 0.5, "slope": 0.10}
    there = {"margin": 0.38, "away": 0.4, "slope": 0.12}
    neither = {"margin": 0.40, "away": 0.6, "slope": 0.11}
    told = [one.text for one in set_apart([here, there, neither]) if one is not None]
    assert told == ["most margin: 41 cm", "nearest: 40 cm", "2nd most margin: 40 cm"]


def test_one_place_and_equal_places_are_not_set_apart():
    assert set_apart([]) == ()
    assert set_apart([{"margin": 0.4}]) == (None,)
    # a tenth of a millimetre is no difference that anybody is told
    assert set_apart([{"margin": 0.41234}, {"margin": 0.41231}]) == (None, None)


def test_amounts_that_are_no_measure_set_nothing_apart():
    assert set_apart([{"height": 0.1}, {"height": 0.2}]) == (None, None)
