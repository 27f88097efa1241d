"""A rover that says the same of a command again, or this and that, is counted; what is news is written down."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.session.rover.heard import ENDED, HeardStates

STATES = ("received", "started", "done", "refused", "unknown")


@given(st.lists(st.sampled_from(STATES), max_size=30))
def test_no_row_of_answers_is_written_down_without_end(said):
    heard, known, news = HeardStates(), "sent", []
    for state in said:
        if heard.is_news("c", known, state):
            known = state
            news.append(state)
    assert "unknown" not in news  # nobody asked
    assert news == sorted(news, key=STATES.index)
    assert len([state for state in news if state in ENDED]) <= 1
    # nothing that would have been the first of its kind is lost
    ended = next((i for i, state in enumerate(said) if state in ENDED), len(said))
    assert (ended < len(said)) == (bool(news) and news[-1] in ENDED)
    assert ("started" in said[:ended]) == ("started" in news)


@given(st.lists(st.sampled_from(STATES), max_size=30))
def test_also_where_the_log_is_behind(said):
    heard = HeardStates()
    assert sum(heard.is_news("c", "sent", state) for state in said) <= 3
    assert sum(heard.is_news("d", "unknown", state) for state in said) <= 3


def test_the_answer_to_a_question_counts_once():
    heard = HeardStates()
    assert heard.is_news("c", "sent", "received")
    heard.asked("c")
    assert [heard.is_news("c", "received", "unknown") for _ in range(3)] == [True, False, False]
    # what the ground settled as unknown is known again by whatever the rover says
    assert heard.is_news("c", "unknown", "received")


@pytest.fixture
def ended(session, frame_of):
    """A session whose run was broken off by a stop, and the name of its first command."""
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(lambda text: None)
    session.rover.take_telemetry(frame_of(0))
    first = session.commands.send(session.commands.arm()["token"])["commands"][0]
    session.commands.stop("enough")
    return session, first


def test_a_flood_of_acknowledgements_fills_no_log_and_is_counted(ended):
    session, first = ended
    before = len(session.events())
    for state, _ in zip(itertools.cycle(("received", "started", "unknown", "received")), range(4000), strict=False):
        session.rover.take_acknowledgement(first, state)
    kinds = [event.type for event in session.events()[before:]]
    assert kinds == ["command_received", "command_started"]
    assert session.rover.link.as_dict()["acks_again"] == 4000 - len(kinds)
    session.rover.take_acknowledgement(first, "done")
    assert session.state.commands[0].state == "done"


def test_contradictions_are_counted_and_told_of_now_and_then(ended):
    session, first = ended
    session.rover.take_acknowledgement(first, "done")
    before = len(session.events())
    for state, _ in zip(itertools.cycle(("refused", "done")), range(1000), strict=False):
        session.rover.take_acknowledgement(first, state, "" if state == "done" else "I think not")
    assert session.rover.link.kinds["contradiction"] == 500
    assert {event.type for event in session.events()[before:]} == {"link_fault"}
    assert len(session.events()) - before < 100
    assert session.state.commands[0].state == "done"
