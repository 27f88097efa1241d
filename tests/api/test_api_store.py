"""What the store refuses reaches whoever asked as a problem that says what to do; afterwards all is as before."""

import errno
import sqlite3
from contextlib import closing

import pytest

from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog


def refused(client, status):
    before = client.get("/sessions/current").json()["events"]
    answer = client.post("/sessions/current/notes", json={"text": "can't be kept"})
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert client.get("/sessions/current").json()["events"] == before
    return answer.json()


def test_a_locked_database_is_a_problem_that_passes(server, client):
    with closing(sqlite3.connect(server.sessions.folder / DATABASE, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        problem = refused(client, 503)
        other.execute("ROLLBACK")
    assert problem["type"] == "/problems/not-recorded"
    assert "another program holds it locked" in problem["detail"]
    assert client.post("/sessions/current/notes", json={"text": "kept"}).status_code < 300


@pytest.mark.parametrize(("number", "status"), [(errno.ENOSPC, 507), (errno.EIO, 503)])
def test_what_the_disk_refuses_is_told_with_what_to_do(client, monkeypatch, number, status):
    def refuses(*_):
        raise StoreRefused(number, "there is no room for it; make room on its disk", DATABASE)

    monkeypatch.setattr(SqliteLog, "append", refuses)
    assert "make room" in refused(client, status)["detail"]
