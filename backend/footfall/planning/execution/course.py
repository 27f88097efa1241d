"""The set points of a step in each mode, row by row, together with the motion that they are predicted to give."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.progress import Progress
from footfall.planning.between_rows import finer
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.predict import advanced
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.forces import Holder
from footfall.planning.execution.leg_moves import strained, with_hub_at
from footfall.planning.execution.walker import ROW, Lost, Walker
from footfall.planning.step.problem import StepPlan
from footfall.robot.kinematics import wheel_centers

SHARES = 10
"""Waypoints in which load leaves the leg, or comes onto it, with the chassis held."""
HALF = 0.5
"""The first set points with load on the wheel give it more than this share: those for less may be above where lowering
stopped, which depends on the ground, and would lift the wheel again."""
GUARDED = 0.03
"""Lowering is guarded from this height over the ground on [m]."""
FALL = 0.002
"""Guarded lowering is looked at every so far [m]."""
LEAST_FALL = 0.01
"""A shorter way down has no direction worth following [m]."""
SPARE = 0.1
"""Where the others would bear a leg's load with less to spare than this share, other forces are looked for."""
PRESSED_DOWN = (2.0, 1.1)
"""Standing wheels bear the first times what they have to at least where set points can see to it, else the second."""
ROUNDS = 3
"""In which a set point that depends on the sag that it causes is found; the error shrinks tenfold in each."""


@dataclass(frozen=True, eq=False)
class Course:
    """rests: one for each waypoint; phases: (n,). guarded_from, stopped_at, lowest, stop_force: see problem.Execution.

    stopped_at is −1 where lowering would not be stopped by the ground.
    """

    rests: tuple[RestingRover, ...]
    phases: tuple[str, ...]
    guarded_from: int
    stopped_at: int
    lowest: Array
    stop_force: float

    @property
    def commanded(self) -> Array:
        """Set points of the joints at each waypoint, (n, legs × 6) [rad]."""
        return np.array([rest.commanded for rest in self.rests])


class Commander(ABC):
    """What one mode commands. The plan's wheel path is kept in site; ``T_plan`` is the chassis pose planned with."""

    def __init__(
        self,
        rover: CompliantRover,
        start: RestingRover,
        plan: StepPlan,
        settings: ExecutionSettings,
        progress: Progress,
    ) -> None:
        self.rover, self.robot, self.start, self.plan, self.settings = rover, rover.robot, start, plan, settings
        self.leg, self.own = plan.leg, slice(6 * plan.leg, 6 * plan.leg + 6)
        fine, _ = finer(plan.motion, ROW)
        self.T_plan, self.postures, self.phases = fine.Ts_site_base[0], fine.waypoints, fine.phases
        self.holder = Holder(rover, start)
        self.walker = Walker(rover, start, "unload", len(self.postures) + 3 * SHARES, progress)
        self.hubs = self._planned_hubs()
        self.deepest = self.hubs[-1] - (0.0, 0.0, settings.overshoot)
        weight = rover.mass * float(np.linalg.norm(rover.gravity))
        self.stop_force = settings.stop_share * weight / self.robot.leg_count

    def course(self) -> Course:
        """All rows of the step. Raises Lost where it can't be commanded or predicted to its end."""
        self.unload()
        for i in range(1, len(self.postures)):
            if self.phases[i] == "lower" and self._near_ground(i):
                break
            self.carry(i)
        guarded_from = len(self.walker.rests) - 1
        lowest = self.lowest()
        target = self.walker.rest.commanded.copy()
        target[self.own] = lowest
        stopped_at = self._lowered(target)
        if stopped_at >= 0:
            self.holder.normals[self.leg] = self.plan.normal
            self.load()
        walker = self.walker
        return Course(tuple(walker.rests), tuple(walker.phases), guarded_from, stopped_at, lowest, self.stop_force)

    @property
    def higher(self) -> Array:
        """How much higher than planned the wheel is to stand, site (3,) [m]: as the others find the ground."""
        return self.rover.found_higher(self.start) * self.holder.normals[self.leg]

    @abstractmethod
    def unload(self) -> None:
        """Take the load off the leg."""

    @abstractmethod
    def carry(self, i: int) -> None:
        """To the planned posture i with the wheel in the air."""

    @abstractmethod
    def lowest(self) -> Array:
        """Set points (6,) of the leg that would bring its wheel below the ground by the overshoot."""

    @abstractmethod
    def load(self) -> None:
        """Give the leg its load again."""

    def hanging(self, T_site_base: Array, near: Array, hub: Array) -> Array:
        """Set points (6,) of the swing leg that hang its hub at a place in site; near: a posture (legs × 6,)."""
        q = with_hub_at(self.robot, self.leg, near, T_site_base, hub)
        if q is None:
            raise Lost(f"leg {self.leg} can't reach where its wheel is to be while the chassis gives way")
        posture = near.copy()
        posture[self.own] = q
        nothing = np.zeros((self.robot.leg_count, 3))
        return self.holder.set_points(posture, T_site_base, nothing)[self.own]

    def standing_forces(self, near: Array | None = None) -> Array:
        """Forces (legs, 3) [N] of least norm that hold the rover on its new stance, in the planned goal posture.

        near: (legs, 3) [N]; with them those that differ least from these.
        """
        standing = self.start.touching.copy()
        standing[self.leg] = True
        spare = self.settings.spare_friction
        found = self.holder.inside_friction(self.postures[-1], self.T_plan, standing, spare, near)
        if found is None:
            raise Lost("no contact forces inside friction hold the rover on its new stance")
        return found

    def _planned_hubs(self) -> Array:
        """Where the swing leg's hub is to be, site, (n, 3) [m]: as planned.

        While it lifts, higher by what the loaded wheel is pressed in at first, which fades with the height.
        """
        hubs = np.array([apply(self.T_plan, wheel_centers(self.robot, q)[self.leg]) for q in self.postures])
        pressed = self.start.rims[self.leg] - hubs[0]
        lifting = np.array([phase == "lift" for phase in self.phases])
        heights = np.maximum(hubs[lifting, 2] - hubs[0, 2], 0.0)
        hubs[lifting] += (1.0 - heights / max(heights.max(), 1e-6))[:, None] * pressed
        return hubs

    def _near_ground(self, i: int) -> bool:
        """Whether the way to the planned posture i would bring the wheel too near to the ground to go unguarded."""
        fall = self.hubs[i - 1, 2] - self.hubs[i, 2]
        return self.rover.gaps(self.walker.rest)[self.leg] - fall < GUARDED

    def _lowered(self, target: Array) -> int:
        """Go down the guarded line; the row that is predicted to stop it, or −1."""
        walker, up = self.walker, np.array([0.0, 0.0, 1.0])
        origin, T = walker.rest.commanded, walker.rest.T_site_base
        ends = [apply(T, wheel_centers(self.robot, q)[self.leg]) for q in (origin, target)]
        rows = max(2, int(np.ceil((ends[0] - ends[1])[2] / FALL)))
        for row in range(1, rows + 1):
            walker.go(target if row == rows else origin + row / rows * (target - origin), "lower")
            if walker.rest.forces[self.leg] @ up >= self.stop_force:
                return len(walker.rests) - 1
        return -1


class AsCommanded(Commander):
    """The plan's postures are the set points, before and after them the deflection that the loaded leg had."""

    def unload(self) -> None:
        """Commands the posture of the plan's first waypoint, without the deflection that the leg had."""
        self._leg_to(self.postures[0][self.own], "unload")

    def carry(self, i: int) -> None:
        """Commands the planned posture of sample ``i``."""
        self._leg_to(self.postures[i][self.own], self.phases[i])

    def lowest(self) -> Array:
        """Set points (6,) [rad] that put the hub as deep as a wheel may be asked for; raises Lost out of reach."""
        q = with_hub_at(self.robot, self.leg, self.postures[-1], self.T_plan, self.deepest)
        if q is None:
            raise Lost(f"leg {self.leg} can't reach {self.settings.overshoot:g} m below the planned contact")
        return q

    def load(self) -> None:
        """Commands the plan's last posture with the deflection that the loaded leg had at first."""
        deflection = self.start.commanded[self.own] - self.postures[0][self.own]
        self._leg_to(self.postures[-1][self.own] + deflection, "load")

    def _leg_to(self, q: Array, phase: str) -> None:
        target = self.walker.rest.commanded.copy()
        target[self.own] = q
        self.walker.line(target, phase)


class DroopAware(AsCommanded):
    """The swing leg alone is commanded, so that its hub is where it was planned while the chassis sags."""

    def unload(self) -> None:
        """Commands the swing leg so that its hub is where the plan begins, the chassis having sagged.

        Raises Lost where nothing holds the rover then.
        """
        walker, hub = self.walker, self.hubs[0]
        target = self.start.commanded.copy()
        end = self.start
        for _ in range(ROUNDS):
            target[self.own] = self.hanging(end.T_site_base, end.posture, hub)
            end = advanced(self.rover, self.start, target)
            if not end.settled:
                raise Lost(f"with leg {self.leg} unloaded nothing holds the rover in balance")
        walker.line(target, "unload")

    def carry(self, i: int) -> None:
        """Commands the swing leg so that its hub is where sample ``i`` has it, wherever the chassis sags to."""
        walker = self.walker
        target, end = walker.rest.commanded.copy(), walker.rest
        near = self.postures[i]
        for _ in range(ROUNDS - 1):
            target[self.own] = self.hanging(end.T_site_base, _with(end.posture, near, self.own), self.hubs[i])
            end = advanced(self.rover, walker.rest, target)
            if not end.settled:
                break
        walker.go(target, self.phases[i])

    def lowest(self) -> Array:
        """Set points (6,) [rad] that put the hub under its goal, seen from where the chassis has sagged to."""
        return self.beyond_goal(self.walker.rest.T_site_base, self.walker.rest.posture)

    def beyond_goal(self, T_site_base: Array, posture: Array) -> Array:
        """Set points (6,) on the line from the present ones through those that hang the hub where it is to touch.

        A straight line in the joints is a curve of the wheel: so it is right where it matters.
        """
        near = _with(posture, self.postures[-1], self.own)
        height = self.walker.rest.hubs[self.leg, 2] - self.hubs[-1, 2]
        if height < LEAST_FALL:
            return self.hanging(T_site_base, near, self.deepest)
        origin, touching = self.walker.rest.commanded[self.own], self.hanging(T_site_base, near, self.hubs[-1])
        return origin + (height + self.settings.overshoot) / height * (touching - origin)

    def load(self) -> None:
        """Commands the swing leg as springs would have it with all wheels bearing the chassis at its planned pose."""
        forces = self.standing_forces()
        strains = np.zeros_like(forces)
        strains[self.leg] = self.higher - forces[self.leg] / self.rover.wheel_stiffness
        posture = strained(
            self.robot, self.postures[-1], self.T_plan, self.holder.normals, strains, self.rover.body.rolled
        )
        hubs, _ = self.rover.wheels(self.postures[-1], self.T_plan)
        self._leg_to(self.holder.set_points(posture, self.T_plan, forces, hubs)[self.own], "load")


class PoseHeld(DroopAware):
    """All legs are commanded, so that the chassis keeps its pose.

    Closed form: with the pose fixed, contact forces of least change balance the rover; each hub shifts by −Δf / k_w
    against its rim, joints follow, and the set points are q + (G − Jᵀ f) / k.
    """

    def unload(self) -> None:
        """Commands all legs, in rows, so that the swing leg's force goes over to the others at the same pose."""
        self._posture, self._forces = self.start.posture.copy(), self.start.forces.copy()
        swing, eased = self.start.forces[self.leg], self._eased()
        for row in range(1, SHARES + 1):
            share = row / SHARES
            if eased is None:
                self._shift(self._posture, (1 - share) * swing)
            else:
                near = self.start.forces + share * (eased - self.start.forces)
                self._strain(self._posture, self._held(self._posture, near))
            self._command("unload")

    def carry(self, i: int) -> None:
        """Commands all legs so that the hub is where sample ``i`` has it; raises Lost where the leg can't reach it."""
        q = with_hub_at(self.robot, self.leg, _with(self._posture, self.postures[i], self.own), self._T, self.hubs[i])
        if q is None:
            raise Lost(f"leg {self.leg} can't reach where its wheel is planned to be")
        posture = self._posture.copy()
        posture[self.own] = q
        self._shift(posture, np.zeros(3))
        self._command(self.phases[i])

    def lowest(self) -> Array:
        """Set points (6,) [rad] that put the hub under its goal, with the chassis at the pose that is held."""
        return self.beyond_goal(self._T, self._posture)

    def load(self) -> None:
        """Commands all legs, in rows, so that the leg that came down takes up its share of the weight again."""
        posture = _with(self._posture, self.postures[-1], self.own)
        strains = np.zeros_like(self._forces)
        strains[self.leg] = self.higher
        self._shift(
            strained(self.robot, posture, self._T, self.holder.normals, strains, self.rover.body.rolled), np.zeros(3)
        )
        # what held all wheels before holds them again: forces of least norm push a wheel on a steep side along it
        in_the_air, standing = self._forces.copy(), self.standing_forces(near=self.start.forces)
        share_now = self.walker.rest.forces[self.leg, 2] / max(standing[self.leg, 2], 1.0)
        for row in range(1, SHARES + 1):
            share = row / SHARES
            self._strain(self._posture, in_the_air + share * (standing - in_the_air))
            if share > min(max(share_now, HALF), 0.99):
                self._command("load")

    @property
    def _T(self) -> Array:
        """The pose that is kept: the measured one."""
        return self.start.T_site_base

    def _shift(self, posture: Array, swing: Array) -> None:
        """Take the posture, with a force (3,) on the swing leg's wheel: the others' change least."""
        forces = self._forces.copy()
        forces[self.leg] = swing
        self._strain(posture, self._held(posture, forces))

    def _held(self, posture: Array, near: Array) -> Array:
        """Forces (legs, 3) that balance the rover, near to these; every wheel that stands stays well pressed down."""
        for times in PRESSED_DOWN:
            least = times * self.settings.least_load
            found = self.holder.pressed_down(posture, self._T, near, self._others, least)
            if found is not None:
                return found
        return self.holder.least_change(posture, self._T, near, self._others)

    @property
    def _others(self) -> NDArray[np.bool_]:
        """The wheels that stand all along, (legs,)."""
        others = self.start.touching.copy()
        others[self.leg] = False
        return others

    def _eased(self) -> Array | None:
        """Forces (legs, 3) that the other wheels are to bear while the leg is lifted; None: those that change least.

        Those may take a wheel's load, its friction or a joint's torque to the limit where other forces would not.
        """
        start, others = self.start, self._others
        forces = start.forces.copy()
        forces[self.leg] = 0.0
        plain = self.holder.least_change(start.posture, self._T, forces, others)
        spare = self.holder.spare(start.posture, self._T, plain, others)
        if spare >= SPARE:
            return None
        best = None
        for near in (None, self.holder.least_torque(start.posture, self._T, others)):
            found = self.holder.inside_friction(start.posture, self._T, others, self.settings.spare_friction, near)
            if found is not None and self.holder.spare(start.posture, self._T, found, others) > spare:
                best, spare = found, self.holder.spare(start.posture, self._T, found, others)
        return best

    def _strain(self, posture: Array, forces: Array) -> None:
        """Let the hubs go where the forces' change presses them; a swinging wheel is pressed by nothing."""
        strains = -(forces - self._forces) / self.rover.wheel_stiffness
        self._posture = strained(self.robot, posture, self._T, self.holder.normals, strains, self.rover.body.rolled)
        self._forces = forces

    def _command(self, phase: str) -> None:
        self.walker.go(self.holder.set_points(self._posture, self._T, self._forces), phase)


COMMANDERS: dict[str, type[Commander]] = {
    "as_commanded": AsCommanded,
    "droop_aware": DroopAware,
    "pose_held": PoseHeld,
}


def _with(posture: Array, other: Array, own: slice) -> Array:
    """The posture with one leg's angles of another."""
    out = posture.copy()
    out[own] = other[own]
    return out
