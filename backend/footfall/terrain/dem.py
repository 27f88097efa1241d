"""The digital elevation map: heights on a grid, unknown where nothing was seen."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance, Value, value

MAX_CELLS = 16_000_000
"""Largest accepted map: 4000 × 4000 cells (64 MB of heights)."""


@value
class Dem(Value):
    """Heights at cell centres of a grid in the site frame.

    heights: (rows, cols) float32 [m], row 0 south; NaN = unknown.
    geometry: where the cells lie.
    texture: (rows, cols) uint8 grey seen from above, or None; 0 where unknown.
    name: where it came from, for a person.
    """

    heights: NDArray[np.float32]
    geometry: GridGeometry
    name: str
    provenance: Provenance
    texture: NDArray[np.uint8] | None = None

    def check(self) -> None:
        if self.heights.dtype != np.float32 or self.heights.shape != self.geometry.shape:
            raise InvalidTerrain(
                f"heights are {self.heights.dtype} {self.heights.shape}, the grid wants float32 {self.geometry.shape}"
            )
        if self.heights.size > MAX_CELLS:
            raise InvalidTerrain(
                f"{self.heights.size} cells are more than {MAX_CELLS}; choose a coarser resolution or crop",
                cells=self.heights.size,
                limit=MAX_CELLS,
            )
        if not np.isfinite(self.heights).any():
            raise InvalidTerrain("the terrain has no cell with a finite height")
        if np.isinf(self.heights).any():
            raise InvalidTerrain("heights must be finite, or NaN where unknown; some are infinite")
        if self.texture is not None and (self.texture.dtype != np.uint8 or self.texture.shape != self.geometry.shape):
            raise InvalidTerrain("a texture needs one uint8 for each cell")
