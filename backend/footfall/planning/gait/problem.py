"""One gait: what is asked, with which settings, and what comes back.

A *gait* is a periodic order of foot moves that knows nothing of obstacles but the height of the ground: what a walk is
compared with in Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006), fig. 7.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance, Value, value
from footfall.planning.step.problem import Status
from footfall.planning.walk.problem import Stance, WalkGoal

TRIPOD, WAVE = "tripod", "wave"
GAITS = (TRIPOD, WAVE)
"""tripod: three feet move while three stand; wave: one after the other, rear to front."""


@value
class GaitSettings(Value):
    """gait: one of GAITS. stride: how far a foot goes in one cycle, at most [m]; lift: above the higher footfall [m].

    apart: how far a foot goes from one checked sample to the next, at most [m]. height: of the chassis above its feet
    [m]; None: that of the rover at ease. The others: as of WalkSettings.
    """

    gait: str = TRIPOD
    stride: float = 0.4
    lift: float = 0.2
    apart: float = 0.02
    height: float | None = None
    least_margin: float = 0.05
    friction: float = FRICTION
    most_torque: float = 0.9
    clearance: float = 0.01
    raise_terrain: float = 0.05

    def check(self) -> None:
        if self.gait not in GAITS:
            raise InvalidInput(f"gait is one of {', '.join(GAITS)}", gait=self.gait)
        require_above_zero(stride=self.stride, lift=self.lift, apart=self.apart, friction=self.friction)
        require_above_zero(most_torque=self.most_torque)
        require_not_negative(least_margin=self.least_margin, clearance=self.clearance, raise_terrain=self.raise_terrain)


@value
class GaitFailure(Value):
    """A check that a step of a gait fails: its largest lack, and where it began to.

    step: 0…; phase: lift, swing or lower; leg: whose, or None. amount: positive, in ``unit``, inf where nothing would
    do. sample: the first that fails; x, y: of the chassis there [m].
    """

    step: int
    phase: str
    leg: int | None
    check_name: str
    amount: float
    unit: str
    sample: int
    x: float
    y: float

    @property
    def told(self) -> str:
        """For a person."""
        leg = "" if self.leg is None else f" of leg {self.leg}"
        short = f" by {self.amount:.3g} {self.unit}" if np.isfinite(self.amount) else ""
        at = f"chassis at ({self.x:.2f}, {self.y:.2f})"
        return f"step {self.step} ({self.phase}) fails {self.check_name}{leg}{short}, {at}"


@value
class GaitPlan(Value):
    """The motion of a gait, whether it can be made or not: n samples of which ``failing`` says which fail.

    groups: (m,) the legs that each step moves; stances: m + 1. stride: taken [m]; duty: share of a cycle that a foot
    stands. waypoints: (n, legs × 6) [rad], of a leg that doesn't reach its last posture; Ts_site_base: (n, 4, 4);
    steps: (n,); phases: (n,) lift, swing or lower; standing: (n, legs). margins: (n,) of the centre of mass to the
    polygon of the feet that stand [m]; torques: (n,) largest share of a joint's torque limit, inf: not held.
    """

    groups: tuple[tuple[int, ...], ...]
    stances: tuple[Stance, ...]
    stride: float
    duty: float
    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    steps: NDArray[np.int64]
    phases: tuple[str, ...]
    standing: NDArray[np.bool_]
    margins: NDArray[np.float64]
    torques: NDArray[np.float64]
    failing: NDArray[np.bool_]


@value
class GaitResult(Value):
    """The answer to one request for a gait. ``reason`` tells the first failure.

    plan: where all checks hold all the way to the goal, with status FOUND, and only then; failed: otherwise the motion
    as far as it is known, where there is one. walked: how far the chassis goes before the first failure [m].
    """

    status: Status
    plan: GaitPlan | None
    failed: GaitPlan | None
    reason: str
    failures: tuple[GaitFailure, ...]
    walked: float
    goal: WalkGoal
    provenance: Provenance

    def check(self) -> None:
        if (self.status is Status.FOUND) != (self.plan is not None):
            raise InvalidInput("a plan comes with status FOUND, and only then")
