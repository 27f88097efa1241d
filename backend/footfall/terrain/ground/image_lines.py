"""Lines of the site as a camera sees them: what the ground hides, or lies outside the image, is left out."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.telemetry.images import Camera
from footfall.telemetry.projection import in_image, project
from footfall.terrain.dem import Dem
from footfall.terrain.ground.line_of_sight import in_sight

COARSENESS = 0.3
"""Points of a line are left out where that moves it by no more than this [px]."""


def seen(
    dem: Dem, camera: Camera, T_site_camera: Array, points: Array, covered: NDArray[np.bool_] | None = None
) -> tuple[Array, NDArray[np.bool_]]:
    """Where points are in an image, and whether each is to be seen.

    Args:
        dem: the ground that may hide them, in site.
        camera: a pinhole, without distortion.
        T_site_camera: pose of the camera, (4, 4).
        points: (n, 3) in site [m].
        covered: pixels (height, width) before which something else stands, such as the rover's own body; None: none.

    Returns:
        Pixels (n, 2), NaN for points that are not in front of the lens, or not finite; and which are to be seen, (n,).
    """
    pixels = project(camera, apply(inverse(T_site_camera), points))
    with np.errstate(invalid="ignore"):
        visible = in_image(camera, pixels)
    if covered is not None:
        at = np.flatnonzero(visible)
        u, v = np.rint(pixels[at]).astype(np.int64).T
        visible[at] = ~covered[np.clip(v, 0, camera.height - 1), np.clip(u, 0, camera.width - 1)]
    at = np.flatnonzero(visible)
    visible[at] = in_sight(dem, T_site_camera[:3, 3], points[at])
    return pixels, visible


def seen_lines(
    dem: Dem,
    camera: Camera,
    T_site_camera: Array,
    lines: Sequence[Array],
    covered: NDArray[np.bool_] | None = None,
) -> list[Array]:
    """What is to be seen of lines in an image; see ``seen``.

    Args:
        dem: the ground that may hide them, in site.
        camera: a pinhole, without distortion.
        T_site_camera: pose of the camera, (4, 4).
        lines: (n, 3) each, in site [m].
        covered: pixels (height, width) before which something else stands; None: none.

    Returns:
        Each part as pixels (k, 2) with k ≥ 2.
    """
    if not lines:
        return []
    points = np.concatenate(lines)
    pixels, visible = seen(dem, camera, T_site_camera, points, covered)
    of_line = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    # where visibility, or the line, changes, a run ends
    breaks = np.flatnonzero((np.diff(visible.astype(np.int8)) != 0) | (np.diff(of_line) != 0)) + 1
    runs = [run for run in np.split(np.arange(len(points)), breaks) if len(run) > 1 and visible[run[0]]]
    return [_simplified(pixels[run]) for run in runs]


def _simplified(line: Array) -> Array:
    """Fewer points of a line (n, 2) (Ramer, 1972; Douglas & Peucker, 1973, as OpenCV has it)."""
    return cv2.approxPolyDP(line.astype(np.float32)[:, None], COARSENESS, False)[:, 0].astype(np.float64)
