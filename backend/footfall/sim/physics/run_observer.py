"""Watches the rover step by step while a sequence runs: wheels, contacts, slip, torques, the chassis."""

from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.kinematics import leg_link_poses
from footfall.sim.physics.contacts import Touches, crossed, on_wheels
from footfall.sim.physics.physics_settings import TIME_STEP
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import UnplannedContact, WheelEvent
from footfall.terrain.ground.surface import height_at

STANDS = 20.0
"""A wheel that bears more than this stands [N]; what swings through dust bears less."""

LASTING = 0.1
"""A wheel has left the ground, or is on it, when it was so for this long [s]: it may bounce as it lands."""

LEAST_FORCE = 1.0
"""Contacts with less than this are none [N]."""

LOOKED_AFTER = 25
"""Time steps between two looks at the height of the swinging leg."""


@dataclass
class _Wheel:
    """How a wheel stands. since: from when on it has been otherwise. point: where it met the ground last; center: of
    its rim then."""

    down: bool
    point: Array
    center: Array
    since: float | None = None


class RunObserver:
    """Call :meth:`row` when a command begins and :meth:`look` after every time step.

    goals: leg → (2 or 3,) where its wheel is to come down, site [m].
    """

    def __init__(self, rover: PhysicalRover, goals: dict[int, Array]) -> None:
        self._rover = rover
        self._goals = goals
        self._start = rover.time
        legs = rover.robot.leg_count
        self.events: list[WheelEvent] = []
        self.slip, self.drag = np.zeros(legs), np.zeros(legs)
        self.torque, self.least_load = np.zeros(6 * legs), np.full(legs, np.inf)
        self.clearance = np.nan
        self._contacts: dict[tuple[str, str], UnplannedContact] = {}
        self._over: list[UnplannedContact] = []
        self._row, self._leg, self._swings = 0, None, False
        self._looks = 0
        forces, points = self._on_wheels(rover.touches())
        centers, _, _ = rover.rims()
        self._wheels = [
            _Wheel(bool(force > STANDS), point, center)
            for force, point, center in zip(forces, points, centers, strict=True)
        ]
        # how far each wheel's material has slipped over the ground since it came down, or stood as it was put [m]
        self._path = np.zeros((legs, 3))

    @property
    def contacts(self) -> list[UnplannedContact]:
        """Contacts that nobody planned, in the order of their beginning."""
        return sorted([*self._over, *self._contacts.values()], key=lambda one: (one.start, one.link_a, one.link_b))

    @property
    def now(self) -> float:
        """Seconds since the start."""
        return self._rover.time - self._start

    def row(self, row: int, leg: int | None, swings: bool) -> None:
        """From now on command ``row`` runs. leg: which one it moves, if one; swings: that its wheel is in the air.

        What a wheel was dragged while it was put down is no slip of it as a support.
        """
        if self._leg is not None and leg != self._leg:
            self._path[self._leg] = 0.0
        self._row, self._leg, self._swings = row, leg, swings

    def look(self) -> None:
        """Take in the present moment."""
        touching = self._rover.touches()
        self._unplanned(touching)
        forces, points = self._on_wheels(touching)
        standing = np.arange(len(forces)) != self._leg
        self.least_load[standing] = np.minimum(self.least_load, forces)[standing]
        centers, velocities, spins = self._rover.rims()
        self._slipped(forces, points - centers, velocities, spins)
        for leg, wheel in enumerate(self._wheels):
            self._switched(leg, wheel, forces[leg], points[leg], centers[leg])
        shares = np.abs(self._rover.torques) / self._rover.robot.torque_limits
        np.maximum(self.torque, shares, out=self.torque)
        self._looks += 1
        if self._swings and self._leg is not None and self._looks % LOOKED_AFTER == 0:
            self.clearance = np.fmin(self.clearance, self._height(self._leg))

    def standing(self, leg: int) -> Array | None:
        """Where a wheel stands, (3,) [m], or None where it does not."""
        force, point = (array[leg] for array in self._on_wheels(self._rover.touches()))
        return point if force > STANDS else None

    def _on_wheels(self, touching: Touches) -> tuple[Array, Array]:
        """Size of the ground's force on each wheel (legs,) [N] and where it acts (legs, 3)."""
        forces, points = on_wheels(self._rover.physics, touching)
        return np.linalg.norm(forces, axis=1), points

    def _slipped(self, forces: Array, arms: Array, velocities: Array, spins: Array) -> None:
        """Add up the materials' way over the ground while wheels bear load; a moment without does not end the way.

        arms: (legs, 3) from the rims' centres to where the ground's force acts.
        """
        loaded = forces > STANDS
        speeds = velocities + crossed(spins, arms)
        normals = arms / np.linalg.norm(arms, axis=1, keepdims=True)
        along = speeds - np.einsum("lk,lk->l", speeds, normals)[:, None] * normals
        self._path[loaded] += TIME_STEP * along[loaded]
        far = np.linalg.norm(self._path, axis=1)
        moving = np.arange(len(far)) == self._leg
        self.slip = np.where(moving, self.slip, np.maximum(self.slip, far))
        self.drag = np.where(moving, np.maximum(self.drag, far), self.drag)

    def _switched(self, leg: int, wheel: _Wheel, force: float, point: Array, center: Array) -> None:
        down = bool(force > STANDS) if not wheel.down else bool(force > 0)
        if down == wheel.down:
            wheel.since = None
            if down:
                wheel.point, wheel.center = point, center
            return
        if wheel.since is None:
            wheel.since = self.now
            if down:
                wheel.point, wheel.center = point, center
        if self.now - wheel.since < LASTING - 1e-9:
            return
        place = wheel.point
        goal = self._goals.get(leg)
        off = np.nan if goal is None or not down else float(np.linalg.norm(place[:2] - goal[:2]))
        kind = "touch-down" if down else "lift-off"
        self.events.append(WheelEvent(kind, leg, self._row, wheel.since, place, wheel.center, leg == self._leg, off))
        wheel.down, wheel.since, self._path[leg] = down, None, 0.0

    def _unplanned(self, touching: Touches) -> None:
        physics = self._rover.physics
        forces: dict[tuple[str, str], float] = {}
        treads = {int(geom): leg for leg, geom in enumerate(physics.tread)}
        for (a, b), force in zip(touching.geoms, np.linalg.norm(touching.forces, axis=1), strict=True):
            of = treads.get(int(b)) if a == physics.ground else None
            if force < LEAST_FORCE or (of is not None and not (self._swings and of == self._leg)):
                continue
            pair = (physics.geom_names[b], physics.geom_names[a])
            forces[pair] = forces.get(pair, 0.0) + float(force)
        for pair in [pair for pair in self._contacts if pair not in forces]:
            if self.now - self._contacts[pair].end > LASTING:
                self._over.append(self._contacts.pop(pair))
        for pair, force in forces.items():
            known = self._contacts.get(pair)
            start, row, peak = (self.now, self._row, 0.0) if known is None else (known.start, known.row, known.force)
            self._contacts[pair] = UnplannedContact(*pair, row=row, start=start, end=self.now, force=max(peak, force))

    def _height(self, leg: int) -> float:
        """Least height of the leg's corners over the ground straight below them [m]; NaN where that is unknown."""
        rover = self._rover
        poses = leg_link_poses(rover.robot, rover.posture[6 * leg : 6 * leg + 6], leg)
        meshes = rover.robot.description.meshes
        points = np.concatenate([apply(rover.T_site_base @ T, meshes[name].vertices) for name, T in poses.items()])
        gaps = points[:, 2] - height_at(rover.dem, points[:, 0], points[:, 1])
        return float(np.nanmin(gaps)) if np.isfinite(gaps).any() else np.nan
