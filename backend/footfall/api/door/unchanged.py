"""Products never change: an answer about one that is named by its digest carries an ETag, and is not sent twice."""

import hashlib
import re

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from footfall.api.access import BASE
from footfall.core.value import SOFTWARE_VERSION

_PRODUCT = re.compile(
    BASE + r"/sessions/[^/]+/(terrains|maps|plans|executions|shifts|body-moves|held-moves|steadiness)/"
    r"[0-9a-f]{32}([./](?!at$).*)?"
)


class Unchanged:
    """ASGI middleware: ETag on what is immutable, and 304 where ``If-None-Match`` names it.

    The tag names address and version of the software, which together decide every byte; the route runs all the same,
    so that what is gone, or not for the one who asks, is refused as ever.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "GET" or not _PRODUCT.fullmatch(scope["path"]):
            return await self.app(scope, receive, send)
        address = f"{SOFTWARE_VERSION} {scope['path']}?".encode() + scope["query_string"]
        tag = f'"{hashlib.sha256(address).hexdigest()[:32]}"'
        given = [one.strip().removeprefix("W/") for one in Headers(scope=scope).get("if-none-match", "").split(",")]
        known, silent = tag in given or "*" in given, False

        async def tell(message: Message) -> None:
            nonlocal silent
            if message["type"] == "http.response.start" and message["status"] == 200:
                kept = [(b"etag", tag.encode()), (b"cache-control", b"private, max-age=31536000, immutable")]
                if known:
                    silent = True
                    message = {**message, "status": 304, "headers": kept}
                else:
                    message = {**message, "headers": [*message["headers"], *kept]}
            elif silent:
                message = {**message, "body": b""}
            await send(message)

        return await self.app(scope, receive, tell)
