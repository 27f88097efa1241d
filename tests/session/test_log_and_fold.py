"""Event log, fold and folder: what was written is what comes back, and damage shows."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput, NotFound
from footfall.io.event_log import line, read_lines
from footfall.maps.layers import MapSettings
from footfall.session.event import event_of, next_event
from footfall.session.fold import EVENT_TYPES, SessionState, fold, fold_all
from footfall.session.store import SessionStore

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
    "run_started": st.fixed_dictionaries({"run": RUN}),
    "command_sent": st.fixed_dictionaries({"id": REASON, "sequence": DIGEST, "run": RUN, "row": RUN}),
    "command_done": st.fixed_dictionaries({"id": REASON}),
    "command_refused": st.fixed_dictionaries({"id": REASON, "reason": REASON}),
    "run_ended": st.fixed_dictionaries({"reason": REASON}),
    "stop_requested": st.fixed_dictionaries({"reason": REASON, "at": st.floats(0, 1e9)}),
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


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "s"
    store = SessionStore.create(path, {"format": "footfall-session", "version": 1, "name": "s"})
    last = None
    for text in "abc":
        last = next_event(last, 1.0, "note", {"text": text})
        store.append(last)
    store.put(MapSettings())
    store.close()
    return path


def test_a_torn_last_line_is_cut_off_and_nothing_else(folder):
    log = folder / "events.jsonl"
    whole = log.read_bytes()
    log.write_bytes(whole + b'{"seq":3,"time":1.0,"ty')
    store = SessionStore(folder)
    assert (len(store.events), store.torn) == (3, 23)
    store.append(next_event(store.events[-1], 2.0, "note", {"text": "d"}))
    store.close()
    assert log.read_bytes().startswith(whole)
    assert len(SessionStore(folder).events) == 4


def test_a_torn_line_is_noted_in_the_session(sessions, session):
    session_id = session.id
    session.close()
    del sessions._open[session_id]
    with (sessions.folder / session_id / "events.jsonl").open("ab") as log:
        log.write(b'{"torn')
    again = sessions.open(session_id)
    repaired = [e for e in again.events() if e.type == "log_repaired"]
    assert repaired[0].payload["bytes"] == 6


def test_a_cut_tail_shows_against_the_sealed_head(folder):
    log = folder / "events.jsonl"
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:2]))
    with pytest.raises(InvalidBundle, match="was cut"):
        SessionStore(folder)


def test_two_writers_are_refused(folder):
    store = SessionStore(folder)
    with pytest.raises(Conflict, match="another process"):
        SessionStore(folder)
    store.close()
    SessionStore(folder).close()


def test_a_damaged_artifact_is_named(folder):
    store = SessionStore(folder)
    digest = MapSettings().digest
    assert store.get(digest).digest == digest
    path = folder / "artifacts" / f"{digest}.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(InvalidBundle, match=digest):
        store.get(digest)
    other = MapSettings(window=0.7)
    store.put(other)
    (folder / "artifacts" / f"{other.digest}.npz").replace(path)
    with pytest.raises(InvalidBundle, match=f"its content is {other.digest}"):
        store.get(digest)
    with pytest.raises(NotFound):
        store.get(other.digest)
    store.close()


def test_the_session_file_is_plain_json(folder):
    about = json.loads((folder / "session.json").read_text())
    assert about["version"] == 1
    assert about["head"]["seq"] == 2
