"""A run that has ended has no row that goes on, in whatever order the records of it come."""

from hypothesis import given
from hypothesis import strategies as st

from footfall.session.log.event import next_event
from footfall.session.log.fold import fold_all
from footfall.session.log.fold_commands import OPEN_STATES

ROWS = 3
STARTED = ("run_started", {"run": 1, "mark": "m", "sequence": "s", "rows": ROWS})
ENDED = ("run_ended", {"run": 1, "outcome": "link_lost", "reason": "the link was lost", "unsent": 0})
SAID = ["command_sent", "command_received", "command_started", "command_done", "command_refused"]


def folded(steps):
    events = []
    for i, (type, payload) in enumerate(steps):
        events.append(next_event(events[-1] if events else None, 1000.0 + i, type, payload))
    return fold_all(events)


def about(type, row):
    payload = {"id": f"m-{row}", "sequence": "s", "run": 1, "row": row, "reason": ""}
    return type, payload


@st.composite
def told(draw):
    """Records of the rows, each as far as it came, and the end of the run anywhere between them."""
    steps = []
    for row in range(ROWS):
        steps += [about(type, row) for type in SAID[: draw(st.integers(0, 4))]]
        if draw(st.booleans()):
            steps.append(about("command_refused", row))
    steps.insert(draw(st.integers(0, len(steps))), ENDED)
    return [STARTED, *draw(st.permutations(steps))]


@given(told())
def test_no_row_of_an_ended_run_goes_on(steps):
    for number in range(1, len(steps) + 1):
        state = folded(steps[:number])
        assert state.run is not None
        if state.run.state == "ended":
            assert not [one for one in state.commands if one.state in OPEN_STATES]


@given(st.sampled_from(["command_received", "command_started"]))
def test_a_late_word_of_a_beginning_is_kept_as_a_time(late):
    state = folded([STARTED, about("command_sent", 0), ENDED, about(late, 0)])
    (row,) = state.commands
    assert (row.state, row.reason) == ("unknown", "the link was lost")
    assert row.times is not None
    assert late.removeprefix("command_") in row.times


def test_a_late_word_of_an_end_still_counts():
    state = folded([STARTED, about("command_sent", 0), ENDED, about("command_started", 0), about("command_done", 0)])
    assert [one.state for one in state.commands] == ["done"]


def test_a_row_whose_record_comes_after_the_end_is_unknown_until_more_is_told():
    state = folded([STARTED, ENDED, about("command_sent", 1)])
    assert [(one.state, one.reason) for one in state.commands] == [("unknown", "the link was lost")]
    state = folded([STARTED, ENDED, about("command_sent", 1), about("command_refused", 1)])
    assert [one.state for one in state.commands] == ["refused"]


def test_rows_of_the_run_before_end_with_the_beginning_of_the_next():
    second = ("run_started", {"run": 2, "mark": "m", "sequence": "s", "rows": 1})
    state = folded([STARTED, about("command_sent", 0), ENDED, second, about("command_started", 0)])
    assert [one.state for one in state.commands] == ["unknown"]
