"""The first step of the README in Python and with curl, run as it is written. The browser's is in tests/browser."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.server import running_server
from tests.support.waiting import BOUND, until

README = Path(__file__).resolve().parents[2] / "README.md"
ADDRESS = "http://127.0.0.1:8080"


def block(language: str) -> str:
    found = re.findall(rf"^```{language}\n(.*?)^```", README.read_text(), re.M | re.S)
    assert len(found) == 1, f"the README has {len(found)} {language} blocks, one is meant"
    return found[0]


def check_exported(path: Path) -> None:
    steps = json.loads(path.read_text())["steps"]
    assert len(steps) > 5
    assert all(step["type"] == "command" for step in steps)


def test_python(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", block("python")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=BOUND,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("Status.FOUND")
    assert re.search(r"^Status\.FOUND \d+ foot moves$", run.stdout, re.M)
    assert "joint limits: " in run.stdout
    check_exported(tmp_path / "step.seq.json")


def test_curl(tmp_path: Path) -> None:
    if shutil.which("curl") is None:
        pytest.skip("curl is not on this machine")
    script = block("bash")
    assert ADDRESS in script
    with running_server(tmp_path / "sessions", prepare=lambda s: s.open_sample("rock-step"), physics=True) as served:
        served.rover.start()
        current = served.sessions.current
        until(lambda: current is not None and current.rover.frame, "the first telemetry")
        run = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", script.replace(ADDRESS, served.url)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=BOUND,
        )
        assert run.returncode == 0, run.stderr
        assert current is not None
        assert current.state.plan_status == "found"
    check_exported(tmp_path / "step.seq.json")
