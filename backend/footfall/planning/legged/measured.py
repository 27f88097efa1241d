"""A robot that others described as telemetry tells of it, and as plans begin from it."""

import numpy as np

from footfall.balance.forces import distribute
from footfall.balance.legged_effort import efforts_under
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.legged.footing import rest
from footfall.planning.legged.problem import LeggedState
from footfall.planning.legged.stance import all_standing
from footfall.planning.legged.stand import stand
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def as_measured(
    robot: LeggedRobot, q: np.ndarray, T_site_base: np.ndarray, feet: Feet, time: float = 0.0, mode: str = "idle"
) -> RobotState:
    """The robot as its own telemetry would have it, at rest: forces and efforts are computed, by static balance.

    Args:
        robot: the robot.
        q: posture, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        feet: those that stand, with contacts and normals of the ground.
        time: of the robot's clock [s].
        mode: one of footfall.telemetry.state.MODES.

    Returns:
        The state; forces are those of least norm.

    Raises:
        InvalidInput: no forces inside friction hold the robot on these feet.
    """
    standing = list(feet.standing)
    com = apply(T_site_base, placed(robot, q).com)
    held = None
    if standing:
        held = distribute(feet.contacts[standing], feet.normals[standing], com, robot.mass)
    if held is None:
        down = ", ".join(robot.leg_names[leg] for leg in standing) or "none"
        raise InvalidInput(f"the feet on the ground ({down}) can't hold {robot.name} up: it would tip or slip")
    forces = np.zeros((len(robot.legs), 3))
    forces[standing] = held
    efforts = efforts_under(robot, q, T_site_base, standing, feet.contacts[standing], held)
    return RobotState(robot.name, time, q, T_site_base, forces, efforts, mode, described=robot.layout)


def measured_at_rest(robot: LeggedRobot, dem: Dem, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> RobotState:
    """The robot standing at ease, as its telemetry would have it.

    Args:
        robot: the robot.
        dem: the ground, in site.
        x: east, of the chassis' origin in site [m].
        y: north, of the chassis' origin in site [m].
        yaw: heading of the chassis in site [rad].

    Returns:
        The state.

    Raises:
        InvalidInput: there is no such stance, or nothing holds the robot in it.
    """
    stance = stand(robot, dem, x, y, yaw)
    return as_measured(robot, stance.q, stance.T_site_base, all_standing(stance))


def set_points_of(robot: LeggedRobot, state: RobotState) -> Array:
    """Set points on which a robot rests, by its efforts.

    Args:
        robot: the robot.
        state: of the robot, with its efforts.

    Returns:
        (joints,) [rad or m]; where it is, of a joint that nobody says the stiffness of.
    """
    return state.posture + state.joint_torques / robot.stiffness


def set_points_told(robot: LeggedRobot, state: RobotState) -> Array | None:
    """Set points on which a robot rests that sags, where telemetry tells its efforts.

    Args:
        robot: the robot.
        state: of the robot.

    Returns:
        (joints,) [rad or m]; None of a rigid robot, and without efforts.
    """
    return set_points_of(robot, state) if robot.sags and state.joint_torques.any() else None


def standing_state(robot: LeggedRobot, dem: Dem, state: RobotState) -> LeggedState:
    """How a robot stands on the ground, by its joints and its chassis; planners judge whether its feet are on it.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: of telemetry.

    Returns:
        The state that plans begin from.

    Raises:
        InvalidInput: the state is of another robot.
    """
    if state.robot != robot.name or state.described is None or state.described.digest != robot.layout.digest:
        raise InvalidInput(f"the state is one of {state.robot}, with other joints than {robot.name} has")
    soles = apply(state.T_site_base, placed(robot, state.posture).soles)
    rests = [rest(dem, float(x), float(y), float(r)) for (x, y, _), r in zip(soles, robot.radii, strict=True)]
    contacts, normals = (np.array([one[part] for one in rests]) for part in (1, 2))
    told = set_points_told(robot, state)
    return LeggedState(robot.name, state.posture, state.T_site_base, soles, contacts, normals, told)
