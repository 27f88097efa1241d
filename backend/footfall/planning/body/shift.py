"""The chassis moved over feet that stay where they are: what if?"""

from collections.abc import Sequence

import numpy as np

from footfall.balance.forces import distribute
from footfall.balance.support import margin
from footfall.balance.torques import holding_torques
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.maps.standing import contacts, standing
from footfall.planning.body.body_shift import BodyShift, PredictedState, ShiftRefused
from footfall.planning.body.follow import Obstacle, follow
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.robot.tolerance import state_inside
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def shifted_state(robot: Robot, dem: Dem, state: RobotState, shift: BodyShift) -> PredictedState | ShiftRefused:
    """Shift the chassis, every standing wheel locked where it stands, and predict the state.

    A wheel stands where maps.standing says so, also over ground that nobody saw; a leg in the air keeps its joint
    angles. Each leg stays on the branch of its inverse kinematics: the posture is the one that a continuous move leads
    to (see follow.py). Forces are those of least norm inside friction, torques those that hold, as for ``stand``.
    Collisions are not looked at: plan_body_move does.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        shift: how the chassis is to move, from where it is.

    Returns:
        The state there, or why the chassis can't be there with the feet where they are.

    Raises:
        InvalidInput: the state is of another robot, or shift is no BodyShift.
    """
    require_same_robot(robot, state)
    require_shift(shift)
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    state = state_inside(robot, state)
    down = standing(robot, dem, state.posture, state.T_site_base, robot.legs)
    T_to = shift.applied(state.T_site_base)
    found = follow(robot, np.asarray(state.posture), np.asarray(state.T_site_base), T_to, down)
    if isinstance(found, Obstacle):
        return ShiftRefused(found.leg, found.joint, found.excess, obstacle_in_words(found))
    return _resting(robot, dem, state, Provenance(parents, shift), found.postures[-1], T_to, down)


def obstacle_in_words(found: Obstacle) -> str:
    """An obstacle as a reason, with what to try."""
    where = "with the chassis there" if found.at_goal else f"{found.fraction:.0%} of the way"
    return f"{where}, {found.text}; ask for a smaller shift or another direction"


def require_same_robot(robot: Robot, state: RobotState) -> None:
    """Raise InvalidInput unless the state is of this robot."""
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")


def require_shift(shift: BodyShift) -> None:
    """Raise InvalidInput unless it is a BodyShift."""
    if not isinstance(shift, BodyShift):
        raise InvalidInput("a shift of the chassis is a BodyShift(dx, dy, dz, droll, dpitch, dyaw)")


def _resting(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    provenance: Provenance,
    posture: Array,
    T_site_base: Array,
    down: Sequence[int],
) -> PredictedState | ShiftRefused:
    # the feet as they stand now: the wheels have not moved, and rounding must not choose another piece of ground
    feet = contacts(robot, dem, state.posture, state.T_site_base, down)
    com = apply(T_site_base, center_of_mass(robot, posture))
    held = distribute(feet.points, feet.normals, com, robot.mass)
    if held is None:
        beyond = -margin(feet.points, com[:2]) if len(down) >= 3 else np.inf
        if len(down) < 3:
            reason = f"the rover would tip: {len(down)} wheels are on the ground, three are needed"
        elif beyond > 0:
            reason = f"the rover would tip: its centre of mass would be {beyond:z.3f} m outside the support polygon"
        else:
            reason = "the rover would slip: no contact forces inside friction hold it"
        size = float(beyond) if 0 < beyond < np.inf else float("nan")
        return ShiftRefused(None, "", size, f"{reason}; ask for a smaller shift or another direction")
    forces = np.zeros((robot.leg_count, 3))
    forces[list(down)] = held
    torques = holding_torques(robot, posture, T_site_base, list(down), feet.points, held)
    return PredictedState(
        robot=state.robot,
        time=state.time,
        posture=posture,
        T_site_base=T_site_base,
        wheel_forces=forces,
        joint_torques=torques,
        mode="idle",
        predicted=("wheel_forces", "joint_torques"),
        provenance=provenance,
    )
