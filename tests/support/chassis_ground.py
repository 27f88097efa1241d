"""Ground and stances for the tests of steps and of chassis moves."""

import numpy as np

from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import leg_wheel_pose
from footfall.telemetry.state import RobotState
from footfall.terrain.from_arrays import from_heights


def wavy(rocks=(), hole=None, half=4.5, resolution=0.1, seed=None):
    """Gentle waves; rocks: (x, y, radius, height) domes; hole: (x, y, radius) unknown; seed: of 2 cm of roughness."""
    x = np.arange(-half, half + resolution / 2, resolution)
    X, Y = np.meshgrid(x, x)
    heights = 0.01 * np.sin(2 * X) * np.cos(1.7 * Y)
    if seed is not None:
        heights += np.random.default_rng(seed).uniform(0.0, 0.02, heights.shape)
    for east, north, radius, height in rocks:
        dome = np.sqrt(np.maximum(0.0, 1 - ((X - east) ** 2 + (Y - north) ** 2) / radius**2))
        heights = np.maximum(heights, height * dome)
    if hole is not None:
        heights[np.hypot(X - hole[0], Y - hole[1]) < hole[2]] = np.nan
    return from_heights(heights.astype(np.float32), resolution, -half, -half, "waves")


def with_posture(state, posture):
    return RobotState(
        state.robot, state.time, posture, state.T_site_base, state.wheel_forces, state.joint_torques, state.mode
    )


def lifted(robot, state, legs, height=0.3):
    """The state with the wheels of some legs straight up by so much, on their branches."""
    posture = np.array(state.posture)
    for leg in legs:
        own = slice(6 * leg, 6 * leg + 6)
        T = leg_wheel_pose(robot, posture[own], leg).copy()
        T[2, 3] += height
        found = solve_leg(robot, leg, T[None])
        away = np.where(found.valid[0], np.abs(found.q[0] - posture[own]).max(axis=1), np.inf)
        posture[own] = found.q[0, np.argmin(away)]
    return with_posture(state, posture)
