"""Points to pixels and back, by the camera model of the rectified images: a pinhole without distortion."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.telemetry.images import Camera

NEAREST = 0.05
"""Points closer to a lens than this [m], along its axis, are not in the image."""


def project(camera: Camera, points: ArrayLike) -> Array:
    """Pixels (…, 2), u to the right and v down, of points (…, 3) in the camera frame [m].

    The centre of the first pixel is (0, 0). NaN for what is not in front of the lens.
    """
    p = np.asarray(points, float)
    z = np.where(p[..., 2] >= NEAREST, p[..., 2], np.nan)
    return np.stack([camera.fx * p[..., 0] / z + camera.cx, camera.fy * p[..., 1] / z + camera.cy], axis=-1)


def sight(camera: Camera, u: ArrayLike, v: ArrayLike) -> Array:
    """Directions in which pixels look.

    Args:
        camera: a pinhole, without distortion.
        u: columns (…) [px].
        v: rows (…) [px].

    Returns:
        Directions (…, 3) in the camera's frame, with z = 1.
    """
    u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)


def in_image(camera: Camera, pixels: Array) -> NDArray[np.bool_]:
    """Whether pixels (…, 2) lie in the image, whose rim is half a pixel outside the outermost centres."""
    u, v = pixels[..., 0], pixels[..., 1]
    return (u >= -0.5) & (u <= camera.width - 0.5) & (v >= -0.5) & (v <= camera.height - 0.5)
