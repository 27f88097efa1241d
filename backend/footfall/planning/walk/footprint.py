"""Where the feet would be if the rover stood at ease, and the chassis pose that suits feet where they are."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.robot.ik import contact_point
from footfall.robot.model import Robot

HIP_PITCH, KNEE_PITCH = math.radians(-24.0), math.radians(80.0)
"""A posture with room to walk: the leg reaches 0.2 m farther out and as far in before its wrist is straight [rad]."""
FOLLOWS_SLOPE = 0.6
"""Share of the slope through its feet that the chassis leans with."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """feet: (legs, 2) contacts in base of the rover at ease [m]; height: of the base above them [m]."""

    feet: Array
    height: float

    def at(self, x: float, y: float, yaw: float) -> Array:
        """The feet (legs, 2) in site of a rover at ease there."""
        c, s = math.cos(yaw), math.sin(yaw)
        return self.feet @ np.array([[c, s], [-s, c]]) + (x, y)

    def fits(self, contacts: Array) -> tuple[Array, Array]:
        """Chassis poses (n, 6) that suit contacts (n, legs, 3) best, and how far each foot is off, (n, legs) [m].

        A pose is x, y, z [m], roll, pitch, yaw [rad]. Position and heading are those of least squares (Umeyama,
        "Least-squares estimation of transformation parameters", 1991, in the plane).
        """
        middle = contacts.mean(axis=1)
        feet = self.feet - self.feet.mean(axis=0)
        away = contacts - middle[:, None]
        sines = (feet[:, 0] * away[..., 1] - feet[:, 1] * away[..., 0]).sum(axis=1)
        cosines = (feet * away[..., :2]).sum(axis=(1, 2))
        yaw = np.arctan2(sines, cosines)
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        off = np.hypot(
            away[..., 0] - (c * feet[:, 0] - s * feet[:, 1]), away[..., 1] - (s * feet[:, 0] + c * feet[:, 1])
        )
        # the plane through the feet, in axes that turn with the chassis
        along, left = c * away[..., 0] + s * away[..., 1], c * away[..., 1] - s * away[..., 0]
        xx, xy, yy = (along**2).sum(axis=1), (along * left).sum(axis=1), (left**2).sum(axis=1)
        xz, yz = (along * away[..., 2]).sum(axis=1), (left * away[..., 2]).sum(axis=1)
        det = np.maximum(xx * yy - xy * xy, 1e-6)
        rise, bank = (xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det
        poses = np.column_stack(
            [
                middle[:, :2],
                middle[:, 2] + self.height,
                np.arctan(FOLLOWS_SLOPE * bank),
                -np.arctan(FOLLOWS_SLOPE * rise),
                yaw,
            ]
        )
        return poses, off


def footprint(robot: Robot, height: float | None = None) -> Footprint:
    """Of a robot at ease; height: of the base above its feet [m], where it is not that of the posture."""
    posture = np.zeros(6 * robot.leg_count)
    posture[1::6], posture[2::6] = HIP_PITCH, KNEE_PITCH
    posture[4::6] = math.pi / 2 - HIP_PITCH - KNEE_PITCH
    feet = _feet(robot, posture)
    return Footprint(feet[:, :2].copy(), height_above_feet(robot, posture) if height is None else height)


def height_above_feet(robot: Robot, posture: Array) -> float:
    """Of the base in a posture (legs × 6,) on level ground [m]."""
    return float(-_feet(robot, posture)[:, 2].mean())


def _feet(robot: Robot, posture: Array) -> Array:
    return np.array([contact_point(robot, posture, leg, np.eye(4)) for leg in robot.legs])
