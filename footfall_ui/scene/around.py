"""What is around the known ground: what nobody saw, how large and which way things are, and the sky."""

from collections.abc import Callable

import viser

from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall_ui.scene.bearings import BearingsDrawing
from footfall_ui.scene.of_session import read
from footfall_ui.scene.sky import SkyDrawing
from footfall_ui.scene.unknown import UnknownDrawing


class AroundDrawing:
    """All of it follows the terrain; the sky, the page's theme too."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, theme: Callable[[], str]) -> None:
        """theme: what the page wears, a key of SKIES."""
        self._drawings = (UnknownDrawing(server), BearingsDrawing(server))
        self._sky, self._theme = SkyDrawing(server), theme

    def draw(self, live: LiveSession) -> None:
        """As the session's terrain has it."""
        dem = read(live, live.state.dem, Dem) if live.state.dem else None
        for drawing in self._drawings:
            drawing.show(dem)
        self._sky.show(dem, self._theme())
