"""Terrain as collision checks shall see it: raised, and with a buffer around what stands. Never changes to the map."""

import math
from dataclasses import replace

import cv2
import numpy as np

from footfall.core.errors import InvalidTerrain
from footfall.core.value import Provenance, Value, value
from footfall.terrain.dem import Dem

MAX_BUFFER_CELLS = 200
"""Wider buffers are refused: they would leave nothing of the ground's shape."""


@value
class CollisionView(Value):
    """How a terrain is seen by collision checks. raise_by: heights go up by this [m]; buffer: radius [m]."""

    raise_by: float = 0.15
    buffer: float = 0.0

    def check(self) -> None:
        """Raises InvalidTerrain for a raise_by or buffer that is negative or not finite."""
        if not (0 <= self.raise_by < math.inf and 0 <= self.buffer < math.inf):
            raise InvalidTerrain("raise_by and buffer need numbers of at least zero [m]")


def collision_view(dem: Dem, view: CollisionView | None = None) -> Dem:
    """The terrain, first grown by the buffer, then raised; the map stays as it is."""
    view = view or CollisionView()
    heights = _grown(dem, view.buffer) + np.float32(view.raise_by)
    name = f"{dem.name}, raised by {view.raise_by:g} m, buffer {view.buffer:g} m"
    return replace(dem, heights=heights, name=name, provenance=Provenance({"dem": dem.digest}, view))


def _grown(dem: Dem, radius: float) -> np.ndarray:
    """Each known cell takes the highest known height within ``radius`` [m]: dilation with a flat disc (J. Serra, 1982).

    Unknown cells stay unknown: a buffer is no knowledge of ground that nobody saw.
    """
    cells = int(radius / dem.geometry.resolution + 1e-6)
    if cells == 0:
        return dem.heights
    if cells > MAX_BUFFER_CELLS:
        raise InvalidTerrain(f"a buffer of {radius:g} m is more than {MAX_BUFFER_CELLS} cells of this terrain")
    reach = np.arange(-cells, cells + 1)
    disc = np.hypot(*np.meshgrid(reach, reach)) * dem.geometry.resolution <= radius + 1e-9
    known = np.isfinite(dem.heights)
    highest = cv2.dilate(
        np.where(known, dem.heights, np.float32(-np.inf)),
        disc.astype(np.uint8),
        borderType=cv2.BORDER_CONSTANT,
        borderValue=-math.inf,
    )
    return np.where(known, highest, np.float32(np.nan)).astype(np.float32)
