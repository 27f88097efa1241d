"""Disparities to a fraction of a pixel, on slanted ground too.

Semi-global matching compares patches as if each had one disparity, and finds fractions from a parabola through three
costs. Both pull: to whole pixels, and small rises down to the ground around them, by up to 0.3 px. Here each pixel gets
a plane of disparity, d(x, y) = d + p x + q y, that makes its patch of the left image agree best with the right one:
Gauss–Newton on grey values (Lucas & Kanade, IJCAI 1981; Baker & Matthews, IJCV 2004), with planes as in Bleyer, Rhemann
& Rother, *PatchMatch stereo*, BMVC 2011. Weights leave out what does not fit the plane: occlusions, and surfaces at
other disparities. What the fit leaves open is each disparity's variance, and the plane says how the surface lies: both
tell what was matched by chance.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.terrain.pairs.refine_kernel import fit_planes

Image = NDArray[np.float32]

RADII = (3, 4)
"""Of the windows, step by step [px]."""

WIDE_REACH, NARROW_REACH = 1.0, 0.35
"""A neighbour whose disparity is so far off the plane counts a quarter [px]: in the first step, and later at least."""

NOISY_REACH = 4.0
"""Later, this many standard deviations of the disparities that came in: a small rise in noise can't be told from it."""

NOISE = 2.0
"""Grey levels by which a difference of two images may be wrong where they are even."""

ALIKE = 41
"""Brightness of the two images is made equal over squares of this side [px]: exposure and vignetting differ slowly."""

FARTHEST = 1.0
"""Standard deviation of what comes in where the images say nothing, and how far the result may be from it [px]."""

CONTRAST_AS_NOISE = 0.5
"""Contrast counts as noise in the weights, so errors are smaller than the normal equations say: against rendered ground
by about this factor, in clean images and in noisy ones [px/px]."""

STEEPEST = 0.5
"""Disparity changes by at most this from one pixel to the next on a surface that both cameras see [px]."""


class Refined(NamedTuple):
    """Of each pixel of the left image, (height, width) float32, NaN where unknown.

    disparity: [px]. along, down: its change to the next column and row on the surface there. deviation: its standard
    deviation [px], at most half of FARTHEST.
    """

    disparity: Image
    along: Image
    down: Image
    deviation: Image


def refined(left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: Image) -> Refined:
    """Better disparities; NaN stays NaN. Deterministic.

    disparity: (height, width) to about half a pixel, NaN = unknown.
    """
    known = np.isfinite(disparity)
    start = np.where(known, disparity, np.float32(0.0)).astype(np.float32)
    error, slope = _compared(left.astype(np.float32), right.astype(np.float32), start, known)
    weight = np.where(known, 1.0 / _variance(left.astype(np.float32)), 0.0).astype(np.float32)
    planes = np.stack([start, np.zeros_like(start), np.zeros_like(start), np.full_like(start, FARTHEST**2)])
    reach = WIDE_REACH
    for radius in RADII:
        planes = fit_planes(
            _bordered(start, radius),
            _bordered(error, radius),
            _bordered(slope, radius),
            _bordered(weight, radius),
            _bordered(planes[0], radius),
            planes[:3],
            radius,
            1.0 / reach,
            1.0 / FARTHEST**2,
        )
        np.clip(planes[0], start - np.float32(FARTHEST), start + np.float32(FARTHEST), out=planes[0])
        np.clip(planes[1:3], -STEEPEST, STEEPEST, out=planes[1:3])
        reach = max(NARROW_REACH, NOISY_REACH * _deviation(planes[0][known] - start[known]))
    planes[:, ~known] = np.nan
    return Refined(planes[0], planes[1], planes[2], np.float32(CONTRAST_AS_NOISE) * np.sqrt(planes[3]))


def _deviation(errors: Image) -> float:
    """Standard deviation, if most were normally distributed (Rousseeuw & Croux, JASA 1993)."""
    return 1.4826 * float(np.median(np.abs(errors))) if len(errors) else 0.0


def _bordered(image: Image, width: int) -> Image:
    return cv2.copyMakeBorder(image, width, width, width, width, cv2.BORDER_CONSTANT).astype(np.float32, copy=False)


def _compared(left: Image, right: Image, start: Image, known: NDArray[np.bool_]) -> tuple[Image, Image]:
    """Grey of the right image at each pixel's partner minus that of the left image, and its slope along the row."""
    rows, cols = start.shape
    x = np.arange(cols, dtype=np.float32) - start
    y = np.repeat(np.arange(rows, dtype=np.float32)[:, None], cols, axis=1)
    slopes = cv2.Sobel(right, cv2.CV_32F, 1, 0, ksize=1, scale=0.5)
    there = cv2.remap(right, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    slope = cv2.remap(slopes, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    mean_left, mean_right = (cv2.blur(np.where(known, a, np.float32(0.0)), (ALIKE, ALIKE)) for a in (left, there))
    gain = (mean_left + 1.0) / (mean_right + 1.0)
    error, slope = gain * there - left, gain * slope
    return error.astype(np.float32, copy=False), slope.astype(np.float32, copy=False)


def _variance(image: Image) -> Image:
    """Of a difference at each pixel: the noise, and the contrast around it, which a wrong disparity turns into error.

    So a faint patch in a shadow counts as much as a shadow's edge, which may lie on another surface.
    """
    detail = image - cv2.blur(image, (3, 3))
    return np.float32(NOISE**2) + cv2.blur(detail * detail, (3, 3))
