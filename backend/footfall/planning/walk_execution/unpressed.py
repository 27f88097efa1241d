"""The rover as plans that take it as rigid want it: its wheels not pressed in by their load."""

from dataclasses import replace

import numpy as np

from footfall.core.frames import inverse
from footfall.planning.body.follow import unwrapped
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import wheel_pose
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState


def unpressed(robot: Robot, state: RobotState) -> RobotState:
    """The state with every wheel moved to where its rim is, out of its spring's strain force / stiffness; chassis kept.

    A walk is planned from it: a wheel that its load presses in deeper than wheels may sink is not lifted by a plan that
    knows no springs, and where feet are put down later no load is in the plan either. A leg that does not reach there,
    or whose wheel bears nothing, keeps its posture.
    """
    T_base_site = inverse(state.T_site_base)
    strains = state.wheel_forces / robot.description.wheel_stiffness
    posture = np.array(state.posture)
    for leg in np.flatnonzero(strains.any(axis=1)).tolist():
        own = slice(6 * leg, 6 * leg + 6)
        T_site_wheel = state.T_site_base @ wheel_pose(robot, posture, leg)
        T_site_wheel[:3, 3] += strains[leg]
        q = unwrapped(solve_leg(robot, leg, (T_base_site @ T_site_wheel)[None]).q[0], posture[own])
        away = np.abs(q - posture[own]).max(axis=1)
        if np.isfinite(away).any():
            posture[own] = q[int(np.nanargmin(away))]
    return replace(state, posture=np.clip(posture, robot.lower, robot.upper))
