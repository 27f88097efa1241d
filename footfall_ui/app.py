"""The composition root: sessions, API, page, scene and the simulated rover put together, and served."""

import contextlib
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable, Collection, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.routing import Mount

from footfall.api.assemble import assemble
from footfall.api.auth.oidc import SignOn
from footfall.api.door.front import LOOPBACK, Front
from footfall.api.door.limits import LINE_BYTES
from footfall.core.collector import leave_out_what_is_loaded
from footfall.core.errors import InvalidInput, NotFound
from footfall.io.policies import read_policy
from footfall.io.sign_on_file import read_sign_on
from footfall.resources import static_folder
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.session.access.account_stores import account_store, has_accounts, keep_to_owner
from footfall.session.access.accounts import Accounts
from footfall.session.reading import ReadingProcess
from footfall.session.registry import Sessions
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.recorded import recorded
from footfall.telemetry.link import PATH
from footfall.terrain.dem import Dem
from footfall_ui.listening import Tls, address_of, allow_many_files, front_of, listen, require_safe
from footfall_ui.page_files import PageFiles
from footfall_ui.pools import pool_of
from footfall_ui.proxy import SceneProxy
from footfall_ui.rover_process import RoverProcess
from footfall_ui.scene_server import SceneServer
from footfall_ui.sized_lines import SizedLines, sized_lines


def create_app(
    sessions: Sessions,
    *,
    scene: bool = True,
    rover: RoverProcess | None = None,
    accounts: Accounts | None = None,
    front: Front = LOOPBACK,
    sign_on: SignOn | None = None,
) -> FastAPI:
    """The whole application over ``sessions``, which stay the caller's to close.

    scene: draw one; where that fails, the app works without it and says why.
    rover: a simulated rover to report on; starting and closing it is the caller's as well.
    accounts: who may come in, the caller's to close; None: whoever reaches it may do everything.
    front: how it is reached. sign_on: the provider of an organisation's accounts; None: local accounts only.
    """
    drawn = SceneServer(sessions) if scene else None
    proxy = SceneProxy(drawn)

    def parts() -> dict[str, Any]:
        door = proxy.door
        return {
            "scene": {"available": door.port is not None, "reason": door.reason, "url": "/scene/"},
            "simulated_rover": None if rover is None else rover.as_dict(),
        }

    app = assemble(sessions, parts, accounts, front, sign_on_=sign_on)

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await proxy.close()
        if drawn is not None:
            drawn.close()

    app.router.lifespan_context = lifespan
    app.include_router(proxy.router)
    # the page alone: compressed, what the interface answers would tell of secrets in it by its size
    app.mount("/", PageFiles(directory=static_folder(), html=True), name="page")
    # its folders come first: looking through all addresses of the interface takes longer than answering with a file
    app.router.routes[:0] = [
        Mount(f"/{folder.name}", PageFiles(directory=folder)) for folder in static_folder().iterdir() if folder.is_dir()
    ]
    return app


HEAD_WITHIN = 20.0
"""A connection on which no whole head of a request came in this time is closed [s]."""
STUCK_AFTER = 30.0
"""A connection that takes nothing of what waits for it for so long is closed [s]: its memory is others'."""
SWITCH_AFTER = 0.0005
"""How long one thread may hold the interpreter [s]: a stop waits so long for each that works on a request."""
LOOK_AT_CONNECTIONS = 10
"""Every how many ticks of uvicorn, of 0.1 s."""


class Server(uvicorn.Server):
    """uvicorn that ends its event streams first: an open stream would hold up the shutdown.

    And that closes connections on which no request comes: each holds a file, and without files no stop comes in.
    """

    def __init__(
        self,
        app: FastAPI,
        listening: socket.socket,
        on_ready: Callable[[str], None] = lambda _: None,
        tls: Tls | None = None,
    ) -> None:
        self._listening = listening
        self._app = app
        self._on_ready = on_ready
        self._tls = tls
        self._waiting: dict[Any, float] = {}
        self._unread: dict[Any, tuple[int, float]] = {}
        super().__init__(
            uvicorn.Config(
                app,
                log_level="warning",
                log_config=None,
                ws=sized_lines(),
                ws_max_size=LINE_BYTES,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=5,
                # otherwise any program on this computer could say that it asks from elsewhere
                proxy_headers=app.state.front.proxied,
                ssl_certfile=None if tls is None else tls.certificate,
                ssl_keyfile=None if tls is None else tls.key,
            )
        )

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        super().run(sockets or [self._listening])

    async def serve(self, sockets: list[socket.socket] | None = None) -> None:
        before = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_AFTER)
        try:
            await super().serve(sockets)
        finally:
            sys.setswitchinterval(before)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_ready(address_of(self._listening, self._tls is not None))

    async def on_tick(self, counter: int) -> bool:
        if counter % LOOK_AT_CONNECTIONS == 0:
            self._close_what_says_nothing(time.monotonic())
            self._close_what_takes_nothing(time.monotonic())
            self._look_at_lines(self.server_state.connections, time.monotonic())
        return await super().on_tick(counter)

    def _close_what_says_nothing(self, now: float) -> None:
        # of a WebSocket the head has come; its protocol has no cycle of requests
        http: list[Any] = [one for one in self.server_state.connections if hasattr(one, "cycle")]
        idle = [one for one in http if one.cycle is None or one.cycle.response_complete]
        self._waiting = {one: self._waiting.get(one, now) for one in idle}
        for one, since in self._waiting.items():
            if now - since > HEAD_WITHIN:
                one.transport.abort()

    def _close_what_takes_nothing(self, now: float) -> None:
        before, self._unread = self._unread, {}
        for one in tuple(self.server_state.connections):
            transport = one.transport
            if transport is None or not (waiting := transport.get_write_buffer_size()):
                continue
            size, since = before.get(one, (0, now))
            # it shrinks where somebody reads, and is filled again only after that
            self._unread[one] = (waiting, since if waiting == size else now)
            if now - self._unread[one][1] > STUCK_AFTER:
                transport.abort()

    def _look_at_lines(self, connections: Collection[Any], now: float) -> None:
        for one in tuple(connections):
            if isinstance(one, SizedLines):
                one.close_where_slow(now)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._app.state.streams.close()
        await super().shutdown(sockets)


def serve(
    host: str = "127.0.0.1",
    port: int = 8080,
    *,
    folder: Path,
    sample: str | None = "rock-step",
    session: str | None = None,
    sim: bool = True,
    seed: int = 0,
    physics: bool = True,
    on_ready: Callable[[str], None] = lambda _: None,
    accounts: bool = False,
    tls: Tls | None = None,
    behind_tls_proxy: bool = False,
    public_url: str | None = None,
    light_time: LightTime | None = None,
    foxglove: int | None = None,
    workers: int = 2,
    worker_beside: bool = True,
    policy: Path | None = None,
    described: tuple[LeggedRobot, Dem | None] | None = None,
) -> None:
    """Serve until SIGINT or SIGTERM, then end every process that was started.

    sample: open a copy of this sample; session: open this one of the folder instead; both None: open nothing.
    folder: where sessions are kept.
    sim: run a simulated rover in the session's world; physics: one with masses and springs, or a kinematic one.
    seed: of the cameras' noise. on_ready: called with the address.
    accounts: whether not to serve at all without accounts; where the folder has some, they are asked for in any case.
    tls: certificate and key; behind_tls_proxy: a proxy in front has them. public_url: as browsers elsewhere name it.
    light_time: delay made on the way to and from the rover. foxglove: port of a live Foxglove WebSocket; None: none.
    workers: how many jobs at a time on this machine; worker_beside: where jobs go through a database, whether this
    machine takes some. policy: file of a learned table that walks in a closed loop may choose gaits by.
    described: a robot that others described, and its ground where it is known, which a new session is to be about.

    Raises InvalidInput, NotFound and Conflict before anything is started.
    """
    leave_out_what_is_loaded()
    allow_many_files()
    with _interruptible(), contextlib.ExitStack() as stack:
        known = _accounts_of(folder, stack)
        if accounts and known is None:
            raise NotFound(
                f"there are no accounts in {folder}; make one with `footfall accounts add NAME --role admin`"
            )
        if known is not None:
            keep_to_owner(folder)
        safely = {"tls": tls is not None, "behind_tls_proxy": behind_tls_proxy, "public_url": public_url}
        require_safe(host, accounts=known is not None, **safely)
        sign_on = _sign_on_of(folder, known)
        table = None if policy is None else read_policy(policy)
        # the port is claimed before anything slow, so that a taken one shows at once
        listening = stack.enter_context(contextlib.closing(listen(host, port)))
        front = front_of(listening, **safely)
        jobs = stack.enter_context(pool_of(folder, workers, worker_beside))
        reading = stack.enter_context(contextlib.closing(ReadingProcess()))
        recordings = stack.enter_context(contextlib.closing(ReadingProcess(readers=(recorded.__module__,))))
        sessions = stack.enter_context(
            Sessions(folder, jobs, light_time=light_time, read=reading, read_recordings=recordings, policy=table)
        )
        if described is not None:
            robot, dem = described
            live = sessions.create(robot.name, robot)
            if dem is not None:
                live.terrains.load(dem, dem.name)
        elif session is not None:
            sessions.open(session)
        elif sample is not None:
            sessions.open_sample(sample)
        if foxglove is not None:
            # its library is loaded by those alone who ask for it
            from footfall_ui.foxglove_server import FoxgloveServer

            stack.enter_context(contextlib.closing(FoxgloveServer(sessions, foxglove)))
        rover = None
        if sim:
            link = "ws" + address_of(listening, tls is not None).removeprefix("http") + PATH
            token = None if known is None else known.own_rover()
            rover = RoverProcess(sessions, link, seed, physics, token, None if tls is None else tls.certificate)
            stack.callback(rover.close)
            rover.start()
        app = create_app(sessions, rover=rover, accounts=known, front=front, sign_on=sign_on)
        Server(app, listening, on_ready, tls).run()


def _accounts_of(folder: Path, stack: contextlib.ExitStack) -> Accounts | None:
    """The accounts of a folder, open until the stack ends; None where it has none."""
    if not has_accounts(folder):
        return None
    found = stack.enter_context(contextlib.closing(Accounts(account_store(folder))))
    return found if found.everyone() else None


def _sign_on_of(folder: Path, accounts: Accounts | None) -> SignOn | None:
    """The provider that a folder's file names; local accounts stay a way in, also when that can't be reached."""
    settings = read_sign_on(folder)
    if settings is None:
        return None
    if accounts is None:
        raise NotFound(
            f"{folder} names a provider of accounts and has none of its own; first make an admin's with "
            "`footfall accounts add NAME --role admin`"
        )
    if find_spec("joserfc") is None:
        raise InvalidInput("login with a provider needs the extra `oidc`: pip install 'footfall[oidc]'")
    return SignOn(settings)


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
