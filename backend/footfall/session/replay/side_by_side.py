"""Two sessions side by side: what they were about, what was planned, made into commands and sent, and what differs."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from footfall.planning.step.problem import PlanResult
from footfall.sequence.commands import Sequence
from footfall.session.core import SessionCore
from footfall.session.log.fold import SessionState
from footfall.session.replay.compare import FieldDifference, differences
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

FIRST = 3
"""So many differences of two values are told, the first in field order."""


@dataclass(frozen=True)
class Compared:
    """One thing of both sessions. told: what each has, in words; same: that nothing differs; text: what does."""

    what: str
    told: tuple[str, str]
    same: bool
    text: str


@dataclass(frozen=True)
class SideBySide:
    """names: of the two sessions; rows: what was compared, in the order of the work."""

    names: tuple[str, str]
    rows: tuple[Compared, ...]

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return all(row.same for row in self.rows)


def side_by_side(one: SessionCore, other: SessionCore) -> SideBySide:
    """Compare two sessions; values by content, so that the same work done twice is the same."""
    both = (one, other)
    products: dict[str, tuple[Callable[[SessionState], str | None], Callable[[Any], str]]] = {
        "robot": (lambda state: state.robot, lambda robot: robot.name),
        "state planned from": (lambda state: state.state, _state),
        "terrain": (lambda state: state.dem, _terrain),
        "plan": (lambda state: state.plan, _plan),
        "sequence": (lambda state: state.sequence, _sequence),
    }
    rows = [_values(what, both, *how) for what, how in products.items()]
    facts: dict[str, Callable[[SessionState], str]] = {
        "footfall": _footfall,
        "maps": lambda state: ", ".join(f"leg {leg}" for leg in sorted(state.maps)) or "none",
        "commands": _commands,
        "exports": lambda state: ", ".join(sorted({export.format for export in state.exports})) or "none",
        "notes": lambda state: str(len(state.notes)),
    }
    rows += [_fact(what, (tell(one.state), tell(other.state))) for what, tell in facts.items()]
    return SideBySide((one.name, other.name), tuple(rows))


def _values(
    what: str,
    both: tuple[SessionCore, SessionCore],
    digest_of: Callable[[SessionState], str | None],
    tell: Callable[[Any], str],
) -> Compared:
    digests = [digest_of(session.state) for session in both]
    one, other = (
        None if digest is None else session.get(digest) for session, digest in zip(both, digests, strict=True)
    )
    values = ("none" if one is None else tell(one), "none" if other is None else tell(other))
    if digests[0] == digests[1]:
        return Compared(what, values, True, "")
    if one is None or other is None:
        return Compared(what, values, False, "only one of the two has it")
    found = list(islice(differences(one, other), FIRST + 1))
    text = ", ".join(_in_words(difference) for difference in found[:FIRST])
    return Compared(what, values, False, text + (" and more" if len(found) > FIRST else ""))


def _in_words(difference: FieldDifference) -> str:
    name = difference.path.split("[")[0]
    return f"{name} differs" + ("" if difference.magnitude is None else f" by up to {difference.magnitude:.3g}")


def _fact(what: str, values: tuple[str, str]) -> Compared:
    return Compared(what, values, values[0] == values[1], "")


def _state(state: RobotState) -> str:
    x, y, z = state.T_site_base[:3, 3]
    return f"chassis at ({x:z.3f}, {y:z.3f}, {z:z.3f}) m, {state.mode}"


def _terrain(dem: Dem) -> str:
    known = float(np.isfinite(dem.heights).mean())
    rows, cols = dem.geometry.shape
    return f"{dem.name}: {cols} × {rows} cells of {dem.geometry.resolution:g} m, {known:.0%} known"


def _plan(result: PlanResult) -> str:
    where = f"leg {result.footfall.leg} to ({result.footfall.x:z.3f}, {result.footfall.y:z.3f}) m"
    if result.plan is None:
        return f"{where}: {result.status.value.replace('_', ' ')}, {result.reason}"
    return f"{where}: found by {result.plan.planner}, {len(result.plan.waypoints)} waypoints"


def _sequence(sequence: Sequence) -> str:
    rules = "every rule holds" if sequence.valid else "a rule is broken"
    return f"{len(sequence.commands)} commands, {sequence.duration:z.1f} s, {rules}"


def _footfall(state: SessionState) -> str:
    chosen = state.footfall
    return "none" if chosen is None else f"leg {chosen.leg} at ({chosen.x:z.3f}, {chosen.y:z.3f}) m"


def _commands(state: SessionState) -> str:
    ends = [command.state for command in state.commands]
    return ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends)) or "none sent"
