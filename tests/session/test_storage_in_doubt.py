"""A database that is lost in the middle of a commit: whether the event is in the log shows when it is back."""

from contextlib import closing

import psycopg
import pytest

from footfall.session import folded_log as folded_log_module
from footfall.session.log.event import next_event
from footfall.session.storage.databases import bind
from footfall.session.storage.interface import OutcomeUnknown, StoreRefused
from footfall.session.storage.postgres_log import PostgresLog
from footfall.session.storage.store import SessionStore, read_session
from footfall.session.storage.verify import verify

ABOUT = {"format": "footfall-session", "version": 1, "name": "s"}


def texts(folder):
    return [record["payload"].get("text") for record in read_session(folder).records]


@pytest.fixture
def folder(postgres, tmp_path):
    """A closed session with three notes."""
    bind(tmp_path / "work", postgres.fresh())
    with closing(SessionStore.create(tmp_path / "work" / "s", ABOUT)) as store:
        for text in "abc":
            store.append(next_event(store.events[-1] if store.events else None, 1.0, "note", {"text": text}))
    return tmp_path / "work" / "s"


@pytest.fixture
def in_doubt(folder, monkeypatch):
    """in_doubt(written) → a folded log whose note "d" was refused, when in truth it was written, or not."""

    def made(written):
        log = folded_log_module.FoldedLog(SessionStore(folder))
        insert = PostgresLog._insert

        def loses(self, session, records):
            if written:
                insert(self, session, records)
            self._database.close()
            raise psycopg.OperationalError("the connection is lost")

        def stays_away(self):
            raise StoreRefused(5, "it can't be reached", self.name)

        with monkeypatch.context() as patched:
            patched.setattr(PostgresLog, "_insert", loses)
            patched.setattr(PostgresLog, "reopen", stays_away)
            with pytest.raises(OutcomeUnknown):
                log.record("note", {"text": "d"})
            with pytest.raises(StoreRefused):
                log.record("note", {"text": "meanwhile"})
        return log

    return made


@pytest.mark.parametrize("written", [True, False])
def test_an_event_that_nobody_knows_of_turns_up_or_is_none(in_doubt, folder, written):
    log = in_doubt(written)
    heard = []
    log.listen(heard.append)
    event = log.record("note", {"text": "e"})
    expected = ["d", "e"] if written else ["e"]
    assert [message["event"]["payload"]["text"] for message in heard] == expected
    assert event.payload["text"] == "e"
    assert [one.payload["text"] for one in log.events(3)] == expected
    log.close()
    assert texts(folder)[3:] == expected
    assert verify(folder.parent) == []


@pytest.mark.parametrize("written", [True, False])
def test_who_asks_again_for_what_was_written_after_all_gets_it_once(in_doubt, folder, written):
    log = in_doubt(written)
    assert log.record("note", {"text": "d"}).seq == 3
    log.close()
    assert texts(folder)[3:] == ["d"]


@pytest.mark.parametrize("written", [True, False])
def test_doubt_at_the_end_is_settled_by_the_next_opening(in_doubt, folder, written, monkeypatch):
    log = in_doubt(written)
    with monkeypatch.context() as patched:
        patched.setattr(PostgresLog, "reopen", lambda self: (_ for _ in ()).throw(StoreRefused(5, "away", self.name)))
        log.record_anyway("note", {"text": "kept"})
        log.close()
    with closing(SessionStore(folder)) as again:
        assert [event.payload["text"] for event in again.events[3:]] == ["d", "kept"]
    assert verify(folder.parent) == []
