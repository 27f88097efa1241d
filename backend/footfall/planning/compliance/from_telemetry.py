"""The springs' present strain, from what the rover measures.

How a standing rover's legs strain against each other depends on all that it did before. From scratch it can't be known
(it would be centimetres off after some steps); telemetry shows it: deflected joints and pressed wheels are springs that
measure force.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.forces import equilibrium_matrix
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import PostureStatics
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover, require_three
from footfall.planning.compliance.equilibrium_kernel import Pose
from footfall.planning.compliance.seen_yield import LEAST_YIELD
from footfall.robot.tolerance import inside
from footfall.telemetry.state import RobotState

DOUBT = 0.2
"""How far the stiffness of a joint may be from its description, as a share (one standard deviation)."""
ALIKE = 0.25
"""Share of that variance that all joints have in common: they are of one make, and one temperature."""
UNEXPLAINED = 0.003
"""What of a joint's deflection is from encoders, or from moments at the wheel that the map does not tell [rad] (same).
"""
MOST_SOFTER = 2.0
"""A joint is taken to be at most so many times softer, or stiffer, than described."""
LEAST_LOAD = 0.005
"""A wheel that is pressed with less than this share of the weight is in the air: force sensors are not exact."""

HELD_SHARE, LIKELY_SHARE = 0.9, 0.8
"""Where a wheel that stands still would use more than the first share of its friction, the ground's normal under it is
another, with which it uses the second."""
MOST_TILT, MOST_TILT_UNSEEN = 0.15, 0.7
"""The ground's normal is so far from the map's at most [rad]: where all of the ground under a wheel was seen, and where
not, so that the map may have the wheel on the flank of a rock beside it."""


def measured(
    rover: CompliantRover, state: RobotState, commanded: ArrayLike | None = None, fitted: bool = True
) -> RestingRover:
    """The equilibrium that telemetry shows.

    Wheel forces are those of the state; where it has none at all, each leg's are those that explain its deflection
    best, Jᵀ f = G − k (commanded − posture). They are corrected by the least change that balances the rover.

    A wheel that stands still does not slip. Where it would with the map's normal, which under a wheel is often made up
    from the ground around, the normal is taken to be tilted towards the force.

    Args:
        rover: the yielding rover on its ground.
        state: as telemetry has it.
        commanded: set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        fitted: wheel forces and set points together show how stiff each joint is: with this what a deflection is more,
            or less, than expected is taken for stiffness as far as that is likelier than an error of the encoder. The
            rover then starts exactly where it was measured: what is left stays as ``bias`` on the set points.

    Returns:
        The rover at rest.

    Raises:
        InvalidInput: the state is of another robot, or fewer than three wheels are pressed down.
    """
    robot = rover.robot
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    q, T = np.array(state.posture), np.array(state.T_site_base)
    held = q + state.joint_torques / rover.stiffness
    set_points = inside(robot, held if commanded is None else robot.require_posture(commanded))
    points, normals, known = rover.ground_under(q, T, forces=np.array(state.wheel_forces))
    hubs, turns = rover.wheels(q, T)
    forces = np.array(state.wheel_forces)
    independent = commanded is not None and bool(forces.any())
    if not forces.any():
        forces = forces_of_deflection(rover, q, T, hubs, normals, set_points)
    weight = rover.mass * float(np.linalg.norm(rover.gravity))
    touching = np.sum(forces * normals, axis=1) > LEAST_LOAD * weight
    require_three(touching)
    pressed_by = np.where(touching[:, None], forces, 0.0)
    forces = _balanced(rover, q, T, hubs, normals, pressed_by, touching)
    seen = np.array([rover.seen_under(hub) for hub in hubs])
    most = np.where(seen, MOST_TILT, MOST_TILT_UNSEEN)
    normals, by_force = holding_normals(normals, forces, rover.settings.balance.friction, most)
    if by_force.any():
        forces = _balanced(rover, q, T, hubs, normals, pressed_by, touching)
    torques = holding(rover, q, T, hubs, normals, forces)
    stiffness = rover.stiffness
    if fitted and independent:
        stiffness = stiffness / softer_by(torques / stiffness, set_points - q)
    held = q + torques / stiffness
    pressed = np.sum(forces * normals, axis=1, keepdims=True) / rover.wheel_stiffness
    # the ground is where a wheel that is pressed so much finds it, whatever the map says
    found = np.where(touching[:, None], hubs - (robot.wheel_radius - pressed) * normals, points)
    raised = np.where(known, np.sum((found - points) * normals, axis=1), 0.0)
    rims = hubs + forces / rover.wheel_stiffness
    pose = Pose(T[:3, :3].copy(), T[:3, 3].copy(), q, touching, rims, turns, found, normals, forces)
    left, nothing = held - set_points, np.zeros_like(held)
    # joints that don't yield at all are held by something else than springs, in the air too
    springs = not independent or np.median(np.abs(set_points - q)) > LEAST_YIELD * np.median(
        np.abs(torques / rover.stiffness)
    )
    bias, offset = (left, nothing) if springs else (nothing, left)
    return rover.settle(pose, set_points, set_points, bias, offset, stiffness, raised, by_force, 1)


def holding_normals(normals: Array, forces: Array, friction: float, most: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Normals with which friction holds forces well inside its cone.

    Only those are tilted, towards the force, with which it would use more than HELD_SHARE, to LIKELY_SHARE. Those that
    would be tilted too far, and those of wheels that bear nothing, stay.

    Args:
        normals: (legs, 3) unit, in site.
        forces: of the ground on the wheels, (legs, 3) in site [N].
        friction: coefficient between feet and ground.
        most: how far each may be tilted, (legs,) [rad].

    Returns:
        Normals (legs, 3), and which were tilted, (legs,).
    """
    sizes = np.linalg.norm(forces, axis=1)
    directions = forces / np.maximum(sizes, 1e-9)[:, None]
    angles = np.arccos(np.clip(np.sum(directions * normals, axis=1), -1.0, 1.0))
    tilts = angles - np.arctan(LIKELY_SHARE * friction)
    tilted = (sizes > 0.0) & (angles > np.arctan(HELD_SHARE * friction)) & (tilts <= most)
    # on the great circle from normal to force
    shares = np.sin(np.column_stack([angles - tilts, tilts])) / np.maximum(np.sin(angles), 1e-9)[:, None]
    between = shares[:, :1] * normals + shares[:, 1:] * directions
    return np.where(tilted[:, None], between, normals), tilted


def softer_by(expected: Array, deflections: Array) -> Array:
    """How many times softer joints are than described, most likely, from deflections (n,), expected and seen [rad].

    seen = softer · expected + error; softer = 1 + a part that all joints share + each one's own, by DOUBT together;
    errors by UNEXPLAINED. All are normally distributed, so this is their mean given what was seen (Rasmussen &
    Williams, *Gaussian Processes for Machine Learning*, 2006, eq. 2.23).
    """
    prior = DOUBT**2 * (ALIKE * np.ones((len(expected), len(expected))) + (1 - ALIKE) * np.eye(len(expected)))
    seen = expected[:, None] * prior * expected + UNEXPLAINED**2 * np.eye(len(expected))
    excess = prior @ (expected * np.linalg.solve(seen, deflections - expected))
    return np.clip(1.0 + excess, 1 / MOST_SOFTER, MOST_SOFTER)


def forces_of_deflection(
    rover: CompliantRover, posture: Array, T_site_base: Array, hubs: Array, normals: Array, commanded: Array
) -> Array:
    """Forces of the ground that explain each leg's deflection by least squares.

    Args:
        rover: the yielding rover on its ground.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        hubs: of the wheels, (legs, 3) in site [m].
        normals: of the ground under them, (legs, 3) in site.
        commanded: set points, (legs × 6,) [rad].

    Returns:
        (legs, 3) in site [N].
    """
    torques = rover.stiffness * (commanded - posture)
    G, J_site = gravity_and_jacobians(rover, posture, T_site_base, hubs, normals)
    pushed = (G - torques).reshape(-1, 6)
    return np.array([np.linalg.lstsq(J.T, tau, rcond=None)[0] for J, tau in zip(J_site, pushed, strict=True)])


def holding(
    rover: CompliantRover, posture: Array, T_site_base: Array, hubs: Array, normals: Array, forces: Array
) -> Array:
    """Torques that hold the joints against gravity and the wheels' forces: G − Jᵀ f.

    Args:
        rover: the yielding rover on its ground.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        hubs: of the wheels, (legs, 3) in site [m].
        normals: of the ground under them, (legs, 3) in site.
        forces: of the ground on the wheels, (legs, 3) in site [N].

    Returns:
        (legs × 6,) [N·m].
    """
    G, J_site = gravity_and_jacobians(rover, posture, T_site_base, hubs, normals)
    return G - (forces[:, None] @ J_site).ravel()


def wheel_arms(rover: CompliantRover, hubs: Array, normals: Array) -> Array:
    """Points fixed to the wheels at which the ground's forces act.

    Args:
        rover: the yielding rover on its ground.
        hubs: of the wheels, (legs, 3) in site [m].
        normals: of the ground under them, (legs, 3) in site.

    Returns:
        (legs, 3) in site [m].
    """
    return hubs - rover.body.rolled * normals


def gravity_and_jacobians(
    rover: CompliantRover, posture: Array, T_site_base: Array, hubs: Array, normals: Array
) -> tuple[Array, Array]:
    """What gravity asks of the joints, and how they move the points where the ground pushes.

    Args:
        rover: the yielding rover on its ground.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        hubs: of the wheels, (legs, 3) in site [m].
        normals: of the ground under them, (legs, 3) in site.

    Returns:
        Torques (legs × 6,) [N·m], and Jacobians (legs, 3, 6) in site [m/rad].
    """
    statics = PostureStatics(rover.robot, posture)
    R = T_site_base[:3, :3]
    size = float(np.linalg.norm(rover.gravity))
    G = statics.gravity_torques(-(rover.gravity / size) @ R, size)
    points_base = apply(inverse(T_site_base), wheel_arms(rover, hubs, normals))
    return G, R @ statics.contact_jacobians(list(rover.robot.legs), points_base)


def _balanced(
    rover: CompliantRover,
    posture: Array,
    T_site_base: Array,
    hubs: Array,
    normals: Array,
    forces: Array,
    touching: NDArray[np.bool_],
) -> Array:
    """The forces with the least change of the touching wheels' that balances weight and moment, (legs, 3) [N]."""
    coms = PostureStatics(rover.robot, posture).com
    mass, com_base = loaded(rover.robot, coms, rover.settings.balance)
    com = apply(T_site_base, com_base)
    matrix = equilibrium_matrix(wheel_arms(rover, hubs, normals)[touching], com)
    lacking = np.append(-mass * rover.gravity, np.zeros(3)) - matrix @ forces[touching].ravel()
    out = forces.copy()
    out[touching] += np.linalg.lstsq(matrix, lacking, rcond=None)[0].reshape(-1, 3)
    return out
