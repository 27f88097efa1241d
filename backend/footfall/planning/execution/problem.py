"""What is sent to the rover for one step, or one move of the chassis, and what is expected of it."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.product import Product
from footfall.core.value import Provenance, Value, value
from footfall.planning.answers import Check, Status
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.motion import BODY, Motion
from footfall.planning.step.problem import StepPlan

PHASES = ("unload", "lift", "swing", "lower", "load")


def ends_of(phases: tuple[str, ...]) -> list[int]:
    """The waypoints at which phases end."""
    return [i for i, phase in enumerate(phases) if i == len(phases) - 1 or phases[i + 1] != phase]


class Paced(Product):
    """Base of the executions, whose own fields these are: how long each motion takes, and the pause after it [s]."""

    __slots__ = ()

    durations: NDArray[np.float64]
    pauses: NDArray[np.float64]

    @property
    def seconds(self) -> float:
        """How long it takes [s]."""
        return float(self.durations.sum() + self.pauses.sum())


def require_execution(status: Status, execution: object) -> None:
    """Raises InvalidInput where a status FOUND comes without an execution."""
    if status is Status.FOUND and execution is None:
        raise InvalidInput("an execution comes with status FOUND")


@value
class Execution(Paced):
    """A checked motion: set points, waypoint by waypoint, and where the rover is predicted to be at each.

    plan: the step as it is executed; in the mode as_commanded it may be lifted higher than the one asked for.
    commanded: (n, legs × 6) set points [rad]; the first is what is commanded before. predicted: (n, legs × 6) postures;
    Ts_site_base: (n, 4, 4) chassis poses. phases: (n,), of PHASES, the one whose motion ends at the waypoint.
    durations: (n,) of the motion that ends there [s]; pauses: (n,) after it [s].
    forces: of the ground on the wheels, site, (n, legs, 3) [N]; loads: along the ground's normals, (n, legs) [N].
    friction_use: (n, legs), tangential force over what friction can hold, 0 for wheels that carry nothing.
    clearance: (n,) of the swing leg's wheel over the ground, vertically [m], negative where it is pressed in;
    clearance_uncertainty: (n,) [m], how much less it is with all springs softer by the tolerance; NaN where the softer
    rover is not in balance.

    Lowering is guarded: from the waypoint ``guarded_from`` the leg goes on a straight joint-space line towards
    ``lowest`` (6,), below the ground, and stops where the wheel's force has risen by ``stop_force`` [N] above a moving
    baseline. The waypoints of phase "lower" after ``guarded_from`` lie on that line, about 2 mm apart, up to the first
    that is predicted to stop it, ``stopped_at`` (−1: none would). touch_down: (3,) where the wheel first touches, site;
    touch_down_offset: how far from the planned contact that is, seen from above [m]; both NaN where it never does.
    """

    leg: int
    mode: str
    plan: StepPlan
    commanded: NDArray[np.float64]
    predicted: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    phases: tuple[str, ...]
    durations: NDArray[np.float64]
    pauses: NDArray[np.float64]
    forces: NDArray[np.float64]
    loads: NDArray[np.float64]
    friction_use: NDArray[np.float64]
    clearance: NDArray[np.float64]
    clearance_uncertainty: NDArray[np.float64]
    guarded_from: int
    stopped_at: int
    lowest: NDArray[np.float64]
    stop_force: float
    touch_down: NDArray[np.float64]
    touch_down_offset: float
    provenance: Provenance

    @property
    def aloft(self) -> NDArray[np.int64]:
        """The waypoints of the swing (k,); where nothing swings, as in a step up and back, the one with the leg up."""
        swings = np.flatnonzero([phase == "swing" for phase in self.phases])
        return swings if len(swings) else np.flatnonzero([phase == "lift" for phase in self.phases])[-1:]

    @property
    def motion(self) -> Motion:
        """What is predicted to move, row by row; feet stay but for what wheels give way."""
        stays = np.ones(self.loads.shape, bool)
        stays[[phase in ("lift", "swing", "lower") for phase in self.phases], self.leg] = False
        return Motion(self.predicted, self.Ts_site_base, stays, self.phases)


@value
class ExecutionResult(Value):
    """The answer to one request. ``reason`` says which check failed, by how much, where and what to try.

    execution: comes with status FOUND; also with NO_PATH where a whole motion was predicted that fails a check, to be
    looked at and not to be sent.
    """

    status: Status
    execution: Execution | None
    reason: str
    checks: tuple[Check, ...]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where status FOUND comes without an execution."""
        require_execution(self.status, self.execution)


@value
class BodyExecution(Paced):
    """A checked move of the chassis over its standing wheels: set points, and where the rover is predicted to be.

    plan: the move as it was planned for a rigid rover. wanted: (n, 4, 4) T_site_base that the set points are made for:
    the plan's, with what the chassis is off it at first fading on the way. commanded, predicted, Ts_site_base,
    durations, pauses, forces, loads, friction_use: as in :class:`Execution`.
    """

    plan: BodyMovePlan
    wanted: NDArray[np.float64]
    commanded: NDArray[np.float64]
    predicted: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    durations: NDArray[np.float64]
    pauses: NDArray[np.float64]
    forces: NDArray[np.float64]
    loads: NDArray[np.float64]
    friction_use: NDArray[np.float64]
    provenance: Provenance

    @property
    def phases(self) -> tuple[str, ...]:
        """(n,), the same all the way."""
        return (BODY,) * len(self.commanded)


@value
class BodyExecutionResult(Value):
    """The answer to one request to execute a move of the chassis; as :class:`ExecutionResult`."""

    status: Status
    execution: BodyExecution | None
    reason: str
    checks: tuple[Check, ...]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where status FOUND comes without an execution."""
        require_execution(self.status, self.execution)


Predicted = Execution | BodyExecution
