"""Surfaces seen edge-on: mostly none at all, but a match that slides from the rim of a thing to what lies behind it."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.telemetry.images import ImagePair
from footfall.terrain import stereo


def without_edge_on(disparity: NDArray[np.float32], pair: ImagePair, least_angle: float) -> NDArray[np.float32]:
    """The disparities (height, width) [px], NaN where the ray meets the surface at less than ``least_angle`` [rad].

    Matching by patches, with a cost for every change of disparity, leads over a depth jump in steps that are too small
    to be told from a slope. What it invents there points at the camera: the test of Fuchs & May (*Calibration and
    registration for precise surface reconstruction with time-of-flight cameras*, 2008) for such jump edges.

    Over the normalised image (x, y) a plane has the disparity a·x + b·y + c with the normal (a, b, c), so that for
    the ray r = (x, y, 1) the sine of the angle is (disparity + offset) / (|(a, b, c)| · |r|).
    """
    camera = pair.camera_left
    shifted = disparity + np.float32(stereo.offset(pair))
    x = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(np.float32)[None, :]
    y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)[:, None]
    a = np.float32(camera.fx) * _slope(shifted)
    b = np.float32(camera.fy) * _slope(shifted.T).T
    length = np.sqrt((a * a + b * b + np.square(shifted - a * x - b * y)) * (x * x + y * y + 1.0))
    # a pixel without neighbours, whose slope is NaN, stays: it makes no triangle anyway
    return np.where(shifted < np.float32(math.sin(least_angle)) * length, np.float32(np.nan), disparity)


def _slope(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Change from column to column, (rows, cols): the mean of those known up to two columns away; NaN where none is."""
    rows, cols = image.shape
    change = np.full((rows, cols + 3), np.nan, np.float32)
    change[:, 2 : cols + 1] = image[:, 1:] - image[:, :-1]
    known = np.isfinite(change)
    change[~known] = 0.0
    total, count = np.zeros((rows, cols), np.float32), np.zeros((rows, cols), np.uint8)
    for i in range(4):
        total += change[:, i : i + cols]
        count += known[:, i : i + cols]
    return np.where(count > 0, total / np.maximum(count, 1), np.float32(np.nan))
