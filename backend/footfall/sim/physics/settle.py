"""The set points with which the rover stands still as it was asked to, in physics.

A first guess is from statics: the chassis as low as the wheels' springs bear the weight, torques that hold the links
against gravity and those wheels' forces, set points that much beyond the angles. Then the rover is let come to
rest, the set points are moved by what the angles miss, and again, until they are where they should be.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, quat_wxyz, rotation_from_quat_wxyz, transform, turn_of
from footfall.robot.kinematics import gravity_torques, wheel_centers
from footfall.robot.model import Robot
from footfall.sim.physics.model import PhysicsModel
from footfall.sim.physics.physics_settings import TIME_STEP, PhysicsSettings
from footfall.sim.statics import contact_jacobian
from footfall.terrain.ground.surface import height_at

ROUND = 1.0
"""Seconds that the rover is let come to rest before its set points are corrected."""
MOST_ROUNDS = 8
GOOD_ENOUGH = 5e-4
"""Joint angles that are as near as this to those asked for are left alone [rad]."""
_LATTICE = 12
"""The ground under a wheel is looked at in so many steps from its middle to its rim."""

MOST_OFF = 0.05
"""A rover whose joints are farther than this from what was asked for does not stand as it should [rad]."""
MOST_MOTION = 0.3
"""A chassis that goes farther than this while it comes to rest was not standing [m]."""


@dataclass(frozen=True)
class Settled:
    """How the rover at rest differs from the state that it was asked to stand in.

    moved: of the chassis' origin (3,), site [m]: mostly down, by what the wheels give way. turned: of the chassis
    [rad]. joints: largest difference of a joint angle [rad]. seconds: simulated until then.
    """

    moved: Array
    turned: float
    joints: float
    seconds: float


def settle(
    robot: Robot,
    physics: PhysicsModel,
    data: mujoco.MjData,
    posture: Array,
    T_site_base: Array,
    settings: PhysicsSettings,
) -> tuple[Array, Settled]:
    """Bring ``data`` to rest in a posture (legs × 6,) [rad] at about T_site_base: set points (legs × 6,), how far off.

    Raises InvalidInput where the rover does not stay there.
    """
    forces, normals, contacts, drop = _standing_forces(robot, physics, posture, T_site_base, settings)
    R_site_base = T_site_base[:3, :3]
    torques = settings.mass_scale * gravity_torques(robot, posture, R_site_base, settings.gravity)
    points_base = (contacts - T_site_base[:3, 3]) @ R_site_base
    jacobians = np.zeros((robot.leg_count, 3, 6))
    for leg in robot.legs:
        jacobians[leg] = contact_jacobian(robot, posture, leg, points_base[leg])
        torques[6 * leg : 6 * leg + 6] -= jacobians[leg].T @ (forces[leg] * normals[leg] @ R_site_base)
    springs = np.where(forces > 0, physics.wheel_stiffness, 0.0)
    _place(physics, data, posture, transform(translation=(0.0, 0.0, -drop)) @ T_site_base)
    for leg, rim in enumerate(physics.rims):
        up = forces[leg] / physics.wheel_stiffness[leg] * normals[leg]
        first = physics.model.jnt_qposadr[physics.model.body_jntadr[rim]]
        data.qpos[first : first + 3] = data.xmat[rim].reshape(3, 3).T @ up
    commanded = posture + torques / physics.stiffness
    rounds, off = 0, np.inf
    while True:
        data.ctrl[:] = commanded
        mujoco.mj_step(physics.model, data, nstep=round(ROUND / TIME_STEP))
        rounds += 1
        missed = posture - data.qpos[physics.joints]
        before, off = off, float(np.abs(missed).max())
        if off <= GOOD_ENOUGH or rounds == MOST_ROUNDS or not off < before:
            break
        commanded = commanded + missed + _push(jacobians, points_base, springs, missed) / physics.stiffness
    moved = data.qpos[:3] - T_site_base[:3, 3]
    if not (off <= MOST_OFF and np.linalg.norm(moved) <= MOST_MOTION):
        raise InvalidInput(
            f"{robot.name} does not stay in that state: in physics its chassis goes {np.linalg.norm(moved):z.2f} m and "
            f"a joint {off:z.3f} rad before it comes to rest; give a state in which it stands on this ground",
            moved=moved.tolist(),
            joints=off,
        )
    turned = turn_of(R_site_base.T @ rotation_from_quat_wxyz(data.qpos[3:7]))
    data.time = 0.0
    mujoco.mj_forward(physics.model, data)
    return commanded, Settled(moved, turned, off, rounds * ROUND)


def _push(jacobians: Array, points_base: Array, springs: Array, joints: Array) -> Array:
    """Torques (legs × 6,) [N·m] with which the standing wheels' springs answer small changes of the joint angles.

    The wheels stay where they touch; the chassis goes where the springs, (legs,) [N/m], are least strained.
    """
    legs = len(springs)
    travel = np.einsum("lij,lj->li", jacobians, joints.reshape(legs, 6))
    weight = np.repeat(np.sqrt(springs), 3)
    # column by column the travel of the contacts for the chassis' three shifts and three turns
    turns = np.cross(np.eye(3)[None, :, :], points_base[:, None, :]).transpose(0, 2, 1)
    rigid = np.concatenate([np.tile(np.eye(3), (legs, 1, 1)), turns], axis=2).reshape(3 * legs, 6)
    twist = np.linalg.lstsq(weight[:, None] * rigid, -weight * travel.ravel(), rcond=None)[0]
    strain = (travel.ravel() + rigid @ twist).reshape(legs, 3)
    return np.einsum("lij,li->lj", jacobians, springs[:, None] * strain).ravel()


def _place(physics: PhysicsModel, data: mujoco.MjData, posture: Array, T_site_base: Array) -> None:
    mujoco.mj_resetData(physics.model, data)
    data.qpos[:3] = T_site_base[:3, 3]
    data.qpos[3:7] = quat_wxyz(T_site_base[:3, :3])
    data.qpos[physics.joints] = posture
    mujoco.mj_kinematics(physics.model, data)


def _standing_forces(
    robot: Robot, physics: PhysicsModel, posture: Array, T_site_base: Array, settings: PhysicsSettings
) -> tuple[Array, Array, Array, float]:
    """Forces along the normals (legs,), normals and contacts (legs, 3), and how far the chassis sinks for them [m].

    Each wheel is a ball that meets the ground where that is highest under it; the chassis sinks until they bear it.
    """
    hubs = apply(T_site_base, wheel_centers(robot, posture))
    radius, lattice = robot.wheel_radius, np.linspace(-1.0, 1.0, 2 * _LATTICE + 1) * robot.wheel_radius
    dx, dy = (offsets.ravel() for offsets in np.meshgrid(lattice, lattice))
    inside = np.hypot(dx, dy) < radius
    dx, dy = dx[inside], dy[inside]
    bottom = np.sqrt(radius**2 - dx**2 - dy**2)
    contacts, depth = np.zeros((robot.leg_count, 3)), np.zeros(robot.leg_count)
    for leg, hub in enumerate(hubs):
        ground = height_at(physics.heights, hub[0] + dx, hub[1] + dy)
        if not np.isfinite(ground).all():
            raise InvalidInput(f"wheel {leg} is off the map: there is nothing that it could stand on", leg=leg)
        # how far the ball's underside is below the ground, straight up and down
        deepest = int(np.argmax(ground + bottom))
        depth[leg] = ground[deepest] + bottom[deepest] - hub[2]
        contacts[leg] = hub + np.array([dx[deepest], dy[deepest], -bottom[deepest]])
    normals = (hubs - contacts) / radius
    weight = settings.mass_scale * robot.mass * settings.gravity

    def borne(drop: float) -> Array:
        return physics.wheel_stiffness * np.maximum((depth + drop) * normals[:, 2], 0.0)

    low, high = -1.0, 1.0
    for _ in range(60):
        drop = (low + high) / 2
        low, high = (drop, high) if borne(drop) @ normals[:, 2] < weight else (low, drop)
    return borne(low), normals, contacts, low
