"""What touches what in a simulated moment, and with which force."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.sim.physics.model import PhysicsModel

_THREE = np.arange(3)


@dataclass(frozen=True)
class Touches:
    """geoms: (n, 2). points: (n, 3) site [m]. normals: (n, 3) from the first to the second. forces: (n, 3) of the first
    on the second, site [N]."""

    geoms: NDArray[np.int32]
    points: Array
    normals: Array
    forces: Array

    def only(self, which: NDArray[np.bool_]) -> "Touches":
        """Some of them, by a mask (n,)."""
        return Touches(self.geoms[which], self.points[which], self.normals[which], self.forces[which])


def touches(data: mujoco.MjData) -> Touches:
    """All contacts that bear force or may."""
    contact = data.contact
    addresses = contact.efc_address
    active = addresses >= 0
    frames = contact.frame[active].reshape(-1, 3, 3)
    # with elliptic cones a contact has its normal force and two along the other axes of its frame, one after the other
    rows = addresses[active, None] + _THREE
    forces = np.einsum("nk,nkj->nj", data.efc_force[rows], frames)
    return Touches(contact.geom[active], contact.pos[active], frames[:, 0].copy(), forces)


def on_wheels(physics: PhysicsModel, touching: Touches) -> tuple[Array, Array]:
    """Force of the ground on each wheel (legs, 3) [N], and where it acts (legs, 3): NaN where it bears nothing."""
    legs = len(physics.tread)
    wheel = np.where(touching.geoms[:, 0] == physics.ground, physics.wheel_of[touching.geoms[:, 1]], -1)
    mine = wheel >= 0
    wheel, found = wheel[mine], touching.forces[mine]
    pressure = np.einsum("nk,nk->n", found, touching.normals[mine])
    forces, weighed, total = np.zeros((legs, 3)), np.zeros((legs, 3)), np.zeros(legs)
    np.add.at(forces, wheel, found)
    np.add.at(weighed, wheel, pressure[:, None] * touching.points[mine])
    np.add.at(total, wheel, pressure)
    points = np.full((legs, 3), np.nan)
    points[total > 0] = weighed[total > 0] / total[total > 0, None]
    return forces, points


def chassis_on_ground(physics: PhysicsModel, touching: Touches) -> bool:
    """Whether chassis or payload touch the ground."""
    return bool(((touching.geoms[:, 0] == physics.ground) & np.isin(touching.geoms[:, 1], physics.chassis)).any())


def crossed(a: Array, b: Array) -> Array:
    """Cross products of rows (n, 3); numpy's own takes longer over a few rows than a time step of the simulation."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]
