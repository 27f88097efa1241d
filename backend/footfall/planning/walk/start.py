"""How the rover stands before a walk: on all its feet, or why it can't begin."""

import numpy as np

from footfall.balance.payload import carried
from footfall.balance.torques import torque_check
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.maps.standing import contacts, standing
from footfall.planning.scene.lift import branch_of
from footfall.planning.step.held import NOTHING_HOLDS
from footfall.planning.walk.body_way import At
from footfall.planning.walk.problem import Stance, WalkSettings
from footfall.robot.kinematics import wheel_pose
from footfall.robot.model import Robot
from footfall.robot.tolerance import outside_in_words, state_inside
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

ADVICE = "correct the state or the terrain, or put the legs down first"


def start_of(robot: Robot, dem: Dem, state: RobotState) -> At | str:
    """The stance of a rover that stands on all its feet, or why it does not."""
    state = state_inside(robot, state)
    q, T_site_base = np.array(state.posture), np.array(state.T_site_base)
    outside = outside_in_words(robot, q)
    if outside:
        return f"the rover can't stand as its state says: {outside}; {ADVICE}"
    down = standing(robot, dem, q, T_site_base, robot.legs)
    up = [str(leg) for leg in robot.legs if leg not in down]
    if up:
        return f"a walk begins with all wheels on the ground; those of legs {', '.join(up)} are not; {ADVICE}"
    return At(stance_of(robot, dem, q, T_site_base), T_site_base, q)


def stance_of(robot: Robot, dem: Dem, q: Array, T_site_base: Array) -> Stance:
    """The stance of a posture, all of whose wheels are taken to be down.

    Args:
        robot: the rover.
        dem: the ground, in site.
        q: the posture, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        Which feet are where.
    """
    feet = contacts(robot, dem, q, T_site_base, robot.legs)
    Ts_site_wheel = np.array([T_site_base @ wheel_pose(robot, q, leg) for leg in robot.legs])
    branches = np.array([branch_of(robot, leg, q[6 * leg : 6 * leg + 6]) for leg in robot.legs], np.int64)
    return Stance(feet.points, feet.normals, Ts_site_wheel, branches)


def overloaded(robot: Robot, start: At, settings: WalkSettings) -> str:
    """Why the rover can't stand where a walk begins with the payload that the settings give it, or ""."""
    load = carried(robot, settings.balance)
    if settings.payload_mass is None or load is None:
        return ""
    q, T_site_base, normals = start.posture, start.T_site_base, start.stance.normals
    held = torque_check(robot, q, T_site_base, robot.legs, normals, settings.balance)
    if held.holds:
        return ""
    ratio, limit = beside(held.ratio, 1.0, 2)
    needs = f"{held.joint_name} would need {ratio} of its torque limit ({limit}), however the load is shared"
    mass, (x, y, z) = load
    return (
        f"the rover can't stand where the walk begins with {mass:g} kg at ({x:g}, {y:g}, {z:g}) m in base: "
        f"{needs if held.feasible else NOTHING_HOLDS}; take off payload, or put it nearer to the chassis' middle"
    )
