"""Closed-form inverse kinematics of one leg, and wheel poses on the ground.

After the hip yaw, hip pitch and knee pitch are a planar 2R to the ankle centre; knee roll, ankle pitch
and ankle roll meet there as an x-y-x wrist. A wheel pose has two solutions of each, so eight
*branches*. The branch id is ``4 · shoulder + 2 · elbow + wrist``:

- shoulder 0: the leg's plane points at the ankle; 1: it points away and the leg reaches back over the hip;
- elbow 0: knee pitch ≥ 0 (outer leg bends down); 1: knee pitch < 0;
- wrist 0: ankle pitch ≥ 0; 1: ankle pitch < 0, with knee and ankle roll turned by π.

All named postures of ATHLETE are branch 0. Decoupling after Pieper, "The kinematics of manipulators under
computer control" (1968).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.frames import inverse, rotation
from footfall.robot.kinematics import wheel_pose
from footfall.robot.model import Robot

Array = NDArray[np.float64]
BRANCHES = 8
_SINGULAR = 1e-12
_LIMIT_SLACK = 1e-9  # rad: a joint exactly at its limit survives the rounding of its solution


@dataclass(frozen=True)
class IkSolutions:
    """q: (n, 8, 6) joint angles [rad], NaN where a branch has no solution; valid: (n, 8), exists and inside limits."""

    q: Array
    valid: NDArray[np.bool_]


def solve_leg(robot: Robot, leg: int, Ts_base_wheel: ArrayLike) -> IkSolutions:
    """All branches for wheel poses (n, 4, 4) in base (x from ankle to wheel centre, y axle).

    Angles are turned by 2π into the joint's limits where that is possible; else they are in (−π, π].
    """
    leg = robot.require_leg(leg)
    spec = robot.description.legs[leg]
    Ts = np.asarray(Ts_base_wheel, float)
    if Ts.ndim != 3 or Ts.shape[1:] != (4, 4):
        raise InvalidInput("wheel poses need the shape (n, 4, 4)", shape=list(Ts.shape))
    Ts_hip_wheel = inverse(spec.T_base_hip) @ Ts
    R = Ts_hip_wheel[:, :3, :3]
    ankle = Ts_hip_wheel[:, :3, 3] - spec.foot * R[:, :, 0]

    q = np.empty((len(Ts), 2, 2, 2, 6))
    yaw = np.arctan2(ankle[:, 1], ankle[:, 0])
    reach = np.hypot(ankle[:, 0], ankle[:, 1])
    down = spec.hip_offset[2] - ankle[:, 2]
    l1, l2 = spec.thigh, spec.shank
    for shoulder in (0, 1):
        q0 = yaw + math.pi * shoulder
        out = (reach if shoulder == 0 else -reach) - spec.hip_offset[0]
        cos_knee = (out**2 + down**2 - l1**2 - l2**2) / (2 * l1 * l2)
        with np.errstate(invalid="ignore"):
            # a pose at full stretch may overshoot by rounding
            bend = np.arccos(np.where(np.abs(cos_knee) < 1 + 1e-12, np.clip(cos_knee, -1, 1), np.nan))
        for elbow in (0, 1):
            q2 = bend if elbow == 0 else -bend
            q1 = np.arctan2(down, out) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
            R_hip_knee = rotation("z", q0) @ rotation("y", q1 + q2)
            for wrist, angles in enumerate(_wrist(np.swapaxes(R_hip_knee, -1, -2) @ R)):
                q[:, shoulder, elbow, wrist, :3] = np.stack([q0, q1, q2], axis=-1)
                q[:, shoulder, elbow, wrist, 3:] = angles
    q = q.reshape(len(Ts), BRANCHES, 6)
    q[np.isnan(q).any(axis=-1)] = np.nan
    lower, upper = robot.lower[6 * leg : 6 * leg + 6], robot.upper[6 * leg : 6 * leg + 6]
    return IkSolutions(*_into_limits(q, lower, upper))


def wheel_pose_for_contact(
    robot: Robot, contact: ArrayLike, normal: ArrayLike, heading: ArrayLike, T_site_base: ArrayLike
) -> Array:
    """T_base_wheel, (…, 4, 4), of a wheel that stands upright on the ground at ``contact``.

    contact, normal: (…, 3) in site (normals need not be unit length); heading: (…) azimuth in site [rad] in which
    the wheel would roll. The wheel's x is −normal, its axle is perpendicular to heading and normal, and its
    centre is one radius above the contact along the normal. Inverse of :func:`contact_point`.
    Raises InvalidInput where a normal is zero or parallel to its heading. NaN gives NaN.
    """
    contact, normal, heading = np.asarray(contact, float), np.asarray(normal, float), np.asarray(heading, float)
    shape = np.broadcast_shapes(contact.shape[:-1], normal.shape[:-1], heading.shape)
    up = np.broadcast_to(normal, (*shape, 3))
    length = np.linalg.norm(up, axis=-1, keepdims=True)
    forward = np.broadcast_to(np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], -1), (*shape, 3))
    axle = np.cross(up, forward)
    size = np.linalg.norm(axle, axis=-1, keepdims=True)
    if (length < 1e-9).any() or (size < 1e-9).any():
        raise InvalidInput("a wheel stands on a ground whose normal is not zero and not along its heading")
    up, axle = up / length, axle / size
    T_site_wheel = np.zeros((*shape, 4, 4))
    T_site_wheel[..., :3, 0] = -up
    T_site_wheel[..., :3, 1] = axle
    T_site_wheel[..., :3, 2] = np.cross(axle, up)  # −x × y
    T_site_wheel[..., :3, 3] = contact + robot.wheel_radius * up
    T_site_wheel[..., 3, 3] = 1.0
    return inverse(np.asarray(T_site_base, float)) @ T_site_wheel


def contact_point(
    robot: Robot, posture: ArrayLike, leg: int, T_site_base: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)
) -> Array:
    """Point of the wheel's rim that is lowest along ``normal``, in site, (3,) [m]; the rim is a circle about the axle.

    Where the normal is along the axle (a wheel lying flat) all are as low; it is the one farthest from the ankle.
    """
    T_site_wheel = np.asarray(T_site_base, float) @ wheel_pose(robot, posture, leg)
    up = np.asarray(normal, float)
    length = np.linalg.norm(up)
    if up.shape != (3,) or not length > 0:
        raise InvalidInput("a normal needs three numbers, not all zero")
    axle = T_site_wheel[:3, 1]
    radial = (up @ axle) * axle - up
    size = np.linalg.norm(radial)
    lowest = radial / size if size > 1e-9 * length else T_site_wheel[:3, 0]
    return T_site_wheel[:3, 3] + robot.wheel_radius * lowest


def leg_azimuth(robot: Robot, leg: int, T_site_base: ArrayLike) -> float:
    """Azimuth in site of the leg's radially outward direction [rad]: the default heading of its wheel."""
    out = np.asarray(T_site_base, float)[:3, :3] @ robot.description.legs[leg].T_base_hip[:3, 0]
    return math.atan2(out[1], out[0])


def _wrist(R: Array) -> tuple[Array, Array]:
    """Both solutions (n, 3) of R = Rx(a) Ry(b) Rx(c), b ≥ 0 first. Where b is 0 or π, a is 0."""
    sin_b = np.hypot(R[:, 1, 0], R[:, 2, 0])
    b = np.arctan2(sin_b, R[:, 0, 0])
    a = np.where(sin_b > _SINGULAR, np.arctan2(R[:, 1, 0], -R[:, 2, 0]), 0.0)
    # c from what a and b leave over: near b = 0 an error in a is then undone by c
    rest = np.swapaxes(rotation("x", a) @ rotation("y", b), -1, -2) @ R
    c = np.arctan2(rest[:, 2, 1], rest[:, 1, 1])
    return np.stack([a, b, c], axis=-1), np.stack([a + math.pi, -b, c + math.pi], axis=-1)


def _into_limits(q: Array, lower: Array, upper: Array) -> tuple[Array, NDArray[np.bool_]]:
    two_pi = 2 * math.pi
    q = q - two_pi * np.ceil((q - math.pi) / two_pi)  # (−π, π]
    # Limits such as −110…180 hold the value or its turn by 2π, whichever lies inside.
    for turn in (two_pi, -two_pi):
        outside = (q < lower - _LIMIT_SLACK) | (q > upper + _LIMIT_SLACK)
        turned = q + turn
        fits = (turned >= lower - _LIMIT_SLACK) & (turned <= upper + _LIMIT_SLACK)
        q = np.where(outside & fits, turned, q)
    inside = (q >= lower - _LIMIT_SLACK) & (q <= upper + _LIMIT_SLACK)
    q = np.where(inside, np.clip(q, lower, upper), q)
    return q, np.all(inside, axis=-1, keepdims=True)[..., 0]
