"""What is rechecked: a walk, or any motion whose chassis stays while one foot, or a group of them, moves."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from footfall.core.value import Provenance
from footfall.planning.walk.problem import Stance, Tethered, WalkGoal


class Motion(Protocol):
    """As :class:`~footfall.planning.walk.problem.WalkPlan`; groups: (m,) legs that move together."""

    @property
    def goal(self) -> WalkGoal:
        """Where the chassis is to be at the end."""
        ...

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Legs that move together in each foot move, (m,)."""
        ...

    @property
    def stances(self) -> tuple[Stance, ...]:
        """Which feet are where before each foot move, and at the end, (m + 1,)."""
        ...

    @property
    def waypoints(self) -> NDArray[np.float64]:
        """Postures (n, legs × 6) [rad], joints in straight lines between them."""
        ...

    @property
    def Ts_site_base(self) -> NDArray[np.float64]:
        """Poses of the chassis at the waypoints, (n, 4, 4)."""
        ...

    @property
    def moves(self) -> NDArray[np.int64]:
        """Which foot move each waypoint is of, (n,); m after the last."""
        ...

    @property
    def phases(self) -> tuple[str, ...]:
        """What the motion that ends at each waypoint does, (n,)."""
        ...

    @property
    def tethered(self) -> Tethered | None:
        """The tether that it is held by, or None."""
        ...

    @property
    def provenance(self) -> Provenance:
        """Digests of the robot, the terrain and what else it was made of."""
        ...
