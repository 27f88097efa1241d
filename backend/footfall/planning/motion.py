"""What every planner yields: how the joints and the chassis move, row by row, without time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array

BODY = "body"
"""Phase in which the joints of all legs move together, and the chassis over the feet that stand. In all others it
stays, but where it sags, and legs move by themselves."""


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Rows of a motion; from one to the next joints go straight, and the chassis as :func:`.base_path` has it.

    waypoints: (n, joints) postures, legs one after the other [rad], of joints that slide [m]. Ts_site_base: (n, 4, 4).
    stays: (n, legs) whether a foot is known to keep its place in site on the way to the row; of a step all do but that
    of its leg, also one that hangs in the air. phases: (n,) what is done on the way to the row. To the first row there
    is no way: it only says where the motion begins.
    """

    waypoints: Array
    Ts_site_base: Array
    stays: NDArray[np.bool_]
    phases: tuple[str, ...]

    @property
    def travel(self) -> Array:
        """How far the joint that goes farthest goes on the way to each row but the first, (n - 1,) [rad]."""
        return np.abs(np.diff(self.waypoints, axis=0)).max(axis=1)

    @property
    def travelled(self) -> Array:
        """What :attr:`travel` comes to until each row, (n,) [rad]."""
        return np.concatenate([[0.0], np.cumsum(self.travel)])

    @property
    def leg(self) -> int | None:
        """The leg that alone moves in it; None where others move too, or the chassis does, or nothing."""
        if BODY in self.phases[1:] or (self.Ts_site_base != self.Ts_site_base[0]).any():
            return None
        moving = {leg for row in range(1, len(self.phases)) for leg in self.lifted(row)}
        return moving.pop() if len(moving) == 1 else None

    def lifted(self, row: int) -> tuple[int, ...]:
        """The legs that move by themselves on the way to a row; none where the chassis moves."""
        return () if self.phases[row] == BODY else tuple(np.flatnonzero(~self.stays[row]).tolist())

    def rows(self, chosen: Sequence[int]) -> "Motion":
        """Some of its rows, by their numbers, as a motion."""
        rows, phases = list(chosen), tuple(self.phases[row] for row in chosen)
        return Motion(self.waypoints[rows], self.Ts_site_base[rows], self.stays[rows], phases)
