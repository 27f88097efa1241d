"""Disparity of a rectified pair by semi-global matching (Hirschmüller, PAMI 2008), as OpenCV implements it.

What it finds is then refined, see :mod:`footfall.terrain.pairs.refine`, which also tells how sure each is.

For a point at depth z seen at columns x_left and x_right: d = x_left − x_right and z = f·B / (d + offset), where
offset = cx_right − cx_left (the ``doffs`` of the Middlebury sets) is zero for cameras with equal principal points.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs.edge_on import incidence
from footfall.terrain.pairs.refine import Refined, refined
from footfall.terrain.terrain_settings import TerrainSettings

DARKEST, BRIGHTEST = 5.0, 251.0
"""Patches whose mean grey lies outside hold noise or saturation, no ground."""

MIN_USABLE = 0.02
"""A pair needs this share of pixels between DARKEST and BRIGHTEST."""

MIN_MATCHED = 0.3
"""Of those, this share must have found a partner; chance finds about a tenth."""

SURELY_MATCHED = 0.7
"""With this share or more the two images can't be the wrong way round."""

MIN_DEVIATION = 3.0
"""Grey levels by which an image must vary to be matched at all."""

SMALL_STEP, LARGE_STEP = 8, 24
"""P1 and P2: what a step of one and of more disparities costs, for each pixel of a patch [grey levels]. The usual P2 of
32 carries disparities on into what only one camera sees; with less, those pixels fail the check against the right image
instead: fewer wrong, and hardly fewer in all."""

_MODES = {"hh": cv2.STEREO_SGBM_MODE_HH, "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY}

# The integer division behind sub-pixel disparities in OpenCV's full mode rounds negative fractions up to the next
# sixteenth: 1/32 px too much on average, which lifts ground 3 m away by about 2 mm. The three-way mode rounds evenly.
_ROUNDING = {"hh": np.float32(1 / 32), "3way": np.float32(0.0)}


def offset(pair: ImagePair) -> float:
    """cx_right − cx_left [px]."""
    return pair.camera_right.cx - pair.camera_left.cx


def depth(pair: ImagePair, disparity: NDArray[np.float32]) -> NDArray[np.float64]:
    """Depth along z of the left camera [m] for disparities [px]; NaN stays NaN, infinity where d + offset ≤ 0."""
    shifted = disparity.astype(np.float64) + offset(pair)
    with np.errstate(divide="ignore"):
        return np.where(shifted <= 0, np.inf, pair.camera_left.fx * pair.baseline / np.abs(shifted))


def disparity(pair: ImagePair, settings: TerrainSettings) -> NDArray[np.float32]:
    """Disparity of each pixel of the left image, (height, width) float32 [px], as :func:`match` finds it."""
    return match(pair, settings).disparity


def deviations(found: Refined, pair: ImagePair, settings: TerrainSettings) -> NDArray[np.float32]:
    """Standard deviation of each disparity.

    In shadows, and over the rims of things, matching leads over from one surface to another in steps that are too small
    to be told from a slope. Even patches show in the deviation, and what leads over a rim is met edge-on.

    Args:
        found: planes of the disparity at each pixel.
        pair: the images.
        settings: how flat a surface may be met.

    Returns:
        (height, width) [px], infinite where the surface is met edge-on, NaN where unknown.
    """
    edge_on = incidence(found, pair.camera_left, offset(pair)) < settings.least_angle
    return np.where(edge_on, np.float32(np.inf), found.deviation)


def match(pair: ImagePair, settings: TerrainSettings) -> Refined:
    """Disparity of each pixel of the left image, its slope and deviation; NaN where there is no sure partner.

    Searched from infinite depth to ``settings.min_range``. Raises InvalidImages, naming the pair, where the cameras
    are not rectified, an image is black, saturated or blank, or hardly anything matches.
    """
    require_rectified(pair)
    if np.array_equal(pair.left, pair.right):
        raise InvalidImages(f"pair {pair.name}: left and right are one and the same image", pair=pair.name)
    usable = _usable(pair, "left")
    _usable(pair, "right")
    found = _semi_global(pair.left, pair.right, pair, settings)
    matched = float(np.isfinite(found[usable]).mean())
    if matched < SURELY_MATCHED:
        # a right image taken for the left one finds little, but the other way round it does
        swapped = _semi_global(pair.right, pair.left, pair, settings)
        if float(np.isfinite(swapped).mean()) > max(MIN_MATCHED, 1.4 * float(np.isfinite(found).mean())):
            raise InvalidImages(
                f"pair {pair.name}: the images match better the other way round; left and right seem to be swapped, or "
                "their calibration is wrong (doffs, cx of the right camera less that of the left one)",
                pair=pair.name,
            )
    if matched < MIN_MATCHED:
        raise InvalidImages(
            f"pair {pair.name}: only {matched:.0%} of the pixels match ({MIN_MATCHED:.0%} needed); "
            f"the images may show different scenes or things nearer than {settings.min_range} m, not be rectified, "
            "or calibrated wrongly (cx of the cameras, doffs)",
            pair=pair.name,
            matched=matched,
        )
    found[~usable] = np.nan
    better = refined(pair.left, pair.right, found)
    return better._replace(disparity=_without_border(better.disparity))


def require_rectified(pair: ImagePair) -> None:
    """Raise InvalidImages unless both cameras look the same way with equal focal lengths, side by side."""
    left, right = pair.camera_left, pair.camera_right
    if (left.width, left.height) != (right.width, right.height):
        raise InvalidImages(
            f"pair {pair.name}: the images have different sizes, {left.width} × {left.height} and "
            f"{right.width} × {right.height}; rectified ones are equal",
            pair=pair.name,
        )
    turned = float(np.abs(left.T_base_camera[:3, :3] - right.T_base_camera[:3, :3]).max())
    across = left.T_base_camera[:3, :3].T @ (right.T_base_camera[:3, 3] - left.T_base_camera[:3, 3])
    same_lens = abs(left.fx - right.fx) < 1e-6 * left.fx and abs(left.fy - right.fy) < 1e-6 * left.fy
    if turned > 1e-6 or np.abs(across[1:]).max() > 1e-6 or not same_lens or abs(left.cy - right.cy) > 1e-6:
        raise InvalidImages(
            f"pair {pair.name}: its camera models are not rectified; both need the same rotation, focal lengths and "
            "cy, and the right one must lie along x of the left one",
            pair=pair.name,
        )


def _usable(pair: ImagePair, side: str) -> NDArray[np.bool_]:
    """Pixels around which the image shows something, (height, width)."""
    image = pair.left if side == "left" else pair.right
    mean = cv2.blur(image.astype(np.float32), (5, 5))
    usable = (mean >= DARKEST) & (mean <= BRIGHTEST)
    share = float(usable.mean())
    if share < MIN_USABLE:
        what = "black" if float(mean.mean()) < 128 else "saturated"
        raise InvalidImages(
            f"pair {pair.name}: the {side} image is {what}; only {share:.1%} of it can be used", pair=pair.name
        )
    deviation = float(image[usable].std())
    if deviation < MIN_DEVIATION:
        raise InvalidImages(
            f"pair {pair.name}: the {side} image is blank; its grey varies by {deviation:z.1f} levels, "
            f"matching needs {MIN_DEVIATION:z.0f}",
            pair=pair.name,
        )
    return usable


def _semi_global(
    left: NDArray[np.uint8], right: NDArray[np.uint8], pair: ImagePair, settings: TerrainSettings
) -> NDArray[np.float32]:
    smallest = math.floor(-offset(pair))
    largest = pair.camera_left.fx * pair.baseline / settings.min_range - offset(pair)
    count = max(16, math.ceil((largest - smallest) / 16) * 16)
    if count > left.shape[1]:
        raise InvalidImages(
            f"pair {pair.name}: points {settings.min_range} m away are {largest:z.0f} px apart in images "
            f"{left.shape[1]} px wide; choose a larger min_range",
            pair=pair.name,
        )
    # OpenCV searches only where every candidate partner lies inside the image: without a border the left strip is lost
    before, after = count + max(0, smallest), max(0, -smallest)
    wide_left, wide_right = (
        cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE) for image in (left, right)
    )
    block = settings.block_size
    matcher = cv2.StereoSGBM.create(
        minDisparity=smallest,
        numDisparities=count,
        blockSize=block,
        P1=SMALL_STEP * block * block,
        P2=LARGE_STEP * block * block,
        disp12MaxDiff=1,
        preFilterCap=63,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=2,
        mode=_MODES[settings.matcher],
    )
    sixteenths = matcher.compute(wide_left, wide_right)[:, before : before + left.shape[1]]
    found = sixteenths.astype(np.float32) / 16.0 - _ROUNDING[settings.matcher]
    found[sixteenths < 16 * smallest] = np.nan
    return _without_border(found)


def _without_border(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """NaN where the partner would lie beyond the right image's border: it was invented by the border."""
    columns = np.arange(disparity.shape[1], dtype=np.float32)
    outside = (columns - disparity < 0) | (columns - disparity > disparity.shape[1] - 1)
    return np.where(outside, np.float32(np.nan), disparity)
