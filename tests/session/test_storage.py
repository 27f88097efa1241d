"""The store: what is written comes back, what is not allowed is refused, what earlier versions wrote is taken over."""

import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput, NotFound
from footfall.io.bundles import log_bytes, read_bundle, session_bytes
from footfall.maps.layers import MapSettings
from footfall.session.log.event import event_of, next_event
from footfall.session.log.fold import fold_all
from footfall.session.storage import schema
from footfall.session.storage.head import SLOT, HeadFile, read_head
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog
from footfall.session.storage.store import SessionStore, read_session

ABOUT = {"format": "footfall-session", "version": 1, "name": "s", "created": 1.0, "robot": {"name": "athlete"}}
SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)
STEPS = st.lists(
    st.tuples(st.integers(0, 10) | st.floats(0, 1e10), st.dictionaries(st.text(max_size=3), JSON, max_size=3)),
    max_size=8,
)


def note(last, text, time=1.0):
    return next_event(last, time, "note", {"text": text})


def filled(path):
    """A closed session with three notes and an artifact."""
    store = SessionStore.create(path, ABOUT)
    for text in "abc":
        store.append(note(store.events[-1] if store.events else None, text))
    store.put(MapSettings())
    store.close()
    return path


@pytest.fixture
def folder(work):
    """A closed session with three notes and an artifact, once with each kind of database."""
    return filled(work / "s")


@pytest.fixture
def in_sqlite(tmp_path):
    """A closed session with three notes and an artifact, in SQLite."""
    return filled(tmp_path / "s")


@given(steps=STEPS)
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_comes_back_bit_for_bit(store_in, steps):
    with TemporaryDirectory() as work:
        store = SessionStore.create(store_in(Path(work)) / "s", ABOUT)
        for at, payload in steps:
            store.append(next_event(store.events[-1] if store.events else None, at, "note", payload))
        written = log_bytes(event.as_dict() for event in store.events)
        head = read_head(store.folder)
        assert head is not None
        assert (head.seq, head.damaged) == (len(steps) - 1, 0)
        store.close()
        again = SessionStore(Path(work) / "s")
        assert log_bytes(event.as_dict() for event in again.events) == written
        assert again.session == ABOUT
        assert again.repairs == []
        again.close()


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE events SET payload = '{}' WHERE seq = 1",
        "UPDATE events SET seq = 7 WHERE seq = 2",
        "DELETE FROM events WHERE seq = 2",
        "DELETE FROM events",
        "INSERT INTO events SELECT session, 4, time, type, payload, hash, 'h' FROM events WHERE seq = 2",
        "INSERT INTO events SELECT session, 3, time, type, payload, previous, 'h' FROM events WHERE seq = 2",
        "INSERT OR REPLACE INTO events SELECT session, 2, time, type, '{}', previous, hash FROM events WHERE seq = 2",
        "DELETE FROM sessions",
        "INSERT INTO events SELECT 'other', 0, time, type, payload, previous, hash FROM events WHERE seq = 0",
    ],
)
def test_the_database_itself_only_lets_events_follow(in_sqlite, statement):
    with closing(sqlite3.connect(in_sqlite.parent / DATABASE, isolation_level=None)) as database:
        database.execute("PRAGMA foreign_keys = ON")
        with pytest.raises(sqlite3.IntegrityError):
            database.execute(statement)
    store = SessionStore(in_sqlite)
    assert [event.payload["text"] for event in store.events] == ["a", "b", "c"]
    store.close()


def test_every_commit_waits_for_the_disk(in_sqlite):
    with closing(SqliteLog(in_sqlite.parent / DATABASE)) as log:
        assert log._database.execute("PRAGMA synchronous").fetchone() == (2,)
        assert log._database.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_one_writer_a_session_and_any_number_of_readers(folder):
    store = SessionStore(folder)
    with pytest.raises(Conflict, match="another process"):
        SessionStore(folder)
    other = SessionStore.create(folder.parent / "other", ABOUT)
    for session in (store, other):
        session.append(note(session.events[-1] if session.events else None, "d"))
    code = (
        "import sys; from pathlib import Path; from footfall.session.storage.store import *\n"
        "print(len(read_session(Path(sys.argv[1])).records)); SessionStore(Path(sys.argv[1]))"
    )
    run = subprocess.run([sys.executable, "-c", code, str(folder)], capture_output=True, text=True, check=False)
    assert run.stdout.strip() == "4"
    assert "open in another process" in run.stderr
    other.close()
    store.close()
    SessionStore(folder).close()


def test_lost_events_are_told_loudly_and_there_is_a_way_on(in_sqlite):
    database = in_sqlite.parent / DATABASE
    earlier = database.read_bytes()
    store = SessionStore(in_sqlite)
    store.append(note(store.events[-1], "lost"))
    store.close()
    database.write_bytes(earlier)
    for read in (SessionStore, read_session):
        with pytest.raises(InvalidBundle, match="ends with event 2, its head knows of event 3"):
            read(in_sqlite)
    (in_sqlite / "head").unlink()
    store = SessionStore(in_sqlite)
    assert "made anew" in store.repairs[0]["text"]
    store.close()
    assert SessionStore(in_sqlite).repairs == []


def test_another_history_of_the_same_length_shows(in_sqlite):
    shutil.copytree(in_sqlite.parent, in_sqlite.parent.with_name("copy"))
    for path, text in ((in_sqlite, "here"), (in_sqlite.parent.with_name("copy") / "s", "there")):
        store = SessionStore(path)
        store.append(note(store.events[-1], text))
        store.close()
    shutil.copy(in_sqlite.parent.with_name("copy") / DATABASE, in_sqlite.parent / DATABASE)
    with pytest.raises(InvalidBundle, match="it was replaced"):
        SessionStore(in_sqlite)


def test_a_head_that_a_crash_left_behind_is_brought_up(folder):
    head = HeadFile(folder)
    events = SessionStore(folder)
    events.close()
    for seq, repaired in ((1, False), (0, True)):
        head.renew(seq, events.events[seq].hash)
        store = SessionStore(folder)
        assert bool(store.repairs) is repaired
        store.close()
        found = read_head(folder)
        assert found is not None
        assert found.seq == 2
    head.close()


@given(st.integers(0, 2 * SLOT), st.integers(0, 2 * SLOT - 1), st.integers(1, 255))
@settings(max_examples=60, deadline=None)
def test_a_torn_head_is_the_one_before_or_none(cut, at, mask):
    with TemporaryDirectory() as work:
        head = HeadFile(Path(work))
        hashes = [f"{i:032x}" for i in range(3)]
        head.renew(0, hashes[0])
        for seq in (1, 2):
            head.write(seq, hashes[seq])
        whole = (Path(work) / "head").read_bytes()
        damaged = bytearray(whole)
        damaged[at] ^= mask
        for data in (whole[:cut], bytes(damaged)):
            (Path(work) / "head").write_bytes(data)
            found = read_head(Path(work))
            assert found is None or (found.hash == hashes[found.seq] and found.seq in (1, 2))
            assert data == whole or found is None or found.damaged == 1
        head.close()


def test_a_session_is_made_once_and_needs_its_database(folder):
    with pytest.raises(InvalidInput, match="already"):
        SessionStore.create(folder, ABOUT)
    with pytest.raises(InvalidBundle, match="no session folder"):
        SessionStore(folder.parent / "nothing")
    shutil.copytree(folder, folder.parent.with_name("elsewhere") / "s")
    with pytest.raises(InvalidBundle, match=r"not in footfall\.sqlite"):
        SessionStore(folder.parent.with_name("elsewhere") / "s")
    assert not (folder.parent.with_name("elsewhere") / DATABASE).exists()


def test_a_damaged_artifact_is_named_and_harms_nothing_else(folder):
    store = SessionStore(folder)
    digest = MapSettings().digest
    assert store.get(digest).digest == digest
    path = folder / "artifacts" / f"{digest}.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    other = MapSettings(window=0.7)
    store.put(other)
    with pytest.raises(InvalidBundle, match=digest):
        store.get(digest)
    assert store.get(other.digest).digest == other.digest
    store.append(note(store.events[-1], "and on it goes"))
    (folder / "artifacts" / f"{other.digest}.npz").replace(path)
    with pytest.raises(InvalidBundle, match=f"its content is {other.digest}"):
        store.get(digest)
    with pytest.raises(NotFound):
        store.get(other.digest)
    store.close()


# -- versions of the database -----------------------------------------------------------------


def test_tables_of_a_later_version_or_of_others_are_refused(in_sqlite):
    database = in_sqlite.parent / DATABASE
    with closing(sqlite3.connect(database)) as made:
        made.execute("INSERT INTO schema_versions VALUES (99, 'later', 1.0)")
        made.commit()
    with pytest.raises(InvalidBundle, match="later version"):
        SessionStore(in_sqlite)
    database.unlink()
    with closing(sqlite3.connect(database)) as made:
        made.execute("CREATE TABLE theirs (a)")
    with pytest.raises(InvalidBundle, match="none of FootFall's"):
        SessionStore(in_sqlite)


def test_tables_are_brought_up_step_by_step_and_all_or_nothing(in_sqlite):
    path = in_sqlite.parent / DATABASE
    added, newest = ("CREATE TABLE second (a)", "INSERT INTO second VALUES (1)"), len(schema.SCHEMAS)
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        with pytest.raises(sqlite3.OperationalError):
            schema.bring_up(database, (*schema.SCHEMAS, added, ("CREATE TABLE third (a)", "no SQL")))
        assert database.execute("SELECT max(version) FROM schema_versions").fetchone() == (newest,)
        assert not database.execute("SELECT 1 FROM sqlite_master WHERE name IN ('second', 'third')").fetchall()
        for _ in range(2):
            schema.bring_up(database, (*schema.SCHEMAS, added))
        assert database.execute("SELECT version FROM schema_versions").fetchall() == [
            (n + 1,) for n in range(newest + 1)
        ]
        assert database.execute("SELECT a FROM second").fetchall() == [(1,)]
        assert database.execute("SELECT count(*) FROM events").fetchone() == (3,)


# -- what earlier versions wrote ----------------------------------------------------------------


def old_folder(at, torn=b""):
    """A session's folder as the versions before the database left it."""
    shutil.copytree(SAMPLES / "rock-step", at)
    with (at / "events.jsonl").open("ab") as log:
        log.write(torn)
    return at


@pytest.mark.parametrize("sample", sorted(path.parent.name for path in SAMPLES.glob("*/session.json")))
def test_an_old_folder_is_moved_once_and_is_the_same_session(work, sample):
    folder = Path(shutil.copytree(SAMPLES / sample, work / "old"))
    before = read_bundle(folder)
    state = fold_all(event_of(record) for record in before.records)
    for _ in range(2):
        store = SessionStore(folder)
        assert store.repairs == []
        assert fold_all(store.events).digest == state.digest
        store.close()
    assert (folder / "events.jsonl.moved").read_bytes() == (SAMPLES / sample / "events.jsonl").read_bytes()
    after = read_session(folder)
    assert after.records == before.records
    assert {**after.session, "id": 0} == {**before.session, "id": 0}
    assert after.files.keys() == before.files.keys()


def test_a_torn_last_line_of_an_old_log_is_left_out_and_told(work):
    store = SessionStore(old_folder(work / "old", b'{"seq":11,"ty'))
    assert len(store.events) == 11
    assert store.repairs[0]["bytes"] == 13
    store.close()


def test_damage_of_an_old_log_is_refused_and_nothing_is_moved(work):
    folder = old_folder(work / "old")
    log = folder / "events.jsonl"
    whole = log.read_bytes()
    log.write_bytes(b"".join(whole.splitlines(keepends=True)[:-2]))
    with pytest.raises(InvalidBundle, match="was cut"):
        SessionStore(folder)
    log.write_bytes(whole)
    SessionStore(folder).close()


@pytest.mark.parametrize("step", range(3))
def test_a_move_that_was_cut_short_is_completed(work, monkeypatch, step):
    class Dies(Exception):
        pass

    def dies(*_, **__):
        raise Dies

    folder = old_folder(work / "old")
    with monkeypatch.context() as patched:
        if step == 0:
            patched.setattr("footfall.session.storage.plain_log.new_head", dies)
        else:
            rename, calls = Path.rename, []
            patched.setattr(
                Path, "rename", lambda self, to: dies() if len(calls) == step - 1 else calls.append(rename(self, to))
            )
        with pytest.raises(Dies):
            SessionStore(folder)
    store = SessionStore(folder)
    assert (len(store.events), store.repairs) == (11, [])
    store.close()
    assert not (folder / "events.jsonl").exists()


def test_a_log_beside_the_database_continues_it_or_is_refused(folder):
    records = read_session(folder).records
    more = [*records, note(event_of(records[-1]), "d").as_dict()]
    (folder / "session.json").write_bytes(session_bytes(ABOUT))
    (folder / "events.jsonl").write_bytes(log_bytes(more))
    store = SessionStore(folder)
    assert [event.payload["text"] for event in store.events] == ["a", "b", "c", "d"]
    store.close()
    (folder / "session.json").write_bytes(session_bytes(ABOUT))
    (folder / "events.jsonl").write_bytes(log_bytes([*records, note(event_of(records[-1]), "e").as_dict()]))
    with pytest.raises(InvalidBundle, match="different stories"):
        SessionStore(folder)


def test_a_bundle_is_taken_in_whole_or_not_at_all(work):
    bundle = read_bundle(SAMPLES / "rock-step")

    def breaks():
        raise OSError("no space left")

    with pytest.raises(OSError, match="no space"):
        SessionStore.take_in(work / "a", replace(bundle, files={**bundle.files, f"{0:032x}.npz": breaks}))
    assert not (work / "a").exists()
    with pytest.raises(Conflict, match="refused"):
        SessionStore.take_in(work / "a", replace(bundle, records=bundle.records[1:]))
    assert not (work / "a").exists()
    store = SessionStore.take_in(work / "a", bundle)
    assert store.bundle().records == bundle.records
    store.close()


def test_a_session_is_read_while_events_are_written(session, monkeypatch):
    read, before = SqliteLog.read, len(session.events())

    def meanwhile(log, name):
        found = read(log, name)
        session.add_note("written while the log was read")
        return found

    monkeypatch.setattr(SqliteLog, "read", meanwhile)
    assert len(read_session(session.store.folder).records) == before
    assert len(session.events()) == before + 1
