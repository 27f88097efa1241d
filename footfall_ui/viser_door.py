"""viser, listening on a port that answers nobody but the proxy.

viser listens on a loopback port of its own and would answer anybody on this computer. So that the only way in leads
through this server, where origins and logins are checked, the proxy shows a secret with every request, and the port
refuses those without it, pages and WebSockets alike.
"""

import contextlib
import io
import secrets
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

import httpx
import viser
import websockets.asyncio.server
from viser._messages import ShareUrlRequest
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request

from footfall_ui.visitors import Visitors

SECRET_HEADER = "X-FootFall-Scene"

_replacing = threading.Lock()


@dataclass(frozen=True)
class SceneDoor:
    """Where viser listens, the secret of the proxy, who comes in; port None and a reason where there is no scene."""

    port: int | None
    secret: str = ""
    reason: str = ""
    visitors: Visitors = field(default_factory=Visitors)


def closed_door(reason: str) -> SceneDoor:
    """For a server without a scene."""
    return SceneDoor(None, reason=reason)


def open_viser() -> tuple[viser.ViserServer, SceneDoor]:
    """A viser server on a free port of loopback that refuses (403) every request without the door's secret.

    viser passes its own request handler on to ``websockets``, and offers no place to put another one in front of it. So
    the function that it starts listening with is replaced while it does; whether that worked is asked of the port.
    Raises OSError where viser does not start, or answers without the secret.
    """
    secret = secrets.token_urlsafe()
    # viser announces an address on stdout that is not the one to open
    with contextlib.redirect_stdout(io.StringIO()), _listening_behind(secret):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    port = server.get_port()
    if httpx.get(f"http://127.0.0.1:{port}/", trust_env=False).status_code != 403:
        server.stop()
        raise OSError("viser's own port answers without the secret of the proxy")
    # a page must not be able to open a tunnel from the internet to this computer
    server._websock_server.unregister_handler(ShareUrlRequest)
    return server, SceneDoor(port, secret)


@contextlib.contextmanager
def _listening_behind(secret: str) -> Iterator[None]:
    """While this lasts, whatever viser listens with demands ``secret``."""
    original = websockets.asyncio.server.serve

    def serve(*args: Any, process_request: Any, **options: Any) -> Any:
        def demand(connection: ServerConnection, request: Request) -> Any:
            shown = request.headers.get_all(SECRET_HEADER)
            if len(shown) != 1 or not secrets.compare_digest(shown[0].encode(), secret.encode()):
                return connection.respond(HTTPStatus.FORBIDDEN, "use the scene through FootFall's own address\n")
            return process_request(connection, request)

        return original(*args, process_request=demand, **options)

    with _replacing:
        websockets.asyncio.server.serve = serve  # type: ignore[assignment]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = original
