"""Every format of a sequence over REST and on the command line: its name, its type, its content."""

import io
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader

from footfall.io.exports import FORMATS, MEDIA, SUFFIXES, export
from tests.support.problems import problem
from tests.support.sequences import SAMPLES, recorded
from tests.support.server import running_server


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A client of a server with the rock-step sample open; no rover."""
    with (
        running_server(tmp_path_factory.mktemp("sessions"), prepare=lambda s: s.open_sample("rock-step")) as running,
        running.client() as made,
    ):
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


def test_the_sheet_is_no_product_of_the_session(client):
    sequence = recorded("rock-step")
    address = f"/sequences/{sequence.digest}/export"

    def products() -> int:
        return client.get("/sessions/current").json()["events"]

    before = products()
    client.get(address, params={"format": "html"})
    assert products() == before
    client.get(address, params={"format": "csv"})
    client.get(address, params={"format": "yamcs"})
    assert products() > before


def test_an_unknown_format_is_refused(client):
    problem(client.get(f"/sequences/{recorded().digest}/export", params={"format": "docx"}), 422, "validation")


def run(*arguments: str) -> bytes:
    script = "from footfall.cli import main; main()"
    command = [sys.executable, "-c", script, "export", str(SAMPLES / "rock-step"), *arguments]
    done = subprocess.run(command, capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def test_the_command_line_writes_binary_formats(tmp_path: Path):
    assert run("--format", "ros2") == export(recorded("rock-step"), "ros2")
    path = tmp_path / "step.mcap"
    told = json.loads(run("--format", "ros2", "-o", str(path), "--json"))
    assert told["bytes"] == len(path.read_bytes())
    assert [one.name for one in make_reader(io.BytesIO(path.read_bytes())).iter_attachments()] == ["sequence.json"]
