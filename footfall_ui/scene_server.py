"""The scene's server: it follows the current session, and is opened anew where it has gone."""

import contextlib
import io
import logging
import threading
import time

import viser

from footfall.session.access.identity import Identity
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall_ui.page_scenes import PageScenes
from footfall_ui.viser_door import SceneDoor, closed_door, open_viser

_log = logging.getLogger(__name__)

LOOK_PERIOD = 0.2
"""How often it looks whether another session has become current [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 10.0
"""Between two tries to open it; twice as long each time [s]."""


class SceneServer:
    """Keeps a scene open over ``sessions`` until :meth:`close`; the operator can work without it.

    Nobody is behind a door whose server has ended: whoever finds that out says so (:meth:`gone`), and the scene is
    opened behind another door and drawn from what the session holds.
    """

    def __init__(self, sessions: Sessions) -> None:
        self._sessions = sessions
        self._reported: set[type[Exception]] = set()
        self._pause = FIRST_PAUSE
        self._close_opened = contextlib.ExitStack()
        self._open()
        self._gone: SceneDoor | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scene-server", daemon=True)
        self._thread.start()

    @property
    def door(self) -> SceneDoor:
        """Where the scene is at present; without a port where it could not be opened."""
        return self._door

    def gone(self, door: SceneDoor) -> None:
        """Nobody answers behind this door any more."""
        self._gone = door

    def look_back(self, who: Identity, event: int | None) -> None:
        """Draw the session as it was after that event, in the scene of that page; None: as it is now.

        Raises NotFound for no such event.
        """
        live, scene = self._sessions.current, self._scene
        if live is not None and scene is not None:
            scene.look_back(who, None if event is None else live.as_of(event))

    def close(self) -> None:
        """Draw nothing more, and end the server."""
        self._ended.set()
        self._thread.join()
        self._close_opened.close()

    def _run(self) -> None:
        shown: LiveSession | None = None
        while not self._ended.wait(LOOK_PERIOD):
            if self._gone is self._door:
                _log.warning("the 3-D scene has ended, and is opened again")
                self._open()
                shown = None
            elif self._door.port is None and time.monotonic() >= self._again_at:
                self._open()
            live = self._sessions.current
            if self._scene is not None and live is not None and live is not shown:
                shown = live
                self._scene.follow(live)

    def _open(self) -> None:
        self._close_opened.close()
        self._scene: PageScenes | None = None
        with contextlib.ExitStack() as opened:
            try:
                server, door = open_viser()
                opened.callback(_stop, server)
                self._scene = PageScenes(server, door.visitors)
                opened.callback(self._scene.close)
            except Exception as error:  # whatever it is: the operator can work without the scene
                if type(error) not in self._reported:
                    self._reported.add(type(error))
                    _log.exception("the 3-D scene could not start, and is tried again")
                self._door = closed_door(f"{type(error).__name__}: {error}")
                self._again_at = time.monotonic() + self._pause
                self._pause = min(2 * self._pause, LONGEST_PAUSE)
                return
            self._door, self._pause = door, FIRST_PAUSE
            self._reported.clear()
            self._close_opened = opened.pop_all()


def _stop(server: viser.ViserServer) -> None:
    # viser says goodbye on stdout
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
