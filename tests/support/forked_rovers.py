"""Simulated rovers forked from one process that has loaded their libraries: to load them takes seconds of a core."""

import multiprocessing
import os
import subprocess
import sys
import threading
from multiprocessing.connection import Connection
from typing import cast

from footfall_ui.rover_process import RoverProcess

_forks = multiprocessing.get_context("forkserver")
_forks.set_forkserver_preload(["footfall.sim.__main__"])


class ForkedRover(RoverProcess):
    """The rover process that a server has without being told, but for how it is started.

    What measures which lines were run follows programs, not forks: it gets the program.
    """

    def _started(self, command: list[str], surroundings: dict[str, str]) -> "subprocess.Popen[bytes]":
        if "COVERAGE_PROCESS_CONFIG" in os.environ:
            return super()._started(command, surroundings)
        return cast("subprocess.Popen[bytes]", _Forked(command[command.index("footfall.sim") + 1 :], surroundings))


class _Forked:
    """As much of a ``subprocess.Popen`` as is asked of a rover's; ``arguments`` of ``python -m footfall.sim``."""

    def __init__(self, arguments: list[str], surroundings: dict[str, str]) -> None:
        words, said = _forks.Pipe(duplex=False)
        self._process = _forks.Process(target=_rover, args=(arguments, surroundings, said), daemon=True)
        self._process.start()
        said.close()
        self.stdout = os.fdopen(os.dup(words.fileno()), "rb")
        words.close()
        self.pid = self._process.pid
        self.terminate, self.kill = self._process.terminate, self._process.kill
        self._asked = threading.Lock()  # its exit code can be read once

    @property
    def returncode(self) -> int | None:
        with self._asked:
            return self._process.exitcode

    def poll(self) -> int | None:
        return self.returncode

    def wait(self, timeout: float | None = None) -> int | None:
        with self._asked:
            self._process.join(timeout)
            if self._process.exitcode is None:
                raise subprocess.TimeoutExpired("footfall.sim", timeout or 0.0)
            return self._process.exitcode


def _rover(arguments: list[str], surroundings: dict[str, str], said: Connection) -> None:
    from footfall.sim.__main__ import main  # of the process that forks: this one need not load it

    threading.Thread(target=_end_with_test, daemon=True).start()
    os.setsid()
    for stream in (1, 2):
        os.dup2(said.fileno(), stream)
    os.environ.clear()
    os.environ.update(surroundings)
    sys.argv[1:] = arguments
    sys.exit(main())


def _end_with_test() -> None:
    """What forks it lives on while a rover does, so the end of that tells nothing."""
    tests = multiprocessing.parent_process()
    if tests is not None:
        tests.join()
        os._exit(1)
