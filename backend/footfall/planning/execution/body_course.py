"""The set points of a move of the chassis, row by row, so that the yielding rover carries it where it was planned.

Standing wheels are locked and neither roll nor turn: a pose of the chassis and the strain of the wheels' springs give
every leg, and the ground's forces then give the set points.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.core.frames import inverse
from footfall.core.progress import Progress
from footfall.planning.between_rows import finer
from footfall.planning.body.follow import unwrapped
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.forces import Holder
from footfall.planning.execution.walker import ROW, Lost, Walker
from footfall.planning.motion import BODY
from footfall.planning.scene.lift import LARGEST_STEP
from footfall.robot.ik import solve_leg
from footfall.robot.model import Robot

FEWEST = 4
"""Rows of the shortest move."""
NEAREST, LEAST_FORCE, LEAST_TORQUE = "nearest", "least_force", "least_torque"
ENDS = (NEAREST, LEAST_FORCE, LEAST_TORQUE)
"""Which forces hold the rover where a move ends, of those inside friction: those nearest to the ones that hold it at
first; those of least norm, and those nearest to the ones of least torque, which take legs out of their strain."""


class BodyCourse:
    """The chassis' way: rests, one for each row, and where the chassis was wanted, Ts (n, 4, 4).

    Forces go from those that hold the rover at first to others, one of ENDS, that hold it inside friction where it
    ends, changed least on the way so that they balance it. Each standing hub is shifted by −Δf / k_w, and set points
    are q + (G − Jᵀ f) / k. Raises Lost where no legs, or no forces, hold the chassis.
    """

    def __init__(
        self,
        rover: CompliantRover,
        start: RestingRover,
        plan: BodyMovePlan,
        settings: ExecutionSettings,
        progress: Progress,
        end: str = NEAREST,
    ) -> None:
        self.rover, self.robot, self.start = rover, rover.robot, start
        self.standing = start.touching
        self._holder = Holder(rover, start)
        motion = plan.motion
        fine, _ = finer(motion, ROW, -(-FEWEST // (len(motion.phases) - 1)))
        shares = np.linspace(0.0, 1.0, len(fine.phases))
        self.wanted = faded(start.T_site_base, fine.Ts_site_base, shares)
        ends = self._ends(fine.waypoints[-1], settings.spare_friction, end)
        if ends is None:
            raise Lost("no contact forces inside friction hold the rover where the chassis is to go")
        walker = Walker(rover, start, BODY, len(shares), progress)
        posture, forces = start.posture, start.forces
        for T, share in zip(self.wanted[1:], shares[1:], strict=True):
            posture = self._over_wheels(T, forces, posture)
            near = start.forces + share * (ends - start.forces)
            forces = self._holder.least_change(posture, T, near, self.standing)
            posture = self._over_wheels(T, forces, posture)
            walker.go(self._holder.set_points(posture, T, forces), BODY)
        self.rests = tuple(walker.rests)

    def _ends(self, posture: Array, spare_friction: float, end: str) -> Array | None:
        """Forces (legs, 3) that hold the rover where it ends, one of ENDS; None where none inside friction do."""
        T, standing = self.wanted[-1], self.standing
        near = self.start.forces if end == NEAREST else None
        if end == LEAST_TORQUE:
            near = self._holder.least_torque(posture, T, standing)
        return self._holder.inside_friction(posture, T, standing, spare_friction, near)

    def _over_wheels(self, T_site_base: Array, forces: Array, last: Array) -> Array:
        """The posture nearest to ``last`` whose standing wheels are where these forces press them, as turned as ever.

        Legs in the air keep theirs.
        """
        T_base_site = inverse(T_site_base)
        hubs = self.start.hubs - (forces - self.start.forces) / self.rover.wheel_stiffness
        posture = last.copy()
        for leg in np.flatnonzero(self.standing).tolist():
            T_site_wheel = np.eye(4)
            T_site_wheel[:3, :3], T_site_wheel[:3, 3] = self.start.turns[leg], hubs[leg]
            own = slice(6 * leg, 6 * leg + 6)
            posture[own] = _nearest(self.robot, leg, T_base_site @ T_site_wheel, last[own])
        return posture


def faded(T_site_base: Array, planned: Array, shares: Array) -> Array:
    """Planned poses, begun from where the chassis is: how far that is off the first one fades.

    Args:
        T_site_base: pose of the chassis now, (4, 4).
        planned: (n, 4, 4).
        shares: (n,) of the way, 0…1.

    Returns:
        Poses (n, 4, 4), the first where the chassis is, the last as planned.
    """
    off = T_site_base[:3, 3] - planned[0, :3, 3]
    turned = Rotation.from_matrix(T_site_base[:3, :3] @ planned[0, :3, :3].T).as_rotvec()
    left = (1.0 - shares)[:, None]
    out = planned.copy()
    out[:, :3, 3] += left * off
    out[:, :3, :3] = Rotation.from_rotvec(left * turned).as_matrix() @ planned[:, :3, :3]
    return out


def _nearest(robot: Robot, leg: int, T_base_wheel: Array, last: Array) -> Array:
    """Angles (6,) that put the wheel there, those nearest to the last ones (6,)."""
    q = unwrapped(solve_leg(robot, leg, T_base_wheel[None]).q[0], last)
    away = np.abs(q - last).max(axis=1)
    away[np.isnan(away)] = np.inf
    if not away.min() <= LARGEST_STEP:
        raise Lost(f"leg {leg} can't follow the chassis while its wheel stays where it stands")
    return q[np.argmin(away)]
