"""WebSockets whose messages may be as large as what their address is for, decided before anything of one is kept.

Of a message that has not ended only so much is held, and only while more of it comes.
"""

from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from footfall.api.door.body_limits import FRAME_BYTES
from footfall.api.door.guard import PATIENCE, SLOWEST
from footfall.api.door.limits import TOO_BIG
from footfall.session.budget import Budget
from footfall.telemetry.link import PATH

SCENE_BYTES = 4 << 20
"""Of the scene's page: pictures of what it draws are the most that it sends."""
MOST_PIECES = 1024
"""Frames of one message."""
UNENDED_OF_ONE, UNENDED_IN_ALL = 4 * SCENE_BYTES, 8 * SCENE_BYTES
"""Held of messages to scenes that have not ended: of one client, and of all together [bytes]."""

_SCENES = ("/scene", "/scene/")
_LARGER = {PATH: FRAME_BYTES} | dict.fromkeys(_SCENES, SCENE_BYTES)


class SizedLines(WebSocketsSansIOProtocol):
    """uvicorn's protocol, with the limit of each address; elsewhere that of its configuration.

    A rover's messages have no budget: there is one rover, which others must not cut off. Nor have small ones: of these,
    each connection holds one.
    """

    budget = Budget(UNENDED_IN_ALL, UNENDED_OF_ONE)
    """Of one server; see :func:`sized_lines`."""
    _of_scene = False
    _counted = 0  # of it, by this connection
    _waited: tuple[float, float, int] | None = None  # since when a message has not ended, when more came, how much

    def handle_connect(self, event: Any) -> None:
        """The head of the request is there, and says which address it is for."""
        path = event.path.partition("?")[0]
        self.conn.max_message_size = _LARGER.get(path, self.config.ws_max_size)
        self._of_scene = path in _SCENES
        super().handle_connect(event)

    def data_received(self, data: bytes) -> None:
        """What came whole is heard, also where what follows it can't be read: it may be a stop."""
        self.conn.receive_data(data)
        self.handle_events()
        if self.conn.parser_exc is not None and not self.close_sent:
            self.handle_parser_exception()
        if self._of_scene and not self._count(self.unended):
            self._give_up("too many messages to scenes have not ended; end one before the next begins")

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio.Protocol."""
        self._count(0)
        super().connection_lost(exc)

    def handle_cont(self, event: Any) -> None:
        """A message comes in pieces, which may be empty."""
        if self.close_sent:
            return
        if len(self.frames) >= MOST_PIECES:
            self._give_up(f"a message comes in at most {MOST_PIECES} frames")
            return
        super().handle_cont(event)

    def send_receive_event_to_app(self) -> None:
        """A message is whole."""
        self._waited = None
        super().send_receive_event_to_app()

    @property
    def unended(self) -> int:
        """What is held of a message that has not ended [bytes]."""
        return 0 if self.close_sent else len(self.conn.reader.buffer) + sum(map(len, self.frames))

    def close_where_slow(self, now: float) -> None:
        """Give up a message that does not go on, or too slowly, as bodies are. Call it now and then."""
        size = self.unended
        if not size or self.read_paused or not self.handshake_complete:
            self._waited = None
            return
        since, more_at, before = self._waited or (now, now, size)
        more_at = more_at if size == before else now
        self._waited = since, more_at, size
        waited = now - since
        if now - more_at > PATIENCE or (waited > PATIENCE and size < waited * SLOWEST):
            self._give_up(f"in {waited:z.0f} s {size} bytes of a message came, and not its end; send it faster")

    def _count(self, size: int) -> bool:
        """Let the budget know how much is held now; whether there was room."""
        client = self.client[0] if self.client else ""
        if self._counted:
            self.budget.give_back(client, self._counted)
        fits = size == 0 or self.budget.takes(client, size)
        self._counted = size if fits else 0
        return fits

    def _give_up(self, reason: str) -> None:
        if self.close_sent:
            return
        self.conn.fail(TOO_BIG, reason)
        self.handle_parser_exception()
        self.frames = []
        self._count(0)


def sized_lines() -> type[SizedLines]:
    """The protocol of one server, with a budget of its own."""
    return type("SizedLinesOfOneServer", (SizedLines,), {"budget": Budget(UNENDED_IN_ALL, UNENDED_OF_ONE)})
