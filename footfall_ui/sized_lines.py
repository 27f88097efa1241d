"""WebSockets whose messages may be as large as what their address is for, decided before anything of one is kept."""

from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from footfall.api.door.body_limits import FRAME_BYTES
from footfall.api.door.limits import TOO_BIG
from footfall.telemetry.link import PATH

SCENE_BYTES = 4 << 20
"""Of the scene's page: pictures of what it draws are the most that it sends."""
MOST_PIECES = 1024
"""Frames of one message."""

_LARGER = {PATH: FRAME_BYTES, "/scene": SCENE_BYTES, "/scene/": SCENE_BYTES}


class SizedLines(WebSocketsSansIOProtocol):
    """uvicorn's protocol, with the limit of each address; elsewhere that of its configuration."""

    def handle_connect(self, event: Any) -> None:
        """The head of the request is there, and says which address it is for."""
        path = event.path.partition("?")[0]
        self.conn.max_message_size = _LARGER.get(path, self.config.ws_max_size)
        super().handle_connect(event)

    def data_received(self, data: bytes) -> None:
        """What came whole is heard, also where what follows it can't be read: it may be a stop."""
        self.conn.receive_data(data)
        self.handle_events()
        if self.conn.parser_exc is not None and not self.close_sent:
            self.handle_parser_exception()

    def handle_cont(self, event: Any) -> None:
        """A message comes in pieces, which may be empty."""
        if self.close_sent:
            return
        if len(self.frames) >= MOST_PIECES:
            self.conn.fail(TOO_BIG, f"a message comes in at most {MOST_PIECES} frames")
            self.handle_parser_exception()
            return
        super().handle_cont(event)
