"""Whether forces of the ground hold a legged robot, and what share of its motors' efforts the best of them take.

The program is that of :mod:`footfall.balance.torques`: over all forces inside friction that balance the weight, the
least of the largest |effort| / limit (Hauser et al., IJRR 27, 2008).
"""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import GRAVITY, SIDES
from footfall.balance.cones import facets
from footfall.balance.friction import FRICTION
from footfall.balance.legged_effort_kernel import moves_of
from footfall.balance.region import require_stance
from footfall.balance.simplex import INFEASIBLE, OPTIMAL, UNFINISHED
from footfall.balance.torque_kernel import least_ratio
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError
from footfall.core.frames import apply
from footfall.robot.legged.able_to_walk import MOST_JOINTS
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import center_of_mass
from footfall.robot.pin_scratch import scratch_of


def effort_ratio(
    robot: LeggedRobot,
    posture: ArrayLike,
    T_site_base: Array,
    standing: Sequence[int],
    contacts: ArrayLike,
    normals: ArrayLike,
) -> float:
    """Least possible largest |effort| / limit over all joints.

    Joints without a limit don't count.

    Args:
        robot: the robot.
        posture: joint angles, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        standing: numbers of the legs on the ground, k of them.
        contacts: (k, 3) of theirs, in site [m].
        normals: (k, 3) of the ground there, in site.

    Returns:
        The share, 1 at the limit; inf where no forces inside friction hold the robot.

    Raises:
        InvalidInput: a normal does not point up.
        FootFallError: the program for the forces was not solved, which is a defect.
    """
    q = robot.require_posture(posture)
    R_site_base = T_site_base[:3, :3]
    gravity, axes, origins, com = statics_of(robot, q, R_site_base)
    feet = np.asarray(contacts, float)
    arms, unit = require_stance(feet - apply(T_site_base, com), np.asarray(normals, float))
    weight = robot.mass * GRAVITY
    own = gravity / robot.efforts
    constant, effect = np.zeros((len(standing), MOST_JOINTS)), np.zeros((len(standing), MOST_JOINTS, 3))
    points_base = (feet - T_site_base[:3, 3]) @ R_site_base
    for row, (leg, point) in enumerate(zip(standing, points_base, strict=True)):
        part = robot.slices[leg]
        count = part.stop - part.start
        moves = moves_at(robot, leg, point, axes, origins) @ R_site_base.T
        constant[row, :count] = own[part]
        effect[row, :count] = -weight / robot.efforts[part, None] * moves
    size = max(float(np.abs(arms).max()), 1e-6)
    status, ratio = _least(arms / size, facets(unit, FRICTION, SIDES), effect, constant)
    if status == INFEASIBLE:
        return float("inf")
    if status != OPTIMAL:
        raise FootFallError("the torque program was not solved", status=status)
    lifted = [np.abs(own[robot.slices[leg]]).max() for leg in robot.legs if leg not in standing]
    return float(max([ratio, *lifted]))


def efforts_under(
    robot: LeggedRobot,
    posture: ArrayLike,
    T_site_base: Array,
    standing: Sequence[int],
    contacts: ArrayLike,
    forces: ArrayLike,
) -> Array:
    """What the joints hold while given forces of the ground hold the robot: τ = g(q) − Jᵀ f.

    Args:
        robot: the robot.
        posture: joint angles, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        standing: numbers of the legs on the ground, k of them.
        contacts: (k, 3) of theirs, in site [m].
        forces: of the ground on each of them, (k, 3) in site [N].

    Returns:
        (joints,) [N·m or N].
    """
    q = robot.require_posture(posture)
    R_site_base = T_site_base[:3, :3]
    gravity, axes, origins, _ = statics_of(robot, q, R_site_base)
    points_base = (np.asarray(contacts, float) - T_site_base[:3, 3]) @ R_site_base
    efforts = gravity.copy()
    for leg, point, force in zip(standing, points_base, np.asarray(forces, float) @ R_site_base, strict=True):
        efforts[robot.slices[leg]] -= moves_at(robot, leg, point, axes, origins) @ force
    return efforts


def moves_at(robot: LeggedRobot, leg: int, point: Array, axes: Array, origins: Array) -> Array:
    """How a point of a leg's last body moves with the leg's joints, each together with those that follow it.

    Args:
        robot: the robot.
        leg: number of the leg, from 0.
        point: (3,) in base [m].
        axes: of all joints, as of :func:`statics_of`.
        origins: the same.

    Returns:
        (own joints, 3) in base, [m/rad] or without unit.
    """
    part = robot.slices[leg]
    solver = robot.limbs[leg]
    return solver.coupling.folded(moves_of(point, axes[part], origins[part], solver.limb.slides))


def _least(arms: Array, faces: Array, effect: Array, constant: Array) -> tuple[int, float]:
    """Status and ratio of the program.

    Feet in a row to within 1e-8 of the stance leave pivots so small that the search may lose its way; with the feet in
    another order it is the same program with other pivots.
    """
    status, ratio = UNFINISHED, float("nan")
    for first in range(len(arms)):
        if first:
            arms, faces, effect, constant = (np.roll(part, -1, axis=0) for part in (arms, faces, effect, constant))
        status, ratio = least_ratio(arms, faces, effect, constant, np.empty_like(arms))
        if status != UNFINISHED:
            break
    return int(status), float(ratio)


def statics_of(robot: LeggedRobot, q: Array, R_site_base: Array) -> tuple[Array, Array, Array, Array]:
    """What statics need of a posture.

    Args:
        robot: the robot.
        q: posture, (joints,) [rad or m].
        R_site_base: how the chassis is turned, (3, 3).

    Returns:
        Efforts (joints,) that hold the legs' own weight in the air [N·m or N], of a joint also what followers of it
        bear; axes and origins of the joints, (joints, 3), and the centre of mass, (3,), in base [m].
    """
    down = -GRAVITY * R_site_base[2]
    own_axes = np.concatenate([robot.limbs[leg].limb.axes for leg in robot.legs])
    with scratch_of(robot, robot.pin_model) as data:
        # copies: each call writes where the one before wrote
        each = [np.array(pin.computeGeneralizedGravity(one, data, q)) for one in robot.gravity_models]
        pin.forwardKinematics(robot.pin_model, data, q)
        joints = list(data.oMi)[1:]
        axes = np.array([T.rotation @ axis for T, axis in zip(joints, own_axes, strict=True)])
        origins = np.array([T.translation for T in joints])
    return robot.coupling.folded(np.stack(each, axis=1) @ down), axes, origins, center_of_mass(robot, q)
