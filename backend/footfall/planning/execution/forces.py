"""Set points that hold a posture, and contact forces that change least while the rover is moved."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.balance.forces import distribute, equilibrium_matrix
from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import gravity_and_jacobians, holding, wheel_arms
from footfall.robot.kinematics import center_of_mass

FEWEST_HELD = 3
"""So many wheels' forces have to be free to balance the rover."""
WELL_INSIDE = 0.5
"""A wheel that is to bear little uses this share of its friction at most."""


class Holder:
    """What holds the rover that started at rest in ``start``, whatever its legs do since.

    normals: (legs, 3) of the ground at the wheels, site; one changes where a wheel is put down elsewhere.
    """

    def __init__(self, rover: CompliantRover, start: RestingRover) -> None:
        self.rover, self.start, self.normals = rover, start, start.normals.copy()

    def set_points(self, posture: Array, T_site_base: Array, forces: Array, hubs: Array | None = None) -> Array:
        """Set points (legs × 6,) that hold a posture against gravity and the ground's forces (legs, 3), site.

        In closed form, q + (G − Jᵀ f) / k, less what the joints yield that springs don't explain. hubs: (legs, 3),
        site, under which the forces act; None: the posture's.
        """
        hubs = self.rover.wheels(posture, T_site_base)[0] if hubs is None else hubs
        torques = holding(self.rover, posture, T_site_base, hubs, self.normals, forces)
        bias = np.where(np.repeat(forces.any(axis=1), 6), self.start.bias, 0.0)
        return posture + torques / self.start.stiffness - self.start.offset - bias

    def least_change(self, posture: Array, T_site_base: Array, forces: Array, wheels: NDArray[np.bool_]) -> Array:
        """Forces (legs, 3) that balance the rover, those on ``wheels`` (legs,) changed least from ``forces``."""
        mass, center = self.weighed(posture)
        hubs, _ = self.rover.wheels(posture, T_site_base)
        matrix = equilibrium_matrix(wheel_arms(self.rover, hubs, self.normals), apply(T_site_base, center))
        lacking = np.append(-mass * self.rover.gravity, np.zeros(3)) - matrix @ forces.ravel()
        out = forces.copy()
        out[wheels] += np.linalg.lstsq(matrix[:, np.repeat(wheels, 3)], lacking, rcond=None)[0].reshape(-1, 3)
        return out

    def pressed_down(
        self, posture: Array, T_site_base: Array, forces: Array, wheels: NDArray[np.bool_], least: float
    ) -> Array | None:
        """As :meth:`least_change`, but that no wheel bears less than ``least`` [N]: others then change more.

        None where that takes too much of the others.
        """
        found, held = self.least_change(posture, T_site_base, forces, wheels), wheels.copy()
        while (low := held & (self._loads(found) < least)).any():
            held &= ~low
            if held.sum() < FEWEST_HELD:
                return None
            fixed = found.copy()
            fixed[low] = self._pressing(found[low], self.normals[low], least)
            found = self.least_change(posture, T_site_base, fixed, held)
        return found

    def _loads(self, forces: Array) -> Array:
        return np.sum(forces * self.normals, axis=1)

    def _pressing(self, forces: Array, normals: Array, least: float) -> Array:
        """Forces (k, 3) that press with ``least`` [N], sideways as these do, but well inside friction."""
        sideways = forces - np.sum(forces * normals, axis=1, keepdims=True) * normals
        most = WELL_INSIDE * self.rover.settings.balance.friction * least
        share = np.minimum(1.0, most / np.maximum(np.linalg.norm(sideways, axis=1, keepdims=True), 1e-9))
        return least * normals + share * sideways

    def inside_friction(
        self,
        posture: Array,
        T_site_base: Array,
        standing: NDArray[np.bool_],
        spare: float,
        near: Array | None = None,
    ) -> Array | None:
        """Forces (legs, 3) of least norm on the wheels ``standing`` (legs,) that hold the rover inside friction.

        spare: share of friction that they leave. near: (legs, 3) [N]; with them those that differ least from these.
        None where no forces can.
        """
        mass, center = self.weighed(posture)
        hubs, _ = self.rover.wheels(posture, T_site_base)
        balance = self.rover.settings.balance
        R = balance.R_level_site
        found = distribute(
            wheel_arms(self.rover, hubs, self.normals)[standing] @ R.T,
            self.normals[standing] @ R.T,
            R @ apply(T_site_base, center),
            mass,
            balance.gravity,
            (1 - spare) * balance.friction,
            None if near is None else near[standing] @ R.T,
        )
        if found is None:
            return None
        forces = np.zeros_like(hubs)
        forces[standing] = found @ R
        return forces

    def least_torque(self, posture: Array, T_site_base: Array, standing: NDArray[np.bool_]) -> Array:
        """Forces (legs, 3) on the wheels ``standing`` that balance the rover with the least torques.

        Of all that balance it, those with the least sum of squares of torque / limit; friction counts for nothing.
        """
        hubs, _ = self.rover.wheels(posture, T_site_base)
        G, J_site = gravity_and_jacobians(self.rover, posture, T_site_base, hubs, self.normals)
        legs = np.flatnonzero(standing)
        limits = self.rover.robot.torque_limits.reshape(-1, 6)
        mass, center = self.weighed(posture)
        balance = equilibrium_matrix(wheel_arms(self.rover, hubs, self.normals)[legs], apply(T_site_base, center))
        # the Lagrange conditions of least squares with equations
        size = 3 * len(legs)
        rows = np.zeros((size + 6, size + 6))
        right = np.append(np.zeros(size), np.append(-mass * self.rover.gravity, np.zeros(3)))
        for i, leg in enumerate(legs):
            own = slice(3 * i, 3 * i + 3)
            push = J_site[leg].T / limits[leg][:, None]
            rows[own, own] = push.T @ push
            right[own] = push.T @ (G.reshape(-1, 6)[leg] / limits[leg])
        rows[:size, size:], rows[size:, :size] = balance.T, balance
        forces = np.zeros_like(hubs)
        forces[legs] = np.linalg.lstsq(rows, right, rcond=None)[0][:size].reshape(-1, 3)
        return forces

    def spare(self, posture: Array, T_site_base: Array, forces: Array, standing: NDArray[np.bool_]) -> float:
        """The least of what is spare of a wheel's share of the weight, of friction, and of the torque limits."""
        hubs, _ = self.rover.wheels(posture, T_site_base)
        torques = holding(self.rover, posture, T_site_base, hubs, self.normals, forces)
        loads = np.sum(forces * self.normals, axis=1)[standing]
        sideways = np.linalg.norm(forces - np.sum(forces * self.normals, axis=1)[:, None] * self.normals, axis=1)
        held = self.rover.settings.balance.friction * np.maximum(loads, 1e-9)
        weight = self.rover.mass * float(np.linalg.norm(self.rover.gravity))
        return float(
            min(
                loads.min() / weight * len(forces),
                1.0 - (sideways[standing] / held).max(),
                1.0 - (np.abs(torques) / self.rover.robot.torque_limits).max(),
            )
        )

    def weighed(self, posture: Array) -> tuple[float, Array]:
        """Mass [kg] and centre of mass (3,) [m] in base, payload included."""
        return loaded(self.rover.robot, center_of_mass(self.rover.robot, posture), self.rover.settings.balance)


def borne(rover: CompliantRover, rests: Sequence[RestingRover], least_load: float) -> tuple[Array, Array, Array]:
    """What the wheels bear at rests.

    Args:
        rover: the yielding rover on its ground.
        rests: n of them.
        least_load: of a wheel whose friction counts [N].

    Returns:
        Forces of the ground in site (n, legs, 3) [N], loads along the normals (n, legs) [N], and shares of friction in
        use (n, legs), 0 where a wheel bears no more than ``least_load``.
    """
    forces = np.array([one.forces for one in rests])
    normals = np.array([one.normals for one in rests])
    loads = np.sum(forces * normals, axis=2)
    sideways = np.linalg.norm(forces - loads[..., None] * normals, axis=2)
    friction = rover.settings.balance.friction
    return forces, loads, np.where(loads > least_load, sideways / (friction * np.maximum(loads, 1e-9)), 0.0)
