"""The composition root: sessions, API, page, scene and the simulated rover put together, and served."""

import contextlib
import io
import logging
import signal
import socket
import sys
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from footfall.api.assemble import assemble
from footfall.api.guard import LOOPBACK_NAMES, is_loopback_name
from footfall.core.errors import Conflict, InvalidInput
from footfall.resources import static_folder
from footfall.session.registry import Sessions
from footfall.telemetry.link import MAX_BINARY_FRAME, PATH
from footfall_ui.proxy import SceneDoor, SceneProxy, closed_door, door_of
from footfall_ui.rover_process import RoverProcess

_log = logging.getLogger(__name__)

FOLLOW_PERIOD = 0.2
"""How often the scene looks whether another session has become current [s]."""


class _Page(StaticFiles):
    """The operator's page. The browser asks each time whether a file is still the same."""

    async def get_response(self, path: str, scope: Scope) -> Any:
        answer = await super().get_response(path, scope)
        answer.headers["Cache-Control"] = "no-cache"
        return answer


def create_app(
    sessions: Sessions,
    *,
    scene: bool = True,
    rover: RoverProcess | None = None,
    static: Path | None = None,
) -> FastAPI:
    """The whole application over ``sessions``, which stay the caller's to close.

    scene: start viser; where that fails, the app works without it and says why.
    rover: a simulated rover to report on; starting and closing it is the caller's as well.
    static: folder of the page, by default the one that ships with FootFall.
    """
    door, close_scene = _open_scene(sessions) if scene else (closed_door("it was switched off"), _nothing)

    def parts() -> dict[str, Any]:
        return {
            "scene": {"available": door.port is not None, "reason": door.reason, "url": "/scene/"},
            "simulated_rover": None if rover is None else rover.as_dict(),
        }

    app = assemble(sessions, parts)

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await proxy.close()
        close_scene()

    proxy = SceneProxy(door)
    app.router.lifespan_context = lifespan
    app.include_router(proxy.router)
    app.mount("/", _Page(directory=static or static_folder(), html=True), name="page")
    return app


def _nothing() -> None:
    """There is no scene to close."""


def _open_scene(sessions: Sessions) -> tuple[SceneDoor, Callable[[], None]]:
    try:
        import viser

        from footfall_ui.scene import Scene

        # viser announces an address on stdout that is not the one to open
        with contextlib.redirect_stdout(io.StringIO()):
            server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    except Exception as error:  # whatever it is: the operator can work without the scene
        _log.exception("the 3-D scene could not start")
        return closed_door(f"{type(error).__name__}: {error}"), _nothing
    try:
        drawn = Scene(server)
    except Exception as error:
        _log.exception("the 3-D scene could not start")
        server.stop()
        return closed_door(f"{type(error).__name__}: {error}"), _nothing

    ended = threading.Event()

    def follow() -> None:
        shown = None
        while not ended.wait(FOLLOW_PERIOD):
            live = sessions.current
            if live is not None and live is not shown:
                shown = live
                drawn.follow(live)

    follower = threading.Thread(target=follow, name="scene-follower", daemon=True)
    follower.start()

    def close() -> None:
        ended.set()
        follower.join()
        drawn.close()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()

    return door_of(server), close


class Server(uvicorn.Server):
    """uvicorn that ends its event streams first: an open stream would hold up the shutdown."""

    def __init__(
        self, app: FastAPI, listening: socket.socket, on_ready: Callable[[str], None] = lambda _: None
    ) -> None:
        self._listening = listening
        self._app = app
        self._on_ready = on_ready
        super().__init__(
            uvicorn.Config(
                app,
                log_level="warning",
                ws="websockets-sansio",
                ws_max_size=4 * MAX_BINARY_FRAME,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=5,
            )
        )

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        super().run(sockets or [self._listening])

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_ready(address_of(self._listening))

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._app.state.streams.close()
        await super().shutdown(sockets)


def listen(host: str, port: int) -> socket.socket:
    """A listening socket on loopback. Raises InvalidInput for another host, Conflict where the port is taken."""
    if not is_loopback_name(host):
        raise InvalidInput(
            f"FootFall has no authentication yet, so it listens on {', '.join(LOOPBACK_NAMES)} only, not on {host!r}: "
            "whoever reached it could move the rover. From another computer, use an SSH tunnel",
            host=host,
        )
    if not 0 <= port <= 65535:
        raise InvalidInput("a port is a number from 0 to 65535", port=port)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((host, port))
        made.listen(128)
    except OSError as error:
        made.close()
        raise Conflict(
            f"port {port} of {host} can't be used ({error.strerror}); end the other program, "
            "or choose another port with --port",
            port=port,
        ) from error
    return made


def address_of(listening: socket.socket) -> str:
    """``http://…`` of a listening socket."""
    host, port = listening.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def serve(
    host: str = "127.0.0.1",
    port: int = 8080,
    *,
    folder: Path,
    sample: str | None = "rock-step",
    session: str | None = None,
    sim: bool = True,
    seed: int = 0,
    on_ready: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve until SIGINT or SIGTERM, then end every process that was started.

    sample: open a copy of this sample; session: open this one of the folder instead; both None: open nothing.
    folder: where sessions are kept.
    sim: run a simulated rover in the session's world.  on_ready: called with the address.

    Raises InvalidInput, NotFound and Conflict before anything is started.
    """
    with _interruptible(), contextlib.ExitStack() as stack:
        # the port is claimed before anything slow, so that a taken one shows at once
        listening = stack.enter_context(contextlib.closing(listen(host, port)))
        sessions = stack.enter_context(Sessions(folder))
        if session is not None:
            sessions.open(session)
        elif sample is not None:
            sessions.open_sample(sample)
        rover = None
        if sim:
            link = "ws" + address_of(listening).removeprefix("http") + PATH
            rover = RoverProcess(sessions, link, seed)
            stack.callback(rover.close)
            rover.start()
        Server(create_app(sessions, rover=rover), listening, on_ready).run()


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """SIGTERM unwinds like SIGINT does, so that no child process is left behind."""

    def leave(*_: object) -> None:
        sys.exit(0)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    except KeyboardInterrupt:
        return
    finally:
        signal.signal(signal.SIGTERM, before)
