"""What draws the scene of a test's server, to look into and to end; and a page of it without a browser."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import msgspec
import viser
from viser._messages import Message, ViewerCameraMessage
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from footfall_ui.viser_door import SceneDoor, open_viser

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
CAMERA = ViewerCameraMessage((1, 0, 0, 0), (0, -5, 3), 1.0, 0.1, 100.0, 480, 640, (0, 0, 0), (0, 0, 1))


class Drawing:
    """viser servers, in the order in which they were opened; as long as ``refused``, none is."""

    def __init__(self) -> None:
        self.servers: list[viser.ViserServer] = []
        self.refused = False

    def open(self) -> tuple[viser.ViserServer, SceneDoor]:
        """In place of ``open_viser``."""
        if self.refused:
            raise OSError("no more ports")
        server, door = open_viser()
        self.servers.append(server)
        return server, door


def drawn(server: viser.ViserServer) -> set[str]:
    """Names of what is drawn for the page that came first; nothing without a page."""
    pages = list(server.get_clients().values())
    return set(pages[0].scene._handle_from_node_name) if pages else set()


@contextmanager
def scene_page(url: str, page: str = "", headers: Mapping[str, str] | None = None) -> Iterator[Connection]:
    """viser's page in the page of that name, as its WebSocket: it has said where it looks from. url: of the server."""
    with connect(
        f"ws{url.removeprefix('http')}/scene?page={page}",
        subprotocols=[PROTOCOL],
        additional_headers=headers,
        proxy=None,
        max_size=None,
        origin=Origin(url),
    ) as socket:
        say(socket, CAMERA)
        yield socket


def say(socket: Connection, message: Message) -> None:
    """As viser's page does."""
    socket.send(msgspec.msgpack.encode(message.as_serializable_dict()))
