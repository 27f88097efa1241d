"""What the Dockerfile says holds, as far as it can be seen without building it."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.server import running_server
from tests.support.waiting import BOUND

TOP = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def lines() -> list[str]:
    """Instructions, one a line, without comments."""
    text = (TOP / "Dockerfile").read_text().replace("\\\n", " ")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def test_the_base_is_named_by_its_content(lines):
    assert [line for line in lines if line.startswith("FROM")] == [lines[0]]
    assert re.fullmatch(r"FROM [\w./:-]+@sha256:[0-9a-f]{64}", lines[0])


def test_it_runs_without_privileges_what_the_readme_says(lines):
    starts = [line.split(None, 1) for line in lines]
    users = [rest for name, rest in starts if name == "USER"]
    assert users[-1] not in ("root", "0")
    assert json.loads(starts[-1][1]) == ["make", "run"]
    made = re.findall(r"make (\.\S+)", " ".join(rest for name, rest in starts if name == "RUN"))
    assert made
    for target in made:
        assert f"\n{target.replace('.venv', '$(VENV)')}:" in (TOP / "Makefile").read_text()


def test_its_health_check_is_good_while_the_server_answers_and_bad_after(lines, tmp_path):
    told = next(line for line in lines if line.startswith("HEALTHCHECK"))
    python, *rest = json.loads(told[told.index("CMD") + 3 :])
    assert python == ".venv/bin/python"
    assert f"EXPOSE {8080}" in lines

    def check(port: str) -> int:
        command = [sys.executable, *(one.replace("127.0.0.1:8080", f"127.0.0.1:{port}") for one in rest)]
        assert port in command[-1]
        return subprocess.run(command, capture_output=True, timeout=BOUND, check=False).returncode

    with running_server(tmp_path) as server:
        port = server.url.rpartition(":")[2]
        assert check(port) == 0
    assert check(port) != 0
