"""Lone surrogates are found wherever they are, and spelled out so that nothing else changes."""

import json

from hypothesis import given
from hypothesis import strategies as st

from footfall.api.bodies.jsonable import dumps
from footfall.core.surrogates import all_spelled_out, has_lone_surrogate, lone_surrogate_in, spelled_out
from footfall.io.event_log import line, make_record, read_lines

texts = st.text(st.characters(categories=("L", "Cs", "So", "Po")), max_size=6)
documents = st.recursive(
    st.none() | st.booleans() | st.integers() | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
)


def writable(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


@given(texts)
def test_what_utf_8_can_hold_stays_and_the_rest_is_spelled_out(text):
    assert has_lone_surrogate(text) is not writable(text)
    told = spelled_out(text)
    assert writable(told)
    assert (told == text) == writable(text)
    assert told == text.encode(errors="backslashreplace").decode()


@given(documents)
def test_one_is_found_anywhere_in_a_document(document):
    whole = writable(json.dumps(document, ensure_ascii=False))
    assert (lone_surrogate_in(document) is None) is whole
    assert lone_surrogate_in(all_spelled_out(document)) is None
    if whole:
        assert all_spelled_out(document) == document
    assert json.loads(dumps(document).encode()) == all_spelled_out(document)


@given(st.dictionaries(texts, documents, max_size=4))
def test_no_event_is_written_that_can_not_be_told(payload):
    record = make_record(0, 0.0, "note", payload, "0" * 32)
    assert lone_surrogate_in(record["payload"]) is None
    assert read_lines(line(record))[0] == [record]


def test_numbers_of_a_deep_document_are_passed_over():
    deep: object = 1.0
    for _ in range(10_000):
        deep = [deep]
    assert lone_surrogate_in(deep) is None
