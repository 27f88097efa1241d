"""Images as a lens takes them made into a rectified pair (Bouguet's method, as OpenCV implements it).

Distortion is taken out and both cameras are turned, by software, until they look the same way at right angles to the
baseline; then each point lies in one row of both images.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import inverse, require_transform, transform
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.telemetry.images import Camera, ImagePair
from footfall.terrain.settings import MAX_SKEW

FOCAL_RANGE = (0.2, 5.0)
"""A rectified focal length outside these shares of the lens's own means that the models can't be right."""


def rectify(
    calibration: PairCalibration,
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    *,
    time: float = 0.0,
    time_right: float | None = None,
    T_site_base: ArrayLike | None = None,
    max_skew: float = MAX_SKEW,
) -> ImagePair:
    """The rectified pair of two grey images (height, width), of the same size; pixels without a source are black.

    time, time_right: when they were taken [s] (None: at the same time). T_site_base: (4, 4), by default identity.
    Raises InvalidImages, naming the pair: wrong size, taken at different times, a pose that is not finite.
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
    turns, cameras = rectified_cameras(calibration)
    images = [
        _seen_through(image, model, R, camera)
        for image, model, R, camera in zip(
            (left, right), (calibration.left, calibration.right), turns, cameras, strict=True
        )
    ]
    return ImagePair(name, time, images[0], images[1], cameras[0], cameras[1], T, time_right)


def require_simultaneous(name: str, time_left: float, time_right: float | None, max_skew: float) -> None:
    """Raise InvalidImages where the images of a pair were taken more than ``max_skew`` [s] apart.

    time_right: None where it is the same moment.
    """
    apart = 0.0 if time_right is None else abs(time_right - time_left)
    if not apart <= max_skew:
        raise InvalidImages(
            f"pair {name}: the images were taken {apart:.3f} s apart, {max_skew:.3f} s at most: not synchronised",
            pair=name,
            apart=apart,
        )


def rectified_cameras(
    calibration: PairCalibration,
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
    f, cx, cy = float(P_left[0, 0]), float(P_left[0, 2]), float(P_left[1, 2])
    if not (np.isfinite([f, cx, cy]).all() and FOCAL_RANGE[0] < f / a.fx < FOCAL_RANGE[1]):
        raise InvalidImages(
            f"pair {calibration.name}: rectified, the focal length would be {f:.1f} px instead of about {a.fx:.0f}; "
            "the distortion coefficients or the poses are wrong",
            pair=calibration.name,
        )
    R_base_rectified = a.T_base_camera[:3, :3] @ R_left.T
    left, right = (
        Camera(model.name, model.width, model.height, f, f, center, cy, transform(R_base_rectified, position))
        for model, center, position in (
            (a, cx, a.T_base_camera[:3, 3]),
            (b, float(P_right[0, 2]), b.T_base_camera[:3, 3]),
        )
    )
    return (R_left, R_right), (left, right)


def _seen_through(
    image: NDArray[np.uint8], model: CameraModel, R: NDArray[np.float64], camera: Camera
) -> NDArray[np.uint8]:
    K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    build = cv2.fisheye.initUndistortRectifyMap if model.model == "fisheye" else cv2.initUndistortRectifyMap
    u, v = build(model.matrix, _coefficients(model), R, K, (camera.width, camera.height), cv2.CV_32FC1)
    return cv2.remap(image, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT, borderValue=(0.0,)).astype(np.uint8)


def _coefficients(model: CameraModel) -> NDArray[np.float64]:
    return np.zeros(4) if model.model == "none" else np.array(model.distortion)
