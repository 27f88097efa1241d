"""Disparities to a fraction of a pixel, on slanted ground too.

Semi-global matching compares patches as if each had one disparity, and finds fractions from a parabola through three
costs. Both pull: to whole pixels, and small rises down to the ground around them, by up to 0.3 px. Here each pixel gets
a plane of disparity, d(x, y) = d + p x + q y, that makes its patch of the left image agree best with the right one:
Gauss–Newton on grey values (Lucas & Kanade, IJCAI 1981; Baker & Matthews, IJCV 2004), with the slopes of both images
(Malis, *Improving vision-based control using efficient second-order minimization techniques*, ICRA 2004) and planes as
in Bleyer, Rhemann & Rother, *PatchMatch stereo*, BMVC 2011. Weights leave out what does not fit the plane: occlusions,
and surfaces at other disparities. What the fit leaves open is each disparity's variance, in units of what the images
were found to differ by, and the plane says how the surface lies: both tell what was matched by chance.

Windows grow from step to step, and a neighbour counts by how far its disparity of the step before is off the plane, in
standard deviations of the pixel's own (adaptive weights smoothing: Polzehl & Spokoiny, J. R. Stat. Soc. B 62, 2000): in
faint images a pixel takes its whole window, where they are clear it stays on its own surface.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Floats32
from footfall.terrain.pairs.refine_kernel import fit_planes

RADII = (3, 5, 7)
"""Of the windows, step by step [px]."""

WIDE_REACH, NARROW_REACH = 1.0, 0.35
"""A neighbour whose disparity is so far off the plane counts a quarter [px]: in the first step, and later at least."""

REACH_IN_DEVIATIONS = 3.0
"""Later, this many standard deviations of the pixel's own disparity: what differs by less may be the same surface."""

NOISE = 2.0
"""Grey levels by which a difference of two images may be wrong where they are even."""

CONTRAST_AS_NOISE = 0.2
"""Share of the contrast around a pixel that counts as noise in the weights: a wrong disparity turns it into error."""

ROUNDED = 0.4
"""Grey levels by which differences are off at least, as both are whole numbers: √(2/12)."""

ALIKE = 41
"""Brightness of the two images is made equal over squares of this side [px]: exposure and vignetting differ slowly."""

FARTHEST = 1.0
"""Standard deviation of what comes in where the images say nothing, and how far the result may be from it [px]."""

STEEPEST = 0.5
"""Disparity changes by at most this from one pixel to the next on a surface that both cameras see [px]."""


class Refined(NamedTuple):
    """Of each pixel of the left image, (height, width) float32, NaN where unknown.

    disparity: [px]. along, down: its change to the next column and row on the surface there. deviation: its standard
    deviation [px], at most FARTHEST.
    """

    disparity: Floats32
    along: Floats32
    down: Floats32
    deviation: Floats32


def refined(left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: Floats32) -> Refined:
    """Better disparities; deterministic.

    Args:
        left: (height, width).
        right: (height, width).
        disparity: (height, width) to about half a pixel [px], NaN = unknown.

    Returns:
        Planes of the disparity at each pixel; NaN stays NaN.
    """
    known = np.isfinite(disparity)
    grey_left, grey_right = left.astype(np.float32), right.astype(np.float32)
    weight = np.where(known, 1.0 / _variance(grey_left), 0.0).astype(np.float32)
    came_in = np.where(known, disparity, np.float32(0.0)).astype(np.float32)
    planes = np.stack([came_in, np.zeros_like(came_in), np.zeros_like(came_in)])
    compared = _Compared(grey_left, grey_right, known)
    # every other row tells how much the images differ
    some = np.s_[::2]
    known_there, root = known[some], np.sqrt(weight[some])
    reach, deviation = np.full_like(came_in, WIDE_REACH), came_in
    for radius in RADII:
        at = planes[0]
        error, slope = compared.at(at)
        planes, variance = fit_planes(
            _bordered(at, radius),
            _bordered(error, radius),
            _bordered(slope, radius),
            _bordered(weight, radius),
            planes,
            radius,
            1.0 / reach,
            1.0 / FARTHEST**2,
        )
        np.clip(planes[0], came_in - np.float32(FARTHEST), came_in + np.float32(FARTHEST), out=planes[0])
        np.clip(planes[1:], -STEEPEST, STEEPEST, out=planes[1:])
        residual = error[some] + slope[some] * (at[some] - planes[0][some])
        deviation = _in_units_of((residual * root)[known_there], variance)
        reach = np.maximum(np.float32(REACH_IN_DEVIATIONS) * deviation, np.float32(NARROW_REACH))
    planes[:, ~known] = np.nan
    return Refined(planes[0], planes[1], planes[2], np.where(known, deviation, np.float32(np.nan)))


def off_plane(disparity: Floats32, along: Floats32, down: Floats32) -> Floats32:
    """How far the surface around each pixel is off the pixel's plane, the mean over the largest window.

    A fit that took all neighbours for one surface would be off by that. What differs by little from the plane is taken
    for it, so disparities of small things and rims may be wrong by as much, which no difference of images shows.

    Args:
        disparity: (height, width) [px], NaN = unknown.
        along: its change per column, (height, width) [px].
        down: its change per row, (height, width) [px].

    Returns:
        (height, width) [px]; 0 where unknown.
    """
    known = np.isfinite(disparity)
    rows, cols = np.indices(disparity.shape, np.float32)
    side = 2 * RADII[-1] + 1

    def mean(of: ArrayLike) -> Floats32:
        return _single(cv2.blur(np.where(known, of, np.float32(0.0)).astype(np.float32), (side, side)))

    share = mean(np.ones_like(disparity))
    off = mean(disparity) - share * disparity - along * (mean(cols) - share * cols) - down * (mean(rows) - share * rows)
    return np.where(known, np.abs(off) / np.maximum(share, np.float32(1.0 / side**2)), np.float32(0.0))


def _in_units_of(residuals: Floats32, variance: Floats32) -> Floats32:
    """Deviations of disparities [px], whose variances [px²] were reckoned as if differences had one of 1 / weight.

    residuals: differences that are left, × √weight. Their own spread is the unit (variance of unit weight: Förstner &
    Wrobel, *Photogrammetric Computer Vision*, 2016, §4.2.3). What came in counts as it did.
    """
    unit = max(_deviation(residuals), ROUNDED / NOISE)
    from_images = 1.0 / variance - np.float32(1.0 / FARTHEST**2)
    return _single(1.0 / np.sqrt(np.maximum(from_images, 0.0) / unit**2 + 1.0 / FARTHEST**2))


def _deviation(errors: Floats32) -> float:
    """Standard deviation, if most were normally distributed (Rousseeuw & Croux, JASA 1993)."""
    return 1.4826 * float(np.median(np.abs(errors))) if len(errors) else 0.0


def _bordered(image: Floats32, width: int) -> Floats32:
    return _single(cv2.copyMakeBorder(image, width, width, width, width, cv2.BORDER_CONSTANT))


def _along_rows(image: Floats32) -> Floats32:
    return _single(cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=1, scale=0.5))


def _single(image: ArrayLike) -> Floats32:
    return np.asarray(image, np.float32)


class _Compared:
    """Two images (height, width), compared at disparities."""

    def __init__(self, left: Floats32, right: Floats32, known: NDArray[np.bool_]):
        rows, cols = left.shape
        self._left, self._right, self._unknown = left, right, ~known
        self._x = np.arange(cols, dtype=np.float32)
        self._y = np.repeat(np.arange(rows, dtype=np.float32)[:, None], cols, axis=1)
        self._slope_left, self._slope_right = (_along_rows(image) for image in (left, right))
        self._mean_left = self._mean(left)

    def at(self, disparity: Floats32) -> tuple[Floats32, Floats32]:
        """Grey of the right image at each pixel's partner minus that of the left one, and the mean of their slopes.

        The slopes are along the row. Sampled over eight pixels: over four, fractions of a disparity were drawn towards
        the half by 0.03 px.
        """
        x = self._x - disparity
        there = cv2.remap(self._right, x, self._y, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
        slope = cv2.remap(self._slope_right, x, self._y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        gain = (self._mean_left + 1.0) / (self._mean(there) + 1.0)
        return _single(gain * there - self._left), _single(0.5 * (gain * slope + self._slope_left))

    def _mean(self, image: ArrayLike) -> Floats32:
        """Of the known ones among the pixels around each."""
        known = np.array(image, np.float32)
        known[self._unknown] = 0.0
        return _single(cv2.blur(known, (ALIKE, ALIKE)))


def _variance(image: Floats32) -> Floats32:
    """Of a difference at each pixel: the noise, and some of the contrast around it.

    So a faint patch in a shadow counts beside a shadow's edge, which may lie on another surface.
    """
    detail = image - cv2.blur(image, (3, 3))
    return _single(NOISE**2 + CONTRAST_AS_NOISE * cv2.blur(detail * detail, (3, 3)))
