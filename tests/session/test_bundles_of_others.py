"""A session that others wrote, its chain whole: whatever it says, it is refused by name, or opened and can be shown."""

import copy
import io
import json
import re
import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from footfall.core.declared import misfit
from footfall.core.errors import InvalidBundle
from footfall.io.artifacts import HOMES
from footfall.io.bundles import ARTIFACTS, EVENTS, SESSION, read_bundle
from footfall.io.event_log import line, rechain
from footfall.session.jobs import requests
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.log.fold import SessionState
from footfall.session.log.records import Note
from footfall.session.products.kinds import FILE, KINDS
from footfall.session.replay.page_story import page_story
from footfall.session.replay.side_by_side import side_by_side
from footfall.session.storage import value_kinds
from footfall.session.storage.artifact_folder import verify_artifact
from footfall.telemetry.link import EPOCHS_AHEAD

DIGEST = re.compile("[0-9a-f]{32}")
ODD = [
    None, True, 0, -1, 1.5, 1e308, 10**400, 2**63, "", "x", "0" * 32, "../../x", "\ud800", "\0",
    [], [1, 2], [None], [[]], {}, {"a": 1}, {"name": 5}, ["a", "b", "c"],
]  # fmt: skip


@pytest.fixture
def told(session, state_of, frame_of):
    """The bundle of a session with something of everything in its log."""
    session.maps.choose_footfall(2, 1.0, 0.0)
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.add_note("one")
    session.rover.connected(lambda text: None)
    session.rover.take_telemetry(frame_of(0))
    ids = session.commands.send(session.commands.arm()["token"])["commands"]
    session.rover.take_acknowledgement(ids[0], "refused", "the joint is stuck")
    session.sequences.export(None, "csv")
    session.commands.stop("enough")
    return read_bundle(session.export_bundle())


def packed(about, records, files):
    """As somebody packs them who knows how events are chained."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(SESSION, json.dumps(about))
        archive.writestr(EVENTS, b"".join(line(one) for one in records))
        for name, content in files.items():
            archive.writestr(f"{ARTIFACTS}/{name}", content())
    return out.getvalue()


def places(item, at=()):
    """Every place in plain JSON."""
    yield at
    inside = item.items() if isinstance(item, dict) else enumerate(item) if isinstance(item, list) else ()
    for name, one in inside:
        yield from places(one, (*at, name))


def changed(item, place, other):
    """With ``other`` in a place; None: without it."""
    if not place:
        return other
    item = copy.copy(item)
    if len(place) == 1 and other is None:
        del item[place[0]]
    else:
        item[place[0]] = changed(item[place[0]], place[1:], other)
    return item


@settings(
    max_examples=250, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_whatever_it_says_it_is_refused_or_can_be_shown(sessions, told, data):
    about = {**told.session}
    records = [{**one, "payload": json.loads(json.dumps(dict(one["payload"])))} for one in told.records]
    row = data.draw(st.integers(-1, len(records) - 1))
    changes = {**about} if row < 0 else records[row]["payload"]
    place = data.draw(st.sampled_from([one for one in places(changes) if one] or [()]))
    other = data.draw(st.sampled_from(ODD))
    if row < 0:
        about = changed(about, place, other)
    else:
        records[row]["payload"] = changed(changes, place, other) if place else {}
    records = rechain(records)
    if row >= 0:
        about["head"] = {"seq": len(records) - 1, "hash": records[-1]["hash"]}
    listed = {one["id"] for one in sessions.list()}
    try:
        live = sessions.import_bundle(packed(about, records, told.files))
    except InvalidBundle:
        assert {one["id"] for one in sessions.list()} == listed
        return
    live.summary()
    live.export_bundle()
    if live.commands.gate["stopped"]:
        live.commands.clear_stop()  # else the next one would have to carry it on
    sessions._open.pop(live.id).close()


def digests(item):
    """Every place in plain JSON that holds the digest of an artifact."""
    for place in places(item):
        found = item
        for name in place:
            found = found[name]
        if isinstance(found, str) and DIGEST.fullmatch(found):
            yield place


@settings(
    max_examples=200, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_whatever_value_an_event_names_it_is_refused_or_told_and_compared(sessions, session, told, data):
    records = [{**one, "payload": json.loads(json.dumps(dict(one["payload"])))} for one in told.records]
    row = data.draw(st.sampled_from([row for row, one in enumerate(records) if any(digests(one["payload"]))]))
    payload = records[row]["payload"]
    place = data.draw(st.sampled_from(list(digests(payload))))
    other = data.draw(st.sampled_from(sorted(name.partition(".")[0] for name in told.files)))
    # also in all later events: else the fold finds that they do not fit
    was = payload
    for name in place:
        was = was[name]
    everywhere = data.draw(st.booleans())
    records = [
        {**one, "payload": json.loads(json.dumps(one["payload"]).replace(was, other))} if everywhere else one
        for one in records
    ]
    if not everywhere:
        records[row]["payload"] = changed(payload, place, other)
    records = rechain(records)
    about = {**told.session, "head": {"seq": len(records) - 1, "hash": records[-1]["hash"]}}
    try:
        live = sessions.import_bundle(packed(about, records, told.files))
    except InvalidBundle:
        return
    live.summary()
    page_story(live.events(), live.typed, live.robot)
    side_by_side(live, session)
    if live.commands.gate["stopped"]:
        live.commands.clear_stop()
    sessions._open.pop(live.id).close()


def test_a_value_of_another_kind_is_refused_with_the_place_that_names_it(sessions, told):
    ground = next(
        name.partition(".")[0] for name, content in told.files.items() if verify_artifact(name, content()) == "Dem"
    )
    for place, wanted in ((("digest",), "PlanResult"), (("parents", "state"), "RobotState or PredictedState")):
        records = [dict(one) for one in told.records]
        made = next(one for one in records if one["payload"].get("kind") == "plan")
        made["payload"] = changed(json.loads(json.dumps(made["payload"])), place, ground)
        named = re.escape(f"event {made['seq']} (product) names a Dem as {'.'.join(place)}, where a {wanted} belongs")
        with pytest.raises(InvalidBundle, match=named):
            sessions.import_bundle(packed({**told.session, "head": None}, rechain(records), told.files))


def test_a_product_without_what_it_was_made_from_is_refused(sessions, told):
    records = [dict(one) for one in told.records]
    made = next(one for one in records if one["payload"].get("kind") == "plan")
    made["payload"] = changed(json.loads(json.dumps(made["payload"])), ("parents", "dem"), None)
    with pytest.raises(InvalidBundle, match=f"event {made['seq']}: plan is said to be made without dem"):
        sessions.import_bundle(packed({**told.session, "head": None}, rechain(records), told.files))


def test_every_product_that_can_be_made_has_its_kind_and_its_parents():
    """One without would be taken in unseen."""
    parents = {name: value_kinds.parents_called(name) for kind in KINDS.values() for name in kind.needs}
    assert all(parents.values()), parents
    known = {cls for places in value_kinds._NAMED.values() for classes in places.values() for cls in classes}
    known |= {cls for classes in parents.values() for cls in classes} | {kind.makes for kind in KINDS.values()}
    homes = {name for names in HOMES.values() for name in names}
    assert known - {FILE} <= homes
    assert {kind.request for kind in KINDS.values()} - {None} <= homes | set(vars(requests))
    assert all(callable(PRODUCTS[name]) for name in KINDS)


def test_a_time_that_is_none_is_refused(sessions, told):
    for time in (10**400, True, None):
        records = [dict(one) for one in told.records]
        records[-2]["time"] = time
        with pytest.raises(InvalidBundle):
            sessions.import_bundle(packed({**told.session, "head": None}, rechain(records), told.files))


def test_an_epoch_that_no_rover_would_believe_is_refused(sessions, told):
    records = [dict(one) for one in told.records]
    stop = next(one for one in records if one["type"] == "stop_requested")
    stop["payload"] = {**stop["payload"], "epoch": int(stop["time"]) + 2 * EPOCHS_AHEAD}
    with pytest.raises(InvalidBundle, match="no rover would believe"):
        sessions.import_bundle(packed({**told.session, "head": None}, rechain(records), told.files))


def test_what_a_field_does_not_declare_is_found_with_its_path():
    for fine in (SessionState(), SessionState(maps={"2": "d"}, notes=(Note(1.0, "a"),), stop=SessionState().stop)):
        assert misfit(fine) is None
    assert misfit(SessionState(name=None)) == "name"  # type: ignore[arg-type]
    assert misfit(SessionState(maps={"2": 5})) == "maps['2']"  # type: ignore[dict-item]
    assert misfit(SessionState(notes=(Note(1.0, "a"), Note(1.0, True)))) == "notes[1].text"  # type: ignore[arg-type]
    assert misfit(SessionState(footfall=(2, 1.0, 0.0))) == "footfall"  # type: ignore[arg-type]
    assert misfit(SessionState(runs=True)) == "runs"
