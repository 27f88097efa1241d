"""A client that connects to the events and never reads: the server stays small, and others hear at once."""

import json
import os
import threading
from collections import deque
from contextlib import closing
from itertools import takewhile
from pathlib import Path

from websockets.sync.client import connect

from benchmarks.soak.processes import Deaf
from footfall.api import mailbox
from tests.support.server import running_server
from tests.support.waiting import BOUND, until

BACKLOG = 200
MESSAGES, LONG = 2000, 32_000
LINE = "/api/v1/sessions/current/events/line?rate=50"


def memory():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_who_never_reads_costs_the_server_and_others_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(mailbox, "LONGEST_BACKLOG", BACKLOG)
    with (
        running_server(tmp_path, prepare=lambda sessions: sessions.create("slow")) as server,
        server.client() as client,
    ):
        live = server.sessions.current
        assert live is not None
        port = int(server.url.rpartition(":")[2])
        with closing(Deaf(port, LINE)), connect(f"ws://127.0.0.1:{port}{LINE}", proxy=None) as line:
            until(lambda: len(client.get("/sessions/current/listeners").json()["listeners"]) == 2, "both listeners")
            hearing = threading.Thread(target=lambda: deque(takewhile(is_no_event, map(json.loads, line)), 0))
            hearing.start()
            before = memory()
            for number in range(MESSAGES):
                live.folded_log.tell("view", view={"number": number, "padding": f"{number:08d}" * (LONG // 8)})
                if number % 50 == 0:
                    until(lambda: waiting(client)[1] < BACKLOG / 2, "the other listener", period=0.01)
            client.post("/sessions/current/notes", json={"text": "heard by who listens"})
            hearing.join(BOUND)
            assert not hearing.is_alive()
            assert 0 < waiting(client)[0] <= BACKLOG + 1
            until(lambda: client.get("/sessions/current/listeners").json()["listeners"][0]["slow"], "the mark")
            # what was said in all is three times as much
            assert memory() - before < MESSAGES * LONG / 3


def is_no_event(message):
    return message["type"] != "event"


def waiting(client):
    return [one["waiting"] for one in client.get("/sessions/current/listeners").json()["listeners"]]
