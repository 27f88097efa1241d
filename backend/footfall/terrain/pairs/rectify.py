"""Images as a lens takes them made into a rectified pair (Bouguet's method, as OpenCV implements it).

Distortion is taken out and both cameras are turned, by software, until they look the same way at right angles to the
baseline; then each point lies in one row of both images.

Which part of the turned view an image shows is a choice. "whole": all that the camera sees, as a rectangle without
empty pixels, at the lens's own scale; both images have the rows that both cameras see, each its own columns and centre.
"common", which is OpenCV's (alpha = 0): one centre for both, enlarged until neither image has an empty pixel. Where the
centres of two lenses lie apart that costs what only lies in the rest: 100 px of 640 cost a third of the ground.
"""

import math
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import inverse, require_transform, transform
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.telemetry.images import Camera, ImagePair
from footfall.terrain.terrain_settings import COMMON, MAX_SKEW, WHOLE

FOCAL_RANGE = (0.2, 5.0)
"""A rectified focal length outside these shares of the lens's own means that the models can't be right."""

LARGEST_MARGIN = 0.25
"""A rectified image goes beyond the lens's own width and height by this share at most, to each side: wide lenses see to
where a plane image has no end."""

_PRECISE = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
_ASIDE = 1e5
"""OpenCV says about so much for a ray that is not ahead."""


def rectify(
    calibration: PairCalibration,
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    *,
    time: float = 0.0,
    time_right: float | None = None,
    T_site_base: ArrayLike | None = None,
    max_skew: float = MAX_SKEW,
    view: str = WHOLE,
) -> ImagePair:
    """The rectified pair of two grey images; pixels without a source are black.

    Args:
        calibration: of the two cameras.
        left: (height, width).
        right: (height, width), of the same size.
        time: when the left one was taken [s].
        time_right: when the right one was taken [s]; None: at the same time.
        T_site_base: pose of the chassis, (4, 4); None: identity.
        max_skew: the images are taken at most so far apart [s].
        view: which part it shows, "whole" or "common".

    Returns:
        The pair.

    Raises:
        InvalidImages: an image has the wrong size, they were taken at different times, or the pose is not finite; the
            pair is named.
    """
    name = calibration.name
    for side, image, camera in (("left", left, calibration.left), ("right", right, calibration.right)):
        if image.dtype != np.uint8 or image.shape != (camera.height, camera.width):
            raise InvalidImages(
                f"pair {name}: the {side} image has {image.shape[1]} × {image.shape[0]} pixels ({image.dtype}), its "
                f"calibration is of {camera.width} × {camera.height} (uint8)",
                pair=name,
            )
    require_simultaneous(name, time, time_right, max_skew)
    try:
        T = require_transform(np.eye(4) if T_site_base is None else T_site_base, "the rover's pose")
    except InvalidInput as err:
        raise InvalidImages(f"pair {name}: {err.message}", pair=name) from err
    turns, cameras = rectified_cameras(calibration, view)
    images = [
        _seen_through(image, model, R, camera)
        for image, model, R, camera in zip(
            (left, right), (calibration.left, calibration.right), turns, cameras, strict=True
        )
    ]
    return ImagePair(name, time, images[0], images[1], cameras[0], cameras[1], T, time_right)


def require_simultaneous(name: str, time_left: float, time_right: float | None, max_skew: float) -> None:
    """Refuse images of a pair that were taken too far apart.

    Args:
        name: of the pair.
        time_left: when the left one was taken [s].
        time_right: when the right one was taken [s]; None: at the same moment.
        max_skew: how far apart they may be [s].

    Raises:
        InvalidImages: they are farther apart.
    """
    apart = 0.0 if time_right is None else abs(time_right - time_left)
    if not apart <= max_skew:
        raise InvalidImages(
            f"pair {name}: the images were taken {apart:z.3f} s apart, {max_skew:z.3f} s at most: not synchronised",
            pair=name,
            apart=apart,
        )


def rectified_cameras(
    calibration: PairCalibration, view: str = WHOLE
) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], tuple[Camera, Camera]]:
    """Rotations (3, 3) from each real camera into its rectified one, and the two rectified cameras."""
    a, b = calibration.left, calibration.right
    T_right_left = inverse(calibration.T_left_right)
    arguments: tuple[Any, ...] = (
        a.matrix,
        _coefficients(a),
        b.matrix,
        _coefficients(b),
        (a.width, a.height),
        T_right_left[:3, :3],
        np.ascontiguousarray(T_right_left[:3, 3:]),
    )
    if a.model == "fisheye":
        R_left, R_right, P_left, P_right, _ = cv2.fisheye.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY)
    else:
        R_left, R_right, P_left, P_right, *_ = cv2.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0.0)
    if view == COMMON:
        left, right = (
            _Frame(float(P_left[0, 0]), float(P[0, 2]), float(P_left[1, 2]), a.width, a.height)
            for P in (P_left, P_right)
        )
        if not (np.isfinite([left.f, left.cx, left.cy]).all() and FOCAL_RANGE[0] < left.f / a.fx < FOCAL_RANGE[1]):
            raise InvalidImages(
                f"pair {calibration.name}: rectified, the focal length would be {left.f:z.1f} px instead of about "
                f"{a.fx:z.0f}; the distortion coefficients or the poses are wrong",
                pair=calibration.name,
            )
    else:
        left, right = _whole_views(calibration, R_left, R_right)
    R_base_rectified = a.T_base_camera[:3, :3] @ R_left.T
    cameras = tuple(
        Camera(
            model.name,
            frame.width,
            frame.height,
            left.f,
            left.f,
            frame.cx,
            left.cy,
            transform(R_base_rectified, model.T_base_camera[:3, 3]),
        )
        for model, frame in ((a, left), (b, right))
    )
    return (R_left, R_right), (cameras[0], cameras[1])


class _Frame(NamedTuple):
    """What a rectified image shows: focal length, centre and size [px]."""

    f: float
    cx: float
    cy: float
    width: int
    height: int


def _whole_views(calibration: PairCalibration, *turns: NDArray[np.float64]) -> tuple[_Frame, _Frame]:
    """The frames in which each camera keeps its columns, and both the rows that both see."""
    models = (calibration.left, calibration.right)
    f = float(np.mean([[one.fx, one.fy] for one in models]))
    seen = [_inner_rectangle(model, R, f) for model, R in zip(models, turns, strict=True)]
    top, bottom = max(one[1] for one in seen), min(one[3] for one in seen)
    size = models[0].width, models[0].height
    widths = [right - left + 1 for left, _, right, _ in seen]
    shares = np.array([[width / size[0], (bottom - top + 1) / size[1]] for width in widths])
    if not (FOCAL_RANGE[0] < shares).all():
        raise InvalidImages(
            f"pair {calibration.name}: rectified, of {size[0]} × {size[1]} pixels "
            f"{min(widths):z.0f} × {bottom - top + 1:z.0f} would be left; the distortion coefficients, the focal "
            "length or the poses are wrong",
            pair=calibration.name,
        )
    # a rounding more or less must not cost a pixel
    width, height = math.floor(max(widths) + 1e-6), math.floor(bottom - top + 1 + 1e-6)
    left, right = (_Frame(f, -one[0], -top, width, height) for one in seen)
    return left, right


def _inner_rectangle(model: CameraModel, R: NDArray[np.float64], f: float) -> NDArray[np.float64]:
    """Left, top, right and bottom of the largest upright rectangle [px, from the axis] without an empty pixel."""
    w, h = model.width - 1, model.height - 1
    across, down = np.arange(model.width, dtype=float), np.arange(model.height, dtype=float)
    edges = [
        np.column_stack([np.zeros_like(down), down]),
        np.column_stack([across, np.zeros_like(across)]),
        np.column_stack([np.full_like(down, w), down]),
        np.column_stack([across, np.full_like(across, h)]),
    ]
    left, top, right, bottom = (f * _turned_rays(model, edge, R) for edge in edges)
    K, margin = model.matrix, (LARGEST_MARGIN * model.width, LARGEST_MARGIN * model.height)
    return np.array(
        [
            max(left[:, 0].max(), -K[0, 2] - margin[0]),
            max(top[:, 1].max(), -K[1, 2] - margin[1]),
            min(right[:, 0].min(), w - K[0, 2] + margin[0]),
            min(bottom[:, 1].min(), h - K[1, 2] + margin[1]),
        ]
    )


def _turned_rays(model: CameraModel, pixels: NDArray[np.float64], R: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where rays of pixels (n, 2) meet the plane at depth one of the turned camera, (m, 2), without those behind."""
    points = pixels[:, None, :]
    if model.model == "fisheye":
        found = cv2.fisheye.undistortPoints(points, model.matrix, _coefficients(model), R=R, criteria=_PRECISE)[:, 0]
    else:
        found = cv2.undistortPoints(points, model.matrix, _coefficients(model), R=R, criteria=_PRECISE)[:, 0]
    ahead = np.isfinite(found).all(axis=1) & (np.abs(found).max(axis=1) < _ASIDE)
    return np.asarray(found[ahead], float) if ahead.any() else np.zeros((1, 2))


def _seen_through(
    image: NDArray[np.uint8], model: CameraModel, R: NDArray[np.float64], camera: Camera
) -> NDArray[np.uint8]:
    K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    build = cv2.fisheye.initUndistortRectifyMap if model.model == "fisheye" else cv2.initUndistortRectifyMap
    u, v = build(model.matrix, _coefficients(model), R, K, (camera.width, camera.height), cv2.CV_32FC1)
    return cv2.remap(image, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT, borderValue=(0.0,)).astype(np.uint8)


def _coefficients(model: CameraModel) -> NDArray[np.float64]:
    return np.zeros(4) if model.model == "none" else np.array(model.distortion)
