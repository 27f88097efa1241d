"""Many stored sessions: listed without reading one, looked at without opening one, and few stay open at a time."""

import os
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from footfall.core.errors import Conflict
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.artifacts import encode
from footfall.io.bundles import FORMAT, VERSION, Bundle
from footfall.session import looked, registry
from footfall.session.access.identity import LOCAL
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.event import next_event
from footfall.session.registry import Sessions
from footfall.session.storage import head, store
from footfall.session.storage.postgres_log import PostgresLog
from footfall.session.storage.sqlite_log import SqliteLog
from footfall.session.storage.store import SessionStore
from footfall.session.storage.verify import verify
from tests.support.waiting import BOUND

MANY = 24


def fill(folder, robot, count):
    """So many sessions, of 1, 2, 3 … events."""
    content = encode(robot.description)
    for number in range(count):
        name = f"s{number:02}"
        about = {"format": FORMAT, "version": VERSION, "id": name, "name": name, "created": 1e9 + number}
        about |= {"robot": {"name": robot.name, "digest": robot.digest}, "software": SOFTWARE_VERSION}
        made = {"name": name, "robot": robot.digest, "robot_name": robot.name}
        events = [next_event(None, 1e9, "session_created", made)]
        for noted in range(number):
            events.append(next_event(events[-1], 1e9 + noted, "note", {"text": f"{noted}"}))
        files = {f"{robot.digest}.npz": lambda: content}
        records = [event.as_dict() for event in events]
        SessionStore.take_in(folder / name, Bundle(about, records, 0, VERSION, files)).close()


@pytest.fixture(scope="module")
def unhurried():
    """What a power cut would leave is not asked here, and to wait for the disk some thousand times takes minutes."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", lambda _: None)
        patched.setattr(head, "_sync", lambda _: None)
        yield


@pytest.fixture(scope="module")
def stored(unhurried, athlete, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored")
    fill(folder, athlete, MANY)
    return folder


@pytest.fixture
def work(stored, tmp_path):
    """A folder with MANY sessions."""
    return shutil.copytree(stored, tmp_path / "work")


@pytest.fixture
def anew(work, tiny, athlete):
    """anew() → the sessions of the folder as another start of FootFall finds them."""
    return lambda: Sessions(work, jobs=InlineJobs("tiny_recipes"), robot=athlete)


def names():
    return [f"s{number:02}" for number in range(MANY)]


def test_start_and_list_read_no_log(unhurried, store_in, tmp_path, tiny, athlete, monkeypatch):
    work = store_in(tmp_path / "work")
    fill(work, athlete, 6)
    for log in (SqliteLog, PostgresLog):
        monkeypatch.setattr(log, "read", lambda *_: pytest.fail("a log was read"))
    monkeypatch.setattr(store, "WriterLock", lambda *_: pytest.fail("a session was opened"))
    with Sessions(work, jobs=InlineJobs("tiny_recipes"), robot=athlete) as sessions:
        listed = sessions.list()
        assert [(one["id"], one["events"]) for one in reversed(listed)] == [(f"s{i:02}", i + 1) for i in range(6)]
        assert not any(one["open"] or "problem" in one for one in listed)


def test_to_look_at_all_opens_none_and_keeps_few(anew):
    with anew() as sessions:
        seen = [sessions.look(name) for name in names()]
        assert [len(one.events()) for one in seen] == list(range(1, MANY + 1))
        assert sessions.opened() == []
        latest = list(zip(names(), seen, strict=True))[-looked.MOST_SESSIONS :]
        assert all(sessions.look(name) is one for name, one in latest)
        assert sessions.look("s00") is not seen[0]
        with pytest.raises(Conflict, match="only looked at"):
            seen[0].add_note("nothing")
    # whoever opens them finds them as they were left
    with anew() as sessions:
        assert [one["events"] for one in reversed(sessions.list())] == list(range(1, MANY + 1))


def test_of_all_that_are_written_to_few_stay_open(anew, work):
    with anew() as sessions:
        current = sessions.open("s00")
        for name in names()[1:]:
            sessions.get(name).add_note("all the same")
            assert len(sessions.opened()) <= registry.MOST_IDLE + 2
        assert sessions.opened()[0] is sessions.current is current
        assert sorted(live.id for live in sessions.opened()[1:]) == names()[-registry.MOST_IDLE - 1 :]
        # one that was closed is there again, and another server may have one that is closed here
        assert [note.text for note in sessions.look("s01").state.notes][-1] == "all the same"
        with anew() as others:
            others.get("s02").add_note("by others")
        assert sessions.get("s02").state.notes[-1].text == "by others"
    assert [one for one in verify(work) if one.harmful] == []


def test_nothing_that_goes_on_is_closed(anew, monkeypatch):
    monkeypatch.setattr(registry, "MOST_IDLE", 1)
    with anew() as sessions:
        sessions.open("s00")
        heard, held = sessions.get("s01"), sessions.get("s02")
        told = []
        unlisten = heard.listen(told.append)
        held.commands.conn_act("take", LOCAL)
        for name in names()[3:10]:
            sessions.get(name)
        assert {live.id for live in sessions.opened()} >= {"s00", "s01", "s02"}
        assert sessions.get("s01") is heard
        heard.add_note("heard")
        assert told[-1]["event"]["type"] == "note"
        unlisten()
        held.commands.conn_act("release", LOCAL)
        for name in names()[10:13]:
            sessions.get(name)
        assert {live.id for live in sessions.opened()} == {"s00", "s11", "s12"}


def test_who_looks_at_a_session_does_not_wait_for_another_one_that_is_read(anew, monkeypatch):
    begun, may_go_on = threading.Event(), threading.Event()

    class LongLog(looked.LookedStore):
        def __init__(self, folder):
            if folder.name == "s23":
                begun.set()
                assert may_go_on.wait(BOUND)
            super().__init__(folder)

    monkeypatch.setattr(looked, "LookedStore", LongLog)
    with anew() as sessions, ThreadPoolExecutor(3) as threads:
        first, second = (threads.submit(sessions.look, "s23") for _ in range(2))
        try:
            assert begun.wait(BOUND)
            assert threads.submit(sessions.look, "s01").result(BOUND).id == "s01"
        finally:
            may_go_on.set()
        # both that asked for it have the one that was read
        assert first.result(BOUND) is second.result(BOUND)
        assert first.result(BOUND).id == "s23"
