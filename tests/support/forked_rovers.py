"""Simulated rovers that begin with all libraries loaded: loading them takes each rover that is started a second of a
core, and most tests that have one in a process of its own look at something else.

One process of each process of tests loads them, and is forked for each rover. It runs nothing itself, so no thread of
compiled code is there that would be missing after a fork.
"""

import multiprocessing
import os
import subprocess
import sys
import threading
from multiprocessing import reduction
from typing import IO

from footfall.session.jobs.worker import end_with_server
from footfall_ui.rover_process import RoverProcess

LOADED = "footfall.sim.__main__"

_forking = multiprocessing.get_context("forkserver")
_forking.set_forkserver_preload([LOADED])


class ForkedRover:
    """What :class:`subprocess.Popen` would be of ``python -m footfall.sim``."""

    def __init__(self, arguments: list[str], surroundings: dict[str, str]) -> None:
        reads, writes = os.pipe()
        try:
            self._process = _forking.Process(target=_run, args=(arguments, surroundings, _Sent(writes)), name="rover")
            self._process.start()
        finally:
            os.close(writes)
        self.pid: int = self._process.pid or 0
        self.stdout: IO[bytes] | None = os.fdopen(reads, "rb")

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(LOADED, timeout or 0.0)
        return self._process.exitcode

    def terminate(self) -> None:
        self._process.terminate()

    def kill(self) -> None:
        self._process.kill()


class ForkedRoverProcess(RoverProcess):
    """A rover as a server has it without being told, but for how its process begins."""

    def _begun(self, command: list[str], surroundings: dict[str, str]) -> ForkedRover:
        assert command[:3] == [sys.executable, "-m", "footfall.sim"]
        return ForkedRover(command[3:], surroundings)


class _Sent:
    """A file descriptor on its way to the process that is begun."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __reduce__(self):
        return _received, (reduction.DupFd(self.number),)


def _received(sent) -> int:
    return sent.detach()


def _run(arguments: list[str], surroundings: dict[str, str], output: int) -> None:
    from footfall.sim.__main__ import main

    os.setsid()
    for number in (1, 2):
        os.dup2(output, number)
    os.close(output)
    os.environ.update(surroundings)
    # killed tests leave no rover behind; nor the process that forks, which ends with the last of them
    threading.Thread(target=end_with_server, daemon=True).start()
    sys.argv = [LOADED, *arguments]
    sys.exit(main())
