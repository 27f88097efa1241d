"""Ground that nobody saw: stripes in the legend's colour of unknown ground, under the holes of the map."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.maps.colors import UNKNOWN_RGB
from footfall.maps.over_imagery import darkened, grid_spacing
from footfall.terrain.dem import Dem
from footfall.terrain.ground.under_holes import under_holes
from footfall_ui.scene.drawable import drawable
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.glb import unlit_glb

TEXELS, STRIPES = 128, 8
"""Of one square of the ground grid, along its side."""
STRIPE, GAP, LINE = 0.8, 0.45, 0.3
"""Brightness of stripes, of what is between them, and of the ground grid's lines."""
NAME = "/unknown"


def pattern() -> NDArray[np.uint8]:
    """One square of the ground grid, (TEXELS, TEXELS, 3): it goes on in its copies beside it."""
    along = np.add.outer(np.arange(TEXELS), np.arange(TEXELS)) * STRIPES / TEXELS
    brightness = np.where(along % 1.0 < 0.5, STRIPE, GAP)
    brightness[0] = brightness[:, 0] = LINE
    return darkened(np.broadcast_to(np.array(UNKNOWN_RGB, np.uint8), (TEXELS, TEXELS, 3)), brightness)


def unknown_glb(dem: Dem) -> bytes | None:
    """The pattern under all holes: its squares are those of the ground grid. None without holes."""
    mesh = under_holes(dem)
    if not len(mesh.triangles):
        return None
    spacing = grid_spacing(dem.geometry.resolution)
    begin = spacing * np.floor(mesh.vertices[:, :2].min(axis=0) / spacing)
    return unlit_glb(mesh, (mesh.vertices[:, :2] - begin) / spacing, pattern())


class UnknownDrawing:
    """Made once for each terrain."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, dem: Dem | None) -> None:
        """None: there is no terrain."""
        digest = "" if dem is None else dem.digest
        if digest == self._of:
            return
        self._of = ""
        names, content = [], None if dem is None else unknown_glb(drawable(dem))
        if content is not None:
            names = [f"{NAME}/{digest}"]
            add = self._server.scene.add_glb
            self._drawn.add(add, names[0], content, cast_shadow=False, receive_shadow=False)
        self._drawn.only(names)
        self._of = digest
