"""The processes that are killed: the server as ``footfall serve`` starts it, its workers, and a rover beside it."""

import base64
import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

PATIENCE = 180.0
"""Longest wait for anything [s]."""


def until(look: Callable[[], Any], what: str, timeout: float = PATIENCE) -> Any:
    """The first true answer of ``look``. Raises TimeoutError, and what ``look`` raises."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if answer := look():
            return answer
        time.sleep(0.02)
    raise TimeoutError(f"{what} did not happen within {timeout:g} s")


class ServerProcess:
    """``footfall serve`` over one session of a data folder; on the same port after every start."""

    def __init__(self, data: Path, session: str, log: Path, workers: int = 2) -> None:
        self._command = [str(Path(sys.executable).with_name("footfall")), "serve", "--no-sim", "--session", session]
        self._command += ["--data", str(data), "--workers", str(workers)]
        self._log = log
        self._port = 0
        self._process: subprocess.Popen[str] | None = None

    @property
    def url(self) -> str:
        """Where it answers, without a path."""
        return f"http://127.0.0.1:{self._port}"

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._port

    @property
    def pid(self) -> int:
        """Number of its process. Raises ProcessLookupError where there is none."""
        if self._process is None or self._process.poll() is not None:
            raise ProcessLookupError("the server does not run")
        return self._process.pid

    def start(self) -> None:
        """Returns once it answers. Raises RuntimeError where it ends instead."""
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                [*self._command, "--port", str(self._port)], stdout=subprocess.PIPE, stderr=log, text=True
            )
        line = self._process.stdout.readline() if self._process.stdout is not None else ""
        if "http://" not in line:
            raise RuntimeError(f"the server did not start; {self._log} says why")
        self._port = int(line.rpartition(":")[2])

    def workers(self) -> list[int]:
        """Numbers of its worker processes."""
        children, found = [], []
        for task in Path(f"/proc/{self.pid}/task").iterdir():
            with contextlib.suppress(OSError):  # the thread has ended meanwhile
                children += (task / "children").read_text().split()
        for child in children:
            with contextlib.suppress(OSError):  # it has ended meanwhile
                if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                    found.append(int(child))
        return sorted(found)

    def end(self, number: int = signal.SIGTERM) -> None:
        """Send it a signal and wait until it is gone, its workers too."""
        process, self._process = self._process, None
        if process is not None:
            process.send_signal(number)
            process.communicate()  # its workers have the same output: its end is theirs too


class RoverProcess:
    """The rover of :mod:`benchmarks.soak.rover`: started again, it stands as it stood."""

    def __init__(self, folder: Path, hurry: float) -> None:
        """folder: with ``world.npz`` and ``state.npz``; the journal comes there."""
        self._folder, self._hurry = folder, hurry
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Number of its process. Raises ProcessLookupError where there is none."""
        if self._process is None or self._process.poll() is not None:
            raise ProcessLookupError("the rover does not run")
        return self._process.pid

    def start(self, url: str) -> None:
        """url: of the rover's link, ws://…"""
        command = [sys.executable, "-m", "benchmarks.soak.rover", "--hurry", str(self._hurry), "--url", url]
        for name, file in (("terrain", "world.npz"), ("state", "state.npz"), ("journal", "journal")):
            command += [f"--{name}", str(self._folder / file)]
        with (self._folder / "rover.log").open("ab") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log, cwd=Path(__file__).parents[2])

    def begun(self) -> list[tuple[str, str, float]]:
        """(id, name, when [s]) of the commands on which it set out, in their order, over all its lives."""
        journal = self._folder / "journal"
        lines = journal.read_text().splitlines() if journal.exists() else []
        return [(one, name, float(at)) for one, name, at in map(str.split, lines)]

    def executed(self) -> list[str]:
        """Ids of the commands on which it set out, in their order, over all its lives."""
        return [one for one, _, _ in self.begun()]

    def end(self, number: int = signal.SIGKILL) -> None:
        """Send it a signal and wait until it is gone."""
        if self._process is not None:
            self._process.send_signal(number)
            self._process.wait()


class Deaf:
    """A client that follows the session's events at a path of a server on this machine, and never reads."""

    def __init__(self, port: int, path: str) -> None:
        """Raises OSError where no server takes it on."""
        self._line = line = socket.socket()
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.settimeout(PATIENCE)
        line.connect(("127.0.0.1", port))
        key = base64.b64encode(bytes(16)).decode()
        wanted = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade"}
        wanted |= {"Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13"}
        headers = "".join(f"{name}: {content}\r\n" for name, content in wanted.items())
        line.sendall(f"GET {path} HTTP/1.1\r\n{headers}\r\n".encode())
        if line.recv(12) != b"HTTP/1.1 101":
            raise OSError(f"the server did not take a listener on at {path}")

    def close(self) -> None:
        """Hang up."""
        self._line.close()


def kill(pid: int) -> None:
    """SIGKILL to one process, by its number."""
    os.kill(pid, signal.SIGKILL)
