"""A FootFall server for tests: a real uvicorn on a free port, in a thread of the test's process."""

import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.routing import WebSocketRoute

from footfall.api.auth.oidc import SignOn
from footfall.session.access.accounts import Accounts
from footfall.session.registry import Sessions
from footfall.telemetry.link import PATH
from footfall_ui.app import Server, create_app
from footfall_ui.listening import address_of, listen
from footfall_ui.rover_process import RoverProcess
from tests.support.forked_rovers import ForkedRoverProcess
from tests.support.kept_workers import KeptWorkers, kept_reading
from tests.support.waiting import BOUND, joined, until


@dataclass(frozen=True)
class Running:
    """A server that answers on ``url``."""

    url: str
    sessions: Sessions
    rover: RoverProcess
    app: FastAPI

    @property
    def websockets(self) -> list[str]:
        """Addresses of everything here that takes a WebSocket, as the app's routes have them."""
        routes = [one for one in iter_route_contexts(self.app.routes) if isinstance(one.original_route, WebSocketRoute)]
        return [f"ws{self.url.removeprefix('http')}{one.path}".format(session="current") for one in routes]

    @property
    def api(self) -> str:
        return f"{self.url}/api/v1"

    def client(self) -> httpx.Client:
        """A client of the REST interface."""
        # nothing is encrypted here, and reading the certificates of all authorities takes 20 ms
        return httpx.Client(base_url=self.api, timeout=BOUND, trust_env=False, verify=False)

    def until_rover_left(self) -> None:
        """Wait until the link is free for another rover; the session has heard of it a moment before."""
        with self.client() as client:
            until(lambda: not client.get("/info").json()["rover_link"]["linked"], "the end of an earlier link")


@contextmanager
def running_server(
    folder: Path,
    *,
    scene: bool = False,
    prepare: Callable[[Sessions], Any] | None = None,
    port: int = 0,
    accounts: Accounts | None = None,
    sign_on: SignOn | None = None,
    physics: bool = False,
) -> Iterator[Running]:
    """Serve sessions kept in ``folder``; ``prepare`` may open one first. ``.rover.start()`` starts a rover.

    accounts: who may come in; None: everybody. sign_on: the provider of other accounts.
    physics: of that rover; a kinematic one answers the same on a busy machine.
    """
    with (
        closing(listen("127.0.0.1", port)) as listening,
        Sessions(folder, KeptWorkers(), read=kept_reading()) as sessions,
    ):
        if prepare is not None:
            prepare(sessions)
        url = address_of(listening)
        token = None if accounts is None else accounts.own_rover()
        rover = ForkedRoverProcess(sessions, f"ws{url.removeprefix('http')}{PATH}", physics=physics, token=token)
        ready = threading.Event()
        app = create_app(sessions, scene=scene, rover=rover, accounts=accounts, sign_on=sign_on)
        server = Server(app, listening, lambda _: ready.set())
        thread = threading.Thread(target=server.run, name="server")
        thread.start()
        try:
            if not ready.wait(BOUND):
                raise RuntimeError(f"the server did not start within {BOUND:.0f} s")
            yield Running(url, sessions, rover, app)
        finally:
            rover.close()
            server.should_exit = True
            joined(thread)
