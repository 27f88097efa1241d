"""Joint torques of a rover that stands still, and whether any contact forces keep them within limits.

The ground may share the weight between the wheels in many ways. The *torque ratio* of a posture is the
least, over all contact forces in equilibrium inside friction, of the largest |torque| / limit: a linear
program. Above 1 no sharing of the load spares the motors; below 1 one exists, and it is returned.

References:
----------
K. Hauser, T. Bretl, J.-C. Latombe, K. Harada, B. Wilcox, "Motion planning for legged robots on varied
terrain", International Journal of Robotics Research 27, 2008 (equilibrium with torque limits).
"""

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.balance_settings import GRAVITY, BalanceSettings
from footfall.balance.cones import facets, unit_normals
from footfall.balance.friction import FRICTION
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import PostureStatics
from footfall.balance.region import require_stance
from footfall.balance.simplex import INFEASIBLE, OPTIMAL
from footfall.balance.tether import Tether
from footfall.balance.tether_kernel import fill_limb
from footfall.balance.torque_kernel import least_ratio
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.frames import apply, inverse, require_transform
from footfall.core.value import LATER, Value, value
from footfall.robot.model import Robot


@value
class TorqueCheck(Value):
    """Whether the motors can hold a posture.

    feasible: some contact forces inside friction hold the rover, whatever the torques. Where not, ratio is
    inf, joint −1, joint_name empty, and forces and torques are NaN.
    ratio: least possible max |torque| / limit over all joints of the rover; held where at most 1.
    joint, joint_name: the joint with that ratio; −1 and "tether" where it is the drum of one.
    forces: (legs, 3) [N] in site that reach it, zero for legs in the air; torques: (legs × 6,) [N·m].
    pull: of the tether [N], 0 without one and where nothing holds the rover.
    """

    feasible: bool
    ratio: float
    joint: int
    joint_name: str
    forces: NDArray[np.float64]
    torques: NDArray[np.float64]
    pull: float = field(default=0.0, metadata=LATER)

    @property
    def holds(self) -> bool:
        """Whether there are contact forces with which no joint needs more than its limit."""
        return self.feasible and self.ratio <= 1.0


def contact_points(
    robot: Robot, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int], normals: ArrayLike
) -> Array:
    """Lowest rim points of some wheels along the ground's normals.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the wheels' legs, k of them.
        normals: (k, 3) of the ground under those, in site.

    Returns:
        (k, 3) in site [m].

    Raises:
        InvalidInput: the rover has no such leg, or the normals or the pose don't fit.
    """
    return PostureStatics(robot, posture).contacts(
        *_standing(robot, legs, normals), require_transform(T_site_base, "T_site_base")
    )


def holding_torques(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    contacts: ArrayLike,
    forces: ArrayLike,
    gravity: float = GRAVITY,
) -> Array:
    """Torques that hold the joints: g(q) − Σ Jᵀ f.

    By virtual work: the motors' work over any small motion is the gain of potential energy less the work of the
    ground's forces.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs on the ground, k of them.
        contacts: (k, 3) of theirs, in site [m].
        forces: of the ground on their wheels, (k, 3) in site [N].
        gravity: [m/s²].

    Returns:
        (legs × 6,) [N·m].
    """
    T_site_base = require_transform(T_site_base, "T_site_base")
    statics = PostureStatics(robot, posture)
    torques = statics.gravity_torques(T_site_base[2, :3], gravity)
    points_base = apply(inverse(T_site_base), np.asarray(contacts, float).reshape(-1, 3))
    forces_base = np.asarray(forces, float).reshape(-1, 3) @ T_site_base[:3, :3]
    J = statics.contact_jacobians(legs, points_base)
    torques.reshape(-1, 6)[list(legs)] -= (forces_base[:, None] @ J)[:, 0]
    return torques


def torque_margin(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    normals: ArrayLike,
    friction: float = FRICTION,
    gravity: float = GRAVITY,
) -> TorqueCheck:
    """As :func:`torque_check`, with friction and gravity alone.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs on the ground, k of them.
        normals: (k, 3) of the ground under those, in site.
        friction: coefficient between feet and ground.
        gravity: [m/s²].

    Returns:
        The least torque ratio, with forces and torques that reach it.

    Raises:
        InvalidInput: legs don't exist or stand twice, shapes don't fit, or a normal does not point up.
    """
    settings = BalanceSettings(friction=friction, gravity=gravity)
    return torque_check(robot, posture, T_site_base, legs, normals, settings)


def torque_check(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    normals: ArrayLike,
    settings: BalanceSettings,
    tether: Tether | None = None,
) -> TorqueCheck:
    """Least torque ratio with the wheels of some legs on the ground and the others in the air.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs on the ground, k of them.
        normals: (k, 3) of the ground under those, in site.
        settings: friction pyramids, gravity, its direction and the payload.
        tether: pulls as it serves best, and its share of the drum's most counts like that of a torque limit; None:
            there is none.

    Returns:
        The least ratio, with forces and torques that reach it.

    Raises:
        InvalidInput: legs don't exist or stand twice, shapes don't fit, or, without a tether, a normal does not point
            up, against gravity.
        FootFallError: the program for the torques was not solved, which is a defect.
    """
    T_site_base = require_transform(T_site_base, "T_site_base")
    if len(set(legs)) != len(legs):
        raise InvalidInput("a leg stands only once among the supporting legs", legs=list(legs))
    statics = PostureStatics(robot, posture)
    standing, unit = _standing(robot, legs, normals)
    if not standing:
        return _infeasible(robot)
    contacts = statics.contacts(standing, unit, T_site_base)
    mass, com_base = loaded(robot, statics.com, settings)
    com = apply(T_site_base, com_base)
    level, unit_level = require_stance(settings.level(contacts - com), settings.level(unit), tether is None)
    R_level_base = settings.R_level_site @ T_site_base[:3, :3]
    limits = robot.torque_limits.reshape(-1, 6)[standing]
    torques = statics.gravity_torques(R_level_base[2], settings.gravity)
    gravity_share = torques.reshape(-1, 6)[standing] / limits
    J_level = R_level_base @ statics.contact_jacobians(standing, apply(inverse(T_site_base), contacts))
    weight = mass * settings.gravity
    # ratio of each supporting joint = share of gravity + effect · force of its foot, in weights
    effect = np.ascontiguousarray((-weight / limits[:, None] * J_level).transpose(0, 2, 1))
    faces, feet = facets(unit_level, settings.friction, settings.sides), len(standing)
    most = 0.0 if tether is None else tether.most_force / weight
    if tether is not None:
        at, toward = tether.pull(T_site_base)
        arm, own_faces, own_effect = np.empty(3), np.empty_like(faces[0]), np.empty((6, 3))
        fill_limb(settings.level(np.array([at - com, toward])), most, arm, own_faces, own_effect)
        level, faces = np.vstack([level, arm]), np.concatenate([faces, own_faces[None]])
        effect, gravity_share = np.concatenate([effect, own_effect[None]]), np.vstack([gravity_share, np.zeros(6)])
    shares = np.empty((len(level), 3))
    size = max(float(np.abs(level).max()), 1e-6)
    status, _ = least_ratio(level / size, faces, effect, gravity_share, shares)
    if status == INFEASIBLE:
        return _infeasible(robot)
    if status != OPTIMAL:
        raise FootFallError("the torque program was not solved", status=int(status))
    forces = np.zeros((robot.leg_count, 3))
    forces[standing] = weight * shares[:feet] @ settings.R_level_site
    torques.reshape(-1, 6)[standing] += limits * (effect[:feet] @ shares[:feet, :, None])[:, :, 0]
    ratios = np.abs(torques) / robot.torque_limits
    pull = float(np.linalg.norm(shares[feet:]))
    if tether is not None and pull / most > ratios.max() + 1e-9:
        return TorqueCheck(True, pull / most, -1, "tether", forces, torques, weight * pull)
    # at the optimum several joints are often equally loaded: the first of them is named
    worst = int(np.argmax(ratios >= ratios.max() - 1e-9))
    return TorqueCheck(True, float(ratios.max()), worst, robot.joint_names[worst], forces, torques, weight * pull)


def _standing(robot: Robot, legs: Sequence[int], normals: ArrayLike) -> tuple[list[int], Array]:
    """The legs as checked numbers, and one unit normal for each."""
    standing = [robot.require_leg(leg) for leg in legs]
    directions = np.asarray(normals, float)
    if directions.shape != (len(standing), 3):
        raise InvalidInput("each supporting leg needs one normal", legs=len(standing), normals=list(directions.shape))
    return standing, unit_normals(directions)


def _infeasible(robot: Robot) -> TorqueCheck:
    forces = np.full((robot.leg_count, 3), np.nan)
    return TorqueCheck(False, float("inf"), -1, "", forces, np.full(6 * robot.leg_count, np.nan))
