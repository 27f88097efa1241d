"""A walk as a value: what a search found, joined to one row of waypoints."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.value import Provenance
from footfall.planning.answers import Check
from footfall.planning.walk.body_way import At, BodyWay
from footfall.planning.walk.foot_move import Moved
from footfall.planning.walk.joined_rows import JoinedRows, swung
from footfall.planning.walk.problem import WalkGoal, WalkPlan, WalkSettings, part_name


class Measured(Protocol):
    """Waypoints (n,) of a walk or a gait, with what was measured there."""

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Legs that move together in each foot move, (m,)."""
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
    def margins(self) -> Array:
        """Margin of the centre of mass to the support polygon, (n,) [m]."""
        ...

    @property
    def torques(self) -> Array:
        """Largest share of a joint's torque limit, (n,)."""
        ...


def walk_of(goal: WalkGoal, start: At, way: list[Moved], closing: BodyWay | None, provenance: Provenance) -> WalkPlan:
    """The walk of some foot moves; closing: the chassis' way after the last, None for a walk that ends there."""
    rows = JoinedRows()
    for number, moved in enumerate(way):
        rows.body(moved.body, number)
        path, phases = swung(moved)
        for row in range(1, len(path)):
            rows.add(path[row], moved.to.T_site_base, number, phases[row], moved.margins[row], moved.torques[row])
    if closing is not None:
        rows.body(closing, len(way))
    return WalkPlan(
        goal=goal,
        legs=tuple(moved.leg for moved in way),
        stances=(start.stance, *(moved.to.stance for moved in way)),
        **rows.waypoints,
        provenance=provenance,
    )


def checks_of(plan: Measured, settings: WalkSettings) -> tuple[Check, ...]:
    """What a plan was checked for, each where it has least to spare; what it fails is never planned."""
    margin, torque = int(np.argmin(plan.margins)), int(np.argmax(plan.torques))
    kind = "conservative polygon" if settings.support == "required" else "support polygon"
    inside = float(plan.margins[margin]) - settings.least_margin
    left = settings.most_torque - float(plan.torques[torque])
    found = [
        Check(f"balance ({kind})", True, inside, "m", _where(plan, margin) + _less(inside)),
        Check("torque", True, left, "of the limit", _where(plan, torque) + _less(left)),
    ]
    for name in ("joint limits", "self collision", "terrain collision"):
        found.append(Check(name, True, float("nan"), "", "sure all the way, sizes are not told"))
    return tuple(found)


def _where(plan: Measured, at: int) -> str:
    return f"{part_name(int(plan.moves[at]), len(plan.groups))}, {plan.phases[at]}, waypoint {at}"


def _less(spare: float) -> str:
    """What is to be said where there is less than asked for: a walk keeps what it begins with then."""
    return "" if spare >= 0.0 else "; the rover stands with less than is asked for, which gets no less on the way"
