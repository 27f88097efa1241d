"""A running server tells its figures and its health, and every answer carries the id that its log lines have."""

import errno
import json
import os
import shutil
from collections import namedtuple

import pytest
from prometheus_client.parser import text_string_to_metric_families

from footfall.api.routes import health
from footfall.core.errors import Cancelled, CommandRefused
from footfall.core.value import SOFTWARE_VERSION
from footfall.session.jobs.job import Job
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog
from footfall.telemetry.link import HelloMessage, message_object
from tests.support.frames import moving_frames
from tests.support.server import running_server
from tests.support.waiting import a_while, until


def figures(plain, ground) -> dict[tuple, float]:
    """(name, label values…) → figure."""
    text = ground.get(f"{plain.url}/metrics").text
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_figures_follow_what_happens(plain, ground):
    live = plain.sessions.current
    before = figures(plain, ground)
    hello = message_object(HelloMessage("athlete", 6))
    for of_a_line in ("type", "id", "epoch"):
        del hello[of_a_line]
    frames = [message_object(frame) for frame in moving_frames(10) if frame.number != 4]
    frames[3]["time"] = None
    assert ground.post("/rover/telemetry", json={**hello, "frames": frames}).status_code == 200
    ground.post("/stop")
    ground.get("/sessions/nothing-here")
    ground.get("/sessions/current/telemetry")
    after = figures(plain, ground)

    def more(*key) -> float:
        return after[key] - before.get(key, 0.0)

    assert more("footfall_link_frames_total", live.id) == 8
    assert more("footfall_link_gaps_total", live.id) == 2  # one was left out, one refused
    assert more("footfall_link_faults_total", "wrong-field", live.id) == 1
    assert more("footfall_rover_bad_messages_total", "wrong-field") == 1
    assert more("footfall_stops_total", live.id) == 1
    assert more("footfall_event_append_seconds_count", live.id) >= 2
    assert after["footfall_event_append_seconds_sum", live.id] > 0
    assert after["footfall_link_connected", live.id] == 0
    now = [after[f"footfall_{name}", live.id] for name in ("stop_in_force", "stop_acknowledged", "session_current")]
    assert now == [1, 0, 1]
    assert after["footfall_run_under_way", live.id] == after["footfall_conn_held", live.id] == 0
    assert after["footfall_disk_free_bytes",] > 0
    assert after["process_resident_memory_bytes",] > 1e6
    assert after["footfall_build_info", SOFTWARE_VERSION] == 1
    assert 0 <= after["footfall_telemetry_age_seconds", live.id] < 30
    assert after["footfall_events_unrecorded", live.id] == 0
    assert more("footfall_http_requests_total", "GET", "/sessions/{session}", "404") == 1
    assert more("footfall_http_requests_total", "POST", "/stop", "200") == 1
    assert after["footfall_http_request_seconds_count", "GET", "/sessions/{session}/telemetry"] >= 1
    assert not any("nothing-here" in str(key) for key in after)


def test_a_refusal_of_the_gate_is_counted_by_its_check(plain, ground, monkeypatch):
    def refuse(*_, **__):
        raise CommandRefused("the rover moved", check="start")

    monkeypatch.setattr(type(plain.sessions.current.commands), "clear_stop", refuse)
    assert ground.post("/stop/clear").status_code == 409
    assert figures(plain, ground)["footfall_gate_refusals_total", "start"] == 1


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_told_as_such_wherever_it_shows(plain, ground, monkeypatch, number):
    def full(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(type(plain.sessions.current), "add_note", full)
    answer = ground.post("/sessions/current/notes", json={"text": "no room"})
    assert (answer.status_code, answer.json()["type"]) == (507, "/problems/not-recorded")
    assert "make room" in answer.json()["detail"]


def test_without_its_database_a_server_is_not_ready(plain, ground):
    assert ground.get(f"{plain.url}/health/ready").status_code == 200
    database = plain.sessions.folder / DATABASE
    elsewhere = database.with_name("elsewhere")
    database.rename(elsewhere)
    try:
        answer = ground.get(f"{plain.url}/health/ready")
        assert answer.status_code == 503
        assert [one["what"] for one in answer.json()["checks"] if not one["ok"]] == ["event log"]
    finally:
        elsewhere.rename(database)
    assert ground.get(f"{plain.url}/health/ready").status_code == 200


def test_health_asks_for_open_sessions_alone_however_many_are_stored(plain, ground, monkeypatch):
    asked = []
    about = SqliteLog.about
    monkeypatch.setattr(SqliteLog, "sessions", lambda _: pytest.fail("all that are stored were read"))
    monkeypatch.setattr(SqliteLog, "about", lambda log, session: asked.append(session) or about(log, session))
    assert ground.get(f"{plain.url}/health/ready").json()["ready"] is True
    assert sorted(asked) == sorted(one.id for one in plain.sessions.opened())


def test_jobs_are_counted_with_how_long_they_took(plain, ground):
    job, waiting = Job("maps", "first", None, None), Job("plan", "first", None, None)
    for one in (job, waiting):
        plain.sessions.jobs.adopt(one)
    job.report(0.5, "half")
    found = figures(plain, ground)
    assert found["footfall_jobs", "maps", "running"] == found["footfall_jobs", "plan", "queued"] == 1
    a_while(0.05)
    job.end()
    waiting.end(error=Cancelled("no"))
    found = figures(plain, ground)
    assert found["footfall_job_seconds_count", "maps", "done"] == 1
    assert found["footfall_job_seconds_sum", "maps", "done"] >= 0.05
    assert found["footfall_job_seconds_count", "plan", "cancelled"] == 1
    assert ("footfall_jobs", "maps", "running") not in found


def test_listeners_and_what_they_missed_are_listed(plain, ground):
    live = plain.sessions.create("listened to")
    with ground.stream("GET", "/sessions/current/events?rate=0.1") as stream:
        lines = stream.iter_lines()
        next(lines)
        for frame in moving_frames(50):
            live.rover.take_telemetry(frame)
        (one,) = until(lambda: ground.get("/sessions/current/listeners").json()["listeners"], "the listener")
        assert (one["rate"], one["session"], one["slow"]) == (0.1, live.id, False)
        until(lambda: ground.get("/sessions/current/listeners").json()["listeners"][0]["dropped"] >= 48, "the drops")
        assert figures(plain, ground)["footfall_listeners",] >= 1
        assert figures(plain, ground)["footfall_listener_drops_total",] >= 48
    assert ground.get("/sessions/current/events?rate=1000").status_code == 422


def test_the_id_of_a_request_comes_back(plain, ground):
    assert ground.get("/info", headers={"X-Request-ID": "from-a-test.1"}).headers["x-request-id"] == "from-a-test.1"
    own = ground.get("/info", headers={"X-Request-ID": "no good, has spaces"}).headers["x-request-id"]
    assert len(own) == 12
    assert own != ground.get("/info").headers["x-request-id"]


def test_health(plain, ground, monkeypatch):
    assert ground.get(f"{plain.url}/health/live").json() == {"live": True}
    answer = ground.get(f"{plain.url}/health/ready")
    assert answer.status_code == 200
    assert answer.json()["ready"] is True
    assert [one["what"] for one in answer.json()["checks"]] == ["workers", "sessions folder", "disk space", "event log"]
    assert not list(plain.sessions.folder.glob(".ready*"))

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(health.shutil, "disk_usage", lambda path: usage(1 << 40, 1 << 40, 5 << 20))
    answer = ground.get(f"{plain.url}/health/ready")
    assert answer.status_code == 503
    (bad,) = [one for one in answer.json()["checks"] if not one["ok"]]
    assert bad == {"what": "disk space", "ok": False, "text": "5 MiB are free, at least 256 MiB are needed; make room"}
    monkeypatch.undo()
    assert shutil.disk_usage(plain.sessions.folder).free > 0

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(health.os, "fsync", full)
    bad = [one for one in ground.get(f"{plain.url}/health/ready").json()["checks"] if not one["ok"]]
    assert [one["what"] for one in bad] == ["sessions folder"]
    monkeypatch.undo()
    assert not list(plain.sessions.folder.glob(".ready*"))


def test_ended_workers_are_not_ready(tmp_path):
    with running_server(tmp_path) as running, running.client() as client:
        running.sessions.jobs.close()
        answer = client.get(f"{running.url}/health/ready")
        assert answer.status_code == 503
        assert "start the server again" in json.dumps(answer.json())
