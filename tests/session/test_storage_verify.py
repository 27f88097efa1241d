"""Verify finds what was damaged, backup copies what is in use, prune takes nothing that is needed."""

import os
import shutil
import sqlite3
import subprocess
import threading
import time
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import FootFallError, InvalidInput, NotFound
from footfall.io.artifacts import encode
from footfall.io.bundles import read_bundle
from footfall.maps.layers import MapSettings
from footfall.session.log.event import next_event
from footfall.session.storage.backup import backup
from footfall.session.storage.databases import open_log
from footfall.session.storage.prune import prune
from footfall.session.storage.sqlite_log import DATABASE
from footfall.session.storage.store import SessionStore, read_session
from footfall.session.storage.verify import verify
from tests.support.waiting import a_while

ABOUT = {"format": "footfall-session", "version": 1, "name": "s"}
SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"


def append(store, text, time=1.0):
    store.append(next_event(store.events[-1] if store.events else None, time, "note", {"text": text}))


def kinds(findings):
    return sorted((one.session, one.kind, one.harmful) for one in findings)


@pytest.fixture(scope="module")
def states():
    """Bytes of database and head after each of a few events: (database, head, records)."""
    with TemporaryDirectory() as work:
        folder = Path(work) / "s"
        SessionStore.create(folder, ABOUT).close()
        found = []
        for i in range(4):
            store = SessionStore(folder)
            append(store, f"event {i}")
            store.close()
            found.append(((Path(work) / DATABASE).read_bytes(), (folder / "head").read_bytes(), read_session(folder)))
        return found


def laid_out(work, database, head):
    folder = Path(work) / "s"
    (folder / "artifacts").mkdir(parents=True)
    (Path(work) / DATABASE).write_bytes(database)
    (folder / "head").write_bytes(head)
    return folder


def test_an_undamaged_folder_is_whole(states):
    for database, head, _ in states:
        with TemporaryDirectory() as work:
            laid_out(work, database, head)
            assert verify(Path(work)) == []


@given(st.data())
@settings(max_examples=80, deadline=None)
def test_a_changed_bit_is_found_or_changes_nothing_that_is_read(states, data):
    database, head, truth = states[-1]
    changed = {"database": bytearray(database), "head": bytearray(head)}
    which = data.draw(st.sampled_from(sorted(changed)))
    at = data.draw(st.integers(0, len(changed[which]) - 1))
    changed[which][at] ^= 1 << data.draw(st.integers(0, 7))
    with TemporaryDirectory() as work:
        folder = laid_out(work, bytes(changed["database"]), bytes(changed["head"]))
        findings = verify(Path(work))
        if which == "head":
            assert [one.kind for one in findings] == ["head"]
        if not findings:
            read = read_session(folder)
            assert (read.session, read.records) == (truth.session, truth.records)
        with suppress(FootFallError, OSError):
            store = SessionStore(folder)
            assert [event.as_dict() for event in store.events] == truth.records
            store.close()


@given(st.data())
@settings(max_examples=30, deadline=None)
def test_a_cut_database_or_head_is_found(states, data):
    database, head, _ = states[-1]
    which = data.draw(st.sampled_from(["database", "head"]))
    cut = data.draw(st.integers(0, len(database if which == "database" else head) - 1))
    with TemporaryDirectory() as work:
        laid_out(work, database[:cut] if which == "database" else database, head[:cut] if which == "head" else head)
        found = verify(Path(work))
        assert found
        assert which == "head" or any(one.harmful for one in found)


@pytest.fixture(scope="module")
def unfinished():
    """Database, write-ahead log and head of a session as a kill leaves them, and its events."""
    with TemporaryDirectory() as work:
        store = SessionStore.create(Path(work) / "s", ABOUT)
        for i in range(4):
            append(store, f"event {i}")
        files = [Path(work) / DATABASE, Path(work) / f"{DATABASE}-wal", Path(work) / "s" / "head"]
        yield (*(path.read_bytes() for path in files), [event.as_dict() for event in store.events])
        store.close()


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_a_damaged_or_cut_write_ahead_log_is_found_or_was_not_needed(unfinished, data):
    database, ahead, head, events = unfinished
    at = data.draw(st.integers(0, len(ahead) - 1))
    flipped = bytearray(ahead)
    flipped[at] ^= 1 << data.draw(st.integers(0, 7))
    for changed in (ahead[:at], bytes(flipped)):
        with TemporaryDirectory() as work:
            folder = laid_out(work, database, head)
            (Path(work) / f"{DATABASE}-wal").write_bytes(changed)
            if not any(one.harmful for one in verify(Path(work))):
                assert read_session(folder).records == events


@pytest.mark.parametrize("old", range(3))
def test_a_rollback_of_database_or_head_is_found(states, old):
    for database, head, kind in ((states[old][0], states[3][1], "head"), (states[3][0], states[old][1], "head")):
        with TemporaryDirectory() as work:
            laid_out(work, database, head)
            (finding,) = verify(Path(work))
            assert finding.kind == kind
            # one event behind is what a crash leaves; it is told, and is no loss
            assert finding.harmful == (old < 2 or database is not states[3][0])


def test_removed_guards_and_rewritten_events_are_found(states):
    with TemporaryDirectory() as work:
        folder = laid_out(work, *states[-1][:2])
        with closing(sqlite3.connect(Path(work) / DATABASE, isolation_level=None)) as database:
            database.execute("DROP TRIGGER events_stay")
            database.execute("UPDATE events SET time = 2.0 WHERE seq = 1")
        assert kinds(verify(Path(work))) == [("", "database", True), ("s", "log", True)]
        with closing(sqlite3.connect(Path(work) / DATABASE, isolation_level=None)) as database:
            database.execute("UPDATE events SET time = 1.0 WHERE seq = 1")
            database.execute("""UPDATE sessions SET about = '{"name": "another"}'""")
        assert ("s", "log", True) in kinds(verify(Path(work)))
        with pytest.raises(FootFallError, match="was changed"):
            SessionStore(folder)


@pytest.fixture
def folder(store_in, tmp_path):
    """A working folder with two sessions, and a folder that is no session; once with each kind of database."""
    work = store_in(tmp_path / "w")
    for name in ("refused-step", "edited-export"):
        SessionStore.take_in(work / name, read_bundle(SAMPLES / name)).close()
    (work / "accounts").mkdir()
    return work


def test_artifacts_are_verified_by_digest_and_by_who_names_them(folder):
    assert verify(folder) == []
    files = sorted((folder / "edited-export" / "artifacts").iterdir())
    dem = next(r["payload"]["digest"] for r in read_session(folder / "edited-export").records if r["type"] == "product")
    (folder / "edited-export" / "artifacts" / f"{dem}.npz").unlink()
    other = next(path for path in files if dem not in path.name)
    data = bytearray(other.read_bytes())
    data[len(data) // 2] ^= 1
    other.write_bytes(data)
    store = SessionStore(folder / "edited-export")
    orphan = store.put(MapSettings(window=0.77))
    (folder / "edited-export" / "artifacts" / ".x.npz.1.partial").write_bytes(b"half")
    found = verify(folder)
    assert {one.session for one in found} == {"edited-export"}
    assert {(one.kind, one.harmful) for one in found} == {
        ("artifact", True), ("missing", True), ("orphan", False), ("unfinished", False)
    }  # fmt: skip
    texts = "\n".join(one.text for one in found)
    assert all(name in texts for name in (dem, other.name, orphan, ".x.npz.1.partial"))
    assert verify(folder, ["refused-step"]) == []
    store.close()
    with pytest.raises(NotFound, match="nobody"):
        verify(folder, ["nobody"])


def test_a_session_without_its_events_or_its_folder_is_found(folder):
    shutil.rmtree(folder / "edited-export")
    assert kinds(verify(folder)) == [("edited-export", "folder", True)]
    with closing(open_log(folder)) as log:
        log.forget("refused-step")
        log.forget("edited-export")
    assert kinds(verify(folder)) == [("refused-step", "log", True)]
    shutil.copytree(SAMPLES / "edited-export", folder / "older")
    assert ("older", "unmoved", False) in kinds(verify(folder))


@pytest.fixture
def read_only(tmp_path):
    """Makes a folder one that can't be written, also by root."""
    mounted = []

    def made(folder):
        place = tmp_path / "read-only"
        place.mkdir()
        for options in (["--bind", str(folder), str(place)], ["-o", "remount,ro,bind", str(place)]):
            if subprocess.run(["mount", *options], capture_output=True, check=False).returncode:
                pytest.skip("a folder can't be mounted read-only here; that needs root")
        mounted.append(place)
        return place

    yield made
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.parametrize("in_use", [True, False])
def test_a_folder_that_can_not_be_written_is_whole_if_it_is(folder, read_only, in_use):
    """Also with events that are only in the write-ahead log yet."""
    store = SessionStore(folder / "edited-export")
    append(store, "in the write-ahead log")
    if not in_use:
        store.close()
    assert [one for one in verify(read_only(folder)) if one.harmful] == []
    store.close()


# -- backup -----------------------------------------------------------------------------------


def test_a_backup_of_sessions_in_use_is_whole_and_can_be_worked_with(folder, tmp_path):
    store = SessionStore(folder / "edited-export")
    (folder / "edited-export" / "recordings").mkdir()
    for name in ("a.mcap", "b.mcap.part"):
        (folder / "edited-export" / "recordings" / name).write_bytes(b"told")
    written, enough = [], threading.Event()

    def write():
        while not enough.is_set():
            a_while(0.002)  # the others want to read
            append(store, str(len(written)))
            written.append(len(store.events))

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for i in range(2):
            before = len(store.events)
            assert backup(folder, tmp_path / f"copy{i}") == []
            records = read_session(tmp_path / f"copy{i}" / "edited-export").records
            assert before <= len(records) <= len(store.events)
    finally:
        enough.set()
        writer.join()
    assert sorted(p.name for p in (tmp_path / "copy0").iterdir()) == ["edited-export", DATABASE, "refused-step"]
    assert [p.name for p in (tmp_path / "copy0" / "edited-export" / "recordings").iterdir()] == ["a.mcap"]
    again = SessionStore(tmp_path / "copy0" / "edited-export")
    assert again.repairs == []
    append(again, "goes on")
    again.close()
    store.close()
    with pytest.raises(InvalidInput, match="new folder"):
        backup(folder, tmp_path / "copy0")


def test_a_backup_of_one_session_holds_nothing_of_the_others(folder, tmp_path):
    store = SessionStore(folder / "refused-step")
    append(store, "for nobody else")
    store.close()
    assert backup(folder, tmp_path / "copy", ["edited-export"], recordings=False) == []
    assert b"for nobody else" not in (tmp_path / "copy" / DATABASE).read_bytes()
    assert verify(tmp_path / "copy", ["edited-export"]) == verify(tmp_path / "copy") == []
    with pytest.raises(NotFound, match="nobody"):
        backup(folder, tmp_path / "other", ["nobody"])


def test_damage_goes_along_and_is_told(folder, tmp_path):
    path = next((folder / "edited-export" / "artifacts").iterdir())
    path.write_bytes(b"damaged")
    assert [one.kind for one in backup(folder, tmp_path / "copy") if one.harmful] == ["artifact"]
    assert (tmp_path / "copy" / "edited-export" / "artifacts" / path.name).read_bytes() == b"damaged"


def test_a_backup_that_fails_leaves_nothing(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("footfall.session.storage.backup.verify", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        backup(folder, tmp_path / "copy")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["w"]


# -- prune ------------------------------------------------------------------------------------


def test_prune_takes_what_nothing_refers_to_and_only_when_told(folder):
    artifacts = folder / "edited-export" / "artifacts"
    needed = sorted(artifacts.iterdir())
    orphan = MapSettings(window=0.77)
    (artifacts / f"{orphan.digest}.npz").write_bytes(encode(orphan))
    (artifacts / ".x.npz.1.partial").write_bytes(b"half")
    recordings = folder / "edited-export" / "recordings"
    recordings.mkdir()
    for name, age in (("old.mcap", 1000.0), ("new.mcap", 0.0)):
        (recordings / name).write_bytes(b"told")
        os.utime(recordings / name, (time.time() - age, time.time() - age))
    everything = sorted(folder.rglob("*"))
    plan = prune(folder, recordings_before=time.time() - 500)
    assert sorted(folder.rglob("*")) == sorted({*everything, *(folder.glob("*/lock"))})
    assert sorted(Path(one.path).name for one in plan.removals) == sorted(
        [f"{orphan.digest}.npz", ".x.npz.1.partial", "old.mcap"]
    )
    carried_out = prune(folder, recordings_before=time.time() - 500, carry_out=True)
    assert carried_out == plan
    assert sorted(artifacts.iterdir()) == needed
    assert [path.name for path in recordings.iterdir()] == ["new.mcap"]
    assert verify(folder) == []
    assert prune(folder, carry_out=True).removals == []


def test_what_only_an_artifact_refers_to_is_kept(folder):
    store = SessionStore(folder / "edited-export")
    inner = store.put(MapSettings(window=0.77))
    outer = store.put_bytes(b"a file", "bin")
    event = next_event(store.events[-1], 1.0, "note", {"text": "", "about": [{"is": outer}], "told": inner})
    store.append(event)
    store.close()
    assert prune(folder, carry_out=True).removals == []


def test_an_open_a_damaged_and_an_unmoved_session_are_left_alone(folder):
    store = SessionStore(folder / "edited-export")
    store.put(MapSettings(window=0.77))
    damaged = next((folder / "refused-step" / "artifacts").iterdir())
    damaged.write_bytes(b"damaged")
    shutil.copytree(SAMPLES / "edited-export", folder / "older")
    pruned = prune(folder, sessions_before=0.0, carry_out=True)
    assert pruned.removals == []
    assert set(pruned.spared) == {"edited-export", "refused-step", "older"}
    assert "open in another process" in pruned.spared["edited-export"]
    pruned = prune(folder, ["edited-export"], sessions_before=time.time() + 1e9, carry_out=True)
    assert (pruned.removals, list(pruned.spared)) == ([], ["edited-export"])
    append(store, "still here")
    store.close()


def test_old_sessions_go_with_their_events(folder):
    last = read_session(folder / "edited-export").records[-1]["time"]
    store = SessionStore(folder / "refused-step")
    append(store, "used since", time=last + 10)
    store.close()
    (removal,) = prune(folder, sessions_before=last + 5, carry_out=True).removals
    assert (removal.session, removal.path) == ("edited-export", "edited-export")
    assert sorted(p.name for p in folder.iterdir() if p.is_dir()) == ["accounts", "refused-step"]
    assert verify(folder) == []
    SessionStore.take_in(folder / "edited-export", read_bundle(SAMPLES / "edited-export")).close()


def test_a_removal_that_was_cut_short_is_finished(folder, monkeypatch):
    class Dies(Exception):
        pass

    def dies(*_):
        raise Dies

    with monkeypatch.context() as patched:
        with closing(open_log(folder)) as log:
            patched.setattr(type(log), "forget", dies)
        with pytest.raises(Dies):
            prune(folder, ["edited-export"], sessions_before=1e12, carry_out=True)
    assert kinds(verify(folder)) == [("edited-export", "folder", True)]
    pruned = prune(folder, carry_out=True)
    assert [one.path for one in pruned.removals] == [".removed-edited-export"]
    assert verify(folder) == []
