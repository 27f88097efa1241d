"""Every format of a sequence over REST and on the command line: its name, its type, its content."""

import hashlib
import io
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from mcap.reader import make_reader

from footfall.io.exports import FORMATS, MEDIA, SUFFIXES, export
from footfall.sequence.commands import Sequence
from tests.support.problems import problem
from tests.support.sequences import SAMPLES, recorded
from tests.support.server import running_server
from tests.support.waiting import BOUND


@contextmanager
def opened(folder: Path, sample: str) -> Iterator[httpx.Client]:
    """A client of a server with a sample open; no rover."""
    with running_server(folder, prepare=lambda s: s.open_sample(sample)) as running, running.client() as made:
        yield made


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with opened(tmp_path_factory.mktemp("sessions"), "rock-step") as made:
        yield made


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """Of the sample whose commands are as planned for a rigid rover."""
    with opened(tmp_path_factory.mktemp("sessions"), "edited-export") as made:
        yield made


@pytest.mark.parametrize("format", FORMATS)
def test_every_format_is_served(client, format):
    sequence = recorded("rock-step")
    answer = client.get(f"/sequences/{sequence.digest}/export", params={"format": format})
    assert answer.status_code == 200, answer.text
    assert answer.content == export(sequence, format)
    assert answer.headers["content-type"] == MEDIA[format].replace("text/csv", "text/csv; charset=utf-8")
    name = re.search('filename="([^"]+)"', answer.headers["content-disposition"])
    assert name is not None
    assert name[1] == f"sequence-{sequence.digest[:8]}{SUFFIXES[format]}"


def test_reading_records_nothing_and_exporting_does_but_for_the_sheet(client):
    sequence = recorded("rock-step")
    address = f"/sequences/{sequence.digest}/export"

    def products() -> int:
        return client.get("/sessions/current").json()["events"]

    before = products()
    for format in ("html", "csv", "yamcs"):
        assert client.get(address, params={"format": format}).status_code == 200
    sheet = client.post(address, params={"format": "html"})
    assert (sheet.status_code, sheet.json()["digest"]) == (201, None)
    assert products() == before
    made = client.post(address, params={"format": "csv"})
    assert made.status_code == 201
    assert made.json() == {
        "format": "csv",
        "digest": hashlib.sha256(export(sequence, "csv")).hexdigest()[:32],
        "url": f"/api/v1{address}?format=csv",
    }
    assert products() == before + 1
    assert client.get(made.headers["location"].removeprefix("/api/v1")).content == export(sequence, "csv")


def test_an_unknown_format_is_refused(client):
    problem(client.get(f"/sequences/{recorded().digest}/export", params={"format": "docx"}), 422, "validation")


def run(*arguments: str) -> bytes:
    script = "from footfall.cli import main; main()"
    command = [sys.executable, "-c", script, "export", str(SAMPLES / "rock-step"), *arguments]
    done = subprocess.run(command, capture_output=True, timeout=BOUND)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def test_the_command_line_writes_binary_formats(tmp_path: Path):
    assert run("--format", "ros2") == export(recorded("rock-step"), "ros2")
    path = tmp_path / "step.mcap"
    told = json.loads(run("--format", "ros2", "-o", str(path), "--json"))
    assert told["bytes"] == len(path.read_bytes())
    assert [one.name for one in make_reader(io.BytesIO(path.read_bytes())).iter_attachments()] == ["sequence.json"]


def undone(client, read: dict) -> dict:
    """The commands before those that were read in."""
    answer = client.post(f"/sequences/{read['id']}/undo", headers={"If-Match": f'"{read["digest"]}"'})
    assert answer.status_code == 200, answer.text
    return answer.json()


READ = ("json", "seqjson", "csv", "fprime", "yamcs", "ros2")


@pytest.mark.parametrize("format", READ)
def test_what_can_be_read_back_comes_back_checked(rigid, format):
    sequence = recorded("edited-export")
    assert sequence.at_rest is None
    require_read_back(rigid, sequence, format, as_commanded=True)


@pytest.mark.parametrize("format", READ)
def test_with_the_pose_held_it_does_too(client, format):
    sequence = recorded("rock-step")
    assert sequence.at_rest is not None
    require_read_back(client, sequence, format)


def require_read_back(client, sequence: Sequence, format: str, as_commanded: bool = False) -> None:
    before = client.get("/sequences/current").json()
    sent = {"file": (f"step{SUFFIXES[format]}", export(sequence, format))}
    answer = client.post("/sessions/current/sequences/import", files=sent, params={"as_commanded": as_commanded})
    assert answer.status_code == 201, answer.text
    read = answer.json()
    assert answer.headers["etag"] == f'"{read["digest"]}"'
    assert answer.headers["location"] == f"/api/v1/sequences/{read['id']}"
    assert client.get(answer.headers["location"].removeprefix("/api/v1")).json()["digest"] == read["digest"]
    assert read["commands"] == before["commands"]
    # one leg steps, whichever joints move
    (leg,) = set(read["legs"]) - {None}
    assert all(one["leg"] in (None, leg) for one in read["commands"])
    assert read["valid"] is True
    assert read["starts_from"] == ("rover" if format in ("csv", "yamcs") else "file")
    assert undone(client, read) == before
    assert before["starts_from"] == "plan"


def test_a_changed_row_of_a_file_fails_its_rule_and_is_not_armed(rigid):
    before = rigid.get("/sequences/current").json()
    header, *rows = (line.split(",") for line in export(recorded("edited-export"), "csv").decode().splitlines())
    number, duration = header.index("row"), header.index("duration_s")
    for line in rows:
        line[duration] = "0.001" if line[number] == "1" else line[duration]
    content = "\r\n".join(map(",".join, [header, *rows])).encode()
    address, file = "/sessions/current/sequences/import", {"file": ("step.csv", content)}
    read = rigid.post(address, files=file, params={"as_commanded": True}).json()
    assert read["valid"] is False
    assert {(one["row"], one["rule"]) for one in read["rules"] if not one["holds"]} == {(0, "speed")}
    assert rigid.get(f"/sequences/{read['digest']}/export", params={"format": "json"}).status_code == 422
    assert undone(rigid, read) == before


def test_of_a_rover_that_sags_planned_commands_are_judged_as_such_only_when_asked_for(rigid):
    """The wheel would be off the ground later, and be dragged: the same rows, from where the rover stands."""
    before = rigid.get("/sequences/current").json()
    sent = {"file": ("step.csv", export(recorded("edited-export"), "csv"))}
    read = rigid.post("/sessions/current/sequences/import", files=sent).json()
    assert read["starts_from"] == "rover"
    assert "no-drag" in {one["rule"] for one in read["rules"] if not one["holds"]}
    assert undone(rigid, read) == before


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("step.csv", b"sequence,robot\n", "step.csv: its columns must be"),
        ("step.seq.json", b'{"steps": 3}', "step.seq.json: "),
        ("step.docx", b"PK", "step.docx: sequences are read from .json, .csv, .seq, .ycs, .mcap, not from '.docx'"),
        ("../../step.json", b"[" * 100_000, "step.json: it is no JSON"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_and_changes_nothing(client, name, content, said):
    before = client.get("/sequences/current").json()
    answer = client.post("/sessions/current/sequences/import", files={"file": (name, content)})
    assert problem(answer, 422, "invalid-sequence")["detail"].startswith(said)
    assert client.get("/sequences/current").json() == before


def test_without_a_file_it_is_said(client):
    answer = client.post("/sessions/current/sequences/import", files={"other": ("step.csv", b"")})
    assert "other" in problem(answer, 422, "invalid-input")["detail"]
