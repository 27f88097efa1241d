"""viser's page and its WebSocket under ``/scene/`` of the server's own address."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from html import escape
from typing import Annotated

import httpx
from fastapi import APIRouter, Body, Depends, Request, Response, WebSocket
from fastapi.concurrency import run_in_threadpool
from starlette.responses import HTMLResponse, RedirectResponse, StreamingResponse
from starlette.websockets import WebSocketDisconnect
from viser._messages import Message, ViewerCameraMessage
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from footfall.api.auth.roles import authorise
from footfall.api.auth.who import PAGE_HEADER, identity_of, paged
from footfall.core.errors import InvalidInput
from footfall.session.access.identity import Identity, Role
from footfall_ui.scene_policy import scene_policy
from footfall_ui.scene_server import SceneServer
from footfall_ui.viser_door import SECRET_HEADER, SceneDoor, closed_door
from footfall_ui.visitors import THEMES

MOST_PIXELS = 100_000
"""No page shows a scene wider or higher than this."""

_PASSED_UP = ("accept", "accept-encoding", "if-none-match")
_PASSED_DOWN = ("content-type", "content-encoding", "content-length", "etag")


class SceneProxy:
    """Routes under ``/scene/``; :meth:`close` when the server ends."""

    def __init__(self, scene: SceneServer | None) -> None:
        """scene: what is drawn, the caller's to close; None: nothing."""
        self._scene = scene
        self._policy = "" if scene is None else scene_policy()
        # viser is on this machine and not encrypted; the certificates of all authorities would take 20 ms to read
        self._client = httpx.AsyncClient(trust_env=False, verify=False)
        self.router = APIRouter(include_in_schema=False, dependencies=[Depends(authorise)])
        self.router.add_api_route("/scene", self._to_folder)
        self.router.add_api_route("/scene/{path:path}", self._page)
        self.router.add_api_route("/scene/theme", self._wear, methods=["PUT"], status_code=204)
        self.router.add_api_route("/scene/size", self._fit, methods=["PUT"], status_code=204)
        self.router.add_api_route("/scene/moment", self._look_back, methods=["PUT"], status_code=204)
        # viser's page connects to its own address without the last slash
        self.router.add_api_websocket_route("/scene", self._messages)
        self.router.add_api_websocket_route("/scene/", self._messages)

    @property
    def door(self) -> SceneDoor:
        """Where the scene is at present."""
        return closed_door("it was switched off") if self._scene is None else self._scene.door

    async def close(self) -> None:
        """Let go of the connections to viser."""
        await self._client.aclose()

    async def _to_folder(self, request: Request) -> Response:
        return RedirectResponse(f"/scene/?{request.url.query}" if request.url.query else "/scene/")

    async def _page(self, path: str, request: Request) -> Response:
        door = self.door
        if door.port is None:
            return HTMLResponse(_NO_SCENE.format(reason=escape(door.reason)), status_code=503)
        headers = {name: request.headers[name] for name in _PASSED_UP if name in request.headers}
        headers[SECRET_HEADER] = door.secret
        try:
            answer = await self._client.send(
                self._client.build_request("GET", f"http://127.0.0.1:{door.port}/{path}", headers=headers), stream=True
            )
        except httpx.HTTPError as error:
            if isinstance(error, httpx.ConnectError):
                self._gone(door)
            return HTMLResponse(_NO_SCENE.format(reason=escape(str(error))), status_code=502)
        passed = {name: answer.headers[name] for name in _PASSED_DOWN if name in answer.headers}
        passed["content-security-policy"] = self._policy
        return StreamingResponse(_body(answer), answer.status_code, passed)

    async def _wear(self, theme: Annotated[str, Body(embed=True)], request: Request) -> None:
        """The page's sky from now on; where there is no scene, nothing wears it."""
        if theme not in THEMES:
            raise InvalidInput(f"the page has no theme of that name; it has {', '.join(THEMES)}", themes=THEMES)
        self.door.visitors.dress(_page_of(request), theme)

    async def _fit(
        self,
        width: Annotated[float, Body(embed=True, gt=0, le=MOST_PIXELS)],
        height: Annotated[float, Body(embed=True, gt=0, le=MOST_PIXELS)],
        request: Request,
    ) -> None:
        """How large the page shows the scene [px of the page]: labels are arranged for that."""
        self.door.visitors.fit(_page_of(request), width, height)

    async def _look_back(self, event: Annotated[int | None, Body(embed=True)], request: Request) -> None:
        """The page's scene as the session was after that event; null: as it is now."""
        if self._scene is not None:
            await run_in_threadpool(self._scene.look_back, _page_of(request), event)

    async def _messages(self, socket: WebSocket) -> None:
        door = self.door
        if door.port is None:
            await socket.close(1013, "the scene could not start")
            return
        try:
            async with connect(
                f"ws://127.0.0.1:{door.port}/",
                subprotocols=[Subprotocol(one) for one in socket.scope["subprotocols"]],
                additional_headers={SECRET_HEADER: door.secret},
                compression=None,
                max_size=None,
                proxy=None,
            ) as viser:
                await socket.accept(viser.subprotocol)
                who = paged(identity_of(socket), socket.query_params.get("page", ""))
                with door.visitors.entered(viser.local_address[1], who):
                    await _both_ways(socket, viser, who.role >= Role.PLANNER)
        except (OSError, TimeoutError, WebSocketException) as error:
            if isinstance(error, ConnectionRefusedError):
                self._gone(door)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.close(1013, "the scene does not answer")

    def _gone(self, door: SceneDoor) -> None:
        if self._scene is not None:
            self._scene.gone(door)


def _page_of(request: Request) -> Identity:
    return paged(identity_of(request), request.headers.get(PAGE_HEADER, ""))


async def _body(answer: httpx.Response) -> AsyncIterator[bytes]:
    try:
        async for part in answer.aiter_raw():
            yield part
    finally:
        await answer.aclose()


async def _both_ways(socket: WebSocket, viser: ClientConnection, may_click: bool) -> None:
    up, down = asyncio.create_task(_up(socket, viser, may_click)), asyncio.create_task(_down(socket, viser))
    _, unfinished = await asyncio.wait((up, down), return_when=asyncio.FIRST_COMPLETED)
    for task in unfinished:
        task.cancel()
    await asyncio.gather(up, down, return_exceptions=True)
    if up in unfinished:
        # viser ended it; its page reads the code (1002: versions differ)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close(viser.close_code or 1001, viser.close_reason or "")


async def _up(socket: WebSocket, viser: ClientConnection, may_click: bool) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            content = message.get("bytes")  # viser's page sends nothing else
            if content and (may_click or _looks_only(content)):
                await viser.send(content)


def _looks_only(content: bytes) -> bool:
    """Whether a message of viser's page says where it looks from, and nothing that chooses or changes something."""
    try:
        return isinstance(Message.deserialize(content), ViewerCameraMessage)
    except Exception:  # whatever it is that can't be read
        return False


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
