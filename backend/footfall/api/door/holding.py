"""How many bytes of requests and answers are held at once, of each client and in all. A stop needs none of it."""

import asyncio
import re

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from footfall.api.access import BASE, STOP
from footfall.api.door.answers import Answer
from footfall.api.door.body_limits import JSON_BYTES, body_limit
from footfall.api.door.problems import Json, problem
from footfall.session.budget import Budget

OF_ONE, IN_ALL = 128 << 20, 256 << 20
"""Bodies that are held, and likewise answers that wait to be fetched: of one client, and of all together [bytes]."""
RETRY_AFTER = 5
"""Who was refused may ask again after so long [s]."""


MADE_AT_ONCE = 2
"""Files and camera images to fetch that are made at once: each has a processor to itself, and a stop needs one."""

_FILE = re.compile(BASE + r"/.*(\.(npz|tif|asc|ply|obj|stl|off|zip|html)|/images/[^/]+/(left|right)\.png)")


class _Full(HTTPException):
    """There is no room for more of the body; routes let it pass as what it is."""

    def __init__(self, text: str) -> None:
        super().__init__(503, text, {"Retry-After": str(RETRY_AFTER)})


class Holding:
    """ASGI middleware. bodies: what is held of requests with files; answers: of large answers that nobody fetched yet.

    Small bodies are not counted: of these, each connection holds one.
    """

    def __init__(self, app: ASGIApp, max_body: int, of_one: int = OF_ONE, in_all: int = IN_ALL) -> None:
        self.app = app
        self._max_body = max_body
        self.bodies, self.answers = Budget(in_all, of_one), Budget(in_all, of_one)
        self._making = asyncio.Semaphore(MADE_AT_ONCE)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] == STOP:
            return await self.app(scope, receive, send)
        if scope["method"] != "GET" or not _FILE.fullmatch(scope["path"]):
            return await self._held(scope, receive, send)
        making = True
        await self._making.acquire()

        def made() -> None:
            nonlocal making
            if making:
                making = False
                self._making.release()

        async def send_made(message: Message) -> None:
            made()  # fetching it may take as long as it likes
            await send(message)

        try:
            await self._held(scope, receive, send_made)
        finally:
            made()

    async def _held(self, scope: Scope, receive: Receive, send: Send) -> None:
        # behind a proxy that says who asks, the server has put that address here
        client, held, started = (scope.get("client") or ("",))[0], 0, False
        counted = body_limit(scope["path"], self._max_body) > JSON_BYTES

        async def receive_counted() -> Message:
            nonlocal held
            message = await receive()
            size = len(message.get("body", b"")) if counted else 0
            if size and not self.bodies.takes(client, size):
                raise _Full(
                    f"requests of {self.bodies.of_one >> 20} MiB by one client, and of {self.bodies.in_all >> 20} MiB "
                    "in all, are worked on at once; send it again when others have ended"
                )
            held += size
            return message

        async def send_noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        async def refuse() -> None:
            text = "too many large answers wait to be fetched; fetch them one after the other"
            await _busy(text)(scope, receive, send_noted)

        answer = Answer(self.answers, client, send_noted, refuse)
        try:
            await self.app(scope, receive_counted, answer.send)
        except _Full as full:
            if started:
                raise
            await _busy(full.detail)(scope, receive, send)
        finally:
            if held:
                self.bodies.give_back(client, held)


def _busy(text: str) -> Json:
    answer = problem("busy", 503, text)
    answer.headers["Retry-After"] = str(RETRY_AFTER)
    return answer
