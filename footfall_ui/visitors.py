"""Who sits at which of viser's pages, in which theme, how large it shows the scene: the proxy knows who asks, viser
only numbers its connections.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeVar

import viser

from footfall.session.access.identity import LOCAL, Identity

_T = TypeVar("_T")

PAGE = "scene"
"""What a scene is called where acts name their page, and it does not say which page it is in."""


THEMES = ("dark", "light", "sunlight")
"""Of the page (static/js/themes.js); the first is worn where none was named."""
MOST_KEPT = 200
"""Pages whose theme and size are kept; of more, the one that said so longest ago is forgotten."""


class Visitors:
    """Identities by the port that the proxy's connection to viser comes from; themes and sizes by seat. Thread-safe."""

    def __init__(self) -> None:
        self._by_port: dict[int, Identity] = {}
        self._lock = threading.Lock()
        self._themes: OrderedDict[str, str] = OrderedDict()
        self._sizes: OrderedDict[str, tuple[float, float]] = OrderedDict()
        self._heard: list[tuple[str, Callable[[], None]]] = []

    def dress(self, who: Identity, theme: str) -> None:
        """A page wears this theme from now on."""
        self._say(self._themes, who, theme, THEMES[0])

    def fit(self, who: Identity, width: float, height: float) -> None:
        """A page shows its scene so large from now on [px of the page, whatever the screen's or viser's are]."""
        self._say(self._sizes, who, (width, height), None)

    def size_of(self, who: Identity | None) -> tuple[float, float] | None:
        """How wide and high a page shows its scene [px]; None where it has not said so."""
        with self._lock:
            return None if who is None else self._sizes.get(who.seat)

    def theme_of(self, who: Identity | None) -> str:
        """The theme of a page; the first one of a page that named none, or of nobody in particular."""
        with self._lock:
            return THEMES[0] if who is None else self._themes.get(who.seat, THEMES[0])

    def listen(self, who: Identity | None, heard: Callable[[], None]) -> Callable[[], None]:
        """Hear when that page wears another theme or has another size, None: never; what is returned ends that."""
        if who is None:
            return lambda: None
        ear = (who.seat, heard)
        with self._lock:
            self._heard.append(ear)

        def unlisten() -> None:
            with self._lock:
                self._heard = [one for one in self._heard if one is not ear]

        return unlisten

    def _say(self, kept: OrderedDict[str, _T], who: Identity, said: _T, unsaid: _T | None) -> None:
        with self._lock:
            before = kept.get(who.seat, unsaid)
            kept[who.seat] = said
            kept.move_to_end(who.seat)
            if len(kept) > MOST_KEPT:
                kept.popitem(last=False)
            heard = [tell for seat, tell in self._heard if seat == who.seat and said != before]
        for tell in heard:
            tell()

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
