"""What came of attempted walks: of each, and of those of one family beside what is wanted of it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.walks.terrains import Slopes
from footfall.planning.walk.smoothing import WalkFigures


@dataclass(frozen=True)
class Attempt:
    """family, terrain: its seed; seed: of the planner. status: of the result, or ``no start`` where the rover can't
    stand. wall, processor: of the planner [s]. Of the walk, or of the one that comes nearest: foot_moves, way of the
    chassis [m], least margin [m] and largest torque, as it tells them; failed: checks that the recheck refused, None:
    it was not asked. rechecked: how long that took [s]. slope: of the ground. before, after: what smoothing came to.
    """

    family: str
    terrain: int
    seed: int
    status: str
    reason: str = ""
    wall: float = float("nan")
    processor: float = float("nan")
    foot_moves: int = 0
    way: float = 0.0
    margin: float = float("nan")
    torque: float = float("nan")
    slope: Slopes | None = None
    failed: tuple[str, ...] | None = None
    rechecked: float = float("nan")
    before: WalkFigures | None = None
    after: WalkFigures | None = None

    @property
    def found(self) -> bool:
        return self.status == "found"


@dataclass(frozen=True)
class Floor:
    """Wanted of walks of 2.75 m: median and p95 of the wall clock [s] at most, share that is solved at least."""

    median: float
    p95: float
    solved: float


FLOORS: Mapping[str, Floor] = {
    "smooth": Floor(2.0, 6.0, 0.98),
    "steep": Floor(5.0, 15.0, 0.90),
    "rappel": Floor(10.0, 60.0, 0.90),
}


def summary(attempts: Sequence[Attempt], metres: float) -> dict[str, Any]:
    """Figures by name; times are those of the walks that were found. Refused starts count as not solved."""
    found = [one for one in attempts if one.found]
    rechecked = [one for one in attempts if one.failed is not None]
    figures: dict[str, Any] = {
        "attempts": len(attempts),
        "terrains": sorted({one.terrain for one in attempts}),
        "seeds": sorted({one.seed for one in attempts}),
        "slope_median": _median([one.slope.median for one in attempts if one.slope is not None]),
        "slope_p95": _median([one.slope.p95 for one in attempts if one.slope is not None]),
        "solved": len(found) / len(attempts),
        "unsolved": dict(Counter(one.status for one in attempts if not one.found)),
        "unsolved_wall": _median([one.wall for one in attempts if not one.found and np.isfinite(one.wall)]),
        "rechecked": len(rechecked),
        "recheck_failed": sum(bool(one.failed) for one in rechecked),
        "recheck_wall": _median([one.rechecked for one in rechecked]),
    }
    for name in ("wall", "processor", "foot_moves", "way", "margin", "torque"):
        numbers = [float(getattr(one, name)) for one in found]
        figures[name] = {
            "median": _median(numbers),
            "p95": float(np.percentile(numbers, 95)) if numbers else None,
            "least": min(numbers, default=None),
            "most": max(numbers, default=None),
        }
    smoothed = [one for one in found if one.before is not None]
    figures["smoothing"] = {
        name: [float(np.mean([getattr(getattr(one, side), name) for one in smoothed])) for side in ("before", "after")]
        for name in (WalkFigures.__dataclass_fields__ if smoothed else ())
    }
    floor = FLOORS.get(attempts[0].family) if metres == 2.75 else None
    if floor is not None:
        times = [one.wall for one in found]
        figures["wanted"] = {
            f"median {floor.median:g} s": bool(times and np.median(times) <= floor.median),
            f"p95 {floor.p95:g} s": bool(times and np.percentile(times, 95) <= floor.p95),
            f"solved {floor.solved:.0%}": len(found) / len(attempts) >= floor.solved,
        }
    return figures


def _median(numbers: Sequence[float]) -> float | None:
    return float(np.median(numbers)) if numbers else None
