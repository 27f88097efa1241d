"""The robot that everything computes with: a description and its pin models, built once.

The default robot is the first ATHLETE prototype. Its proportions, joint limits, mass fractions and torque ratios are
those of the unit-scale ATHLETE model that K. Hauser published (length scale 2.75, mass scale 850, torque scale
2337.5); its author says the joint limits were tuned by hand. What has no source stands in ``description.assumed``.
"""

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput, InvalidRobot, NotFound
from footfall.robot.description import JOINTS, RobotDescription, athlete_layout
from footfall.telemetry.joint_layout import JointLayout

_JOINT_MODELS = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}


class Robot:
    """One rover. Immutable after construction; pickles as its description.

    The base is fixed: the models hold the joints only, and gravity is turned into the base frame.
    ``model`` is the whole robot, ``leg_models[i]`` one leg on a fixed base (the same frames). Computations take
    their own pin Data, so one Robot may serve several threads.

    lower, upper [rad], torque_limits [N·m], speed_limits [rad/s], stiffness [N·m/rad]: (legs × 6,).
    mass: whole rover with payload [kg].
    """

    def __init__(self, description: RobotDescription) -> None:
        self.description = description
        self.name = description.name
        self.leg_count = len(description.legs)
        self.lower, self.upper = description.lower, description.upper
        self.torque_limits = description.torque_limits
        self.speed_limits = description.speed_limits
        self.stiffness = description.stiffness
        self.wheel_radius = description.wheel_radius
        self.model = _checked_model(description)
        self.leg_models = tuple(_leg_model(description, i) for i in range(self.leg_count))
        # Gravity torques are linear in gravity: one model for each axis of unit gravity, none ever changed.
        self.unit_gravity_models = tuple(_with_gravity(self.model, axis) for axis in np.eye(3))
        payload = description.payload
        self.mass = float(sum(inertia.mass for inertia in self.model.inertias)) + (payload.mass if payload else 0.0)
        self.link_frames = {link: self.model.getFrameId(link) for link in description.meshes}

    def __reduce__(self) -> tuple[Any, ...]:
        return Robot, (self.description,)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, legs={self.leg_count})"

    @property
    def digest(self) -> str:
        """Content name of the description."""
        return self.description.digest

    @property
    def legs(self) -> range:
        """Leg numbers."""
        return range(self.leg_count)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of all joints, leg by leg from the hip to the foot."""
        return self.description.joint_names

    @property
    def layout(self) -> JointLayout:
        """Its legs and joints by name."""
        return athlete_layout(self.leg_count)

    def posture(self, name: str) -> NDArray[np.float64]:
        """Joint angles of a named posture, (legs × 6,) [rad]; raises NotFound naming those that exist."""
        try:
            return self.description.postures[name]
        except KeyError:
            known = ", ".join(self.description.postures)
            raise NotFound(f"{self.name} has no posture {name!r}; it has {known}") from None

    def require_posture(self, posture: ArrayLike) -> NDArray[np.float64]:
        """The posture as float64 (legs × 6,); raises InvalidInput unless it has that many finite angles."""
        q = np.asarray(posture, float)
        if q.shape != (6 * self.leg_count,) or not np.isfinite(q).all():
            raise InvalidInput(
                f"a posture of {self.name} needs {6 * self.leg_count} finite joint angles [rad]", shape=list(q.shape)
            )
        return q

    def require_leg(self, leg: int) -> int:
        """The leg number; raises InvalidInput unless the robot has that leg."""
        if not isinstance(leg, (int, np.integer)) or isinstance(leg, bool) or leg not in self.legs:
            raise InvalidInput(f"{self.name} has legs 0 to {self.leg_count - 1}", leg=str(leg))
        return int(leg)

    def leg_length(self, leg: int) -> float:
        """Farthest that a contact can be from the hip-yaw joint [m]: the leg stretched straight."""
        return float(self.description.legs[self.require_leg(leg)].reaches[-1] + self.wheel_radius)


def _checked_model(description: RobotDescription) -> pin.Model:
    model = pin.buildModelFromXML(description.urdf)
    found = tuple(model.names)[1:]
    if found != description.joint_names:
        raise InvalidRobot(f"the URDF of {description.name} has other joints than its description", found=list(found))
    model.gravity = pin.Motion.Zero()
    return model


def _leg_model(description: RobotDescription, leg: int) -> pin.Model:
    """The six joints of one leg on a fixed base; kinematics only."""
    spec = description.legs[leg]
    model = pin.Model()
    offsets = [np.zeros(3), spec.hip_offset, (spec.thigh, 0, 0), np.zeros(3), (spec.shank, 0, 0), np.zeros(3)]
    parent = 0
    for (part, axis), offset in zip(JOINTS, offsets, strict=True):
        placement = pin.SE3(np.eye(3), np.asarray(offset, float)) if parent else pin.SE3(spec.T_base_hip)
        parent = model.addJoint(parent, _JOINT_MODELS[axis](), placement, f"leg{leg}_{part}_joint")
    return model


def _with_gravity(model: pin.Model, gravity: NDArray[np.float64]) -> pin.Model:
    copy = model.copy()
    copy.gravity = pin.Motion(gravity, np.zeros(3))
    return copy
