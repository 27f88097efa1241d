"""Contour lines on the ground, every fifth of them bolder, and a word on how far apart they are."""

import numpy as np
import viser

from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall.terrain.ground.contours import contour_step, contours
from footfall_ui.scene.drawable import drawable
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.of_session import read

COLOR, OVER = (250, 244, 220), 0.012
"""Light, for colours and images; over the ground [m]."""
BOLD = 5
"""Every so many lines one is bolder."""
THIN, THICK = 1.0, 2.5
"""[pixels]"""
MOST = 120_000
"""Pieces; rougher ground gets fewer lines."""
LINES, BOLDER, TEXT = "/contours/thin", "/contours/bold", "/contours/text"


class ContoursDrawing:
    """Made once for each terrain, then shown and hidden."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""
        self._handles: list[viser.SceneNodeHandle] = []

    def draw(self, live: LiveSession) -> None:
        """As the view has it; the terrain is the session's."""
        asked = live.choices.view.shown.contours and live.state.dem is not None
        if asked and live.state.dem is not None and self._of != live.state.dem:
            self._make(read(live, live.state.dem, Dem))
        if live.state.dem is None:
            self._of, self._handles = "", []
            self._drawn.clear()
        for handle in self._handles:
            handle.visible = asked

    def _make(self, dem: Dem) -> None:
        self._of, self._handles = "", []
        ground = drawable(dem)
        step = contour_step(ground)
        pieces = contours(ground, step)
        while len(pieces) > MOST:
            step *= 2
            pieces = contours(ground, step)
        pieces[..., 2] += OVER
        bold = np.rint((pieces[:, 0, 2] - OVER) / step).astype(np.int64) % BOLD == 0
        names = []
        for name, own, width in ((LINES, pieces[~bold], THIN), (BOLDER, pieces[bold], THICK)):
            if len(own):
                local, middle = near(own)
                add = self._server.scene.add_line_segments
                self._handles.append(
                    self._drawn.add(add, name, local, COLOR, thickness=width, thickness_units="screen", position=middle)
                )
                names.append(name)
        if len(pieces):
            text = f"contour lines every {step:g} m"
            self._handles.append(self._drawn.add(self._server.scene.add_label, TEXT, text, position=pieces[-1, 0]))
            names.append(TEXT)
        self._drawn.only(names)
        self._of = dem.digest
