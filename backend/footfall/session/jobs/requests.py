"""What was asked of a job, as values: stored beside the products, so that a replay asks the same."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.tether import Tether
from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Value, before, value
from footfall.maps.layers import MapSettings
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.gait.problem import WAVE, GaitSettings
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.route.problem import RouteSettings
from footfall.planning.step.problem import Footfall, Point, StepSettings
from footfall.planning.walk.problem import WalkGoal, WalkSettings


@value
class MapRequest(Value):
    """Maps for one leg."""

    leg: int
    settings: MapSettings

    def check(self) -> None:
        if type(self.leg) is not int or self.leg < 0:
            raise InvalidInput("leg is a whole number, 0…", leg=repr(self.leg))


@value
class StepRequest(Value):
    """A step of one leg to a chosen footfall.

    through: points, site [m], that the wheel's centre passes. explain: the result says what was tried and taken.
    instead: None: not asked; else places (x, y) that maps call good, nearest first, for a refusal to name.
    """

    footfall: Footfall
    settings: StepSettings
    through: tuple[Point, ...] = field(default=(), metadata=LATER)
    explain: bool = field(default=False, metadata=LATER)
    instead: tuple[tuple[float, float], ...] | None = field(default=None, metadata=LATER)


@value
class ExecutionRequest(Value):
    """What to command for a planned step.

    set_points: (legs × 6,) of the rover at rest [rad]; None: as its measured torques tell.
    """

    settings: ExecutionSettings
    set_points: NDArray[np.float64] | None


@value
class OutcomeRequest(Value):
    """What came of a run, after so many of its rows.

    set_points: (joints,) of the rover at rest then [rad or m].
    """

    run: int
    rows: int
    set_points: NDArray[np.float64]


@value
class ShiftRequest(Value):
    """The shift of the chassis that makes a footfall possible."""

    footfall: Footfall
    settings: FindShiftSettings


@value
class BodyMoveRequest(Value):
    """A move of the chassis over its standing feet."""

    shift: BodyShift
    settings: BodyMoveSettings


@value
class WalkRequest(Value):
    """A walk to a goal. unpressed: its wheels are first taken out of their springs' strain, as rigid plans want it.

    tether: that the rover hangs on. gait: it goes in this one, a wave, which keeps to the settings of the walk; None:
    its footfalls are searched.
    """

    goal: WalkGoal
    settings: WalkSettings
    unpressed: bool = field(default=False, metadata=LATER)
    tether: Tether | None = field(default=None, metadata=LATER)
    gait: GaitSettings | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        if self.gait is not None and self.tether is not None:
            raise InvalidInput("no gait hangs on a tether: leave out one of them")
        if self.gait is not None and self.gait.gait != WAVE:
            raise InvalidInput(f"a walk moves one foot at a time: its gait is a {WAVE}", gait=self.gait.gait)


@value
class GaitRequest(Value):
    """A gait to a goal. unpressed: as of a :class:`WalkRequest`."""

    goal: WalkGoal
    settings: GaitSettings = GaitSettings()
    unpressed: bool = False


@value
class RouteRequest(Value):
    """A route to a goal, x and y [m] in site."""

    goal: tuple[float, float]
    settings: RouteSettings = RouteSettings()

    def check(self) -> None:
        if len(self.goal) != 2 or not np.isfinite(self.goal).all():
            raise InvalidInput("the goal of a route needs finite x and y [m]", goal=list(self.goal))


@value
class DescribedMapRequest(Value):
    """Maps for one leg of a robot that others described."""

    leg: int
    settings: LeggedSettings = LeggedSettings()

    def check(self) -> None:
        if type(self.leg) is not int or self.leg < 0:
            raise InvalidInput("leg is a whole number, 0…", leg=repr(self.leg))


@value
class DescribedStepRequest(Value):
    """A step of a robot that others described, to a chosen footfall."""

    footfall: Footfall
    settings: LeggedSettings = LeggedSettings()


@value
class DescribedWalkRequest(Value):
    """A walk of a robot that others described, to a goal."""

    goal: WalkGoal
    settings: LeggedSettings = LeggedSettings()


@value
class FootMovesRequest(Value):
    """Commands of foot moves ``first`` … ``first + count - 1`` of a walk, counted from 0.

    settings: of their execution; None: as if the rover were rigid. set_points: as in :class:`ExecutionRequest`.
    """

    first: int
    count: int = 1
    settings: ExecutionSettings | None = field(default=None, metadata=LATER)
    set_points: NDArray[np.float64] | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        if self.first < 0 or self.count < 1:
            raise InvalidInput("foot moves count from 0, and at least one is commanded", first=self.first)


@value
class ExportRequest(Value):
    """A sequence in one of the export formats. first_row: number of the first row in the file."""

    format: str
    first_row: int = field(default=1, metadata=before(0))


@value
class ImportRequest(Value):
    """Commands from a file. name: its name, whose ending says the format; content: its bytes.

    set_points: (legs × 6,) of an ATHLETE that sags, for files that don't say from where they start [rad]; None: rigid.
    """

    name: str
    content: NDArray[np.uint8]
    set_points: NDArray[np.float64] | None = field(default=None, metadata=LATER)


@value
class CheckRequest(Value):
    """A session to recompute. bundle: the bytes of its zip."""

    bundle: NDArray[np.uint8]
