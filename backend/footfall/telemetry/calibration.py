"""Calibration of stereo pairs as their cameras are, before rectification: lens distortion and poses."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.frames import inverse, require_transform
from footfall.core.value import Value, value

DISTORTION = {"none": (0,), "plumb_bob": (4, 5), "rational": (8, 12, 14), "fisheye": (4,)}
"""Models and how many coefficients each takes, named and ordered as in OpenCV.

plumb_bob: k1, k2, p1, p2[, k3] (Brown, 1966). rational: k1, k2, p1, p2, k3, k4, k5, k6[,
s1, s2, s3, s4 of a thin prism[, τx, τy of a tilted sensor]]. fisheye: k1…k4 of the angle
(Kannala & Brandt, PAMI 2006).
"""


@value
class CameraModel(Value):
    """A camera with its lens, OpenCV axes (z forward, x right, y down).

    fx, fy, cx, cy: [px]; the centre of the first pixel is at (0, 0). model: one of ``DISTORTION``;
    distortion: its coefficients. T_base_camera: pose on the chassis, (4, 4).
    """

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: str
    distortion: NDArray[np.float64]
    T_base_camera: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidImages for a size, intrinsics or coefficients that can't be, and for an unknown lens model."""
        if self.width < 1 or self.height < 1:
            raise InvalidImages(f"camera {self.name} needs a size above zero")
        if not np.isfinite([self.fx, self.fy, self.cx, self.cy]).all() or not (self.fx > 0 and self.fy > 0):
            raise InvalidImages(f"camera {self.name} needs finite intrinsics and focal lengths above zero")
        if self.model not in DISTORTION:
            raise InvalidImages(
                f"camera {self.name}: the distortion model {self.model!r} is unknown; known are {', '.join(DISTORTION)}"
            )
        counts = DISTORTION[self.model]
        if self.distortion.ndim != 1 or len(self.distortion) not in counts:
            raise InvalidImages(
                f"camera {self.name}: {self.model} takes {' or '.join(map(str, counts))} coefficients, "
                f"not an array of shape {self.distortion.shape}"
            )
        if not np.isfinite(self.distortion).all():
            raise InvalidImages(f"camera {self.name} needs finite distortion coefficients")
        require_transform(self.T_base_camera, f"T_base_camera of {self.name}")

    @property
    def matrix(self) -> NDArray[np.float64]:
        """K, (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@value
class PairCalibration(Value):
    """Two cameras side by side, not yet rectified."""

    name: str
    left: CameraModel
    right: CameraModel

    def check(self) -> None:
        """Raises InvalidImages for cameras of different sizes or kinds of lenses, or not side by side along x."""
        if (self.left.width, self.left.height) != (self.right.width, self.right.height):
            raise InvalidImages(
                f"pair {self.name}: the cameras have different sizes, {self.left.width} × {self.left.height} and "
                f"{self.right.width} × {self.right.height}",
                pair=self.name,
            )
        if (self.left.model == "fisheye") != (self.right.model == "fisheye"):
            raise InvalidImages(f"pair {self.name}: both lenses must be fisheye, or neither", pair=self.name)
        x, y, z = self.T_left_right[:3, 3]
        if not x > max(abs(y), abs(z)):
            raise InvalidImages(
                f"pair {self.name}: the baseline must be above zero: the right camera lies at ({x:z.3f}, {y:z.3f}, "
                f"{z:z.3f}) m from the left one and should lie mostly along its +x",
                pair=self.name,
            )

    @property
    def T_left_right(self) -> NDArray[np.float64]:
        """Pose of the right camera in the left one, (4, 4)."""
        return inverse(self.left.T_base_camera) @ self.right.T_base_camera
