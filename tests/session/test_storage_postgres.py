"""What only a database server brings along: its guards, several machines, and a connection that can be lost."""

import contextlib
import json
import os
import shutil
import signal
from contextlib import closing

import psycopg
import pytest

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput
from footfall.session import folded_log as folded_log_module
from footfall.session import stop_log
from footfall.session.access.identity import Identity, Role
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.event import next_event
from footfall.session.registry import Sessions
from footfall.session.storage import postgres_connection, postgres_log, postgres_schema
from footfall.session.storage.backup import backup
from footfall.session.storage.databases import bind, binding, open_log
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.postgres_log import PostgresLog
from footfall.session.storage.store import SessionStore, read_session
from footfall.session.storage.verify import verify

ABOUT = {"format": "footfall-session", "version": 1, "name": "s"}


def append(store, text):
    store.append(next_event(store.events[-1] if store.events else None, 1.0, "note", {"text": text}))


def texts(folder):
    return [record["payload"].get("text") for record in read_session(folder).records]


def until_set(postgres, name, value):
    """Wait until the server has taken over a setting."""
    while True:
        with closing(psycopg.connect(postgres.address())) as asking:
            if asking.execute(f"SHOW {name}".encode()).fetchone() == (value,):
                return


def bound(folder):
    """The database of a folder."""
    found = binding(folder)
    assert found is not None
    return found


def backend(store):
    """Number of the server's process that a session's connection ends in."""
    return store._log._database.info.backend_pid


def cut(postgres, store):
    """End a session's connection from the server's side."""
    with closing(psycopg.connect(postgres.address(), autocommit=True)) as server:
        server.execute("SELECT pg_terminate_backend(%s, 5000)", (backend(store),))


@pytest.fixture
def work(postgres, tmp_path):
    bind(tmp_path / "work", postgres.fresh())
    return tmp_path / "work"


@pytest.fixture
def folder(work):
    """A closed session with three notes."""
    with closing(SessionStore.create(work / "s", ABOUT)) as store:
        for text in "abc":
            append(store, text)
    return work / "s"


@pytest.fixture
def database(work):
    """A connection of its own to the tables of a working folder."""
    with closing(psycopg.connect(bound(work).url, autocommit=True)) as opened:
        yield opened


# -- the tables -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE events SET payload = '{}' WHERE seq = 1",
        "DELETE FROM events WHERE seq = 2",
        "DELETE FROM events",
        "TRUNCATE events",
        "INSERT INTO events SELECT session, 4, time, type, payload, hash, 'h' FROM events WHERE seq = 2",
        "INSERT INTO events SELECT session, 3, time, type, payload, previous, 'h' FROM events WHERE seq = 2",
        "INSERT INTO events SELECT session, 2, time, type, '{}', previous, hash FROM events WHERE seq = 2",
        "DELETE FROM sessions",
        "INSERT INTO events SELECT 'other', 0, time, type, payload, previous, hash FROM events WHERE seq = 0",
    ],
)
def test_the_database_itself_only_lets_events_follow(folder, database, statement):
    with pytest.raises(psycopg.IntegrityError):
        database.execute(statement)
    assert texts(folder) == ["a", "b", "c"]


@pytest.mark.parametrize(
    "statement",
    [
        "ALTER TABLE events DISABLE TRIGGER events_stay",
        "DROP TRIGGER events_remain_all ON events",
        "CREATE OR REPLACE FUNCTION events_follow() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RETURN NEW; END'",
        "ALTER TABLE events DROP CONSTRAINT events_pkey",
    ],
)
def test_removed_guards_are_found(folder, database, statement):
    assert verify(folder.parent) == []
    database.execute(statement)
    assert [(one.kind, one.harmful) for one in verify(folder.parent)] == [("database", True)]


@pytest.mark.parametrize(
    ("statement", "kind"),
    [
        ("UPDATE events SET time = '2.0' WHERE seq = 1", "log"),
        ("UPDATE sessions SET about = '{}'", "log"),
        ("DELETE FROM events WHERE seq = 2", "head"),
        ("DELETE FROM events WHERE seq = 1", "log"),
    ],
)
def test_what_its_owner_changed_past_the_guards_is_found(folder, database, statement, kind, tmp_path):
    database.execute("SET session_replication_role = replica")
    database.execute(statement)
    found = verify(folder.parent)
    assert [(one.session, one.kind) for one in found if one.harmful and one.kind != "missing"][:1] == [("s", kind)]
    with pytest.raises(InvalidBundle):
        SessionStore(folder)
    with contextlib.suppress(Conflict):  # a gap does not go into the copy
        assert any(one.harmful for one in backup(folder.parent, tmp_path / "copy"))


def test_lost_events_are_told_and_there_is_a_way_on(folder, database):
    database.execute("SET session_replication_role = replica")
    database.execute("DELETE FROM events WHERE seq = 2")
    with pytest.raises(InvalidBundle, match=r"its head knows of event 2.*write-ahead logs"):
        SessionStore(folder)
    (folder / "head").unlink()
    with closing(SessionStore(folder)) as store:
        assert "made anew" in store.repairs[0]["text"]


def test_a_commit_waits_for_the_disk_whatever_the_server_is_used_to(postgres, folder, database):
    with closing(psycopg.connect(postgres.address(), autocommit=True)) as server:
        try:
            server.execute("ALTER DATABASE postgres SET synchronous_commit = off")
            with closing(open_log(folder.parent)) as log:
                assert isinstance(log, PostgresLog)
                assert log._database.execute("SHOW synchronous_commit").fetchone() == ("on",)
            server.execute("ALTER SYSTEM SET full_page_writes = off")
            server.execute("SELECT pg_reload_conf()")
            until_set(postgres, "full_page_writes", "off")
            with pytest.raises(Conflict, match="full_page_writes off"):
                SessionStore(folder)
        finally:
            server.execute("ALTER SYSTEM RESET full_page_writes")
            server.execute("ALTER DATABASE postgres RESET synchronous_commit")
            server.execute("SELECT pg_reload_conf()")
            until_set(postgres, "full_page_writes", "on")


def test_tables_of_a_later_version_or_of_others_are_refused(folder, database, postgres, tmp_path):
    database.execute("INSERT INTO schema_versions VALUES (99, 'later', 1.0)")
    with pytest.raises(InvalidBundle, match="later version"):
        SessionStore(folder)
    url = postgres.fresh()
    with closing(psycopg.connect(url, autocommit=True)) as other:
        other.execute("CREATE TABLE events (a int)")
    with pytest.raises(InvalidBundle, match="none of FootFall's"):
        bind(tmp_path / "other", url)


def test_tables_are_brought_up_step_by_step_and_all_or_nothing(folder, database):
    store, schemas = bound(folder.parent).id, postgres_schema.SCHEMAS
    added = ("CREATE TABLE second (a int)", "INSERT INTO second VALUES (1)")
    with pytest.raises(psycopg.errors.SyntaxError):
        postgres_schema.bring_up(database, store, False, (*schemas, added, ("CREATE TABLE third (a int)", "no SQL")))
    assert database.execute("SELECT max(version) FROM schema_versions").fetchone() == (len(schemas),)
    assert database.execute("SELECT to_regclass('second'), to_regclass('third')").fetchone() == (None, None)
    for _ in range(2):
        postgres_schema.bring_up(database, store, False, (*schemas, added))
    versions = database.execute("SELECT version FROM schema_versions ORDER BY 1").fetchall()
    assert versions == [(number,) for number in range(1, len(schemas) + 2)]
    assert database.execute("SELECT a FROM second").fetchall() == [(1,)]
    assert database.execute("SELECT count(*) FROM events").fetchone() == (3,)


# -- which database -----------------------------------------------------------------------------


def test_folder_and_database_belong_to_each_other(folder, postgres, tmp_path):
    url = bound(folder.parent).url
    bind(folder.parent, url)
    with pytest.raises(Conflict, match="belongs to another data folder"):
        bind(tmp_path / "other", url)
    assert not (tmp_path / "other" / "store").exists()
    with pytest.raises(FileNotFoundError, match="no tables"):
        bind(folder.parent, postgres.fresh())
    bind(folder.parent, f"{url}&connect_timeout=5")  # the same database under another address
    assert bound(folder.parent).url.endswith("=5")
    assert texts(folder) == ["a", "b", "c"]


def test_what_is_no_address_or_holds_a_password_is_refused(tmp_path):
    for url, reason in (
        ("mysql://host/db", "postgresql://"),
        ("postgresql://me:secret@host/db", "password"),
        ("postgresql://host/db?password=secret", "password"),
    ):
        with pytest.raises(InvalidInput, match=reason):
            bind(tmp_path / "work", url)
    with pytest.raises(StoreRefused, match="can't be reached"):
        bind(tmp_path / "work", f"postgresql://tests@/postgres?host={tmp_path}")
    assert binding(tmp_path / "work") is None


def test_sessions_in_sqlite_are_not_left_behind_unseen(tmp_path, postgres):
    SessionStore.create(tmp_path / "s", ABOUT).close()
    with pytest.raises(Conflict, match="new folder"):
        bind(tmp_path, postgres.fresh())
    assert texts(tmp_path / "s") == []


# -- several machines ---------------------------------------------------------------------------


def test_two_servers_never_write_to_one_session(folder):
    """The other server sees the same files through a mount of its own, where the first one's file lock is not seen."""
    elsewhere = shutil.copytree(folder.parent, folder.parent.with_name("elsewhere"))
    with closing(SessionStore(folder)) as store:
        with pytest.raises(Conflict, match="another server"):
            SessionStore(elsewhere / "s")
        append(store, "d")
        assert texts(elsewhere / "s") == ["a", "b", "c", "d"]
        with closing(SessionStore.create(elsewhere / "other", ABOUT)) as other:
            append(other, "theirs")
    shutil.copy(folder / "head", elsewhere / "s" / "head")
    with closing(SessionStore(elsewhere / "s")) as store:
        append(store, "e")


def test_a_writer_whose_lock_went_to_another_server_writes_no_more(folder, postgres):
    elsewhere = shutil.copytree(folder.parent, folder.parent.with_name("elsewhere"))
    store = SessionStore(folder)
    cut(postgres, store)
    with closing(SessionStore(elsewhere / "s")) as other:
        with pytest.raises(StoreRefused, match="another server"):
            append(store, "ours")
        append(other, "theirs")
        with pytest.raises(Conflict, match="another server"):
            append(store, "ours")
    assert texts(elsewhere / "s") == ["a", "b", "c", "theirs"]
    store._let_go()


# -- a connection that can be lost --------------------------------------------------------------


def test_a_connection_that_was_cut_between_two_events_is_made_again_unnoticed(folder, postgres):
    with closing(SessionStore(folder)) as store:
        for text in "de":
            cut(postgres, store)
            append(store, text)
    assert texts(folder) == ["a", "b", "c", "d", "e"]
    assert verify(folder.parent) == []


@pytest.mark.parametrize("mode", ["fast", "immediate"])
def test_stop_works_without_the_server_and_is_written_when_it_is_back(
    work, postgres, athlete, tiny, state_of, frame_of, mode
):
    sent, heard = [], []
    with Sessions(work, jobs=InlineJobs("tiny_recipes"), robot=athlete) as sessions:
        running = sessions.create("test")
        running.terrains.load(tiny.dem(), "test")
        running.stances.set(state_of())
        running.plans.step(2, (1.0, 0.0)).finish()
        running.sequences.make()
        running.rover.connected(sent.append)
        running.rover.take_telemetry(frame_of(0))
        running.commands.send(running.commands.arm()["token"])
        before = running.events()
        running.listen(heard.append)
        postgres.stop(mode)
        try:
            running.commands.stop("without a database")
            assert json.loads(sent[-1])["type"] == "stop"
            assert running.commands.gate["stopped"]
            assert running.unrecorded == 2
            with pytest.raises(StoreRefused, match="can't be reached"):
                running.add_note("refused, as it would not be kept")
            assert "can't be reached" in str(sessions.list()[0].get("problem"))
            assert next((one.session, one.kind) for one in verify(work)) == ("", "database")
        finally:
            postgres.start()
        running.add_note("it is back")
        events = running.events()
        assert events[: len(before)] == before
        # a run whose telemetry grew old while the server went down ended by itself, before the stop
        assert sorted(e.type for e in events[len(before) : -1]) == ["run_ended", "stop_requested"]
        assert events[-1].type == "note"
        assert [m["store"]["unrecorded"] for m in heard if m["type"] == "store"] == [1, 2, 0]
        name = running.id
    assert [one for one in verify(work) if one.harmful] == []
    with closing(SessionStore(work / name)) as again:
        assert again.events[: len(events)] == events


def test_a_server_that_hangs_is_given_up_and_the_event_is_in_the_log_once(folder, postgres, monkeypatch):
    monkeypatch.setattr(postgres_connection, "LONGEST", 0.3)
    monkeypatch.setattr(postgres_log, "PATIENCE", 0.3)
    store = SessionStore(folder)
    log = folded_log_module.FoldedLog(store)
    hangs = backend(store)
    os.kill(hangs, signal.SIGSTOP)
    try:
        log.record_anyway("note", {"text": "d"})
    finally:
        os.kill(hangs, signal.SIGCONT)
    assert log.unrecorded == 1
    monkeypatch.setattr(postgres_connection, "LONGEST", 20.0)
    monkeypatch.setattr(postgres_log, "PATIENCE", 5.0)
    log.record("note", {"text": "e"})
    log.close()
    assert texts(folder) == ["a", "b", "c", "d", "e"]


def test_a_stop_is_answered_while_the_server_hangs_and_written_when_it_goes_on(
    work, postgres, athlete, tiny, frame_of, monkeypatch
):
    monkeypatch.setattr(stop_log, "PATIENCE", 0.2)
    sent = []
    with Sessions(work, jobs=InlineJobs("tiny_recipes"), robot=athlete) as sessions:
        running = sessions.create("test")
        running.rover.connected(sent.append)
        running.rover.take_telemetry(frame_of(0))
        hangs = backend(running.store)
        os.kill(hangs, signal.SIGSTOP)
        try:
            # the database itself is waited for 20 s, and would then be there no more
            assert running.commands.stop("the database hangs", Identity("ann", Role.COMMANDER))["stopped"]
            assert json.loads(sent[-1])["type"] == "stop"
            assert [event for event in running.folded_log._events if event.type == "stop_requested"] == []
        finally:
            os.kill(hangs, signal.SIGCONT)
        running.add_note("it goes on")
        told = [event.payload for event in running.events() if event.type == "stop_requested"]
        assert [(one["reason"], one["by"]["name"]) for one in told] == [("the database hangs", "ann")]


def test_locked_tables_are_waited_for_a_bounded_time(folder, database, monkeypatch):
    monkeypatch.setattr(postgres_log, "PATIENCE", 0.1)
    with closing(SessionStore(folder)) as store:
        with database.transaction():
            database.execute("LOCK TABLE events IN EXCLUSIVE MODE")
            with pytest.raises(StoreRefused, match="holds its tables locked"):
                append(store, "waits")
        append(store, "d")
    assert texts(folder) == ["a", "b", "c", "d"]


def test_a_server_that_only_lets_read_is_told(folder):
    with closing(SessionStore(folder)) as store:
        assert isinstance(store._log, PostgresLog)
        store._log._database.execute("SET default_transaction_read_only = on")
        with pytest.raises(StoreRefused, match="standby"):
            append(store, "d")
