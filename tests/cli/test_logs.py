"""Logs: JSON lines with the ids of request, session and job, also from other libraries; nothing secret in them."""

import errno
import json
import logging
import subprocess
import sys
import threading
from collections import deque
from logging.handlers import RotatingFileHandler
from pathlib import Path

import pytest
import structlog
from hypothesis import given
from hypothesis import strategies as st

from footfall import logs
from footfall.session.jobs.local import Jobs
from footfall_ui.rover_process import _listen
from tests.support.server import running_server
from tests.support.waiting import BOUND


@pytest.fixture
def started(capfd, tmp_path):
    """Logging into a folder; what lines() gives are the lines so far."""
    root = logging.getLogger()
    before, level = list(root.handlers), root.level
    logs.start_logging(tmp_path)

    def lines() -> list[dict]:
        path = tmp_path / logs.FOLDER / logs.FILE
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    yield lines
    for handler in [one for one in root.handlers if one not in before]:
        root.removeHandler(handler)
        handler.close()
    root.setLevel(level)


def test_a_line_is_an_object_with_what_is_bound(started, capfd):
    with structlog.contextvars.bound_contextvars(session="s1", job="j1"):
        logging.getLogger("some.other.library").warning("the %s is hot", "sensor", extra={"degrees": 81})
    logging.getLogger("footfall.quiet").info("nothing special")
    first, second = started()
    about = {name: first[name] for name in ("event", "level", "logger", "session", "job", "degrees")}
    assert about == {
        "event": "the sensor is hot",
        "level": "warning",
        "logger": "some.other.library",
        "session": "s1",
        "job": "j1",
        "degrees": 81,
    }
    assert first["timestamp"].endswith("Z")
    assert "session" not in second
    told = capfd.readouterr().err
    assert "the sensor is hot" in told
    assert "nothing special" not in told


def test_an_exception_is_data(started):
    try:
        raise ValueError("token=abc123 was wrong")
    except ValueError:
        logging.getLogger("x").exception("it failed")
    (line,) = started()
    assert line["exception"][0]["exc_type"] == "ValueError"
    assert "abc123" not in json.dumps(line)


def test_an_exception_tells_where_it_came_from_and_nothing_of_what_was_there(started, capfd):
    """What frames hold is secret, or large: a server that puts it into words answers nobody meanwhile."""
    held = {"of nobody's business": ["hidden in a frame"] * 1000}

    def fails(kept, deep):
        if deep:
            fails(kept, deep - 1)
        raise ValueError("password=abc123 was wrong")

    try:
        fails(held, 30)
    except ValueError:
        logging.getLogger("x").exception("it failed")
    (line,) = started()
    written, told = json.dumps(line), capfd.readouterr().err
    assert line["exception"][0]["frames"][-1]["name"] == "fails"
    assert "ValueError: password=" in told
    for text in (written, told):
        assert "hidden in a frame" not in text
        assert "abc123" not in text
        assert len(text) < 20_000


SECRETS = [
    "Authorization: Bearer {}",
    "authorization=Basic {}",
    "GET /x?token={}&y=1",
    "password={}",
    '"session_token": "{}"',
    "Cookie: footfall={}",
    "FOOTFALL_ROVER_TOKEN={}",
    "api-key: {}",
]


@given(secret=st.text("abcdefXYZ0123456789-_.~+/", min_size=8, max_size=40), form=st.sampled_from(SECRETS))
def test_no_secret_is_written(secret, form):
    text = form.format(secret)
    event = {"event": text, "headers": {"authorization": secret, "list": [text]}, "api_token": secret, "note": "fine"}
    hidden = logs.without_secrets(None, "info", event)
    assert secret not in json.dumps(hidden).replace("footfall", "")
    assert hidden["note"] == "fine"


def test_a_folder_that_cannot_be_written_is_told_and_borne(tmp_path, capfd):
    (tmp_path / logs.FOLDER).write_text("in the way")
    root = logging.getLogger()
    before = list(root.handlers)
    logs.start_logging(tmp_path)
    assert "nothing is logged to a file" in capfd.readouterr().err
    for handler in [one for one in root.handlers if one not in before]:
        root.removeHandler(handler)


def test_a_full_disk_is_told_once_and_its_end_too(started, capfd, tmp_path, monkeypatch):
    file = next(one for one in logging.getLogger().handlers if isinstance(one, RotatingFileHandler))
    full = True

    def flush() -> None:
        if full:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(file, "flush", flush)
    for number in range(5):
        logging.getLogger("tests").info("line %d with token=sesame-open", number)
    told = capfd.readouterr().err
    assert told.count("\n") == 1
    assert "takes no lines" in told
    assert "No space left on device" in told
    full = False
    for number in range(5, 8):
        logging.getLogger("tests").info("line %d", number)
    told = capfd.readouterr().err
    assert told == "the log file takes lines again; 5 of them were refused, and may be missing\n"
    monkeypatch.undo()
    file.flush()
    assert started()[-1]["event"] == "line 7"


def test_requests_are_logged_with_their_ids(started, tmp_path):
    serving = running_server(tmp_path / "sessions", prepare=lambda s: s.create("first"))
    with serving as running, running.client() as client:
        asked = client.post(
            "/sessions/current/notes", json={"text": "x"}, params={"token": "hush"}, headers={"X-Request-ID": "r-1"}
        )
        assert asked.status_code == 201
    (line,) = [one for one in started() if one.get("request") == "r-1"]
    about = {name: line[name] for name in ("event", "method", "route", "status", "session", "level")}
    assert about == {
        "event": "POST /api/v1/sessions/current/notes 201",
        "method": "POST",
        "route": "/sessions/{session}/notes",
        "status": 201,
        "session": "current",
        "level": "info",
    }
    assert "hush" not in json.dumps(started())


def test_what_a_job_logs_names_it(started, monkeypatch):
    ended = threading.Event()
    with Jobs(workers=1) as jobs:

        def done(job, product) -> str:
            logging.getLogger("test").warning("recorded")
            ended.set()
            return ""

        monkeypatch.setattr(Jobs, "_run", lambda self, process, job, message: (None, None))
        job = jobs.submit("maps", {}, None, done, session="s9")
        assert ended.wait(BOUND)
    (line,) = [one for one in started() if one["event"] == "recorded"]
    assert (line["job"], line["session"]) == (job.id, "s9")


def test_what_a_worker_process_logs_during_a_job_comes_with_its_ids(started, monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "session"))
    with Jobs("tiny_recipes", workers=1) as jobs:
        job = jobs.submit("logs", {}, None, session="s9")
        job.finish(BOUND)
    told = {one["event"].partition("\n")[0]: one for one in started() if one.get("job") == job.id}
    assert set(told) == {"the ground is soft", "it broke"}
    first = told["the ground is soft"]
    assert [first[name] for name in ("logger", "level", "session", "where")] == ["footfall.tiny", "warning", "s9", 3]
    assert "ZeroDivisionError: a bug" in json.dumps(told["it broke"])


def test_what_the_simulated_rover_says_comes_with_its_session(started):
    lines = ["INFO footfall.sim: linked", "WARNING footfall.sim.physics: it shakes"]
    said = "\n".join([*lines, "Traceback (most recent call last):", "", "  it: fell"])
    process = subprocess.Popen([sys.executable, "-c", f"print({said!r})"], stdout=subprocess.PIPE)
    words: deque[str] = deque()
    _listen(process, "s7", words)
    assert process.wait() == 0
    told = [(one["event"], one["level"], one["logger"], one["session"]) for one in started()]
    assert told == [
        ("linked", "info", "footfall.sim", "s7"),
        ("it shakes", "warning", "footfall.sim.physics", "s7"),
        ("Traceback (most recent call last):", "warning", "footfall.sim.physics", "s7"),
        ("  it: fell", "warning", "footfall.sim.physics", "s7"),
    ]
    assert words[-1] == "  it: fell"
