"""What is around the known ground: what nobody saw, how large and which way things are, and the sky."""

import viser

from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall_ui.scene.bearings import BearingsDrawing
from footfall_ui.scene.of_session import read
from footfall_ui.scene.sky import SkyDrawing
from footfall_ui.scene.unknown import UnknownDrawing


class AroundDrawing:
    """All of it follows the terrain alone."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._drawings = (UnknownDrawing(server), BearingsDrawing(server), SkyDrawing(server))

    def draw(self, live: LiveSession) -> None:
        """As the session's terrain has it."""
        dem = read(live, live.state.dem, Dem) if live.state.dem else None
        for drawing in self._drawings:
            drawing.show(dem)
