"""What is rechecked: a walk, or any motion whose chassis stays while one foot, or a group of them, moves."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from footfall.core.value import Provenance
from footfall.planning.walk.problem import Stance, Tethered, WalkGoal


class Motion(Protocol):
    """As :class:`~footfall.planning.walk.problem.WalkPlan`; groups: (m,) legs that move together."""

    @property
    def goal(self) -> WalkGoal: ...
    @property
    def groups(self) -> tuple[tuple[int, ...], ...]: ...
    @property
    def stances(self) -> tuple[Stance, ...]: ...
    @property
    def waypoints(self) -> NDArray[np.float64]: ...
    @property
    def Ts_site_base(self) -> NDArray[np.float64]: ...
    @property
    def moves(self) -> NDArray[np.int64]: ...
    @property
    def phases(self) -> tuple[str, ...]: ...
    @property
    def tethered(self) -> Tethered | None: ...
    @property
    def provenance(self) -> Provenance: ...
