"""A walk cut into stretches over which the same feet stand, each sampled, and where its links are by pin."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from footfall.core.arrays import Array
from footfall.planning.motion import Motion
from footfall.planning.walk.problem import CheckedMotion, part_name
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.robot.description import PARTS, link_name
from footfall.robot.model import Robot


@dataclass(frozen=True)
class MotionStretch:
    """Samples of a motion during which the same feet stand.

    move: number of the foot move, of so many. moving: the legs in the air; none: the chassis moves over all feet.
    qs: (n, legs × 6) [rad]; Ts_site_base: (n, 4, 4). waypoints: (n,), the one that each sample's motion ends at;
    fractions: (n,), how far on the way there; phases: of each sample.
    """

    robot: Robot
    move: int
    of: int
    moving: tuple[int, ...]
    qs: Array
    Ts_site_base: Array
    waypoints: NDArray[np.int64]
    fractions: Array
    phases: tuple[str, ...]

    @property
    def standing(self) -> list[int]:
        """Legs that don't move in it."""
        return [leg for leg in self.robot.legs if leg not in self.moving]

    def where(self, at: int) -> str:
        """A sample, for a person."""
        way = f"{self.fractions[at]:.0%} of the way to waypoint {self.waypoints[at]}"
        return f"{part_name(self.move, self.of)}, {self.phases[at]}, {way}"

    @cached_property
    def Ts_base_link(self) -> dict[str, Array]:
        """Poses (n, 4, 4) of every link, by name, from the URDF; of legs that keep still it is one pose, many times."""
        model, count = self.robot.model, len(self.qs)
        scratch = model.createData()
        moving = self.moving or self.robot.legs
        frames = {link_name(leg, part): self._frame(leg, part) for leg in self.robot.legs for part in PARTS}
        chosen = {link_name(leg, part): frames[link_name(leg, part)] for leg in moving for part in PARTS}
        found = {link: np.empty((count, 4, 4)) for link in chosen}
        for i, q in enumerate(self.qs):
            pin.framesForwardKinematics(model, scratch, q)
            for link, frame in chosen.items():
                found[link][i] = scratch.oMf[frame].homogeneous
        for link, frame in frames.items():
            if link not in found:
                found[link] = np.broadcast_to(scratch.oMf[frame].homogeneous, (count, 4, 4))
        return found

    @cached_property
    def coms_site(self) -> Array:
        """Centres of mass, with the payload, in site, (n, 3) [m]."""
        model, payload = self.robot.model, self.robot.description.payload
        scratch, chassis = model.createData(), self.robot.model.inertias[0]
        coms = np.array([np.array(pin.centerOfMass(model, scratch, q)) for q in self.qs])
        joints_mass = float(sum(inertia.mass for inertia in model.inertias.tolist()[1:]))
        # pin leaves out what is fixed to the base
        moment, mass = joints_mass * coms + chassis.mass * chassis.lever, joints_mass + chassis.mass
        if payload is not None:
            moment, mass = moment + payload.mass * payload.position, mass + payload.mass
        coms = moment / mass
        return np.einsum("nij,nj->ni", self.Ts_site_base[:, :3, :3], coms) + self.Ts_site_base[:, :3, 3]

    def Ts_site(self, link: str) -> Array:
        """Poses of a link, or of "base", in site, (n, 4, 4)."""
        return self.Ts_site_base if link == "base" else self.Ts_site_base @ self.Ts_base_link[link]

    def _frame(self, leg: int, part: str) -> int:
        return self.robot.link_frames[link_name(leg, part)]


def stretches(robot: Robot, plan: CheckedMotion, every: RecheckSettings) -> Iterator[MotionStretch]:
    """The walk from its first waypoint to its last; foot moves and phases must be in order.

    One that stays where it is has one sample.
    """
    motion, of = plan.motion, len(plan.groups)
    if len(motion.phases) == 1:
        yield _sampled(robot, motion, 0, of, (), range(1), every)
    first = 0
    for last in range(1, len(motion.phases)):
        move, moving = int(plan.moves[last]), motion.lifted(last)
        goes_on = last + 1 < len(motion.phases)
        if goes_on and motion.lifted(last + 1) == moving and plan.moves[last + 1] == move:
            continue
        yield _sampled(robot, motion, move, of, moving, range(first, last + 1), every)
        first = last


def _sampled(
    robot: Robot,
    motion: Motion,
    move: int,
    of: int,
    moving: tuple[int, ...],
    waypoints: Sequence[int],
    every: RecheckSettings,
) -> MotionStretch:
    qs, poses = [motion.waypoints[waypoints[0]][None]], [motion.Ts_site_base[waypoints[0]][None]]
    numbers, fractions = [np.array(waypoints[:2][-1:])], [np.zeros(1)]
    for one, other in pairwise(waypoints):
        q_a, q_b = motion.waypoints[one], motion.waypoints[other]
        T_a, T_b = motion.Ts_site_base[one], motion.Ts_site_base[other]
        turned = Rotation.from_matrix(T_a[:3, :3].T @ T_b[:3, :3]).magnitude()
        turns = max(float(np.abs(q_b - q_a).max()), float(turned)) / every.turn
        count = max(1, int(np.ceil(max(turns, np.linalg.norm(T_b[:3, 3] - T_a[:3, 3]) / every.way))))
        t = np.arange(1, count + 1) / count
        qs.append(q_a + t[:, None] * (q_b - q_a))
        poses.append(between(T_a, T_b, t))
        numbers.append(np.full(count, other))
        fractions.append(t)
    order = np.concatenate(numbers)
    phases = tuple(motion.phases[i] for i in order)
    q, Ts = np.concatenate(qs), np.concatenate(poses)
    return MotionStretch(robot, move, of, moving, q, Ts, order, np.concatenate(fractions), phases)


def between(T_a: Array, T_b: Array, t: Array) -> Array:
    """Poses on the way between two: the origin on a straight line, the turn about one axis.

    Args:
        T_a: where it begins, (4, 4).
        T_b: where it ends, (4, 4).
        t: shares of the way, (n,) 0…1.

    Returns:
        (n, 4, 4).
    """
    Ts = np.tile(np.eye(4), (len(t), 1, 1))
    Ts[:, :3, :3] = Slerp([0.0, 1.0], Rotation.from_matrix([T_a[:3, :3], T_b[:3, :3]]))(t).as_matrix()
    Ts[:, :3, 3] = T_a[:3, 3] + t[:, None] * (T_b[:3, 3] - T_a[:3, 3])
    return Ts
