"""Forgetting an area of the map, because the operator does not believe it."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput, InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance, Value, value
from footfall.terrain.dem import Dem

MAX_CORNERS = 1000


@value
class Area(Value):
    """A disc (center (x, y) and radius [m]) or a polygon (corners (x, y) [m], in order), site frame."""

    center: tuple[float, ...] = ()
    radius: float = 0.0
    corners: tuple[tuple[float, ...], ...] = ()

    def check(self) -> None:
        """Raises InvalidInput for what is neither a disc nor a polygon, or both, not finite, or of too many corners."""
        disc, polygon = bool(self.center), bool(self.corners)
        if disc == polygon:
            raise InvalidInput("an area is either a disc, with center and radius, or a polygon with corners")
        if disc and not (len(self.center) == 2 and np.isfinite(self.center).all() and 0 < self.radius < math.inf):
            raise InvalidInput("a disc needs a finite center (x, y) and a radius above zero [m]")
        if polygon:
            if not 3 <= len(self.corners) <= MAX_CORNERS or any(len(corner) != 2 for corner in self.corners):
                raise InvalidInput(f"a polygon needs 3 to {MAX_CORNERS} corners (x, y)", corners=len(self.corners))
            if not np.isfinite(self.corners).all():
                raise InvalidInput("a polygon needs finite corners [m]")


def inside(area: Area, grid: GridGeometry) -> NDArray[np.bool_]:
    """Cells, (rows, cols), whose centre lies in the area; polygons by the even-odd rule."""
    x, y = grid.xs[None, :], grid.ys[:, None]
    if area.center:
        return np.hypot(x - area.center[0], y - area.center[1]) <= area.radius
    within = np.zeros(grid.shape, bool)
    for (x0, y0), (x1, y1) in zip(area.corners, (*area.corners[1:], area.corners[0]), strict=True):
        if y0 != y1:
            crossing = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
            within ^= ((y0 <= y) != (y1 <= y)) & (x < crossing)
    return within


def clear(dem: Dem, area: Area) -> Dem:
    """The map with the area unknown. Raises InvalidTerrain where nothing known lies in it, or nothing would be left."""
    gone = inside(area, dem.geometry)
    known = np.isfinite(dem.heights)
    if not (gone & known).any():
        raise InvalidTerrain("there is no known ground in this area, so there is nothing to clear")
    if not (known & ~gone).any():
        raise InvalidTerrain("the area covers all of the known ground; build or load another terrain instead")
    empty = {"heights": np.nan, "texture": 0, "variance": np.nan, "count": 0, "time": np.nan, "source": 0}
    layers = {
        name: np.where(gone, np.array(none, layer.dtype), layer)
        for name, none in empty.items()
        if (layer := getattr(dem, name)) is not None
    }
    return replace(dem, provenance=Provenance({"dem": dem.digest}, area), **layers)
