"""The digital elevation map: heights on a grid, unknown where nothing was seen."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.frames import require_transform
from footfall.core.grid import GridGeometry
from footfall.core.value import LATER, Provenance, Value, value

MAX_SOURCES = 255
MAX_CELLS = 16_000_000
"""Largest accepted map: 4000 × 4000 cells (64 MB of heights)."""


@value
class HeightError(Value):
    """How far the cells' surface is from that of the mesh it was read from, vertically [m].

    p95: what 95 % of the ground stays under. most: the largest difference found; at a wall, up to its height.
    """

    p95: float
    most: float


@value
class Dem(Value):
    """Heights at cell centres of a grid in the site frame.

    heights: (rows, cols) float32 [m], row 0 south; NaN = unknown.
    geometry: where the cells lie.
    texture: (rows, cols) uint8 grey seen from above, or None; 0 where unknown.
    name: where it came from, for a person.

    What is remembered of each cell, None where the origin does not say:
    variance: (rows, cols) float32 of the height [m²], NaN where unknown.
    count: (rows, cols) uint16, measurements fused.
    time: (rows, cols) float64 of the newest measurement [s since 1970], NaN where unknown.
    source: (rows, cols) uint8 of the newest measurement: 1 + index into ``sources``, 0 = none.
    sources: names of cameras or other origins.
    viewpoint: where the chassis stood at the newest snapshot (x, y, z), site [m], or None.
    correction: (4, 4), what moved the newest snapshot's points onto the map: p_map = correction @ p_site; or None.
    left_out: image pairs of the newest snapshot that could not be used, by name, and why.
    true_north: how far true north is turned clockwise from the site's y [deg]: in the middle of the map, least and
        most over it; None where its file did not say.
    height_error: of a terrain that was read from a mesh.
    """

    heights: NDArray[np.float32]
    geometry: GridGeometry
    name: str
    provenance: Provenance
    texture: NDArray[np.uint8] | None = None
    variance: NDArray[np.float32] | None = None
    count: NDArray[np.uint16] | None = None
    time: NDArray[np.float64] | None = None
    source: NDArray[np.uint8] | None = None
    sources: tuple[str, ...] = ()
    viewpoint: tuple[float, ...] | None = None
    correction: NDArray[np.float64] | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)
    true_north: tuple[float, float, float] | None = field(default=None, metadata=LATER)
    height_error: HeightError | None = field(default=None, metadata=LATER)

    @property
    def remembers(self) -> bool:
        """Whether it says of its cells how sure they are, from when, and from where; else nothing can be merged."""
        return not any(layer is None for layer in (self.variance, self.count, self.time, self.source))

    def check(self) -> None:
        """Raises InvalidTerrain for too many cells, arrays off the grid, and heights infinite or all unknown."""
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
        self._check_memory()

    def _check_memory(self) -> None:
        known = np.isfinite(self.heights)
        for name, kind in (("variance", np.float32), ("count", np.uint16), ("time", np.float64), ("source", np.uint8)):
            layer = getattr(self, name)
            if layer is not None and (layer.dtype != kind or layer.shape != self.geometry.shape):
                raise InvalidTerrain(f"{name} needs one {np.dtype(kind).name} for each cell, not {layer.dtype}")
        if self.variance is not None and not (self.variance[known] > 0).all():
            raise InvalidTerrain("every known height needs a variance above zero [m²]")
        if self.variance is not None and np.isinf(self.variance[known]).any():
            raise InvalidTerrain("a variance must be finite [m²]")
        if self.time is not None and not np.isfinite(self.time[known]).all():
            raise InvalidTerrain("every known height needs the finite time of its measurement [s since 1970]")
        if len(self.sources) > MAX_SOURCES:
            raise InvalidTerrain(f"a terrain names at most {MAX_SOURCES} sources, not {len(self.sources)}")
        if self.source is not None and int(self.source.max()) > len(self.sources):
            raise InvalidTerrain(f"a cell names source {int(self.source.max())}, there are {len(self.sources)}")
        if self.viewpoint is not None and not (len(self.viewpoint) == 3 and np.isfinite(self.viewpoint).all()):
            raise InvalidTerrain("a viewpoint has three finite coordinates [m]")
        if self.correction is not None:
            require_transform(self.correction, "correction")
