"""viser, listening on a port that answers nobody but the proxy.

viser listens on a loopback port of its own and would answer anybody on this computer. So that the only way in leads
through this server, where origins and logins are checked, the proxy shows a secret with every request, and the port
refuses those without it, pages and WebSockets alike.
"""

import contextlib
import io
import secrets
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

import httpx
import viser
import websockets.asyncio.server
from viser._messages import ShareUrlRequest
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request

from footfall.core.errors import Conflict
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

    def has_secret(request: Request, port: int) -> bool:
        shown = request.headers.get_all(SECRET_HEADER)
        return len(shown) == 1 and secrets.compare_digest(shown[0].encode(), secret.encode())

    server = _open(0, has_secret, {})
    return server, SceneDoor(server.get_port(), secret)


def open_on_this_computer(port: int) -> viser.ViserServer:
    """A viser server on a port of loopback for browsers of this computer; 0: a free one.

    Pages of other origins are refused (403), also where their name leads to this computer. Raises Conflict where the
    port is taken, OSError where viser does not start, or answers other pages.
    """
    with contextlib.closing(socket.socket(socket.AF_INET)) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind(("127.0.0.1", port))
        except OSError as error:
            raise Conflict(f"port {port} can't be had ({error.strerror}); --port 0 takes a free one") from None
    return _open(port, _is_of_this_computer, {"Host": "other.example"})


def _is_of_this_computer(request: Request, port: int) -> bool:
    """Whether a request names this computer, and its page, if any, comes from here."""
    names = [f"{name}:{port}" for name in ("127.0.0.1", "localhost")]
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    return len(hosts) == 1 and hosts[0] in names and origins in ([], [f"http://{hosts[0]}"])


def _open(port: int, allowed: Callable[[Request, int], bool], refused: dict[str, str]) -> viser.ViserServer:
    """refused: headers of a request that must not be answered, which is asked of the port itself."""
    # viser announces an address on stdout that is not the one to open
    with contextlib.redirect_stdout(io.StringIO()), _listening_behind(allowed):
        server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
    asked = httpx.get(f"http://127.0.0.1:{server.get_port()}/", headers=refused, trust_env=False, verify=False)
    if asked.status_code != 403:
        server.stop()
        raise OSError("viser's own port answers requests that it must refuse")
    # a page must not be able to open a tunnel from the internet to this computer
    server._websock_server.unregister_handler(ShareUrlRequest)
    return server


@contextlib.contextmanager
def _listening_behind(allowed: Callable[[Request, int], bool]) -> Iterator[None]:
    """While this lasts, whatever viser listens with answers only the requests that are allowed on its port."""
    original = websockets.asyncio.server.serve

    def serve(*args: Any, process_request: Any, **options: Any) -> Any:
        def demand(connection: ServerConnection, request: Request) -> Any:
            if not allowed(request, connection.local_address[1]):
                return connection.respond(HTTPStatus.FORBIDDEN, "use the scene through FootFall's own address\n")
            return process_request(connection, request)

        return original(*args, process_request=demand, **options)

    with _replacing:
        websockets.asyncio.server.serve = serve  # type: ignore[assignment]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = original
