"""What statics needs of one posture, from one pass of pin: Jacobians, the centre of mass and where the wheels are.

The gradient of the centre of mass, times mass and gravity, is what gravity asks of the joints.
"""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from footfall.balance.torque_kernel import jacobians_at
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.model import Robot
from footfall.robot.pin_scratch import pin_scratch


class PostureStatics:
    """What statics needs of one posture, in base, from one pass of pin.

    com: (3,) [m] of the robot with the payload of its description. moment_gradient: (3, legs × 6), d(Σ mass × position)
    / d(joint angle) [kg·m/rad]. jacobian: (6, legs × 6), of the point of each joint's link that is at base's origin,
    linear over angular. wheel_centers [m], axles, outward: (legs, 3), each wheel's centre, y and x.
    """

    __slots__ = ("axles", "com", "jacobian", "moment_gradient", "outward", "robot", "wheel_centers")

    def __init__(self, robot: Robot, posture: ArrayLike) -> None:
        q = robot.require_posture(posture)
        self.robot = robot
        with pin_scratch(robot) as data:
            gradient = pin.jacobianCenterOfMass(robot.model, data, q)
            mass = data.mass[0]
            moment = mass * data.com[0]
            self.moment_gradient = mass * gradient
            self.jacobian = np.array(data.J)
            ankles = [data.oMi[6 * leg + 6] for leg in robot.legs]
            turns = np.array([ankle.rotation for ankle in ankles])
            places = np.array([ankle.translation for ankle in ankles])
        self.outward, self.axles = turns[:, :, 0], turns[:, :, 1]
        foot = np.array([leg.foot for leg in robot.description.legs])
        self.wheel_centers = places + foot[:, None] * self.outward
        # pin leaves out what is fixed to the base
        chassis, payload = robot.model.inertias[0], robot.description.payload
        moment = moment + chassis.mass * chassis.lever
        if payload is not None:
            moment = moment + payload.mass * payload.position
        self.com = moment / robot.mass

    def contacts(self, legs: Sequence[int], normals: Array, T_site_base: Array) -> Array:
        """Points of the wheels' rims that are lowest along unit normals (k, 3) in site; site, (k, 3) [m]."""
        chosen = list(legs)
        lowest = lowest_rim_points(
            self.wheel_centers[chosen],
            self.axles[chosen],
            self.outward[chosen],
            normals @ T_site_base[:3, :3],
            self.robot.wheel_radius,
        )
        return apply(T_site_base, lowest)

    def contact_jacobians(self, legs: Sequence[int], points_base: Array) -> Array:
        """d(point) / d(joint angles of its leg), (k, 3, 6) [m/rad].

        points_base: (k, 3) [m], thought fixed to the legs' last links (the wheels are locked).
        """
        return jacobians_at(self.jacobian, np.array(legs, np.int64), points_base)

    def gravity_torques(self, up_base: Array, gravity: float) -> Array:
        """Torques that hold the joints with no wheel on the ground, (legs × 6,) [N·m].

        up_base: (3,) unit, against gravity; gravity [m/s²].
        """
        return gravity * (up_base @ self.moment_gradient)


def lowest_rim_points(centers: Array, axles: Array, outward: Array, normals: Array, radius: float) -> Array:
    """Points of wheels' rims that are lowest along unit normals.

    Of a wheel that lies flat all points are as low; it is the one farthest from the ankle, along ``outward``.

    Args:
        centers: (k, 3) of the wheels [m], as all else in one frame.
        axles: (k, 3) unit.
        outward: (k, 3) away from the ankle.
        normals: (k, 3) unit, out of the ground.
        radius: of the wheels [m].

    Returns:
        (k, 3) [m].
    """
    radial = (normals * axles).sum(axis=1, keepdims=True) * axles - normals
    size = np.sqrt((radial * radial).sum(axis=1, keepdims=True))
    return centers + radius * np.where(size > 1e-9, radial / np.maximum(size, 1e-9), outward)
