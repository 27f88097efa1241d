"""Event log and fold: what was written is what comes back, and damage shows."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core import value
from footfall.core.errors import InvalidBundle, InvalidInput
from footfall.io.event_log import line, read_lines
from footfall.session.log.event import event_of, next_event
from footfall.session.log.fold import EVENT_TYPES, SessionState, fold, fold_all

DIGEST = st.integers(0, 5).map(lambda i: f"{i:032x}")
REASON = st.text(max_size=5)
RUN = st.integers(1, 3)


def product(kind, **about):
    return st.fixed_dictionaries(
        {
            "kind": st.just(kind),
            "digest": DIGEST,
            "parents": st.fixed_dictionaries({"dem": DIGEST, "state": DIGEST, "sequence": DIGEST}),
            "settings": st.none() | DIGEST,
            **about,
        }
    )


PAYLOADS = {
    "session_created": st.fixed_dictionaries({"name": REASON, "robot": DIGEST, "robot_name": REASON}),
    "state_frozen": st.fixed_dictionaries({"digest": DIGEST}),
    "snapshot_taken": st.fixed_dictionaries({"digest": DIGEST, "state": DIGEST}),
    "terrain_loaded": st.fixed_dictionaries({"digest": DIGEST, "name": REASON}),
    "footfall_chosen": st.fixed_dictionaries({"leg": st.integers(0, 5), "x": st.floats(-9, 9), "y": st.floats(-9, 9)}),
    "product": st.one_of(
        product("terrain"),
        product("maps", leg=st.integers(0, 5)),
        product("plan", leg=st.integers(0, 5), status=st.just("found"), reason=REASON),
        product("sequence"),
        product("edit"),
        product("export", format=st.just("csv")),
    ),
    "run_started": st.fixed_dictionaries({"run": RUN}, optional={"rows": RUN, "sequence": DIGEST, "mark": st.text()}),
    "command_sent": st.fixed_dictionaries({"id": REASON, "sequence": DIGEST, "run": RUN, "row": RUN}),
    "command_done": st.fixed_dictionaries({"id": REASON}),
    "command_refused": st.fixed_dictionaries({"id": REASON, "reason": REASON}),
    "run_ended": st.fixed_dictionaries({"reason": REASON}, optional={"run": RUN, "outcome": REASON}),
    "run_held": st.fixed_dictionaries({"run": RUN, "reason": REASON}),
    "run_resumed": st.fixed_dictionaries({"run": RUN, "mode": st.sampled_from(["whole", "steps"])}),
    "run_aborted": st.fixed_dictionaries({"run": RUN}),
    "command_unknown": st.fixed_dictionaries({"id": REASON, "reason": REASON}),
    "conn_changed": st.fixed_dictionaries({"conn": RUN, "holder": st.none() | st.fixed_dictionaries({"name": REASON})}),
    "stop_requested": st.fixed_dictionaries({"reason": REASON, "at": st.floats(0, 1e9)}),
    "stop_repeated": st.fixed_dictionaries({"reason": REASON, "at": st.floats(0, 1e9)}),
    "stop_acknowledged": st.just({}),
    "stop_cleared": st.just({}),
    "session_opened": st.just({}),
    "note": st.fixed_dictionaries({"text": REASON}),
}
STEPS = st.lists(
    st.sampled_from(sorted(PAYLOADS)).flatmap(lambda type: st.tuples(st.just(type), PAYLOADS[type])), max_size=25
)


def chain(steps):
    events = []
    for i, (type, payload) in enumerate(steps):
        events.append(next_event(events[-1] if events else None, 1000.0 + i, type, payload))
    return events


@given(STEPS)
def test_a_log_read_from_bytes_folds_to_the_same_state(steps):
    events = chain(steps)
    data = b"".join(line(event.as_dict()) for event in events)
    records, taken = read_lines(data)
    assert taken == len(data)
    again = [event_of(record) for record in records]
    assert again == events
    assert fold_all(again).digest == fold_all(events).digest


@given(STEPS, st.integers(0, 25))
def test_folding_in_two_parts_is_folding_at_once(steps, cut):
    events = chain(steps)
    assert fold_all(events[cut:], fold_all(events[:cut])).digest == fold_all(events).digest


@given(STEPS.filter(len), st.data())
def test_a_log_cut_anywhere_keeps_every_whole_line(steps, data):
    lines = [line(event.as_dict()) for event in chain(steps)]
    whole = b"".join(lines)
    cut = data.draw(st.integers(0, len(whole)))
    records, taken = read_lines(whole[:cut])
    assert taken == sum(len(one) for one in lines[: len(records)])
    assert cut - taken < len(lines[min(len(records), len(lines) - 1)])


@given(STEPS.filter(lambda steps: len(steps) > 1), st.data())
def test_a_changed_line_shows(steps, data):
    records = [event.as_dict() for event in chain(steps)]
    i = data.draw(st.integers(0, len(records) - 1))
    records[i] = {**records[i], "time": records[i]["time"] + 1}
    with pytest.raises(InvalidBundle, match=f"line {i + 1}"):
        read_lines(b"".join(line(record) for record in records))


def test_lost_and_swapped_lines_show():
    a, b, c = (line(e.as_dict()) for e in chain([("note", {"text": t}) for t in "abc"]))
    for damaged in (a + c, b + c, a + c + b, a + b"{}\n" + c):
        with pytest.raises(InvalidBundle, match="line"):
            read_lines(damaged)


def test_an_event_of_a_later_version_is_refused():
    with pytest.raises(InvalidBundle, match="later version"):
        fold(SessionState(), next_event(None, 0.0, "route_planned", {}))
    with pytest.raises(InvalidBundle, match="incomplete"):
        fold(SessionState(), next_event(None, 0.0, "note", {}))
    assert "note" in EVENT_TYPES


def test_a_payload_is_plain_json():
    for payload in ({"x": float("nan")}, {"x": object()}):
        with pytest.raises(InvalidInput, match="plain JSON"):
            next_event(None, 0.0, "note", payload)
    assert next_event(None, 0.0, "note", {"x": (1, 2)}).payload["x"] == [1, 2]


def test_to_fold_a_note_looks_at_no_note_before_it(monkeypatch):
    """Counted: twice as many notes are twice the work."""
    events = [next_event(None, 1.0, "session_created", {"name": "n", "robot": "0" * 32, "robot_name": "a"})]
    for number in range(200):
        events.append(next_event(events[-1], 2.0, "note", {"text": f"{number}"}))
    looked, freeze = [0], value._freeze

    def counted(item):
        looked[0] += 1
        return freeze(item)

    monkeypatch.setattr(value, "_freeze", counted)
    counts = []
    for length in (101, 201):
        looked[0] = 0
        assert len(fold_all(events[:length]).notes) == length - 1
        counts.append(looked[0])
    assert counts[1] <= 2.1 * counts[0]
