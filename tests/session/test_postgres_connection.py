"""Connections to a PostgreSQL server do not wait for a network that has fallen silent, whatever they are for."""

import asyncio
import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any
from urllib.parse import quote

import psycopg
import pytest
from psycopg.conninfo import conninfo_to_dict

from footfall.session.remote import job_board, worker_service
from footfall.session.remote.job_board import JobBoard
from footfall.session.storage import postgres_connection
from footfall.session.storage.databases import bind, open_log
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.postgres_connection import BOUNDS, conninfo
from footfall.session.storage.postgres_log import PostgresLog
from tests.support.waiting import BOUND, until


class SilentProxy:
    """Carries bytes between TCP and the server's socket, until it is silent: it takes all then and passes none on."""

    def __init__(self, path: str) -> None:
        self.silent = False
        self._path = path
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port = self._door.getsockname()[1]
        self._ends: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._start(self._let_in)

    def _start(self, work: Callable[..., None], *about: socket.socket) -> None:
        self._threads.append(threading.Thread(target=work, args=about))
        self._threads[-1].start()

    def _let_in(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._door.accept()
                server = socket.socket(socket.AF_UNIX)
                self._ends += [client, server]
                server.connect(self._path)
                self._start(self._carry, client, server)
                self._start(self._carry, server, client)

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while content := source.recv(1 << 16):
                if not self.silent:
                    sink.sendall(content)
        self._shut(source, sink)

    def _shut(self, *ends: socket.socket) -> None:
        for end in ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._shut(self._door, *self._ends)
        for thread in self._threads:
            thread.join(BOUND)
        for end in (self._door, *self._ends):
            end.close()


@pytest.fixture
def proxy(postgres) -> Iterator[SilentProxy]:
    with closing(SilentProxy(f"{postgres.folder}/.s.PGSQL.5432")) as made:
        yield made


def address(url: str, proxy: SilentProxy) -> str:
    """The same schema of the same server, over the proxy."""
    options = conninfo_to_dict(url)["options"]
    return f"postgresql://tests@127.0.0.1:{proxy.port}/postgres?sslmode=disable&options={quote(str(options))}"


def test_the_bounds_go_along_and_an_address_may_have_its_own():
    told = conninfo_to_dict(conninfo("postgresql://me@db.example/footfall?connect_timeout=9&options=-csearch_path%3Dx"))
    assert told == {
        **{name: str(value) for name, value in BOUNDS.items()},
        "user": "me",
        "host": "db.example",
        "dbname": "footfall",
        "connect_timeout": "9",
        "options": "-csearch_path=x",
    }
    made = job_board.connector("postgresql://me@db.example/x")
    assert conninfo_to_dict(made._pool_args["conninfo"])["tcp_user_timeout"] == str(BOUNDS["tcp_user_timeout"])


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="this system has no TCP_USER_TIMEOUT")
def test_the_sockets_of_log_and_board_have_the_bounds(postgres, proxy, tmp_path):
    bind(tmp_path, address(postgres.fresh(), proxy))
    with closing(open_log(tmp_path)) as log, closing(JobBoard(log.name)) as noticed:
        noticed.prepare()
        assert isinstance(log, PostgresLog)
        for database in (log._database, noticed._connected()):
            with socket.socket(fileno=socket.dup(database.fileno())) as end:
                assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == BOUNDS["tcp_user_timeout"]
                assert end.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
                for name, option in (
                    ("keepalives_idle", socket.TCP_KEEPIDLE),
                    ("keepalives_interval", socket.TCP_KEEPINTVL),
                    ("keepalives_count", socket.TCP_KEEPCNT),
                ):
                    assert end.getsockopt(socket.IPPROTO_TCP, option) == BOUNDS[name]


def test_a_network_that_falls_silent_is_given_up_and_found_again(postgres, proxy, tmp_path, monkeypatch):
    bind(tmp_path, address(postgres.fresh(), proxy))
    with closing(open_log(tmp_path)) as log, closing(JobBoard(log.name)) as noticed:
        noticed.prepare()
        monkeypatch.setattr(postgres_connection, "LONGEST", 0.3)
        proxy.silent = True
        with pytest.raises(StoreRefused, match="no answer within"):
            log.sessions()
        with pytest.raises(psycopg.OperationalError, match="no answer within"):
            noticed.known()
        # and no new connection is waited for either
        with pytest.raises(psycopg.Error):
            noticed.known()
        with pytest.raises(StoreRefused):
            open_log(tmp_path)
        monkeypatch.setattr(postgres_connection, "LONGEST", 20.0)
        proxy.silent = False
        assert until(lambda: noticed.known() == set(), "the board again")
        log.reopen()
        assert log.sessions() == []


def test_whoever_waits_for_work_has_the_bounds_too(monkeypatch, tmp_path):
    made = []

    class Connector(worker_service._Connector):
        def __init__(self, **options):
            made.append(options)
            raise InterruptedError

    monkeypatch.setattr(worker_service, "_Connector", Connector)
    unused: Any = None
    with pytest.raises(InterruptedError):
        asyncio.run(worker_service._serve("postgresql://me@db.example/x", tmp_path, unused, unused, 1, lambda: None))
    assert conninfo_to_dict(made[0]["conninfo"])["keepalives_idle"] == str(BOUNDS["keepalives_idle"])
