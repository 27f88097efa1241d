"""The chassis moved over feet that stay where they are: what if?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from footfall.balance.forces import distribute
from footfall.balance.support import margin
from footfall.balance.torques import holding_torques
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy
from footfall.core.value import Provenance, Value, value
from footfall.maps.standing import contacts, standing
from footfall.planning.stance.follow import Obstacle, follow
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

FARTHEST = 5.0
"""Largest shift along one axis that is taken for meant [m]."""


@value
class BodyShift(Value):
    """How the chassis is to move, from where it is.

    dx, dy, dz: of the base's origin, along the axes of the site (east, north, up) [m].
    droll, dpitch, dyaw: turn about the base's own axes as they are now (x forward, y left, z up) [rad]:
    R_site_base′ = R_site_base · Rz(dyaw) · Ry(dpitch) · Rx(droll). Where the chassis is level, dyaw turns it about the
    vertical, dpitch > 0 lowers its front and droll > 0 lowers its right side.
    """

    dx: float = 0.0
    dy: float = 0.0
    dz: float = 0.0
    droll: float = 0.0
    dpitch: float = 0.0
    dyaw: float = 0.0

    def check(self) -> None:
        if not np.isfinite(self.vector).all():
            raise InvalidInput("a shift of the chassis needs finite dx, dy, dz [m] and droll, dpitch, dyaw [rad]")
        if np.abs(self.vector[:3]).max() > FARTHEST or np.abs(self.vector[3:]).max() > np.pi:
            raise InvalidInput(f"a shift of the chassis is at most {FARTHEST:g} m along an axis and π about one")

    @property
    def vector(self) -> Array:
        """(6,): dx, dy, dz [m], droll, dpitch, dyaw [rad]."""
        return np.array([self.dx, self.dy, self.dz, self.droll, self.dpitch, self.dyaw], float)

    def applied(self, T_site_base: Array) -> Array:
        """T_site_base′ (4, 4) of the chassis at T_site_base after the shift; the same array for no shift."""
        T = np.array(T_site_base, float)
        if self.vector.any():
            T[:3, :3] = T[:3, :3] @ rotation_rpy(self.droll, self.dpitch, self.dyaw)
            T[:3, 3] += (self.dx, self.dy, self.dz)
        return T

    @property
    def inverse(self) -> "BodyShift":
        """The shift that leads back."""
        return _shift(-self.vector[:3], rotation_rpy(self.droll, self.dpitch, self.dyaw).T)


def shift_between(T_from: Array, T_to: Array) -> BodyShift:
    """The shift that leads from one T_site_base (4, 4) to another."""
    return _shift(T_to[:3, 3] - T_from[:3, 3], T_from[:3, :3].T @ T_to[:3, :3])


def _shift(moved: Array, R: Array) -> BodyShift:
    yaw, pitch, roll = Rotation.from_matrix(R).as_euler("ZYX")
    dx, dy, dz = (float(d) for d in moved)
    return BodyShift(dx, dy, dz, float(roll), float(pitch), float(yaw))


@value
class PredictedState(RobotState):
    """A state that was computed, not measured: posture and chassis pose are what was asked for.

    predicted: fields that come from a model of static contact (rigid legs, friction; the forces of least norm) where
    a measured state has measurements. provenance: the state it starts from, and the shift as settings.
    """

    predicted: tuple[str, ...]
    provenance: Provenance


@value
class ShiftRefused(Value):
    """Why the chassis can't be there with the feet where they are.

    leg: the leg in the way, or None where the rover as a whole would tip. joint: its joint outside its limits, or
    empty. excess: by how much: [rad] where a joint is named, else [m]; NaN where it has no size. reason: in words.
    """

    leg: int | None
    joint: str
    excess: float
    reason: str


def shifted_state(robot: Robot, dem: Dem, state: RobotState, shift: BodyShift) -> PredictedState | ShiftRefused:
    """The rover with its chassis shifted and every standing wheel locked where it stands.

    A wheel stands where maps.standing says so, also over ground that nobody saw; a leg in the air keeps its joint
    angles. Each leg stays on the branch of its inverse kinematics: the posture is the one that a continuous move
    leads to (see follow.py). Forces are those of least norm inside friction, torques those that hold, as for ``stand``.
    Collisions are not looked at: plan_body_move does.

    Raises InvalidInput where the state is of another robot or shift is no BodyShift.
    """
    require_same_robot(robot, state)
    require_shift(shift)
    down = standing(robot, dem, state.posture, state.T_site_base, robot.legs)
    T_to = shift.applied(state.T_site_base)
    found = follow(robot, np.asarray(state.posture), np.asarray(state.T_site_base), T_to, down)
    if isinstance(found, Obstacle):
        return ShiftRefused(found.leg, found.joint, found.excess, told(found))
    return _resting(robot, dem, state, shift, found.postures[-1], T_to, down)


def told(found: Obstacle) -> str:
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
    robot: Robot, dem: Dem, state: RobotState, shift: BodyShift, posture: Array, T_site_base: Array, down: Sequence[int]
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
            reason = f"the rover would tip: its centre of mass would be {beyond:.3f} m outside the support polygon"
        else:
            reason = "the rover would slip: no contact forces inside friction hold it"
        size = float(beyond) if 0 < beyond < np.inf else float("nan")
        return ShiftRefused(None, "", size, f"{reason}; ask for a smaller shift or another direction")
    forces = np.zeros((robot.leg_count, 3))
    forces[list(down)] = held
    torques = holding_torques(robot, posture, T_site_base, list(down), feet.points, held)
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    return PredictedState(
        robot=state.robot,
        time=state.time,
        posture=posture,
        T_site_base=T_site_base,
        wheel_forces=forces,
        joint_torques=torques,
        mode="idle",
        predicted=("wheel_forces", "joint_torques"),
        provenance=Provenance(parents, shift),
    )
