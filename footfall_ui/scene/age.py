"""How old the ground is, as hatching over whatever layer it shows: the older, the denser."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.age import BANDS, age_bands
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.of_session import read

SPACING = 0.075
"""Between the lines on the oldest ground [m]; twice and four times as much on that of the bands before."""
PIECE = 0.12
"""Length of the pieces of a line [m]: dark and light by turns, to be seen on any layer."""
OVER = 0.015
"""Over the ground [m]."""
MOST = 60_000
"""Pieces; a larger terrain gets wider hatching."""
TONES = ((20, 24, 32), (240, 240, 240))
NAME = "/age"


def hatching(dem: Dem) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Pieces of diagonal lines on the ground (n, 2, 3) [m], and their colours (n, 2, 3).

    Every fourth line is drawn on ground older than the first of BANDS, every second on older than the second, all on
    older than the last.
    """
    every, stride = (max(1, round(length * np.sqrt(2) / dem.geometry.resolution)) for length in (SPACING, PIECE / 2))
    pieces = _pieces(dem, every, stride)
    while len(pieces) > MOST:
        every, stride = 2 * every, 2 * stride
        pieces = _pieces(dem, every, stride)
    rows, cols = pieces[:, 0], pieces[:, 1]
    begin, end = _points(dem, rows, cols), _points(dem, rows + stride, cols - stride)
    tones = np.array(TONES, np.uint8)[(rows // stride) % 2]
    return np.stack([begin, end], axis=1), np.repeat(tones[:, None], 2, axis=1)


def _pieces(dem: Dem, every: int, stride: int) -> NDArray[np.int64]:
    """First cells (n, 2), row and column; the other end lies ``stride`` cells to the north-west."""
    bands = age_bands(dem)
    rows, cols = np.nonzero(bands[: dem.geometry.rows - stride] > 0)
    on_line = ((rows + cols) % every == 0) & (rows % stride == 0) & (cols >= stride)
    rows, cols = rows[on_line], cols[on_line]
    band = np.minimum(bands[rows, cols], bands[rows + stride, cols - stride])
    apart = 1 << (len(BANDS) - np.maximum(band, 1))  # every fourth, every second, every line
    drawn = (band > 0) & (((rows + cols) // every) % apart == 0)
    return np.column_stack([rows[drawn], cols[drawn]])


def _points(dem: Dem, rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[np.float64]:
    grid = dem.geometry
    return np.column_stack([grid.xs[cols], grid.ys[rows], dem.heights[rows, cols].astype(float) + OVER])


class AgeDrawing:
    """Made once for each terrain, then shown and hidden."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""
        self._handle: viser.SceneNodeHandle | None = None

    def draw(self, live: LiveSession) -> None:
        """As the view has it."""
        if live.state.dem is None:
            self._forget()
        elif live.choices.view.shown.age:
            self._show(read(live, live.state.dem, Dem))
        elif self._handle is not None:
            self._handle.visible = False

    def _show(self, dem: Dem) -> None:
        if self._of != dem.digest:
            self._forget()
            segments, colors = hatching(dem)
            if len(segments):
                local, middle = near(segments)
                self._handle = self._drawn.add(
                    self._server.scene.add_line_segments,
                    NAME,
                    local,
                    colors,
                    thickness=1.5,
                    thickness_units="screen",
                    position=middle,
                )
            self._of = dem.digest
        elif self._handle is not None:
            self._handle.visible = True

    def _forget(self) -> None:
        """Take it away: there is no terrain, or another."""
        self._of, self._handle = "", None
        self._drawn.clear()
