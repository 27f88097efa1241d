"""The simulated rover's process: started beside the server, moved to the world of whichever session is open."""

import contextlib
import logging
import os
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, Protocol

from structlog.contextvars import bound_contextvars

from footfall.core.errors import FootFallError
from footfall.io.artifacts import encode
from footfall.io.terrain_files import write_terrain
from footfall.session.live import LiveSession
from footfall.session.log.event import loaded_world
from footfall.session.registry import Sessions
from footfall.telemetry.link import TOKEN_VARIABLE
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field

_log = logging.getLogger(__name__)

LOOK_PERIOD = 0.5
"""How often the open session and the process are looked at [s]."""
MOST_RESTARTS = 5
"""So often in a row a process that died is started again, for one session."""
MOST_WORDS = 20
"""So many of the process's last lines are kept."""


class Begun(Protocol):
    """A process that was started: what is asked of a :class:`subprocess.Popen` here."""

    pid: int
    stdout: IO[bytes] | None

    @property
    def returncode(self) -> Any: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...

    def terminate(self) -> None: ...

    def kill(self) -> None: ...


class RoverProcess:
    """One simulated rover as a client of ``url``, for the current one of ``sessions``.

    It is started again with the world of another session when that becomes the current one, and when a
    session without a terrain gets one. physics: a rover with masses and springs, or a kinematic one.
    token: with which it comes in, where the server asks for one; certificate: that the server shows, with TLS.
    """

    def __init__(
        self,
        sessions: Sessions,
        url: str,
        seed: int = 0,
        physics: bool = True,
        token: str | None = None,
        certificate: Path | None = None,
    ) -> None:
        self._sessions = sessions
        self._physics = physics
        self._url = url
        self._seed = seed
        self._token = token
        self._certificate = certificate
        self._folder = TemporaryDirectory(prefix="footfall-rover-")
        self._process: Begun | None = None
        self._session: str | None = None
        self._world: str | None = None
        self._restarts = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="simulated-rover", daemon=True)
        self._words: deque[str] = deque(maxlen=MOST_WORDS)
        self._listening = threading.Thread()
        self.fault = ""

    def start(self) -> None:
        """Start the rover, and follow the current session from now on."""
        self._thread.start()

    def close(self) -> None:
        """End the process and the following."""
        self._ended.set()
        if self._thread.ident is not None:
            self._thread.join()
        self._stop()
        with contextlib.suppress(OSError):
            self._folder.cleanup()

    def as_dict(self) -> dict[str, object]:
        """For ``GET info``."""
        running = self._process is not None and self._process.poll() is None
        return {
            "running": running,
            "pid": self._process.pid if running and self._process else None,
            "fault": self.fault,
        }

    def _watch(self) -> None:
        while not self._ended.is_set():
            try:
                self._follow()
            except (FootFallError, OSError) as error:
                self.fault = str(error)
                _log.warning("the simulated rover could not be started: %s", error)
            self._ended.wait(LOOK_PERIOD)

    def _follow(self) -> None:
        live = self._sessions.current
        if live is None:
            return
        if live.described is not None and live.state.dem is None:
            # no made ground is known to suit its size
            if live.id != self._session:
                self._session = self._world = None
                self._stop()
            self.fault = (
                f"{live.described.name} is simulated when a terrain is loaded: nobody says on what ground it stands"
            )
            return
        world = self._world if live.id == self._session and self._world else loaded_world(live.events())
        if live.id != self._session:
            self._session, self._world = live.id, world
            self._restarts = 0
            self._stop()
            self._spawn(live, live.state.state)
        elif world != self._world:
            # it stood on another ground so far; its frozen state means nothing here
            self._world = world
            self._stop()
            self._spawn(live, None)
        elif self._process is not None and self._process.poll() is not None:
            self.fault = f"the simulated rover ended: {self._last_words() or f'exit code {self._process.returncode}'}"
            _log.warning(self.fault)
            self._process = None
            if self._restarts < MOST_RESTARTS:
                self._restarts += 1
                self._spawn(live, live.state.state)

    def _spawn(self, live: LiveSession, state_digest: str | None) -> None:
        folder = Path(self._folder.name)
        digest = self._world or live.state.dem
        dem = None if digest is None else live.get(digest)
        write_terrain(dem if isinstance(dem, Dem) else rock_field(seed=self._seed), folder / "world.npz")
        command = [sys.executable, "-m", "footfall.sim", "--with-parent", "--seed", str(self._seed)]
        command += ["--url", self._url, "--terrain", str(folder / "world.npz"), "--robot", live.state.robot_name]
        if live.described is not None:
            # kinematic: on the link such robots have no masses and springs
            (folder / "robot.npz").write_bytes(encode(live.described))
            command += ["--described", str(folder / "robot.npz")]
        elif self._physics:
            command.append("--physics")
        if self._certificate is not None:
            command += ["--certificate", str(self._certificate)]
        state = None if state_digest is None or dem is None else live.get(state_digest)
        if isinstance(state, RobotState):
            (folder / "state.npz").write_bytes(encode(state))
            command += ["--state", str(folder / "state.npz")]
        # not among the arguments, which everybody on this computer can read
        surroundings = {**os.environ, **({} if self._token is None else {TOKEN_VARIABLE: self._token})}
        self._process = self._begun(command, surroundings)
        self._words = deque(maxlen=MOST_WORDS)
        self._listening = threading.Thread(target=_listen, args=(self._process, live.id, self._words), daemon=True)
        self._listening.start()
        self.fault = ""

    def _begun(self, command: list[str], surroundings: dict[str, str]) -> Begun:
        # a session of its own: Ctrl-C in the terminal reaches the server only, which then ends the rover
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env=surroundings,
        )

    def _last_words(self) -> str:
        self._listening.join(1.0)
        return self._words[-1] if self._words else ""

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(timeout=3)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _listen(process: Begun, session: str, words: "deque[str]") -> None:
    """Log what the process says until it ends. Its lines begin with level and name; others belong to the one before."""
    level, name = logging.ERROR, "footfall.sim"
    with bound_contextvars(session=session), process.stdout or contextlib.nullcontext(()) as lines:
        for line in lines:
            text = line.decode(errors="replace").rstrip()
            if not text:
                continue
            head, _, rest = text.partition(": ")
            word, _, named = head.partition(" ")
            if rest and named and word in _LEVELS:
                level, name, text = _LEVELS[word], named, rest
            words.append(text)
            logging.getLogger(name).log(level, "%s", text)


_LEVELS = logging.getLevelNamesMapping()
