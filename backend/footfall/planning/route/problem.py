"""One route: what is asked, with which settings, and what comes back. A *route* is a path without footfalls."""

from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import LATER, Provenance, Value, value
from footfall.maps.layers import MapSettings
from footfall.planning.answers import Status, require_answer

COARSEST = 5.0
"""Cells of a route are at most so large [m]: larger than the rover they say nothing of the ground under it."""


@value
class NoGo(Value):
    """Ground that the chassis keeps off: a disc around x, y [m] of ``radius`` [m]."""

    x: float
    y: float
    radius: float

    def check(self) -> None:
        """Raises InvalidInput for a place that is not finite, and for a radius that is not above zero."""
        if not np.isfinite([self.x, self.y]).all():
            raise InvalidInput("a no-go area needs finite x and y [m]")
        require_above_zero(radius=self.radius)


@value
class Corridor(Value):
    """Ground that the chassis keeps to: so far to all sides of a straight line from x, y to to_x, to_y, all [m]."""

    x: float
    y: float
    to_x: float
    to_y: float
    beside: float

    def check(self) -> None:
        """Raises InvalidInput for ends that are not finite, and for a width that is not above zero."""
        if not np.isfinite([self.x, self.y, self.to_x, self.to_y]).all():
            raise InvalidInput("a corridor needs finite ends [m]")
        require_above_zero(beside=self.beside)


COSTS = ("goodness", "feasible")
"""What the ground may cost by: Morphin's goodness (cost.py), or the Ambler's feasible traversability (feasible.py)."""
MOST_HEADINGS = 32


@value
class RouteSettings(Value):
    """resolution: of the cells that the way is looked for on [m].

    worst: least mean of goodness × certainty under the rover. highest: ground under it that rises at most so far over
    the mean plane there [m]: more is not stepped over. no_go: what the chassis keeps off. maps: how goodness is judged.
    cost: one of COSTS. "feasible" takes ``worst`` for the trust in the ground, ``maps.slope_limit`` for footfalls, and
    has no use for ``highest``. headings: so many are looked at, 8 or 16 or another multiple of 4. fades: ground seen so
    long before the newest is trusted half [s]. corridors: where there are any, the chassis keeps to them. turning: what
    a radian of turning on the spot costs, in metres of the best ground; only with "feasible", and only then a route has
    headings. together: way and headings are searched together, so that turns decide which way is taken; else the way is
    that of free turns.
    """

    resolution: float = 0.1
    worst: float = 0.2
    highest: float = 0.5
    no_go: tuple[NoGo, ...] = ()
    maps: MapSettings = MapSettings()
    cost: str = field(default="goodness", metadata=LATER)
    headings: int = field(default=8, metadata=LATER)
    fades: float = field(default=86400.0, metadata=LATER)
    corridors: tuple[Corridor, ...] = field(default=(), metadata=LATER)
    turning: float = field(default=0.0, metadata=LATER)
    together: bool = field(default=False, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput for numbers out of range, an unknown cost, and turns that its cost can't count."""
        require_above_zero(resolution=self.resolution, worst=self.worst, highest=self.highest)
        if self.worst > 1:
            raise InvalidInput("the worst ground that is allowed has a goodness of at most 1", worst=self.worst)
        require_above_zero("s", fades=self.fades)
        if self.cost not in COSTS:
            raise InvalidInput(f"routes cost by {' or '.join(COSTS)}", cost=self.cost)
        require_not_negative(turning=self.turning)
        if self.turning and self.cost != "feasible":
            raise InvalidInput(
                'turning has a cost only with cost "feasible": by goodness a metre costs the same at every heading',
                turning=self.turning,
            )
        if self.together and not self.turning:
            raise InvalidInput("way and headings are searched together where turning costs something: give turning")
        if self.headings % 4 or not 4 <= self.headings <= MOST_HEADINGS:
            raise InvalidInput(
                f"headings are counted in a multiple of 4, at most {MOST_HEADINGS}", headings=self.headings
            )
        if self.resolution > COARSEST:
            raise InvalidInput(f"the cells of a route are at most {COARSEST:g} m", resolution=self.resolution)


ATHLETES_LEG = 2.33
"""Length of the leg that settings as delivered are made for [m]."""


def settings_by_leg(longest: float) -> RouteSettings:
    """Settings as delivered for a robot that others described: to its leg what ATHLETE's are to ATHLETE's.

    Args:
        longest: length of its longest leg [m].

    Returns:
        The settings.
    """
    size, own = longest / ATHLETES_LEG, RouteSettings()
    lengths = {name: size * getattr(own.maps, name) for name in ("window", "roughness_limit", "step_limit")}
    return replace(own, resolution=size * own.resolution, highest=size * own.highest, maps=replace(own.maps, **lengths))


@value
class CostGrid(Value):
    """What a metre costs where the chassis is over a cell: 1 on the best ground, infinite where it must not be.

    costs: (rows, cols) float64.
    """

    costs: NDArray[np.float64]
    geometry: GridGeometry
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput unless each cell has a cost of at least 1 a metre."""
        if self.costs.shape != self.geometry.shape or not (self.costs >= 1.0).all():
            raise InvalidInput("a grid of costs has one for each cell, at least 1 a metre")


@value
class Route(Value):
    """A path of the chassis over a grid of costs. points: (n, 2) x, y [m], straight between.

    cost: of all of it, with its turns; on the best ground that is its length [m]. headings: (n − 1,) how the chassis
    faces along each straight part, from east [rad]; it turns on the spot between them; None where turning is free.
    """

    points: NDArray[np.float64]
    cost: float
    provenance: Provenance
    headings: NDArray[np.float64] | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput unless there is one heading for each straight piece, or none at all."""
        if self.headings is not None and len(self.headings) != len(self.points) - 1:
            raise InvalidInput("a route of n points has n − 1 headings, or none")

    @property
    def length(self) -> float:
        """Of the path [m]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


@value
class RouteResult(Value):
    """The answer to one request for a route. ``reason`` says what is in the way, where, and what to try.

    goal: x, y [m]. plan: with status FOUND, and only then. cut_off: where else the way ends, x, y [m], the place
    nearest to the goal that can be reached; empty where that is not known.
    """

    status: Status
    plan: Route | None
    reason: str
    goal: tuple[float, ...]
    provenance: Provenance
    cut_off: tuple[float, ...] = ()

    def check(self) -> None:
        """Raises InvalidInput where a route comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)
