"""A database that is gone, locked, replaced or full while a session runs: nothing is lost, and stop works."""

import errno
import json
import os
import shutil
import sqlite3
import subprocess
from contextlib import closing

import pytest

from footfall.core.errors import Conflict, InvalidBundle
from footfall.session import folded_log as folded_log_module
from footfall.session.clock import ClockWatch
from footfall.session.log.event import next_event
from footfall.session.storage import sqlite_log
from footfall.session.storage.sqlite_log import DATABASE
from footfall.session.storage.store import SessionStore
from footfall.session.storage.verify import verify
from tests.support.waiting import until

ABOUT = {"format": "footfall-session", "version": 1, "name": "s"}


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(sqlite_log, "PATIENCE", 0.1)
    monkeypatch.setattr(folded_log_module, "TRY_AGAIN_AFTER", 60.0)


@pytest.fixture
def sent():
    """What the rover was told: the frames."""
    return []


@pytest.fixture
def running(session, sent, frame_of):
    """A session that sends a sequence of three rows to a rover."""
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    session.rover.connected(sent.append)
    session.rover.take_telemetry(frame_of(0))
    session.commands.send(session.commands.arm()["token"])
    return session


def gone(database):
    database.rename(database.with_name("elsewhere"))
    return lambda: database.with_name("elsewhere").rename(database)


def copied_back(database):
    """As from another disk: another file of the same content, with its write-ahead log."""
    for suffix in ("", "-wal"):
        shutil.copy(f"{database}{suffix}", f"{database}.copy{suffix}")
    for suffix in ("", "-wal", "-shm"):
        os.unlink(f"{database}{suffix}")

    def back():
        for suffix in ("", "-wal"):
            os.rename(f"{database}.copy{suffix}", f"{database}{suffix}")

    return back


def older(database):
    """Without what the write-ahead log held: an older state of the database comes back."""
    shutil.copy(database, f"{database}.copy")
    for suffix in ("", "-wal", "-shm"):
        os.unlink(f"{database}{suffix}")
    return lambda: os.rename(f"{database}.copy", database)


def locked(database):
    other = sqlite3.connect(database, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    return lambda: (other.execute("ROLLBACK"), other.close())


FAULTS = [gone, copied_back, older, locked]


@pytest.mark.parametrize("fault", FAULTS)
def test_stop_works_without_the_database_and_is_written_when_it_is_back(sessions, running, sent, fault):
    database = sessions.folder / DATABASE
    before = running.events()
    heard = []
    running.listen(heard.append)
    back = fault(database)
    running.commands.stop("without a database")
    assert json.loads(sent[-1])["type"] == "stop"
    running.rover.take_stop_acknowledgement()
    assert running.commands.gate["stopped"]
    assert running.unrecorded == 3
    told = [message["store"] for message in heard if message["type"] == "store"]
    assert [one["unrecorded"] for one in told] == [1, 2, 3]
    assert all(one["problem"] for one in told)
    with pytest.raises((OSError, Conflict)):
        running.add_note("refused, as it would not be kept")
    back()
    running.add_note("it is back")
    events = running.events()
    assert events[: len(before)] == before
    assert [e.type for e in events[len(before) :]] == ["stop_requested", "run_ended", "stop_acknowledged", "note"]
    assert running.unrecorded == 0
    assert [m["store"] for m in heard if m["type"] == "store"][-1] == {"unrecorded": 0, "problem": None}
    assert running.state.stop.acknowledged
    session_id = running.id
    running.close()
    del sessions._open[session_id]
    assert not [one for one in verify(sessions.folder, [session_id]) if one.harmful]
    again = sessions.open(session_id)
    assert again.events()[: len(events)] == events
    assert again.commands.gate["stopped"]


@pytest.mark.parametrize("fault", [gone, locked])
def test_what_could_not_be_written_until_the_end_is_written_by_the_next_opening(sessions, running, caplog, fault):
    back = fault(sessions.folder / DATABASE)
    running.commands.stop("without a database")
    session_id = running.id
    running.close()
    assert "kept beside the database" in caplog.text
    back()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    types = [event.type for event in again.events()]
    assert types[-3:] == ["stop_requested", "run_ended", "session_opened"]
    assert again.commands.gate["stopped"]


def test_a_database_that_was_deleted_takes_no_open_session_along(sessions, session):
    for suffix in ("", "-wal", "-shm"):
        os.unlink(f"{sessions.folder / DATABASE}{suffix}")
    events, session_id = session.events(), session.id
    session.close()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    assert again.events()[: len(events)] == events
    assert [event.type for event in again.events()[len(events) :]] == ["session_opened"]
    assert not [one for one in verify(sessions.folder) if one.harmful]


def test_a_database_with_another_history_is_not_written_to(sessions, running):
    database = sessions.folder / DATABASE
    running.add_note("ours")
    other = sessions.folder.with_name("other")
    other.mkdir()
    with closing(sqlite_log.SqliteLog(other / DATABASE)) as log:
        log.create(running.id, ABOUT, [next_event(None, 1.0, "note", {"text": "theirs"}).as_dict()])
    for suffix in ("-wal", "-shm"):
        os.unlink(f"{database}{suffix}")
    os.replace(other / DATABASE, database)
    running.commands.stop("with the wrong database")
    assert running.unrecorded == 2
    with pytest.raises(Conflict, match="another story"):
        running.add_note("refused")


def test_waiting_for_a_lock_is_bounded_and_says_what_to_do(sessions, running, monkeypatch):
    release = locked(sessions.folder / DATABASE)
    with pytest.raises(OSError, match="another program holds it locked") as caught:
        running.add_note("waits")
    assert caught.value.errno == errno.EBUSY
    release()


@pytest.mark.parametrize("fault", [locked])
def test_what_could_not_be_written_is_written_once_it_can_be_though_nothing_else_happens(
    sessions, running, monkeypatch, fault
):
    monkeypatch.setattr(folded_log_module, "TRY_AGAIN_AFTER", 0.05)
    back = fault(sessions.folder / DATABASE)
    running.commands.stop("while the database is locked")
    assert running.unrecorded == 2
    back()
    until(lambda: running.unrecorded == 0, "the writing of what was kept")
    assert [event.type for event in running.events()[-2:]] == ["stop_requested", "run_ended"]


@pytest.mark.parametrize("fault", [gone, locked])
def test_a_run_that_has_ended_is_told_so_though_it_can_not_be_written(sessions, running, fault):
    assert running.commands.run["state"] == "going"
    back = fault(sessions.folder / DATABASE)
    running.commands.stop("without a database")
    assert running.state.run.state == "going"
    told = running.commands.run
    assert (told["state"], told["outcome"]) == ("ended", "stopped")
    assert [row["state"] for row in told["rows"]] == ["unknown", "unsent", "unsent"]
    back()
    running.add_note("it is back")
    assert {**running.commands.run, "ended": None}.keys() == told.keys()
    assert [row["state"] for row in running.commands.run["rows"]] == ["unknown", "unsent", "unsent"]


# -- a full disk ------------------------------------------------------------------------------


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 1 MB; only root may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("a small disk can't be mounted here (that needs root); the limit of pages below stands in for it")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


def fill(disk):
    with (disk / "filler").open("wb", buffering=0) as file:
        for size in (65536, 4096, 1):
            try:
                while True:
                    file.write(b"\0" * size)
            except OSError:
                pass
    return disk / "filler"


def write_on(log):
    for _ in range(1000):
        log.record("note", {"text": "x" * 1000})


def test_a_full_disk_refuses_by_name_and_keeps_everything(small_disk):
    store = SessionStore.create(small_disk / "s", ABOUT)
    log = folded_log_module.FoldedLog(store)
    filler = fill(small_disk)
    with pytest.raises(OSError, match="no room") as caught:
        write_on(log)
    written = len(log)
    assert caught.value.errno == errno.ENOSPC
    with pytest.raises(OSError, match="No space"):
        store.put_bytes(b"\1" * 100_000, "bin")
    assert not list((small_disk / "s" / "artifacts").iterdir())
    log.record_anyway("stop_requested", {"reason": "full", "at": 1.0, "rover_reached": True})
    assert log.unrecorded == 1
    filler.unlink()
    log.record("note", {"text": "room again"})
    types = [event.type for event in log.events()]
    assert types == [*["note"] * written, "stop_requested", "note"]
    log.close()
    assert verify(small_disk) == []
    again = SessionStore(small_disk / "s")
    assert again.events == log.events()
    again.close()


def test_a_database_at_its_limit_keeps_what_it_has(tmp_path):
    """SQLite's limit of pages, where no small disk can be mounted: the same error from the same call."""
    store = SessionStore.create(tmp_path / "s", ABOUT)
    log = folded_log_module.FoldedLog(store)
    assert isinstance(store._log, sqlite_log.SqliteLog)
    database = store._log._database
    database.execute("PRAGMA max_page_count = 20")
    with pytest.raises(OSError, match="no room"):
        write_on(log)
    written = len(log)
    log.record_anyway("stop_requested", {"reason": "full", "at": 1.0, "rover_reached": True})
    database.execute("PRAGMA max_page_count = 1000")
    log.record("note", {"text": "room again"})
    assert [e.type for e in log.events()] == [*["note"] * written, "stop_requested", "note"]
    log.close()
    assert verify(tmp_path) == []


def test_damage_met_while_writing_is_kept_for_later(tmp_path):
    store = SessionStore.create(tmp_path / "s", ABOUT)
    log = folded_log_module.FoldedLog(store)
    for suffix in ("-wal", "-shm"):
        os.unlink(f"{tmp_path / DATABASE}{suffix}")
    (tmp_path / "new").write_bytes(b"this is no database at all" * 1000)
    os.replace(tmp_path / "new", tmp_path / DATABASE)
    log.record_anyway("note", {"text": "kept"})
    assert log.unrecorded == 1
    with pytest.raises(OSError, match="damaged"):
        log.record("note", {"text": "refused"})
    log.close()
    assert "kept" in (tmp_path / "s" / "events.jsonl").read_text()
    with pytest.raises(InvalidBundle, match="damaged"):
        SessionStore(tmp_path / "s")


# -- clocks -----------------------------------------------------------------------------------


class Clocks:
    """Wall and steady clock, moved by hand [s]."""

    wall = steady = 1000.0

    def run(self, seconds, by=0.0):
        self.wall += seconds + by
        self.steady += seconds


@pytest.fixture
def clocks(monkeypatch):
    clocks = Clocks()
    monkeypatch.setattr(
        folded_log_module, "ClockWatch", lambda last: ClockWatch(last, lambda: clocks.wall, lambda: clocks.steady)
    )
    return clocks


def folded_log(tmp_path):
    folder = tmp_path / "s"
    return folded_log_module.FoldedLog(SessionStore(folder) if folder.exists() else SessionStore.create(folder, ABOUT))


@pytest.mark.parametrize("by", [-3600.0, -2.0, 2.0, 1e9])
def test_a_jump_of_the_clock_is_told_once_with_its_size(tmp_path, clocks, by):
    log = folded_log(tmp_path)
    heard = []
    log.listen(heard.append)
    for seconds, jump in ((1.0, 0.0), (60.0, 0.5), (86_400.0, 20.0), (5.0, by), (5.0, 0.0)):
        clocks.run(seconds, jump)
        log.record("note", {"text": "n"})
    events = log.events()
    assert [event.type for event in events] == ["note"] * 3 + ["clock_jumped"] + ["note"] * 2
    assert events[3].payload["by"] == pytest.approx(by)
    assert f"{abs(by):.1f} s" in events[3].payload["text"]
    assert heard[3]["event"]["type"] == "clock_jumped"
    assert [event.seq for event in events] == list(range(6))
    log.close()
    assert verify(tmp_path) == []


def test_a_clock_that_went_back_while_closed_is_told_at_the_next_opening(tmp_path, clocks):
    log = folded_log(tmp_path)
    log.record("note", {"text": "before"})
    log.close()
    clocks.run(50.0, -100.0)
    again = folded_log(tmp_path)
    again.record("note", {"text": "after"})
    assert [event.type for event in again.events()] == ["note", "clock_jumped", "note"]
    assert again.events()[1].payload["by"] == pytest.approx(-50.0)
    again.close()
    clocks.run(1e6)
    third = folded_log(tmp_path)
    third.record("note", {"text": "long after"})
    assert third.events()[-2].type == "note"
    third.close()


def test_a_slow_disk_is_no_jump(tmp_path, clocks, monkeypatch):
    log = folded_log(tmp_path)
    append = SessionStore.append

    def slow(self, event):
        append(self, event)
        clocks.run(30.0)

    monkeypatch.setattr(SessionStore, "append", slow)
    for _ in range(3):
        log.record("note", {"text": "n"})
    assert {event.type for event in log.events()} == {"note"}
    log.close()


# -- what the operator is told -----------------------------------------------------------------


def test_a_repair_of_the_log_is_written_into_it(sessions, session):
    session_id, count = session.id, len(session.events())
    session.close()
    del sessions._open[session_id]
    (sessions.folder / session_id / "head").unlink()
    again = sessions.open(session_id)
    repaired = again.events()[count]
    assert repaired.type == "log_repaired"
    assert "missing" in repaired.payload["text"]
    assert again.state.digest == session.state.digest
    (about,) = sessions.list()
    assert (about["events"], about["open"]) == (len(again.events()), True)


def test_a_session_that_lost_events_is_refused_and_the_others_are_not(sessions, session):
    lost, kept = session.id, sessions.create("another").id
    older = sqlite_log.SqliteLog(sessions.folder / DATABASE)
    records = older.read(lost)
    session.close()
    del sessions._open[lost]
    older.replace(lost, session.store.session, records[:-1])
    older.close()
    with pytest.raises(InvalidBundle, match="from a backup"):
        sessions.open(lost)
    with pytest.raises(InvalidBundle, match="lost events"):
        sessions.export_bundle(lost)
    assert sessions.get(kept).id == kept
    assert [one.session for one in verify(sessions.folder) if one.harmful] == [lost]
