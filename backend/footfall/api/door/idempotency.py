"""Idempotency-Key on POST: the same key and request again get the first answer again, and nothing is done twice.

Keys are kept in memory for the last thousand requests; they do not outlive the server.
"""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass, field

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from footfall.api.auth.who import IDENTITY
from footfall.api.door.problems import problem

MOST_ANSWERS = 1000
LONGEST_KEY = 200


@dataclass
class _Answer:
    request: str
    messages: list[Message] = field(default_factory=list)
    complete: bool = False


class Idempotency:
    """ASGI middleware; ``exempt`` are path endings that always run: stop is never held back, a cookie never kept."""

    def __init__(self, app: ASGIApp, exempt: tuple[str, ...] = ("/stop", "/login")) -> None:
        self.app = app
        self.exempt = exempt
        self._answers: OrderedDict[tuple[str, str, str], _Answer] = OrderedDict()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        key = Headers(scope=scope).get("idempotency-key") if scope["type"] == "http" else None
        if key is None or scope["method"] != "POST" or scope["path"].endswith(self.exempt):
            return await self.app(scope, receive, send)
        if not 0 < len(key) <= LONGEST_KEY:
            text = f"an Idempotency-Key needs 1 to {LONGEST_KEY} characters"
            return await problem("invalid-input", 422, text)(scope, receive, send)
        body = await _read(receive)
        if body is None:
            return None  # whoever sent it is gone
        # nobody may read another one's answer by its key
        place = (scope[IDENTITY].name if scope[IDENTITY] else "", scope["path"], key)
        request = hashlib.sha256(scope["query_string"] + b"\0" + body).hexdigest()
        known = self._answers.get(place)
        if known is not None:
            return await _again(known, request)(scope, receive, send)

        answer = self._answers[place] = _Answer(request)
        if (surplus := len(self._answers) - MOST_ANSWERS) > 0:
            # what is still being worked on must not be begun again
            ended = [one for one, kept in self._answers.items() if kept.complete]
            for oldest in ended[:surplus]:
                del self._answers[oldest]

        async def record(message: Message) -> None:
            answer.messages.append(message)
            await send(message)

        try:
            await self.app(scope, _replay_body(body, receive), record)
        finally:
            start = next((m for m in answer.messages if m["type"] == "http.response.start"), None)
            if start is None or start["status"] >= 500:
                # nothing was decided: the client may try the same key again
                self._answers.pop(place, None)
            else:
                answer.complete = True


def _again(answer: _Answer, request: str) -> ASGIApp:
    if answer.request != request:
        return problem("idempotency-key-reused", 422, "this Idempotency-Key came with a different request before")
    if not answer.complete:
        return problem("conflict", 409, "the first request with this Idempotency-Key is still being worked on")

    async def resend(scope: Scope, receive: Receive, send: Send) -> None:
        for message in answer.messages:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], (b"idempotent-replayed", b"true")]}
            await send(message)

    return resend


async def _read(receive: Receive) -> bytes | None:
    """The whole body; None where it was cut off: half a request is none."""
    parts: list[bytes] = []
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return None
        parts.append(message.get("body", b""))
        if not message.get("more_body", False):
            return b"".join(parts)


def _replay_body(body: bytes, receive: Receive) -> Receive:
    sent = False

    async def again() -> Message:
        nonlocal sent
        if sent:
            return await receive()
        sent = True
        return {"type": "http.request", "body": body, "more_body": False}

    return again
