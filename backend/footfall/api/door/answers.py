"""Large answers go in pieces, each when the one before has gone; of those that nobody fetches only so many are kept."""

from collections.abc import Awaitable, Callable

from starlette.types import Message, Send

from footfall.session.budget import Budget

LARGE = 1 << 20
"""An answer of more bytes is counted while it waits to be fetched."""
PIECE = 64 << 10
"""What is given to the connection at once [bytes]."""


class Answer:
    """One answer on its way to ``client``. refuse: sends another one instead, where there is no room for it."""

    def __init__(self, budget: Budget, client: str, send: Send, refuse: Callable[[], Awaitable[None]]) -> None:
        self._budget, self._client, self._send, self._refuse = budget, client, send, refuse
        self._start: Message | None = None
        self._refused = False

    async def send(self, message: Message) -> None:
        """In the place of the connection's own ``send``."""
        if self._refused:
            return None
        if message["type"] == "http.response.start" and _tells_length(message):
            self._start = message  # until its body is there: it may have to be another one
            return None
        body = message.get("body", b"")
        if message["type"] != "http.response.body" or len(body) <= LARGE:
            await self._begin()
            return await self._send(message)
        if not self._budget.takes_one(self._client, len(body)):
            if self._start is None:
                raise ConnectionError("too much waits to be fetched by this client")
            self._refused = True
            return await self._refuse()
        try:
            await self._begin()
            await self._in_pieces(message, body)
        finally:
            self._budget.give_back(self._client, len(body))

    async def _begin(self) -> None:
        start, self._start = self._start, None
        if start is not None:
            await self._send(start)

    async def _in_pieces(self, message: Message, body: bytes) -> None:
        rest = memoryview(body)
        while len(rest) > PIECE:
            await self._send({"type": "http.response.body", "body": bytes(rest[:PIECE]), "more_body": True})
            rest = rest[PIECE:]
        await self._send({**message, "body": bytes(rest)})


def _tells_length(start: Message) -> bool:
    return any(name.lower() == b"content-length" for name, _ in start["headers"])
