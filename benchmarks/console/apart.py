"""A server in a process of its own, as ``footfall serve`` starts it: with a scene and a simulated rover.

The rover is the kinematic one: physics is nothing that a ground tool computes beside a real rover.
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx

STARTING = 120.0
"""Longest wait for the server and its rover [s]."""


@dataclass(frozen=True)
class Apart:
    """A server that answers on ``url``; ``process``: its number with the system."""

    url: str
    process: int

    def client(self) -> httpx.Client:
        """A client of the REST interface."""
        return httpx.Client(base_url=f"{self.url}/api/v1", timeout=60, trust_env=False)

    def line(self, path: str) -> str:
        """Address of a WebSocket of the server."""
        return f"ws{self.url.removeprefix('http')}{path}"

    def processor_seconds(self) -> float:
        """What the server itself has used of the processor; workers and rover are processes of their own."""
        ticks = Path(f"/proc/{self.process}/stat").read_text().rpartition(")")[2].split()[11:13]
        return sum(int(one) for one in ticks) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> int:
        """Resident memory [bytes]."""
        return int(Path(f"/proc/{self.process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@contextmanager
def served_apart(rover: bool = True, sample: str = "rock-step", tree: Path | None = None) -> Iterator[Apart]:
    """Serve a sample on a free port until the context ends.

    rover: with one, which is there. tree: where the server's source is, another state of it; None: this one.
    """
    with TemporaryDirectory(prefix="footfall-bench-") as folder:
        command = [str(Path(sys.executable).with_name("footfall")), "serve", "--port", "0", "--data", folder]
        command += ["--sample", sample]
        command += ["--kinematic"] if rover else ["--no-sim"]
        source = None if tree is None else {**os.environ, "PYTHONPATH": f"{tree / 'backend'}{os.pathsep}{tree}"}
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=source, cwd=tree) as server:
            try:
                line = server.stdout.readline() if server.stdout is not None else ""
                if "http://" not in line:
                    raise RuntimeError("the server did not start")
                served = Apart(line.split()[-1], server.pid)
                if rover:
                    await_telemetry(served)
                yield served
            finally:
                server.terminate()
                server.wait(30)


def await_telemetry(served: Apart) -> None:
    """Raises RuntimeError where the rover says nothing within STARTING."""
    end = time.monotonic() + STARTING
    with served.client() as client:
        while not client.get("/sessions/current").json()["link"]["frames"]:
            if time.monotonic() > end:
                raise RuntimeError(f"no telemetry within {STARTING:g} s")
            time.sleep(0.1)
