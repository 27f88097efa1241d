"""The chassis moves over wheels that stay where they are: the joints that follow, continuously.

A standing wheel is locked and neither rolls, turns nor slips: its pose in site is fixed, so each chassis pose gives
its leg by closed-form inverse kinematics. Of the solutions the one nearest to the last is taken. So shoulder and
elbow stay, and the wrist changes only where it passes its straight position (see robot/ik.py).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.planning.between_rows import base_path
from footfall.planning.scene.lift import LARGEST_STEP
from footfall.planning.scene.unreached import ankle_distances, shortfalls
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import wheel_pose
from footfall.robot.limits import farthest_past, room_to_limits
from footfall.robot.model import Robot
from footfall.robot.tolerance import digits_apart

DRIFT = 0.002
"""How far a standing wheel may drift while the joints move in straight lines between waypoints [m]."""
_AIM = 0.5 * DRIFT  # asked of the middles; what lies between is then well inside DRIFT
LONGEST, SHORTEST = 1 / 8, 1 / 1024
"""Steps between two waypoints, as a share of the way."""
_SHARES = (1.0, 1.4)


@dataclass(frozen=True)
class Obstacle:
    """What keeps a leg from following.

    leg; joint: its name, or empty where the leg is too short or too long or would have to jump. excess: how far the
    joint would be outside its limits [rad], or the hip too far from or too near to the wheel [m]; NaN for a jump.
    fraction: of the way. at_goal: whether the goal itself is out of reach.
    """

    leg: int
    joint: str
    excess: float
    fraction: float
    at_goal: bool
    text: str


@dataclass(frozen=True)
class Followed:
    """postures: (n, legs × 6) [rad], the first bit for bit the present one; Ts_site_base: (n, 4, 4)."""

    postures: Array
    Ts_site_base: Array


def follow(robot: Robot, posture: Array, T_from: Array, T_to: Array, standing: Sequence[int]) -> Followed | Obstacle:
    """Postures along :func:`.base_path` with standing wheels fixed; the other legs keep theirs.

    Steps are as long as the standing wheels drift by no more than ``_AIM`` half way and no joint moves by more than
    ``LARGEST_STEP``. A step may reach over a singular posture of a wrist where that is so.

    Args:
        robot: the rover.
        posture: where it begins, (legs × 6,) [rad].
        T_from: pose of the chassis there, (4, 4).
        T_to: pose of the chassis where it ends, (4, 4).
        standing: numbers of the legs whose wheels are fixed.

    Returns:
        The postures, or what is in the way.
    """
    if np.array_equal(T_from, T_to):
        return Followed(np.tile(posture, (2, 1)), np.stack([T_from, T_to]))
    walk = _Walk(robot, posture, T_from, T_to, standing)
    obstacle = walk.unreachable(1.0)
    if obstacle is not None:
        return obstacle
    postures, fractions, step = [posture], [0.0], LONGEST
    while fractions[-1] < 1.0:
        for share in _SHARES:
            fraction = fractions[-1] + share * step
            fraction = 1.0 if fraction > 1.0 - 0.5 * SHORTEST else fraction
            q = walk.near(fraction, postures[-1])
            if q is not None and walk.drift(fractions[-1], postures[-1], fraction, q) <= _AIM:
                postures.append(q)
                fractions.append(fraction)
                break
        else:
            step *= 0.5
            if step < SHORTEST:
                return walk.stopped(fractions[-1], postures[-1])
            continue
        step = min(2.0 * step, LONGEST)
    found = np.array(postures)
    return _outside_limits(robot, found, fractions) or Followed(found, base_path(T_from, T_to, np.array(fractions)))


def shortfall(robot: Robot, leg: int, T_base_wheel: Array, back: bool) -> float:
    """How much too far (or too near) the ankle is for thigh and shank.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        T_base_wheel: pose of the wheel, (4, 4).
        back: whether the leg reaches back over its hip (shoulder 1).

    Returns:
        [m]; at most 0 where the leg reaches.
    """
    return float(shortfalls(robot, leg, T_base_wheel[None], back)[0])


def unwrapped(q: Array, near: Array) -> Array:
    """Angles (…) turned by whole turns to within π of ``near`` (…) [rad]."""
    return q - 2 * math.pi * np.round((q - near) / (2 * math.pi))


def reaches_back(robot: Robot, leg: int, q_leg: Array) -> bool:
    """Whether a leg's ankle is on the far side of its hip-yaw axis (shoulder 1).

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        q_leg: posture of the leg, (6,) [rad].

    Returns:
        True where it is.
    """
    spec = robot.description.legs[leg]
    return bool(spec.hip_offset[0] + spec.thigh * math.cos(q_leg[1]) + spec.shank * math.cos(q_leg[1] + q_leg[2]) < 0)


class _Walk:
    """One way of the chassis over standing wheels."""

    def __init__(self, robot: Robot, posture: Array, T_from: Array, T_to: Array, standing: Sequence[int]) -> None:
        self.robot, self.posture, self.standing = robot, posture, list(standing)
        self.ends = T_from, T_to
        self.Ts_site_wheel = [T_from @ wheel_pose(robot, posture, leg) for leg in standing]
        # centre, two places of the rim and the axle's end: they move if the wheel rolls, turns or leans
        size = np.array([0.0, robot.wheel_radius, robot.wheel_radius, 0.5 * robot.description.wheel_width])
        self._places = size[:, None] * np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0)], float)

    def _T_site_base(self, fraction: float) -> Array:
        return base_path(*self.ends, np.array([fraction]))[0]

    def near(self, fraction: float, last: Array) -> Array | None:
        """The posture at a fraction of the way in which no joint is farther than LARGEST_STEP from the last one."""
        T_base_site = inverse(self._T_site_base(fraction))
        posture = last.copy()
        for leg, T_site_wheel in zip(self.standing, self.Ts_site_wheel, strict=True):
            own = slice(6 * leg, 6 * leg + 6)
            q = unwrapped(solve_leg(self.robot, leg, (T_base_site @ T_site_wheel)[None]).q[0], last[own])
            away = np.abs(q - last[own]).max(axis=1)
            away[np.isnan(away)] = np.inf
            if not away.min() <= LARGEST_STEP:
                return None
            posture[own] = q[np.argmin(away)]
        return posture

    def drift(self, fraction: float, posture: Array, next_fraction: float, following: Array) -> float:
        """Largest drift of a standing wheel half way between two postures [m]."""
        T_site_base = self._T_site_base(0.5 * (fraction + next_fraction))
        middle, worst = 0.5 * (posture + following), 0.0
        for leg, T_site_wheel in zip(self.standing, self.Ts_site_wheel, strict=True):
            T_moved = T_site_base @ wheel_pose(self.robot, middle, leg)
            moved = apply(T_moved, self._places) - apply(T_site_wheel, self._places)
            worst = max(worst, float(np.linalg.norm(moved, axis=1).max()))
        return worst

    def unreachable(self, fraction: float) -> Obstacle | None:
        """The leg that is farthest from reaching its wheel at a fraction of the way; None where all reach."""
        worst, found = -np.inf, None
        T_base_site = inverse(self._T_site_base(fraction))
        for leg, T_site_wheel in zip(self.standing, self.Ts_site_wheel, strict=True):
            T_base_wheel = T_base_site @ T_site_wheel
            back = reaches_back(self.robot, leg, self.posture[6 * leg : 6 * leg + 6])
            short = shortfall(self.robot, leg, T_base_wheel, back)
            if short > worst and not np.isfinite(solve_leg(self.robot, leg, T_base_wheel[None]).q).any():
                what = _which(self.robot, leg, T_base_wheel, back)
                text = f"leg {leg} is {abs(short):z.3f} m too {what}"
                worst, found = short, Obstacle(leg, "", abs(short), fraction, fraction == 1.0, text)
        return found

    def stopped(self, fraction: float, posture: Array) -> Obstacle:
        """Why there is no next posture, however near."""
        obstacle = self.unreachable(min(1.0, fraction + 2 * SHORTEST))
        if obstacle is not None:
            return obstacle
        T_base_site = inverse(self._T_site_base(min(1.0, fraction + SHORTEST)))
        jumps = []
        for leg, T_site_wheel in zip(self.standing, self.Ts_site_wheel, strict=True):
            last = posture[6 * leg : 6 * leg + 6]
            q = unwrapped(solve_leg(self.robot, leg, (T_base_site @ T_site_wheel)[None]).q[0], last)
            jumps.append(float(np.nanmin(np.abs(q - last).max(axis=1))))
        leg = self.standing[int(np.argmax(jumps))]
        text = f"leg {leg} meets a singular posture, where its joints would have to jump"
        return Obstacle(leg, "", float("nan"), fraction, False, text)


def _which(robot: Robot, leg: int, T_base_wheel: Array, back: bool) -> str:
    """Whether a leg that can't reach is too short for it or too long, for a sentence."""
    away, spec = ankle_distances(robot, leg, T_base_wheel[None], back)[0], robot.description.legs[leg]
    return "short to keep its wheel where it stands" if away > spec.thigh else "long to fold that far"


def _outside_limits(robot: Robot, postures: Array, fractions: Sequence[float]) -> Obstacle | None:
    """The joint that is farthest outside its limits: at the goal, or where none is there, on the way."""
    spare = room_to_limits(robot, postures)
    if not (spare[1:] < 0).any():
        return None
    at_goal = bool((spare[-1] < 0).any())
    step = len(postures) - 1 if at_goal else int(np.argmin(spare.min(axis=1)))
    worst = farthest_past(robot, postures[step])
    digits, turn = digits_apart(worst.excess, 0.0), math.degrees(worst.excess)
    text = f"{worst.name} would be {worst.excess:z.{digits}f} rad ({turn:z.{digits - 2}f}°) outside its limits"
    return Obstacle(worst.joint // 6, worst.name, worst.excess, fractions[step], at_goal, text)
