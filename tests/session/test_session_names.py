"""Sessions that get another name: it is in the log, survives a restart, and is listed without reading the log."""

import sqlite3
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.session.jobs.local import InlineJobs
from footfall.session.naming import LONGEST, session_name
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.session.storage import schema
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog

KEPT = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=LONGEST)
HIDDEN = st.characters(codec="utf-8", categories=["Cc", "Cf", "Co", "Zl", "Zp"])


def listed(sessions):
    return {one["id"]: one["name"] for one in sessions.list()}


@given(name=KEPT)
def test_every_printable_name_of_the_length_is_kept_as_it_is(name):
    assert session_name(f"  {name} ") == name


@given(before=KEPT.filter(lambda text: len(text) < LONGEST), hidden=HIDDEN)
def test_what_can_not_be_printed_is_refused_with_its_place(before, hidden):
    with pytest.raises(InvalidInput, match=rf"character {len(before) + 1} of the name \(U\+{ord(hidden):04X}\)"):
        session_name(f"{before}{hidden}x")


@given(excess=st.integers(1, 500))
def test_a_name_that_is_too_long_is_refused_by_how_much(excess):
    with pytest.raises(InvalidInput, match=f"{LONGEST + excess} characters.* leave out {excess}$"):
        session_name("n" * (LONGEST + excess))


@pytest.mark.parametrize("blank", ["", " ", "\n\t "])
def test_a_session_can_not_be_left_without_a_name(blank):
    with pytest.raises(InvalidInput, match="empty"):
        session_name(blank)


@pytest.mark.parametrize("name", [" ", "n" * (LONGEST + 1), "up\u202edown"])
def test_no_session_begins_under_a_name_that_is_none(work, name):
    with Sessions(work, InlineJobs()) as sessions:
        with pytest.raises(InvalidInput) as refused:
            sessions.create(name)
        with pytest.raises(InvalidInput) as by_rule:
            session_name(name)
        assert refused.value.message == by_rule.value.message
        assert sessions.list() == []


def test_a_name_survives_a_restart_and_goes_along_in_bundles(work, tmp_path):
    with Sessions(work, InlineJobs()) as sessions:
        one, other = sessions.create("alike"), sessions.create("alike")
        for name in ("second", "third \N{GREEK SMALL LETTER MU}"):
            one.rename(name)
        events = len(one.events())
        one.rename("third \N{GREEK SMALL LETTER MU}")
        assert len(one.events()) == events, "the same name again is no event"
        assert listed(sessions) == {one.id: "third \N{GREEK SMALL LETTER MU}", other.id: "alike"}
        assert one.summary()["name"] == one.state.name == "third \N{GREEK SMALL LETTER MU}"
        bundle = one.export_bundle()
        with pytest.raises(InvalidInput):
            one.rename("")
    with Sessions(work, InlineJobs()) as again:
        assert listed(again) == {one.id: one.state.name, other.id: "alike"}
        assert again.look(one.id).state.name == one.state.name
    with Sessions(tmp_path / "elsewhere", InlineJobs()) as taken_in:
        there = taken_in.import_bundle(bundle)
        assert listed(taken_in) == {there.id: one.state.name}
    report = replay(bundle)
    assert report.ok
    assert report.name == one.state.name


def test_the_list_tells_when_the_last_event_of_a_session_was(work):
    with Sessions(work, InlineJobs()) as sessions:
        one = sessions.create("drive")
        one.rename("morning drive")
        assert [about["latest"] for about in sessions.list()] == [one.events()[-1].time]


def test_a_log_that_was_kept_beside_the_database_is_listed_by_its_latest_name(tmp_path):
    with Sessions(tmp_path, InlineJobs()) as sessions:
        one = sessions.create("first")
        one.add_note("session_renamed is a word of the log")
        one.rename("second")
        one.add_note("more")
        one.store.keep_beside(())
        assert listed(sessions) == {one.id: "second"}


def test_names_are_listed_by_an_index_also_in_a_database_of_an_earlier_version(tmp_path):
    with closing(sqlite3.connect(tmp_path / DATABASE, isolation_level=None)) as database:
        schema.bring_up(database, schema.SCHEMAS[:1])
        assert not database.execute("SELECT 1 FROM sqlite_master WHERE name = 'names'").fetchall()
    with Sessions(tmp_path, InlineJobs()) as sessions:
        sessions.create("first").rename("second")
    with closing(SqliteLog(tmp_path / DATABASE)) as log:
        assert [one.renamed for one in log.sessions()] == [{"name": "second"}]
        plan = log._database.execute(f"EXPLAIN QUERY PLAN {schema.RENAMED_SESSIONS}").fetchall()
    assert [told for *_, told in plan] == ["SCAN events USING INDEX names"]
