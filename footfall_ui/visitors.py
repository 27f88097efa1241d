"""Who sits at which of viser's pages: the proxy knows who asks, viser only numbers its connections."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import viser

from footfall.session.access.identity import LOCAL, Identity

PAGE = "scene"
"""What a scene is called where acts name their page, and it does not say which page it is in."""


class Visitors:
    """Identities by the port that the proxy's connection to viser comes from."""

    def __init__(self) -> None:
        self._by_port: dict[int, Identity] = {}

    @contextmanager
    def entered(self, port: int, who: Identity) -> Iterator[None]:
        """While that connection lasts."""
        self._by_port[port] = who if who.page else replace(who, page=PAGE)
        try:
            yield
        finally:
            del self._by_port[port]

    def of(self, server: viser.ViserServer, client: int | None) -> Identity:
        """Whose page has this number; nobody in particular where its connection has gone."""
        connection = None if client is None else server._websock_server._live_connections.get(client)
        port = None if connection is None else connection.remote_address[1]
        return self._by_port.get(port, replace(LOCAL, page=PAGE)) if port is not None else replace(LOCAL, page=PAGE)
