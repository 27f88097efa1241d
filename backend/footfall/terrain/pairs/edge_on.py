"""The angle at which a pixel's ray meets the surface: those seen edge-on are mostly none at all."""

import numpy as np
from numpy.typing import NDArray

from footfall.telemetry.images import Camera
from footfall.terrain.pairs.refine import Refined


def incidence(fitted: Refined, camera: Camera, offset: float) -> NDArray[np.float32]:
    """Angle between each pixel's ray and the surface there.

    A match that slides from the rim of a thing to what lies behind it points at the camera: the test of Fuchs & May
    (*Calibration and registration for precise surface reconstruction with time-of-flight cameras*, 2008) for such jump
    edges.

    Over the normalised image (x, y) a plane has the disparity a·x + b·y + c with the normal (a, b, c), so that for the
    ray r = (x, y, 1) the sine of the angle is (disparity + offset) / (|(a, b, c)| · |r|).

    Args:
        fitted: planes of the disparity at each pixel.
        camera: the left one.
        offset: cx_right − cx_left [px].

    Returns:
        (height, width) [rad], NaN where unknown.
    """
    shifted = fitted.disparity + np.float32(offset)
    x = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(np.float32)[None, :]
    y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)[:, None]
    a, b = np.float32(camera.fx) * fitted.along, np.float32(camera.fy) * fitted.down
    length = np.sqrt((a * a + b * b + np.square(shifted - a * x - b * y)) * (x * x + y * y + 1.0))
    return np.arcsin(np.clip(shifted / np.maximum(length, np.float32(1e-9)), -1.0, 1.0))
