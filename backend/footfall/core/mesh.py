"""Triangle meshes: the one form that display, collision and picking share."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value


@value
class Mesh(Value):
    """vertices: (n, 3) float64 [m]; triangles: (m, 3) int32, counter-clockwise seen from outside."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]

    def check(self) -> None:
        """Raises InvalidInput for vertices that are not finite, indices past them, and arrays of other shapes."""
        if self.vertices.ndim != 2 or self.vertices.shape[1:] != (3,) or not np.isfinite(self.vertices).all():
            raise InvalidInput("mesh vertices need n × 3 finite numbers", shape=list(self.vertices.shape))
        if self.triangles.ndim != 2 or self.triangles.shape[1:] != (3,) or self.triangles.dtype != np.int32:
            raise InvalidInput("mesh triangles need m × 3 int32 indices", shape=list(self.triangles.shape))
        if self.triangles.size and (self.triangles.min() < 0 or self.triangles.max() >= len(self.vertices)):
            raise InvalidInput("mesh triangles point past the vertices", vertices=len(self.vertices))
