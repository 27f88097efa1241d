"""Inverse kinematics by search: damped least squares from many starts, joints held inside their limits.

It knows the chain of joints and nothing of how to solve it, so it can contradict the closed form.
Levenberg–Marquardt with projection onto the limits (Kanzow, Yamashita & Fukushima, 2004).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import rotation
from footfall.robot.description import JOINTS
from footfall.robot.model import Robot

FOUND = 1e-7
"""Largest error of the contact [m] and of the wheel's direction [rad] of a solution."""
_ROUNDS, _FEW = 120, 1e-16


@dataclass(frozen=True)
class Chain:
    """One leg: T_base_hip (4, 4), offsets (7, 3) [m] from joint to joint and on to the contact, limits (6,) [rad]."""

    T_base_hip: Array
    offsets: Array
    lower: Array
    upper: Array


def chain(robot: Robot, leg: int) -> Chain:
    """The leg's joints from hip yaw to the rim point that is lowest when the wheel stands upright."""
    spec = robot.description.legs[leg]
    offsets = np.zeros((7, 3))
    offsets[1] = spec.hip_offset
    offsets[2, 0], offsets[4, 0], offsets[6, 0] = spec.thigh, spec.shank, spec.foot + robot.wheel_radius
    own = slice(6 * leg, 6 * leg + 6)
    return Chain(spec.T_base_hip, offsets, robot.lower[own], robot.upper[own])


def forward(leg: Chain, q: Array) -> tuple[Array, Array, Array]:
    """Contact (n, 3) and direction (n, 3) of wheels in base at q (n, 6); their derivatives (n, 6, 6), contact first."""
    R = np.broadcast_to(leg.T_base_hip[:3, :3], (len(q), 3, 3))
    at = np.broadcast_to(leg.T_base_hip[:3, 3], (len(q), 3))
    axes, origins = [], []
    for k, (_, axis) in enumerate(JOINTS):
        at = at + R @ leg.offsets[k]
        origins.append(at)
        axes.append(R[:, :, "xyz".index(axis)])
        R = R @ rotation(axis, q[:, k])
    contact, direction = at + R @ leg.offsets[6], R[:, :, 0]
    axes, origins = np.stack(axes, axis=1), np.stack(origins, axis=1)
    moves = np.cross(axes, contact[:, None] - origins)
    turns = np.cross(axes, direction[:, None])
    return contact, direction, np.concatenate([moves, turns], axis=2).swapaxes(1, 2)


def search(leg: Chain, contacts: Array, directions: Array, starts: Array) -> Array:
    """Joint angles (n, 6) that come nearest to contacts (n, 3) and directions (n, 3), one start (n, 6) each."""
    q = np.clip(starts, leg.lower, leg.upper)
    damping = np.full(len(q), 1e-2)
    error, J = _error(leg, q, contacts, directions)
    cost = np.square(error).sum(axis=1)
    for _ in range(_ROUNDS):
        going = np.flatnonzero(cost > _FEW)
        if not len(going):
            break
        slope = np.einsum("nij,ni->nj", J[going], error[going])
        # a joint at its limit that would leave it stays
        stuck = ((q[going] <= leg.lower) & (slope > 0)) | ((q[going] >= leg.upper) & (slope < 0))
        J_free = np.where(stuck[:, None, :], 0.0, J[going])
        normal = J_free.swapaxes(1, 2) @ J_free + damping[going, None, None] * np.eye(6)
        step = -np.linalg.solve(normal, np.where(stuck, 0.0, slope)[..., None])[..., 0]
        tried = np.clip(q[going] + step, leg.lower, leg.upper)
        new_error, new_J = _error(leg, tried, contacts[going], directions[going])
        new_cost = np.square(new_error).sum(axis=1)
        better = new_cost < cost[going]
        at = going[better]
        q[at], error[at], J[at], cost[at] = tried[better], new_error[better], new_J[better], new_cost[better]
        damping[going] = np.clip(damping[going] * np.where(better, 0.2, 4.0), 1e-12, 1e4)
    return q


def _error(leg: Chain, q: Array, contacts: Array, directions: Array) -> tuple[Array, Array]:
    contact, direction, J = forward(leg, q)
    return np.concatenate([contact - contacts, direction - directions], axis=1), J


def reachable(leg: Chain, contacts: Array, directions: Array, rng: np.random.Generator, starts: int = 20) -> NDArray:
    """Whether a posture inside the limits was found, (n,), from that many random starts each."""
    found = np.zeros(len(contacts), bool)
    for _ in range(starts):
        left = np.flatnonzero(~found)
        if not len(left):
            break
        q = search(leg, contacts[left], directions[left], rng.uniform(leg.lower, leg.upper, (len(left), 6)))
        error, _ = _error(leg, q, contacts[left], directions[left])
        found[left] = np.abs(error).max(axis=1) < FOUND
    return found
