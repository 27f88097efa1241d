"""Camera models and stereo pairs. Images are rectified: the right camera lies along +x of the left."""

from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.frames import require_transform
from footfall.core.value import Value, value
from footfall.telemetry.state import RobotState

LONGEST_NAME = 64
"""Of a pair, as the rover link takes it [characters]."""


@value
class Camera(Value):
    """Pinhole model without distortion, OpenCV axes (z forward, x right, y down).

    fx, fy, cx, cy: [px]; the centre of the first pixel is at (0, 0).
    T_base_camera: pose on the chassis, (4, 4).
    """

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    T_base_camera: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidImages without a size, focal lengths above zero, and finite intrinsics."""
        if self.width < 1 or self.height < 1 or not (self.fx > 0 and self.fy > 0):
            raise InvalidImages(f"camera {self.name} needs a size and focal lengths above zero")
        if not np.isfinite([self.fx, self.fy, self.cx, self.cy]).all():
            raise InvalidImages(f"camera {self.name} needs finite intrinsics")
        require_transform(self.T_base_camera, f"T_base_camera of {self.name}")

    def reduced(self, scale: float) -> "Camera":
        """The same view with ``scale`` times the pixels along each side."""
        width, height = max(1, round(self.width * scale)), max(1, round(self.height * scale))
        return replace(
            self,
            width=width,
            height=height,
            fx=self.fx * width / self.width,
            fy=self.fy * height / self.height,
            cx=(self.cx + 0.5) * width / self.width - 0.5,
            cy=(self.cy + 0.5) * height / self.height - 0.5,
        )


@value
class ImagePair(Value):
    """One rectified stereo pair, grey, (height, width) uint8 each.

    time: when the left image was taken [s]; time_right: the right one, None where it is known to be the same moment.
    T_site_base: pose of the chassis when the pair was taken.
    """

    name: str
    time: float
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    camera_left: Camera
    camera_right: Camera
    T_site_base: NDArray[np.float64]
    time_right: float | None = None

    def check(self) -> None:
        """Raises InvalidImages for images that are not their camera's, and for a baseline that is not above zero."""
        for side, image, camera in (("left", self.left, self.camera_left), ("right", self.right, self.camera_right)):
            if image.dtype != np.uint8 or image.shape != (camera.height, camera.width):
                raise InvalidImages(
                    f"pair {self.name}: the {side} image is {image.dtype} {image.shape}, "
                    f"its camera wants uint8 ({camera.height}, {camera.width})"
                )
        if self.baseline <= 0:
            raise InvalidImages(f"pair {self.name}: the right camera must lie to the right of the left one")
        require_transform(self.T_site_base, "T_site_base")

    @property
    def baseline(self) -> float:
        """Distance between the cameras along x of the left one [m]."""
        left, right = self.camera_left.T_base_camera, self.camera_right.T_base_camera
        return float(left[:3, 0] @ (right[:3, 3] - left[:3, 3]))


@value
class Snapshot(Value):
    """All pairs taken at one state of the rover. left_out: pairs that came but can't be used, by name, and why."""

    state: RobotState
    pairs: tuple[ImagePair, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)

    def check(self) -> None:
        """Raises InvalidImages for a snapshot without pairs."""
        if not self.pairs:
            raise InvalidImages("a snapshot needs at least one image pair")

    @property
    def pixels(self) -> int:
        """Of all its images."""
        return sum(pair.left.size + pair.right.size for pair in self.pairs)
