"""What the rays of new images say about old heights: where one passes below an old surface, nothing is there."""

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.frames import require_transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Value, value

CERTAIN = 3.0
"""Standard deviations of a depth by which a ray must reach further than a point to have passed it."""

_NEAREST = 0.05
"""Points closer to a lens than this [m] are not asked about."""


@value
class DepthView(Value):
    """How far each pixel of one camera sees.

    inverse_depth: (height, width) float32 [1/m]; 0 = beyond all bounds, NaN = not known (no match, the robot itself).
    intrinsics: fx, fy, cx, cy [px].
    deviation: (height, width) standard deviations of the inverse depths, σ_disparity / (f·B) [1/m].
    """

    inverse_depth: NDArray[np.float32]
    intrinsics: tuple[float, ...]
    T_site_camera: NDArray[np.float64]
    deviation: NDArray[np.float32]

    def check(self) -> None:
        """Raises InvalidImages for arrays of unlike shapes, and for deviations that are not above zero."""
        if self.inverse_depth.ndim != 2 or len(self.intrinsics) != 4:
            raise InvalidImages("a view needs an image of inverse depths, and fx, fy, cx, cy")
        if self.deviation.shape != self.inverse_depth.shape or (self.deviation <= 0).any():
            raise InvalidImages("a view needs a deviation above zero for each of its inverse depths")
        require_transform(self.T_site_camera, "T_site_camera")


def seen_through(
    heights: NDArray[np.float32], geometry: GridGeometry, views: tuple[DepthView, ...], clearance: float
) -> NDArray[np.bool_]:
    """Known cells through which some view looked and saw further: what stood there then is gone.

    Pixels beside unknown ones or beside a depth edge prove nothing: the nearest depth of their 3 × 3 neighbours counts.
    Ground that is seen edge-on is not touched, because the point ``clearance`` below it is hidden by the ground in
    front of it.

    Args:
        heights: (rows, cols) [m], NaN where unknown.
        geometry: the grid.
        views: how far each pixel of each camera sees.
        clearance: so far below a height a view has to look [m].

    Returns:
        (rows, cols).
    """
    rows, cols = np.nonzero(np.isfinite(heights))
    points = (geometry.xs[cols], geometry.ys[rows], heights[rows, cols].astype(np.float64) - clearance)
    passed = np.zeros(len(rows), bool)
    for view in views:
        x, y, z = _in_camera(points, view.T_site_camera)
        fx, fy, cx, cy = view.intrinsics
        height, width = view.inverse_depth.shape
        in_front = np.flatnonzero((z > _NEAREST) & ~passed)
        u = np.rint(fx * x[in_front] / z[in_front] + cx)
        v = np.rint(fy * y[in_front] / z[in_front] + cy)
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        asked = in_front[inside]
        at_most = view.inverse_depth + np.float32(CERTAIN) * view.deviation
        # beyond the image's border dilation repeats nothing: unknown there says nothing either
        nearest = cv2.dilate(np.where(np.isnan(at_most), np.float32(np.inf), at_most), np.ones((3, 3), np.uint8))
        passed[asked] = nearest[v[inside].astype(np.int64), u[inside].astype(np.int64)] < 1.0 / z[asked]
    out = np.zeros(heights.shape, bool)
    out[rows, cols] = passed
    return out


def _in_camera(points: tuple[NDArray, NDArray, NDArray], T_site_camera: NDArray[np.float64]) -> list[NDArray]:
    """x, y, z in the camera; written out, so that the result does not depend on the number of threads."""
    dx, dy, dz = (p - T_site_camera[i, 3] for i, p in enumerate(points))
    return [T_site_camera[0, i] * dx + T_site_camera[1, i] * dy + T_site_camera[2, i] * dz for i in range(3)]
