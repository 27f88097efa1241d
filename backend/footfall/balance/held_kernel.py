"""Whether the motors and the ground hold a rover that stands still, compiled: for loops over very many postures.

The question is that of torques.py: are there contact forces inside friction that balance the weight and keep every
joint within a share of its torque limit? Forces are tried (trial_forces_kernel.py) in the cones inside the friction
pyramids, and a proof of none (refusal_kernel.py) with those around them. What both leave open torque_kernel.py decides.

Contacts are thought fixed to the legs' last links, as the wheels are locked. Ground whose normal does not point up,
against gravity, carries nothing: a rover that counts on it is not held, unless it hangs on a tether: then normals may
point anywhere, and the program decides. Nor is one with numbers that are not finite.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.balance.cones import fill_facets
from footfall.balance.refusal_kernel import refused
from footfall.balance.simplex import INFEASIBLE, OPTIMAL
from footfall.balance.tether_kernel import MOST, easiest_pull, fill_change, fill_limb, fill_pull
from footfall.balance.torque_kernel import least_ratio
from footfall.balance.trial_forces_kernel import approach_bounds, inside_cones, smallest_forces, spread_of
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import JOINT_AXES, PART_COUNT

GRAVITY, FRICTION, INSIDE, SIDES = range(4)
"""Entries of ``HeldTables.about``."""

_FEW_ROUNDS, _MOST_ROUNDS = 4, 24
"""Approaches to the bounds before a refusal is sought, and before the program is asked."""


class HeldTables(NamedTuple):
    """A loaded rover and what it is judged by.

    parts: (legs, 6, 4) centre in the link's frame [m] and mass [kg] of the links that joints move, the wheel with the
    last. limits: (legs, 6) torques [N·m]. chassis: (4,) centre in base and mass, payload and all. R_level_site: (3, 3),
    see BalanceSettings. about: (4,) gravity [m/s²], friction, friction of the cones inside the pyramids, their sides.
    tether: (1, 7) anchor in site, attachment in base [m], the drum's most [N]; no row: there is none.
    """

    parts: Array
    limits: Array
    chassis: Array
    R_level_site: Array
    about: Array
    tether: Array


class _Room(NamedTuple):
    """What one answer is worked out in; rows of feet in the order of the legs.

    beyond: (legs, 6, 4) first moment in site [kg·m] and mass of what each joint moves. effect, constant: see
    least_ratio. pull, change: see tether_kernel.py. The others: see trial_forces_kernel.py.
    """

    beyond: Array
    arms: Array
    unit: Array
    forces: Array
    past: Array
    spread: Array
    effect: Array
    constant: Array
    pull: Array
    change: Array


@njit()
def held_ratio(
    poses: Array,
    T_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
) -> tuple[float, bool]:
    """A share of the torque limits that the rover is held with, and whether that is sure; the program is not asked.

    poses: (legs × 7, 3, 4) of the links in site, see ``place_leg``; T_site_base: (3 or 4, 4). contacts [m], normals:
    (legs, 3) in site, read where ``standing`` (legs,). The ratio bounds the least one from above, over all joints, of
    hanging legs too; inf and sure where no forces inside friction hold the rover, inf and unsure where none were found.
    """
    room = _room(standing.size)
    feet, weight = _lay_out(poses, T_site_base, contacts, normals, standing, tables, room)
    if feet == 0:
        return np.inf, True
    arms, unit, forces, past = room.arms[:feet], room.unit[:feet], room.forces[:feet], room.past[:feet]
    inside, around = tables.about[INSIDE], tables.about[FRICTION]
    if not spread_of(arms, room.spread):
        return np.inf, False
    smallest_forces(arms, room.spread, forces)
    if tables.tether.shape[0] > 0:
        share = _pulled(tables, room, feet, weight)
        none, spread = (room.effect[:0], room.constant[:0]), room.spread
        if not approach_bounds(arms, unit, spread, inside, *none, 0.0, _MOST_ROUNDS, forces, past):
            return np.inf, False
        return max(share, _largest(poses, contacts, standing, tables, room, weight)), True
    if not inside_cones(unit, inside, forces):
        none, spread = (room.effect[:0], room.constant[:0]), room.spread
        if not approach_bounds(arms, unit, spread, inside, *none, 0.0, _FEW_ROUNDS, forces, past):
            if refused(arms, unit, around):
                return np.inf, True
            if not approach_bounds(arms, unit, spread, inside, *none, 0.0, _MOST_ROUNDS, forces, past):
                return np.inf, False
    return _largest(poses, contacts, standing, tables, room, weight), True


@njit()
def least_held_ratio(
    poses: Array,
    T_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
) -> float:
    """The least ratio of :func:`held_ratio`, by the program; inf where no forces hold the rover, NaN where unsolved."""
    room = _room(standing.size)
    feet, weight = _lay_out(poses, T_site_base, contacts, normals, standing, tables, room)
    if feet == 0:
        return np.inf
    _fill_effects(poses, contacts, standing, tables, room, weight)
    return max(_least(tables, room, feet, weight), _hanging(poses, contacts, standing, tables, room))


@njit()
def held_by_some_forces(
    poses: Array,
    T_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
) -> bool:
    """Whether any forces inside friction hold the rover, whatever its motors bear; arguments as of :func:`held_ratio`.

    A tether pulls with no more than its drum can. An unsolved program: False.
    """
    room = _room(standing.size)
    feet, weight = _lay_out(poses, T_site_base, contacts, normals, standing, tables, room)
    room.effect[:feet] = room.constant[:feet] = 0.0
    return feet > 0 and _least(tables, room, feet, weight) <= 1.0


@njit()
def held_within(
    poses: Array,
    T_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
    most: float,
) -> bool:
    """Whether the least ratio is at most ``most``; arguments as of :func:`held_ratio`. An unsolved program: False."""
    room = _room(standing.size)
    held, sure, feet, weight = _at_once(poses, T_site_base, contacts, normals, standing, tables, most, room)
    return held if sure else _least(tables, room, feet, weight) <= most


@njit()
def held_at_once(
    poses: Array,
    T_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
    most: float,
) -> tuple[bool, bool]:
    """:func:`held_within` without the program: the answer, and whether it is sure."""
    held, sure, _, _ = _at_once(poses, T_site_base, contacts, normals, standing, tables, most, _room(standing.size))
    return held, sure


@njit()
def _at_once(poses, T_site_base, contacts, normals, standing, tables, most, room):
    """The answer, whether it is sure, number of feet and weight; where not sure, the room is ready for the program."""
    feet, weight = _lay_out(poses, T_site_base, contacts, normals, standing, tables, room)
    if feet == 0 or not _hanging(poses, contacts, standing, tables, room) <= most:
        return False, True, feet, weight
    arms, unit, forces, past = room.arms[:feet], room.unit[:feet], room.forces[:feet], room.past[:feet]
    inside, around = tables.about[INSIDE], tables.about[FRICTION]
    if not spread_of(arms, room.spread):
        _fill_effects(poses, contacts, standing, tables, room, weight)
        return False, False, feet, weight
    smallest_forces(arms, room.spread, forces)
    if tables.tether.shape[0] > 0:
        share = _pulled(tables, room, feet, weight)
        _fill_effects(poses, contacts, standing, tables, room, weight)
        effect, constant, spread = room.effect[:feet], room.constant[:feet], room.spread
        held = share <= most and approach_bounds(
            arms, unit, spread, inside, effect, constant, most, _MOST_ROUNDS, forces, past
        )
        return held, held, feet, weight
    within = inside_cones(unit, inside, forces)
    if within and _largest(poses, contacts, standing, tables, room, weight) <= most:
        return True, True, feet, weight
    _fill_effects(poses, contacts, standing, tables, room, weight)
    effect, constant, spread = room.effect[:feet], room.constant[:feet], room.spread
    if approach_bounds(arms, unit, spread, inside, effect, constant, most, _FEW_ROUNDS, forces, past):
        return True, True, feet, weight
    if not within and refused(arms, unit, around):
        return False, True, feet, weight
    held = approach_bounds(arms, unit, spread, inside, effect, constant, most, _MOST_ROUNDS, forces, past)
    return held, held, feet, weight


@njit()
def all_held_within(
    poses: Array,
    Ts_site_base: Array,
    contacts: Array,
    normals: Array,
    standing: NDArray[np.bool_],
    tables: HeldTables,
    most: float,
) -> NDArray[np.bool_]:
    """:func:`held_within` of each of n postures, (n,); n in front of every argument but the last two."""
    out = np.empty(poses.shape[0], np.bool_)
    for i in range(out.size):
        out[i] = held_within(poses[i], Ts_site_base[i], contacts[i], normals[i], standing[i], tables, most)
    return out


@njit()
def _pulled(tables, room, feet, weight):
    """Pull the tether so that the feet are pressed least sideways; the share of the drum's most that it takes."""
    forces, change, most = room.forces[:feet], room.change[:feet], tables.tether[0, MOST] / weight
    fill_change(room.arms[:feet], room.spread, room.pull, change)
    pull = easiest_pull(room.unit[:feet], forces, change, most)
    for foot in range(feet):
        for row in range(3):
            forces[foot, row] += pull * change[foot, row]
    return pull / most


@njit()
def _room(legs):
    feet = np.empty((5, legs, 3))
    return _Room(
        np.empty((legs, 6, 4)),
        feet[0],
        feet[1],
        feet[2],
        feet[3],
        np.empty((4, 3)),
        np.empty((legs + 1, 6, 3)),
        np.empty((legs + 1, 6)),
        np.empty((2, 3)),
        feet[4],
    )


@njit()
def _lay_out(poses, T_site_base, contacts, normals, standing, tables, room):
    """Number of feet, 0 where they can't carry, and the weight [N]; fills beyond, arms and unit."""
    parts, chassis, beyond = tables.parts, tables.chassis, room.beyond
    mass = chassis[3]
    x = mass * (_row(T_site_base, 0, chassis[0], chassis[1], chassis[2]) + T_site_base[0, 3])
    y = mass * (_row(T_site_base, 1, chassis[0], chassis[1], chassis[2]) + T_site_base[1, 3])
    z = mass * (_row(T_site_base, 2, chassis[0], chassis[1], chassis[2]) + T_site_base[2, 3])
    for leg in range(standing.size):
        mx, my, mz, m = 0.0, 0.0, 0.0, 0.0
        for joint in range(5, -1, -1):
            pose = poses[PART_COUNT * leg + joint]
            cx, cy, cz, own = parts[leg, joint, 0], parts[leg, joint, 1], parts[leg, joint, 2], parts[leg, joint, 3]
            mx += own * (_row(pose, 0, cx, cy, cz) + pose[0, 3])
            my += own * (_row(pose, 1, cx, cy, cz) + pose[1, 3])
            mz += own * (_row(pose, 2, cx, cy, cz) + pose[2, 3])
            m += own
            beyond[leg, joint, 0], beyond[leg, joint, 1], beyond[leg, joint, 2] = mx, my, mz
            beyond[leg, joint, 3] = m
        x, y, z, mass = x + mx, y + my, z + mz, mass + m
    x, y, z = x / mass, y / mass, z / mass
    feet, R, tethered = 0, tables.R_level_site, tables.tether.shape[0] > 0
    if tethered and not fill_pull(tables.tether, T_site_base, R, x, y, z, room.pull):
        return 0, 0.0
    for leg in range(standing.size):
        if not standing[leg]:
            continue
        ax, ay, az = contacts[leg, 0] - x, contacts[leg, 1] - y, contacts[leg, 2] - z
        nx, ny, nz = normals[leg, 0], normals[leg, 1], normals[leg, 2]
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        upward = _row(R, 2, nx, ny, nz) > 0.0 or (tethered and length > 0.0)
        if not (upward and length < np.inf and math.isfinite(ax + ay + az)):
            return 0, 0.0
        for row in range(3):
            room.arms[feet, row] = _row(R, row, ax, ay, az)
            room.unit[feet, row] = _row(R, row, nx, ny, nz) / length
        feet += 1
    return feet, mass * tables.about[GRAVITY]


@njit()
def _row(R, row, x, y, z):
    return R[row, 0] * x + R[row, 1] * y + R[row, 2] * z


@njit()
def _largest(poses, contacts, standing, tables, room, weight):
    """Largest share of a torque limit over all joints with the forces on the feet."""
    R, forces, largest, foot = tables.R_level_site, room.forces, 0.0, 0
    for leg in range(standing.size):
        fx = fy = fz = 0.0
        if standing[leg]:
            x, y, z = weight * forces[foot, 0], weight * forces[foot, 1], weight * forces[foot, 2]
            fx = R[0, 0] * x + R[1, 0] * y + R[2, 0] * z
            fy = R[0, 1] * x + R[1, 1] * y + R[2, 1] * z
            fz = R[0, 2] * x + R[1, 2] * y + R[2, 2] * z
            foot += 1
        largest = max(largest, _share(leg, poses, contacts, standing, tables, room.beyond, fx, fy, fz))
    return largest


@njit()
def _hanging(poses, contacts, standing, tables, room):
    """Largest share of a torque limit over the joints of legs in the air."""
    largest = 0.0
    for leg in range(standing.size):
        if not standing[leg]:
            largest = max(largest, _share(leg, poses, contacts, standing, tables, room.beyond, 0.0, 0.0, 0.0))
    return largest


@njit()
def _share(leg, poses, contacts, standing, tables, beyond, fx, fy, fz):
    """Largest share of a torque limit over the joints of a leg with the force (fx, fy, fz) [N] in site on its foot.

    By virtual work, see torques.py: the moment of the weight beyond a joint, less that of the force, along its axis.
    """
    limits, R, gravity = tables.limits, tables.R_level_site, tables.about[GRAVITY]
    ux, uy, uz = gravity * R[2, 0], gravity * R[2, 1], gravity * R[2, 2]
    largest = 0.0
    for joint in range(6):
        pose = poses[PART_COUNT * leg + joint]
        x, y, z, m = pose[0, 3], pose[1, 3], pose[2, 3], beyond[leg, joint, 3]
        gx, gy, gz = beyond[leg, joint, 0] - m * x, beyond[leg, joint, 1] - m * y, beyond[leg, joint, 2] - m * z
        mx, my, mz = gy * uz - gz * uy, gz * ux - gx * uz, gx * uy - gy * ux
        if standing[leg]:
            px, py, pz = contacts[leg, 0] - x, contacts[leg, 1] - y, contacts[leg, 2] - z
            mx, my, mz = mx - (py * fz - pz * fy), my - (pz * fx - px * fz), mz - (px * fy - py * fx)
        axis = JOINT_AXES[joint]
        torque = pose[0, axis] * mx + pose[1, axis] * my + pose[2, axis] * mz
        largest = max(largest, abs(torque) / limits[leg, joint])
    return largest


@njit()
def _fill_effects(poses, contacts, standing, tables, room, weight):
    """What a weight on a foot and what hangs on its leg do to the ratios of the leg's joints."""
    R, limits, gravity, beyond = tables.R_level_site, tables.limits, tables.about[GRAVITY], room.beyond
    ux, uy, uz = gravity * R[2, 0], gravity * R[2, 1], gravity * R[2, 2]
    foot = 0
    for leg in range(standing.size):
        if not standing[leg]:
            continue
        for joint in range(6):
            pose, axis = poses[PART_COUNT * leg + joint], JOINT_AXES[joint]
            ax, ay, az = pose[0, axis], pose[1, axis], pose[2, axis]
            x, y, z, m = pose[0, 3], pose[1, 3], pose[2, 3], beyond[leg, joint, 3]
            gx, gy, gz = beyond[leg, joint, 0] - m * x, beyond[leg, joint, 1] - m * y, beyond[leg, joint, 2] - m * z
            moment = ax * (gy * uz - gz * uy) + ay * (gz * ux - gx * uz) + az * (gx * uy - gy * ux)
            room.constant[foot, joint] = moment / limits[leg, joint]
            px, py, pz = contacts[leg, 0] - x, contacts[leg, 1] - y, contacts[leg, 2] - z
            jx, jy, jz = ay * pz - az * py, az * px - ax * pz, ax * py - ay * px
            for row in range(3):
                room.effect[foot, joint, row] = -weight * _row(R, row, jx, jy, jz) / limits[leg, joint]
        foot += 1


@njit()
def _least(tables: HeldTables, room: _Room, feet: int, weight: float) -> float:
    """The least ratio of the standing legs' joints by the program; inf where no forces hold, NaN where unsolved."""
    about, limbs = tables.about, feet + tables.tether.shape[0]
    faces, arms = np.empty((limbs, int(about[SIDES]), 3)), np.empty((limbs, 3))
    fill_facets(room.unit[:feet], about[FRICTION], faces[:feet])
    arms[:feet] = room.arms[:feet]
    if limbs > feet:
        fill_limb(room.pull, tables.tether[0, MOST] / weight, arms[feet], faces[feet], room.effect[feet])
        room.constant[feet] = 0.0
    size = 1e-6
    for limb in range(limbs):
        for row in range(3):
            size = max(size, abs(arms[limb, row]))
    forces = np.empty((limbs, 3))
    status, ratio = least_ratio(arms / size, faces, room.effect[:limbs], room.constant[:limbs], forces)
    if status == INFEASIBLE:
        return np.inf
    return float(ratio) if status == OPTIMAL else np.nan
