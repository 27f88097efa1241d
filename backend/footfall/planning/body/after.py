"""How the rover stands after what is planned: the state that the next step is planned from."""

import numpy as np

from footfall.balance.forces import distribute
from footfall.balance.torques import holding_torques
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.maps.standing import contacts, standing
from footfall.planning.body.body_shift import PredictedState
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def state_after(
    robot: Robot, dem: Dem, state: RobotState, posture: Array, T_site_base: Array, after: str
) -> PredictedState:
    """The rover at rest in what a plan or sequence ends with.

    Wheels stand where maps.standing says so; forces are those of least norm inside friction, torques those that hold.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: what the plan starts from.
        posture: that it ends with, (legs × 6,) [rad].
        T_site_base: pose of the chassis that it ends with, (4, 4).
        after: digest of the plan or sequence.

    Returns:
        The state.

    Raises:
        InvalidInput: no forces hold the rover.
    """
    down = standing(robot, dem, posture, T_site_base, robot.legs)
    feet = contacts(robot, dem, posture, T_site_base, down)
    com = apply(T_site_base, center_of_mass(robot, posture))
    held = distribute(feet.points, feet.normals, com, robot.mass)
    if held is None:
        raise InvalidInput(
            f"no forces on the wheels of legs {', '.join(str(leg) for leg in down)} hold the rover where this ends; "
            "plan the step to another footfall",
            standing=list(down),
        )
    forces = np.zeros((robot.leg_count, 3))
    forces[list(down)] = held
    return PredictedState(
        robot=state.robot,
        time=state.time,
        posture=np.asarray(posture),
        T_site_base=np.asarray(T_site_base),
        wheel_forces=forces,
        joint_torques=holding_torques(robot, posture, T_site_base, list(down), feet.points, held),
        mode="idle",
        predicted=("posture", "T_site_base", "wheel_forces", "joint_torques"),
        provenance=Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest, "after": after}),
    )
