"""Motions of a walk or a gait joined to one row of waypoints."""

from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.planning.motion import BODY
from footfall.planning.walk.body_way import BodyWay
from footfall.planning.walk.foot_move import Moved
from footfall.planning.walk.problem import LIFT, LOWER, SWING


class Waypoints(TypedDict):
    """The rows as plans have them.

    Postures (n, legs × 6), chassis poses (n, 4, 4), and (n,) which foot move each is of, what the motion that ends
    there does, margin [m] and largest share of a torque limit.
    """

    waypoints: Array
    Ts_site_base: Array
    moves: NDArray[np.int64]
    phases: tuple[str, ...]
    margins: Array
    torques: Array


@dataclass
class JoinedRows:
    """Waypoints as they are joined; only what adds to it changes it."""

    postures: list[Array] = field(default_factory=list)
    poses: list[Array] = field(default_factory=list)
    moves: list[int] = field(default_factory=list)
    phases: list[str] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)
    torques: list[float] = field(default_factory=list)

    def add(self, posture: Array, T_site_base: Array, number: int, phase: str, margin: float, torque: float) -> None:
        """Take one waypoint of foot move ``number``."""
        self.postures.append(posture)
        self.poses.append(T_site_base)
        self.moves.append(number)
        self.phases.append(phase)
        self.margins.append(float(margin))
        self.torques.append(float(torque))

    def body(self, way: BodyWay, number: int) -> None:
        """Take a chassis' way, whose first waypoint is where the rover is already, if it is anywhere."""
        for row in range(1 if self.postures else 0, len(way.postures)):
            self.add(way.postures[row], way.Ts_site_base[row], number, BODY, way.margins[row], way.torques[row])

    @property
    def waypoints(self) -> Waypoints:
        """All rows as the fields of a plan."""
        return {
            "waypoints": np.array(self.postures),
            "Ts_site_base": np.array(self.poses),
            "moves": np.array(self.moves, np.int64),
            "phases": tuple(self.phases),
            "margins": np.array(self.margins),
            "torques": np.array(self.torques),
        }


def swung(moved: Moved) -> tuple[Array, tuple[str, ...]]:
    """The swing of a foot move of a walk, its first row where the chassis' way ends.

    Args:
        moved: the foot move.

    Returns:
        Postures (n, legs × 6) [rad], and the phase that ends at each.
    """
    over, leg = moved.swing, moved.leg
    path = np.tile(moved.body.postures[-1], (len(over.waypoints), 1))
    path[:, 6 * leg : 6 * leg + 6] = over.waypoints
    return path, tuple(LIFT if row <= over.up else SWING if row <= over.down else LOWER for row in range(len(path)))
