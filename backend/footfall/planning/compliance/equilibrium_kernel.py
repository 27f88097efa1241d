"""Static equilibrium of a rover of springs, compiled; see :mod:`footfall.planning.compliance.compliant_rover`.

Unknowns, in order: translation (3) and rotation (3) of the chassis about its origin, both in site, and the joints.
Newton's method on the balance of forces. The Hessian holds the springs, the ground's stiffness and how gravity and
contact forces change as their arms turn; where a wheel rolls the balance has no potential and it is approximate.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import JOINT_AXES, PART_COUNT, leg_frames

BALANCED = 1e-4
"""Force and moment left over [N, N·m] at which the rover counts as settled: springs move by 1e-8 m."""
MOST_ROUNDS = 80
LONG = 40
"""From this round on steps are halved. The Hessian leaves out how a rim's rolling bends the force on it: along a soft
mode it can be half of what it should be, and whole steps then go to and fro across the balance."""
LARGEST_MOVE = 0.05
"""Of a joint or the chassis in one round [rad, m]."""
HALVINGS = 8
"""Of a step that brings the rover no nearer to balance: wheels that lift off, come down or slip bend its course."""
_STIFFENED = 1.0
"""Added to the Hessian's diagonal [N/m, N·m/rad]: a rover that slides freely has a singular one."""


class Body(NamedTuple):
    """The rover's constants.

    lengths: (legs, 5); hips: (legs, 4, 4), T_base_hip; masses [kg]: (legs, 6) and levers [m]: (legs, 6, 3) of the
    links; chassis and payload: mass [kg], center (3,) in base [m]. stiffness: (legs × 6,) [N·m/rad]; wheel_stiffness
    [N/m]; radius [m]; rolled: radius it rolls on [m]; friction.
    """

    lengths: Array
    hips: Array
    masses: Array
    levers: Array
    chassis_mass: float
    chassis_center: Array
    stiffness: Array
    wheel_stiffness: float
    radius: float
    rolled: float
    friction: float


class Pose(NamedTuple):
    """Where the rover is, changed in place. R (3, 3), t (3,): chassis in site; q: (legs × 6,).

    Of each wheel: touching; rims (legs, 3): centre of the rim, which the ground holds while the hub yields; turns
    (legs, 3, 3): R_site_wheel when the rim was there; points, normals (legs, 3): plane of the ground; forces (legs, 3).
    """

    R: Array
    t: Array
    q: Array
    touching: NDArray[np.bool_]
    rims: Array
    turns: Array
    points: Array
    normals: Array
    forces: Array


@njit()
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit()
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit()
def _times(M: Array, v: Array, out: Array) -> None:
    for k in range(3):
        out[k] = M[k, 0] * v[0] + M[k, 1] * v[1] + M[k, 2] * v[2]


@njit()
def turned(rotvec: Array) -> Array:
    """Rotation matrix (3, 3) of a rotation vector [rad] (Rodrigues)."""
    angle = np.sqrt(_dot(rotvec, rotvec))
    R = np.eye(3)
    if angle < 1e-300:
        return R
    x, y, z = rotvec / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return R + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


@njit()
def leg_in_site(
    body: Body, pose: Pose, leg: int, axes: Array, origins: Array, moments: Array
) -> tuple[Array, Array, float]:
    """Write axes and origins (9, 3) of the chassis' three turns and the leg's six joints, in site.

    moments: (9, 3), axis × (first moment of the leg beyond it about its origin) [kg·m]. Returns the wheel's
    R_site_wheel (3, 3), its hub (3,) and the leg's mass [kg].
    """
    rotations, places = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    leg_frames(body.lengths[leg], pose.q[6 * leg : 6 * leg + 6], rotations, places)
    R = pose.R @ np.ascontiguousarray(body.hips[leg, :3, :3])
    hip, arm, local = np.empty(3), np.empty(3), np.empty(3)
    _times(pose.R, body.hips[leg, :3, 3], hip)
    hip += pose.t
    for d in range(3):
        axes[d] = 0.0
        axes[d, d] = 1.0
        origins[d] = pose.t
    mass = 0.0
    first = np.zeros(3)
    for joint in range(5, -1, -1):
        d = 3 + joint
        local[:] = rotations[joint, :, JOINT_AXES[joint]]
        _times(R, local, axes[d])
        _times(R, places[joint], origins[d])
        origins[d] += hip
        _times(rotations[joint], body.levers[leg, joint], local)
        local += places[joint]
        _times(R, local, arm)
        mass += body.masses[leg, joint]
        first += body.masses[leg, joint] * (arm + hip)
        arm[:] = first - mass * origins[d]
        _cross(axes[d], arm, moments[d])
    arm[:] = first - mass * pose.t
    for d in range(3):
        _cross(axes[d], arm, moments[d])
    hub = np.empty(3)
    _times(R, places[6], hub)
    return R @ rotations[6], hub + hip, mass


@njit()
def rolled_rim(body: Body, pose: Pose, leg: int, R_site_wheel: Array) -> Array:
    """Where the rim's centre has rolled to while the wheel turned, (3,); it never leaves its height over the plane."""
    turn = R_site_wheel @ pose.turns[leg].T
    n = pose.normals[leg]
    rotvec, way = np.empty(3), np.empty(3)
    # turns between two increments are small: sine for the angle is exact to third order
    rotvec[0] = 0.5 * (turn[2, 1] - turn[1, 2])
    rotvec[1] = 0.5 * (turn[0, 2] - turn[2, 0])
    rotvec[2] = 0.5 * (turn[1, 0] - turn[0, 1])
    _cross(rotvec, n, way)
    return pose.rims[leg] + body.rolled * way


@njit()
def contact_force(body: Body, pose: Pose, leg: int, R_site_wheel: Array, hub: Array, K: Array) -> bool:
    """Write the ground's force on a wheel into ``pose.forces`` and −d(force)/d(hub) into K (3, 3).

    A spring in every direction while compressed; its tangential part is returned to the friction cone. A wheel that
    did not touch before comes down without tangential strain. Returns whether it touches.
    """
    n, f = pose.normals[leg], pose.forces[leg]
    stiffness = body.wheel_stiffness
    f[:] = 0.0
    K[:] = 0.0
    depth = body.radius - _dot(n, hub - pose.points[leg])
    if depth <= 0.0:
        return False
    f += stiffness * depth * n
    for i in range(3):
        for j in range(3):
            K[i, j] = stiffness * n[i] * n[j]
    if not pose.touching[leg]:
        return True
    strain = hub - rolled_rim(body, pose, leg, R_site_wheel)
    strain -= _dot(n, strain) * n
    size, most = np.sqrt(_dot(strain, strain)), body.friction * depth
    if size <= most:
        f -= stiffness * strain
        for i in range(3):
            for j in range(3):
                K[i, j] = stiffness if i == j else 0.0
        return True
    along = strain / size
    f -= stiffness * most * along
    for i in range(3):
        for j in range(3):
            across = (1.0 if i == j else 0.0) - n[i] * n[j] - along[i] * along[j]
            K[i, j] += stiffness * (most / size * across - body.friction * along[i] * n[j])
    return True


@njit()
def _add_load(F: Array, axes: Array, moved: Array, index: NDArray[np.int64], gradient: Array, hessian: Array) -> None:
    """Add the work of a load F (3,) whose arm moves by moved (9, 3) per unit of each turn.

    Turning a joint d turns the arms of all e beyond it: d²p / dd de = a_d × (a_e × arm). The chassis' three turns
    have no order: the mean of both.
    """
    way, back = np.empty(3), np.empty(3)
    for d in range(9):
        gradient[index[d]] -= _dot(F, moved[d])
        for e in range(d, 9):
            _cross(axes[d], moved[e], way)
            term = _dot(F, way)
            if e < 3 and e != d:
                _cross(axes[e], moved[d], back)
                term = 0.5 * (term + _dot(F, back))
            hessian[index[d], index[e]] -= term
            if e != d:
                hessian[index[e], index[d]] -= term


@njit()
def unbalanced(
    body: Body, pose: Pose, commanded: Array, gravity: Array, gradient: Array, hessian: Array, hubs: Array, turns: Array
) -> None:
    """Write what is out of balance, gradient (6 + legs × 6,) [N, N·m], its derivative, hubs and turns."""
    legs = len(body.lengths)
    gradient[:] = 0.0
    hessian[:] = 0.0
    axes, origins, moments = np.empty((9, 3)), np.empty((9, 3)), np.empty((9, 3))
    J, KJ, K, arm = np.empty((12, 3)), np.empty(3), np.empty((3, 3)), np.empty(3)
    index, full = np.empty(9, np.int64), np.empty(12, np.int64)
    center = np.empty(3)
    _times(pose.R, body.chassis_center, center)
    mass = body.chassis_mass
    # the chassis as a load: only its three turns move it
    moments[:] = 0.0
    axes[:] = 0.0
    for d in range(3):
        axes[d, d] = 1.0
        _cross(axes[d], center, moments[d])
    moments *= mass
    index[:] = np.array([3, 4, 5, 6, 7, 8, 9, 10, 11])
    _add_load(gravity, axes, moments, index, gradient, hessian)
    for leg in range(legs):
        R_site_wheel, hub, leg_mass = leg_in_site(body, pose, leg, axes, origins, moments)
        hubs[leg] = hub
        turns[leg] = R_site_wheel
        mass += leg_mass
        for d in range(3):
            index[d] = 3 + d
            full[d] = d
            full[3 + d] = 3 + d
        for joint in range(6):
            index[3 + joint] = 6 + 6 * leg + joint
            full[6 + joint] = 6 + 6 * leg + joint
        _add_load(gravity, axes, moments, index, gradient, hessian)
        for joint in range(6):
            i = 6 * leg + joint
            gradient[6 + i] += body.stiffness[i] * (pose.q[i] - commanded[i])
            hessian[6 + i, 6 + i] += body.stiffness[i]
        if not contact_force(body, pose, leg, R_site_wheel, hub, K):
            continue
        f = pose.forces[leg]
        for d in range(9):
            arm[:] = hub - body.rolled * pose.normals[leg] - origins[d]
            _cross(axes[d], arm, moments[d])
            J[3 + d] = moments[d]
        for d in range(3):
            J[d] = axes[d]
            gradient[d] -= f[d]
        _add_load(f, axes, moments, index, gradient, hessian)
        for d in range(12):
            _times(K, J[d], KJ)
            for e in range(12):
                hessian[full[e], full[d]] += _dot(J[e], KJ)
    for d in range(3):
        gradient[d] -= mass * gravity[d]


@njit()
def settle(body: Body, pose: Pose, commanded_from: Array, commanded: Array, gravity: Array, increments: int) -> float:
    """Move ``pose``, in equilibrium with the set points ``commanded_from``, to that with ``commanded``, by increments.

    gravity: (3,) in site [m/s²]. After each increment the strain of the wheels becomes what friction left of it.
    Returns the force or moment left over [N, N·m]; above BALANCED no equilibrium was found and pose is not one.
    """
    size = 6 + len(pose.q)
    gradient, hessian = np.empty(size), np.empty((size, size))
    hubs, turns = np.empty((len(body.lengths), 3)), np.empty((len(body.lengths), 3, 3))
    left = np.inf
    for increment in range(1, increments + 1):
        share = increment / increments
        target = commanded_from + share * (commanded - commanded_from)
        unbalanced(body, pose, target, gravity, gradient, hessian, hubs, turns)
        left = np.abs(gradient).max()
        for made in range(MOST_ROUNDS):
            if not left > BALANCED:
                break
            scale = np.sqrt(np.abs(np.diag(hessian)) + _STIFFENED)
            before = np.linalg.norm(gradient / scale)
            for i in range(size):
                hessian[i, i] += _STIFFENED
            step = np.linalg.solve(hessian, -gradient)
            largest = np.abs(step).max()
            if not np.isfinite(largest):
                return np.inf
            step *= min(1.0, LARGEST_MOVE / max(largest, 1e-300))
            if made >= LONG:
                step *= 0.5
            R, t, q = pose.R.copy(), pose.t.copy(), pose.q.copy()
            for _ in range(HALVINGS):
                pose.t[:] = t + step[:3]
                pose.R[:] = turned(np.asarray(step[3:6], np.float64)) @ R
                pose.q[:] = q + step[6:]
                unbalanced(body, pose, target, gravity, gradient, hessian, hubs, turns)
                if np.linalg.norm(gradient / scale) < before:
                    break
                step *= 0.5
            left = np.abs(gradient).max()
        if not left <= BALANCED:
            return left
        for leg in range(len(hubs)):
            f = pose.forces[leg]
            pose.touching[leg] = _dot(f, f) > 0.0
            pose.rims[leg] = hubs[leg] + f / body.wheel_stiffness
            pose.turns[leg] = turns[leg]
    return left
