"""JSON from outside is read in time that grows with its length, and what is refused is refused by name."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core import strict_json
from footfall.core.strict_json import MOST_DEEP, NotStrict, read_json

SCALARS = st.none() | st.booleans() | st.integers() | st.text("ab,[{\\\"'", max_size=8)
DOCUMENTS = st.recursive(SCALARS, lambda part: st.lists(part) | st.dictionaries(st.text(max_size=3), part))


def parts(document) -> int:
    """As :mod:`~footfall.core.strict_json` counts them: lists, objects, and what stands in each beyond the first."""
    inner = list(document.values()) if isinstance(document, dict) else document if isinstance(document, list) else []
    own = 1 + max(len(inner) - 1, 0) if isinstance(document, (dict, list)) else 0
    return own + sum(parts(one) for one in inner)


@given(DOCUMENTS)
def test_what_is_strict_is_read_as_ever(document):
    text = json.dumps(document)
    assert read_json(text) == document
    assert read_json(text.encode()) == document


@given(DOCUMENTS, st.integers(0, 12))
def test_no_more_parts_than_allowed_and_no_comma_in_a_text_counts(document, most):
    text = json.dumps(document)
    if parts(document) <= most:
        assert read_json(text, most=most) == document
    else:
        with pytest.raises(NotStrict, match=f"more than {most} members and elements"):
            read_json(text, most=most)


def test_a_text_that_never_ends_is_counted_in_one_go():
    with pytest.raises(json.JSONDecodeError):
        read_json('["' + '\\"' * 50_000 + "," * 10, most=5)


class Counted(str):
    """A name that counts how often it is compared."""

    compared = 0
    __hash__ = str.__hash__

    def __eq__(self, other: object) -> bool:
        Counted.compared += 1
        return str.__eq__(self, other)


@pytest.mark.parametrize("place", [0, 10_000, 19_999])
def test_two_names_alike_among_many_are_found_without_comparing_all_with_all(place):
    names = [f"n{i}" for i in range(20_000)]
    pairs = [(Counted(name), None) for name in (*names, names[place])]
    Counted.compared = 0
    with pytest.raises(NotStrict, match=f"'n{place}' is given twice"):
        strict_json._members(pairs)
    assert Counted.compared <= 4 * len(pairs)


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}")])
def test_depth(opening, closing):
    fits = opening * MOST_DEEP + "1" + closing * MOST_DEEP
    assert json.dumps(read_json(fits), separators=(",", ":")) == fits
    for deep in (MOST_DEEP + 1, 100_000):
        with pytest.raises(NotStrict, match=f"more than {MOST_DEEP} deep"):
            read_json(opening * deep + "1" + closing * deep)
