"""The same points found in both images of a pair.

SIFT with the ratio test (Lowe, IJCV 2004) at reduced size; these, and corners (Shi & Tomasi, CVPR 1994) near them, are
then placed by Lucas & Kanade (IJCAI 1981) in the full images.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from footfall.core.arrays import Array
from footfall.telemetry.images import ImagePair

FEWEST_MATCHES = 40
"""With fewer, nothing can be said about a pair."""

RATIO = 0.8
"""The best partner must be this much closer than the second best (Lowe)."""

FEATURES = 800
"""Of each image, the strongest so many."""

CORNERS = 1200
"""Corners tracked from the left into the right image once matches tell where to look."""

WIDEST = 240
"""Features are searched in images reduced to about this width [px]."""

BAND = np.deg2rad(4.0)
"""Partners are looked for within this of the same row [rad]."""

PATCH = 21
"""Side of the patches compared at full size [px]."""

FINDS_BACK = 0.3
"""A point tracked there and back must return within this [px]."""

FAINT = 3.0
"""Contrast that counts as noise more than as detail [grey levels]."""


def matches(pair: ImagePair) -> tuple[Array, Array]:
    """Pixels (n, 2) of the same points in the left and in the right image, to a tenth of a pixel or so."""
    images = [_even(image) for image in (pair.left, pair.right)]
    left, right = _track(images, *_sift_matches(images, pair))
    if len(left) < FEWEST_MATCHES:
        return left, right
    corners = cv2.goodFeaturesToTrack(images[0], CORNERS, 0.01, PATCH / 2)[:, 0]
    # the median of three neighbours: one wrong match does not mislead all around it
    _, neighbours = KDTree(left).query(corners, k=3)
    guess = corners + np.median((right - left)[neighbours], axis=1)
    more = _track(images, corners.astype(float), guess.astype(float))
    return np.concatenate([left, more[0]]), np.concatenate([right, more[1]])


def _sift_matches(images: list[NDArray[np.uint8]], pair: ImagePair) -> tuple[Array, Array]:
    scale = max(1, round(images[0].shape[1] / WIDEST))
    small = [cv2.resize(image, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA) for image in images]
    sift = cv2.SIFT.create(nfeatures=FEATURES, contrastThreshold=0.02)
    found = [sift.detectAndCompute(image, None) for image in small]
    points = [np.array([k.pt for k in keys]).reshape(-1, 2) * scale + 0.5 * (scale - 1) for keys, _ in found]
    if min(len(p) for p in points) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    i, j = _partners(found[0][1], found[1][1], points[0], points[1], pair)
    return points[0][i], points[1][j]


def _partners(
    left: NDArray[Any], right: NDArray[Any], at_left: Array, at_right: Array, pair: ImagePair
) -> tuple[NDArray, NDArray]:
    """Indices of descriptors that are each other's nearest by far, among those that the geometry allows."""
    squared = (left**2).sum(1)[:, None] + (right**2).sum(1) - 2.0 * left @ right.T
    (x, y), (x_right, y_right) = at_left.T, at_right.T
    offset = pair.camera_right.cx - pair.camera_left.cx
    below = np.abs(np.subtract.outer(y, y_right)) > BAND * pair.camera_right.fy
    behind = np.less.outer(x + offset + BAND * pair.camera_right.fx, x_right)
    squared[below | behind] = np.inf
    each = np.arange(len(left))
    partner = squared.argmin(axis=1)
    mutual = squared.argmin(axis=0)[partner] == each
    best = squared[each, partner]
    squared[each, partner] = np.inf
    second = squared.min(axis=1)
    chosen = np.flatnonzero(np.isfinite(best) & (best < RATIO**2 * second) & mutual)
    return chosen, partner[chosen]


def _track(images: list[NDArray[np.uint8]], left: Array, guess: Array) -> tuple[Array, Array]:
    """Partners in the right image near a guess; those that do not find back to where they came from are dropped."""
    if len(left) == 0:
        return left, guess
    options = {
        "winSize": (PATCH, PATCH),
        "maxLevel": 0,
        "criteria": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.003),
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    start, near = left.astype(np.float32)[:, None], guess.astype(np.float32)[:, None]
    there, ok, _ = cv2.calcOpticalFlowPyrLK(images[0], images[1], start, near.copy(), **options)
    back, ok_back, _ = cv2.calcOpticalFlowPyrLK(images[1], images[0], there, start.copy(), **options)
    keep = (ok[:, 0] == 1) & (ok_back[:, 0] == 1)
    keep &= np.abs(back - start).max(axis=(1, 2)) < FINDS_BACK
    keep &= np.abs(there - near).max(axis=(1, 2)) < PATCH / 2
    return left[keep], there[keep, 0].astype(float)


def _even(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The image with mean and contrast made equal everywhere, so that exposure and vignetting don't matter."""
    grey, size = image.astype(np.float32), (2 * PATCH + 1, 2 * PATCH + 1)
    detail = grey - cv2.blur(grey, size)
    contrast = cv2.sqrt(cv2.blur(detail * detail, size)) + FAINT
    return cv2.convertScaleAbs(np.maximum(128.0 + 40.0 * detail / contrast, 0.0)).astype(np.uint8)
