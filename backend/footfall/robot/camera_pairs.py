"""Stereo pairs of a description: both cameras of one, by where their middle is and where it looks."""

import math

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import transform
from footfall.robot.description import CameraPairSpec
from footfall.telemetry.images import Camera


def focal_length(width: int, fov_deg: float) -> float:
    """Of a camera.

    Args:
        width: of its image [px].
        fov_deg: field of view from the left edge to the right [deg].

    Returns:
        [px].
    """
    return round(width / 2 / math.tan(math.radians(fov_deg) / 2), 9)


def looking_axes(tilt: float = 0.0) -> Array:
    """Axes of a camera in a frame that looks along x with z up.

    Args:
        tilt: how far it looks below x [rad].

    Returns:
        (3, 3): z forward and down, x right, y completes them.
    """
    forward = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    right = np.array([0.0, -1.0, 0.0])
    return np.column_stack([right, np.cross(forward, right), forward])


def camera_pair(
    name: str, R_base_camera: Array, middle: Array, width: int, height: int, focal: float, baseline: float
) -> CameraPairSpec:
    """Two cameras side by side that look the same way.

    Args:
        name: of the pair.
        R_base_camera: how both are turned on the chassis, (3, 3).
        middle: between their lenses, (3,) in base [m].
        width: of an image [px].
        height: of an image [px].
        focal: length of both [px].
        baseline: between their lenses [m].

    Returns:
        The pair; poses are rounded, as sines differ in the last bit between machines and digests must not.
    """
    left, right = (
        Camera(
            name=f"{name}_{side}",
            width=width,
            height=height,
            fx=focal,
            fy=focal,
            cx=(width - 1) / 2,
            cy=(height - 1) / 2,
            T_base_camera=np.round(transform(R_base_camera, middle + R_base_camera[:, 0] * shift), 12) + 0.0,
        )
        for side, shift in (("left", -baseline / 2), ("right", baseline / 2))
    )
    return CameraPairSpec(name, left, right)
