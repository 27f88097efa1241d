"""Joint torques of a rover that stands still, and whether any contact forces keep them within limits.

The ground may share the weight between the wheels in many ways. The *torque ratio* of a posture is the
least, over all contact forces in equilibrium inside friction, of the largest |torque| / limit: a linear
program. Above 1 no sharing of the load spares the motors; below 1 one exists, and it is returned.

References
----------
K. Hauser, T. Bretl, J.-C. Latombe, K. Harada, B. Wilcox, "Motion planning for legged robots on varied
terrain", International Journal of Robotics Research 27, 2008 (equilibrium with torque limits).
"""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from footfall.balance.cones import generators
from footfall.balance.forces import GRAVITY, equilibrium_matrix
from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.frames import apply, inverse, require_transform
from footfall.core.value import Value, value
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass, gravity_torques
from footfall.robot.model import Robot

Array = NDArray[np.float64]


@value
class TorqueCheck(Value):
    """Whether the motors can hold a posture.

    feasible: some contact forces inside friction hold the rover, whatever the torques. Where not, ratio is
    inf, joint −1, joint_name empty, and forces and torques are NaN.
    ratio: least possible max |torque| / limit over all joints of the rover; held where at most 1.
    joint, joint_name: the joint with that ratio.
    forces: (legs, 3) [N] in site that reach it, zero for legs in the air; torques: (legs × 6,) [N·m].
    """

    feasible: bool
    ratio: float
    joint: int
    joint_name: str
    forces: NDArray[np.float64]
    torques: NDArray[np.float64]

    @property
    def holds(self) -> bool:
        return self.feasible and self.ratio <= 1.0


def contact_jacobian(robot: Robot, posture: ArrayLike, leg: int, point_base: ArrayLike) -> Array:
    """d(point) / d(joint angles of the leg), (3, 6) [m/rad], in base.

    point_base: (3,) [m], thought fixed to the leg's last link (the wheel is locked).
    """
    q = robot.require_posture(posture)[6 * leg : 6 * leg + 6]
    model = robot.leg_models[leg]
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    J = pin.getJointJacobian(model, data, 6, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    arm = np.asarray(point_base, float) - data.oMi[6].translation
    return J[:3] + np.cross(J[3:].T, arm).T


def contact_points(
    robot: Robot, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int], normals: ArrayLike
) -> Array:
    """Lowest rim points of some wheels along the ground's normals (k, 3), in site, (k, 3) [m]."""
    directions = np.asarray(normals, float)
    if directions.shape != (len(legs), 3):
        raise InvalidInput("each supporting leg needs one normal", legs=len(legs), normals=list(directions.shape))
    points = [
        contact_point(robot, posture, robot.require_leg(leg), T_site_base, normal)
        for leg, normal in zip(legs, directions, strict=True)
    ]
    return np.array(points).reshape(-1, 3)


def holding_torques(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    contacts: ArrayLike,
    forces: ArrayLike,
    gravity: float = GRAVITY,
) -> Array:
    """Torques that hold the joints, (legs × 6,) [N·m]: g(q) − Σ Jᵀ f.

    legs: those on the ground; contacts (k, 3) [m] and forces of the ground on the wheels (k, 3) [N], in
    site. By virtual work: the motors' work over any small motion is the gain of potential energy less the
    work of the ground's forces.
    """
    T_site_base = require_transform(T_site_base, "T_site_base")
    torques = gravity_torques(robot, posture, T_site_base[:3, :3], gravity)
    points_base = apply(inverse(T_site_base), np.asarray(contacts, float).reshape(-1, 3))
    forces_base = np.asarray(forces, float).reshape(-1, 3) @ T_site_base[:3, :3]
    for leg, point, force in zip(legs, points_base, forces_base, strict=True):
        torques[6 * leg : 6 * leg + 6] -= contact_jacobian(robot, posture, leg, point).T @ force
    return torques


def torque_margin(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    normals: ArrayLike,
    friction: float = 0.6,
    gravity: float = GRAVITY,
) -> TorqueCheck:
    """Least torque ratio with the wheels of ``legs`` on the ground and the others in the air.

    normals: (k, 3) of the ground under each of those legs, site; friction: coefficient, eight-sided pyramids.
    Raises InvalidInput for legs that don't exist or stand twice, and for wrong shapes.
    """
    posture = robot.require_posture(posture)
    T_site_base = require_transform(T_site_base, "T_site_base")
    if len(set(legs)) != len(legs):
        raise InvalidInput("a leg stands only once among the supporting legs", legs=list(legs))
    if not 0 < gravity < np.inf:
        raise InvalidInput("gravity must be above zero [m/s²]", gravity=gravity)
    contacts = contact_points(robot, posture, T_site_base, legs, normals)
    if len(legs) == 0:
        return _infeasible(robot)
    com = apply(T_site_base, center_of_mass(robot, posture))
    weight = robot.mass * gravity
    edges = generators(normals, friction)
    sides = edges.shape[1]
    size = max(float(np.abs(contacts - com).max()), 1e-6)
    balance = equilibrium_matrix((contacts - com) / size, np.zeros(3)).reshape(6, -1, 3)
    balance = np.einsum("rkc,kgc->rkg", balance, edges).reshape(6, -1)

    gravity_share = gravity_torques(robot, posture, T_site_base[:3, :3], gravity) / robot.torque_limits
    points_base = apply(inverse(T_site_base), contacts)
    # ratio of each supporting joint = constant + effect · (how much of each generator, in weights)
    effect = np.zeros((6 * len(legs), sides * len(legs)))
    for i, leg in enumerate(legs):
        J = T_site_base[:3, :3] @ contact_jacobian(robot, posture, leg, points_base[i])
        limits = robot.torque_limits[6 * leg : 6 * leg + 6]
        effect[6 * i : 6 * i + 6, sides * i : sides * (i + 1)] = -weight * (J / limits).T @ edges[i].T
    constant = np.concatenate([gravity_share[6 * leg : 6 * leg + 6] for leg in legs])
    ones = np.ones((len(constant), 1))
    solved = linprog(
        np.append(np.zeros(effect.shape[1]), 1.0),
        A_ub=np.block([[effect, -ones], [-effect, -ones]]),
        b_ub=np.concatenate([-constant, constant]),
        A_eq=np.hstack([balance, np.zeros((6, 1))]),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        method="highs",
    )
    if solved.status == 2:
        return _infeasible(robot)
    if solved.status != 0:
        raise FootFallError(f"the torque program was not solved: {solved.message}", status=int(solved.status))
    share = solved.x[:-1].reshape(len(legs), sides)
    forces = np.zeros((robot.leg_count, 3))
    forces[list(legs)] = weight * np.einsum("kg,kgc->kc", share, edges)
    torques = holding_torques(robot, posture, T_site_base, legs, contacts, forces[list(legs)], gravity)
    ratios = np.abs(torques) / robot.torque_limits
    # at the optimum several joints are often equally loaded: the first of them is named
    worst = int(np.argmax(ratios >= ratios.max() - 1e-9))
    return TorqueCheck(True, float(ratios.max()), worst, robot.joint_names[worst], forces, torques)


def _infeasible(robot: Robot) -> TorqueCheck:
    forces = np.full((robot.leg_count, 3), np.nan)
    return TorqueCheck(False, float("inf"), -1, "", forces, np.full(6 * robot.leg_count, np.nan))
