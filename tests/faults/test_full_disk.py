"""A server whose disk is full: what can't be recorded is not done, stop works, and with room again it goes on."""

import resource
import subprocess
from contextlib import contextmanager

import httpx
import pytest

from benchmarks.soak.cycles import Soak
from footfall.session.storage.store import read_session
from footfall.session.storage.verify import verify
from tests.support.waiting import until

SESSION = "/sessions/current"


@pytest.fixture
def small_disk(tmp_path):
    """``tmp_path / "data"`` is a disk of 4 MB; only root may mount one."""
    disk = tmp_path / "data"
    disk.mkdir()
    mounting = ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(disk)]
    if subprocess.run(mounting, capture_output=True, check=False).returncode:
        pytest.skip("a small disk can't be mounted here (that needs root); the limit of file sizes stands in for it")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


@contextmanager
def full(disk):
    """No byte more fits on the disk."""
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file:
        for size in (65536, 4096, 1):
            try:
                while True:
                    file.write(b"\0" * size)
            except OSError:
                pass
    yield
    filler.unlink()


@contextmanager
def no_file_grows(server):
    """Every write that makes a file of the server longer than a page is refused, as by a quota."""
    before = resource.prlimit(server, resource.RLIMIT_FSIZE)
    resource.prlimit(server, resource.RLIMIT_FSIZE, (4096, before[1]))
    yield
    resource.prlimit(server, resource.RLIMIT_FSIZE, before)


def test_a_server_on_a_full_disk_refuses_stops_and_goes_on(small_disk, tmp_path):
    with Soak(tmp_path, seed=20081, hurry=5.0, workers=1) as soak:
        refuses_stops_and_goes_on(soak, lambda: full(small_disk), {507})


def test_a_server_whose_files_must_not_grow_refuses_stops_and_goes_on(tmp_path):
    # what the server says of itself is no file that could grow
    (tmp_path / "server.log").symlink_to("/dev/null")
    with Soak(tmp_path, seed=20081, hurry=5.0, workers=1) as soak:
        # another error than that of a full disk: a file too large
        refuses_stops_and_goes_on(soak, lambda: no_file_grows(soak.server.pid), {503, 507})


def refuses_stops_and_goes_on(soak, no_room, statuses):
    script, client = soak.script, soak.script.client
    script.wait_on_rover()
    sequence = client.get(SESSION).json()["sequence"]
    with no_room():
        # what room the log's own files still had is used up first
        refused = until(lambda: (answer := noted(client)).status_code != 201 and answer, "a refusal")
        assert refused.status_code in statuses
        assert refused.json()["type"] == "/problems/not-recorded"
        assert "so it was not done" in refused.json()["detail"]
        began, before = soak.rover.executed(), client.get(SESSION).json()
        edit = {"edit": {"kind": "delete", "row": 0}}
        edited = client.patch(f"/sequences/{sequence}", json=edit, headers={"if-match": "*"})
        assert edited.status_code in statuses
        assert edited.json()["type"] == "/problems/not-recorded"
        # 409: on a busy machine telemetry may be too old for a moment
        sent = until(lambda: (answer := armed_and_sent(client, sequence)).status_code != 409 and answer, "a refusal")
        assert sent.status_code in statuses
        assert soak.rover.executed() == began, "a command that is not in the log reached the rover"
        # stop asks nobody, reaches the rover, and the operator is told that it is not written yet
        script.stop()
        until(lambda: client.get("/stop").json()["stop_acknowledged"], "the rover's word")
        assert client.get(SESSION).json()["sequence"] == before["sequence"]
        assert "events can't be written" in log_is(client)["text"]
        assert not log_is(client)["ok"]
    until(lambda: noted(client).status_code == 201, "a note that is taken again")
    assert log_is(client)["ok"]
    assert script.stop_in_force()
    script.clear_stop()
    script.wait_on_rover()
    verdict = soak.compare()
    assert verdict.ok, verdict
    soak.server.end()
    assert [one for one in verify(soak.data) if one.harmful] == []
    types = [record["type"] for record in read_session(soak.data / soak.session).records]
    assert types.count("stop_requested") == 1
    assert "stop_acknowledged" in types


def noted(client):
    return client.post(f"{SESSION}/notes", json={"text": "x" * 2000})


def armed_and_sent(client, sequence):
    """The answer to arming, or, where that was answered well, to sending."""
    armed = client.post(f"/sequences/{sequence}/arm")
    if armed.status_code != 200:
        return armed
    return client.post(f"/sequences/{sequence}/send", json={"arming": armed.json()["token"]})


def log_is(client):
    """What the server says of its log to whoever asks for its health."""
    checks = httpx.get(f"{client.base_url.copy_with(path='/health/ready')}", trust_env=False, verify=False).json()[
        "checks"
    ]
    return next(one for one in checks if one["what"] == "event log")
