"""What walks and gaits have in common: checked waypoints of a rover that goes from stance to stance."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.product import Product


class CheckedMotion(Product):
    """Base of a walk and of a gait, whose own fields these are, as in :mod:`footfall.planning.walk.problem`."""

    __slots__ = ()

    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    moves: NDArray[np.int64]
    phases: tuple[str, ...]
    margins: NDArray[np.float64]
    torques: NDArray[np.float64]

    @property
    def chassis_way(self) -> float:
        """How far the chassis' origin goes [m]."""
        return float(sum(np.linalg.norm(b - a) for a, b in pairwise(self.Ts_site_base[:, :3, 3])))

    def require_complete(self, called: str) -> None:
        """Raises InvalidInput unless all is told of each waypoint; called: what this is, for a person."""
        told = (self.Ts_site_base, self.moves, self.phases, self.margins, self.torques)
        if {len(each) for each in told} != {len(self.waypoints)}:
            raise InvalidInput(f"every waypoint of {called} needs a pose, a foot move, a phase, a margin and a torque")
