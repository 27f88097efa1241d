"""viser's page and its WebSocket under ``/scene/`` of the server's own address.

viser listens on a loopback port of its own and answers any page that asks. So that the only way in leads through
this server, where origins are checked, the proxy shows a secret that viser's end demands.
"""

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator
from dataclasses import dataclass
from html import escape
from typing import Any

import httpx
from fastapi import APIRouter, Request, Response, WebSocket
from starlette.responses import HTMLResponse, RedirectResponse, StreamingResponse
from starlette.websockets import WebSocketDisconnect
from viser._messages import ShareUrlRequest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

SECRET_HEADER = "X-FootFall-Scene"
_PASSED_UP = ("accept", "accept-encoding", "if-none-match")
_PASSED_DOWN = ("content-type", "content-encoding", "content-length", "etag")


@dataclass(frozen=True)
class SceneDoor:
    """Where viser listens, and the secret of the proxy; port None and a reason where there is no scene."""

    port: int | None
    secret: str = ""
    reason: str = ""


def closed_door(reason: str) -> SceneDoor:
    """For a server without a scene."""
    return SceneDoor(None, reason=reason)


def door_of(viser_server: Any) -> SceneDoor:
    """The door of a viser server, which from now on drops connections that don't show the secret."""
    secret = secrets.token_urlsafe()
    sockets = viser_server._websock_server

    async def only_through_the_proxy(client: Any) -> None:
        # viser has no public access to the request behind a connection
        connection = sockets._live_connections.get(client.client_id)
        shown = "" if connection is None else connection.request.headers.get(SECRET_HEADER, "")
        if connection is not None and not secrets.compare_digest(shown, secret):
            await connection.close(1008, "use the scene through FootFall's own address")

    sockets.on_client_connect(only_through_the_proxy)
    # a page must not be able to open a tunnel from the internet to this computer
    sockets.unregister_handler(ShareUrlRequest)
    return SceneDoor(viser_server.get_port(), secret)


class SceneProxy:
    """Routes under ``/scene/``; :meth:`close` when the server ends."""

    def __init__(self, door: SceneDoor) -> None:
        self._door = door
        self._client = httpx.AsyncClient(base_url=f"http://127.0.0.1:{door.port or 0}", trust_env=False)
        self.router = APIRouter(include_in_schema=False)
        self.router.add_api_route("/scene", self._to_folder)
        self.router.add_api_route("/scene/{path:path}", self._page)
        # viser's page connects to its own address without the last slash
        self.router.add_api_websocket_route("/scene", self._messages)
        self.router.add_api_websocket_route("/scene/", self._messages)

    async def close(self) -> None:
        """Let go of the connections to viser."""
        await self._client.aclose()

    async def _to_folder(self, request: Request) -> Response:
        return RedirectResponse(request.url.replace(path="/scene/"))

    async def _page(self, path: str, request: Request) -> Response:
        if self._door.port is None:
            return HTMLResponse(_NO_SCENE.format(reason=escape(self._door.reason)), status_code=503)
        headers = {name: request.headers[name] for name in _PASSED_UP if name in request.headers}
        try:
            answer = await self._client.send(
                self._client.build_request("GET", f"/{path}", headers=headers), stream=True
            )
        except httpx.HTTPError as error:
            return HTMLResponse(_NO_SCENE.format(reason=escape(str(error))), status_code=502)
        passed = {name: answer.headers[name] for name in _PASSED_DOWN if name in answer.headers}
        return StreamingResponse(_body(answer), answer.status_code, passed)

    async def _messages(self, socket: WebSocket) -> None:
        if self._door.port is None:
            await socket.close(1013, "the scene could not start")
            return
        try:
            async with connect(
                f"ws://127.0.0.1:{self._door.port}/",
                subprotocols=[Subprotocol(one) for one in socket.scope["subprotocols"]],
                additional_headers={SECRET_HEADER: self._door.secret},
                compression=None,
                max_size=None,
                proxy=None,
            ) as viser:
                await socket.accept(viser.subprotocol)
                await _both_ways(socket, viser)
        except (OSError, TimeoutError, WebSocketException):
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.close(1013, "the scene does not answer")


async def _body(answer: httpx.Response) -> AsyncIterator[bytes]:
    try:
        async for part in answer.aiter_raw():
            yield part
    finally:
        await answer.aclose()


async def _both_ways(socket: WebSocket, viser: ClientConnection) -> None:
    up, down = asyncio.create_task(_up(socket, viser)), asyncio.create_task(_down(socket, viser))
    _, unfinished = await asyncio.wait((up, down), return_when=asyncio.FIRST_COMPLETED)
    for task in unfinished:
        task.cancel()
    await asyncio.gather(up, down, return_exceptions=True)
    if up in unfinished:
        # viser ended it; its page reads the code (1002: versions differ)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close(viser.close_code or 1001, viser.close_reason or "")


async def _up(socket: WebSocket, viser: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            content = message.get("bytes")
            await viser.send(message["text"] if content is None else content)


async def _down(socket: WebSocket, viser: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect, RuntimeError):
        async for message in viser:
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)


_NO_SCENE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>No 3-D scene</title>
<body style="font: 1rem system-ui; margin: 2rem; color: #ddd; background: #222">
<p>The 3-D scene could not start: {reason}</p><p>Everything else works.</p>
</body></html>
"""
