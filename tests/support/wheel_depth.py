"""How deep a wheel is in the ground, by the closed form of its drum's rims: a second method beside the meshes."""

import numpy as np

from footfall.robot.kinematics import wheel_pose
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at


def require_depth(told: float, robot: Robot, dem: Dem, posture: np.ndarray, T_site_base: np.ndarray, leg: int) -> None:
    """The depth [m] of the wheel's mesh, whose corners are on the rims or inside of them, with flats between them."""
    deepest = rim_depth(robot, dem, posture, T_site_base, leg)
    flat = robot.wheel_radius * (1 - np.cos(np.pi / robot.description.wheel_sides))
    assert deepest - flat - 0.002 <= told <= deepest + 0.002, (told, deepest)


def rim_depth(robot: Robot, dem: Dem, posture: np.ndarray, T_site_base: np.ndarray, leg: int) -> float:
    """How far the lowest place of the drum's two rims is straight below the ground [m]; negative above it."""
    T = T_site_base @ wheel_pose(robot, posture, leg)
    angle = np.linspace(0.0, 2 * np.pi, 721)
    rim = robot.wheel_radius * (np.cos(angle)[:, None] * T[:3, 0] + np.sin(angle)[:, None] * T[:3, 2]) + T[:3, 3]
    sides = [rim + side * 0.5 * robot.description.wheel_width * T[:3, 1] for side in (-1, 1)]
    return max(float((height_at(dem, edge[:, 0], edge[:, 1]) - edge[:, 2]).max()) for edge in sides)
