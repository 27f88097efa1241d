"""`footfall serve` with a light time, logs and Foxglove, as a process of its own."""

import json
import signal
import socket
import subprocess
import sys

import httpx
from typer.testing import CliRunner
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall import logs
from footfall.cli import app
from tests.support.waiting import BOUND


def test_an_impossible_delay_is_refused_before_anything_starts(tmp_path):
    run = CliRunner().invoke(app, ["serve", "--telemetry-delay", "-1", "--data", str(tmp_path / "data")])
    assert run.exit_code == 2
    assert "the delay of telemetry is 0 to 1500 s (the Moon: 1.28 s), not -1.0" in run.stderr
    assert not (tmp_path / "data").exists()


def test_the_options_reach_the_server(tmp_path):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        free = probe.getsockname()[1]
    options = ["--port", "0", "--no-sim", "--data", str(tmp_path), "--command-delay", "1.28", "--foxglove", str(free)]
    command = [sys.executable, "-c", "from footfall.cli import main; main()", "serve", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            url = process.stdout.readline().split()[-1]
            assert str(free) in process.stdout.readline()
            with httpx.Client(base_url=url, trust_env=False, verify=False, timeout=BOUND) as client:
                light = client.get("/api/v1/rover/light-time").json()
                assert light == {"telemetry_s": 0.0, "commands_s": 1.28, "round_trip_s": 1.28}
                asked = client.post("/api/v1/stop", headers={"X-Request-ID": "asked-by-a-test"})
                assert asked.status_code == 200
            with connect(f"ws://127.0.0.1:{free}", subprotocols=[Subprotocol("foxglove.sdk.v1")], proxy=None) as viewer:
                assert json.loads(viewer.recv(timeout=BOUND))["name"] == "FootFall"
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=BOUND)
    lines = [json.loads(line) for line in (tmp_path / logs.FOLDER / logs.FILE).read_text().splitlines()]
    assert "asked-by-a-test" in [line.get("request") for line in lines]
