"""How the time of a walk grows: ``python -m benchmarks.walks.growth --out docs/images/walk-growth.svg``.

Left with its length, over smooth ground; right with the number of footfalls that are considered, for 2.75 m. Of each
the median over terrains, in wall clock and in processor time, as others may share the machine. Walks are taken as they
are found: not smoothed.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.timing import machine
from benchmarks.walks.attempts import SMOOTHING
from benchmarks.walks.terrains import REPORTED, SIZES, start_of, terrain
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.plan import BESIDE, plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkSettings

LENGTHS = (2.0, 5.0, 10.0, 20.0, 50.0)
SPACINGS = (0.65, 0.4, 0.2, 0.1, 0.065)
"""Of footfalls [m]: the ground for 2.75 m holds some 200 to 20 000 of them."""

AS_FOUND = replace(SMOOTHING, rounds=0)

Row = tuple[float, int, int, float, float]
"""Length or number of footfalls, walks found, walks asked for, median wall clock and processor time [s]."""


def measured(metres: float, settings: WalkSettings, terrains: int) -> tuple[int, Row]:
    """How many footfalls there are, and the row of walks of so many metres with their length."""
    walls, works, count = [], [], 0
    # the first is not counted: it loads what is compiled
    for number in REPORTED[: terrains + 1]:
        dem, (x, y) = terrain("smooth", number, metres), start_of(metres)
        state, goal = footfall.stand(robot(), dem, x, y), WalkGoal(x + metres, y, 0.0)
        begun, worked = time.perf_counter(), time.process_time()
        result = plan_walk(robot(), dem, state, goal, seed=0, settings=settings)
        took = time.perf_counter() - begun, time.process_time() - worked
        if number != REPORTED[0] and result.plan is not None:
            walls.append(took[0])
            works.append(took[1])
        low, high = np.array([x - BESIDE, y - BESIDE]), np.array([x + metres + BESIDE, y + BESIDE])
        count = len(footfalls(robot(), dem, low, high, settings).contacts)
    wall, work = (float(np.median(times)) if times else float("nan") for times in (walls, works))
    return count, (metres, len(walls), terrains, wall, work)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.walks.growth", description=__doc__)
    parser.add_argument("--out", type=Path, help="picture that is written, .svg or .png")
    parser.add_argument("--terrains", type=int, default=3)
    parser.add_argument("--limit", type=float, default=60.0, help="wall clock of one walk [s]")
    parser.add_argument("--farthest", type=float, choices=tuple(SIZES), default=50.0, help="longest walk [m]")
    asked = parser.parse_args()
    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, Python {about['python']}")
    ways: list[Row] = []
    for metres in LENGTHS:
        if metres <= asked.farthest:
            ways.append(measured(metres, WalkSettings(time_limit=asked.limit, smoothing=AS_FOUND), asked.terrains)[1])
            _tell("m", ways[-1])
    choices: list[Row] = []
    for spacing in SPACINGS:
        count, row = measured(
            2.75, WalkSettings(spacing=spacing, time_limit=asked.limit, smoothing=AS_FOUND), asked.terrains
        )
        choices.append((float(count), *row[1:]))
        _tell("footfalls", choices[-1])
    if asked.out is not None:
        plot(ways, choices, asked.out)
    return 0


def _tell(unit: str, row: Row) -> None:
    print(f"{row[0]:>8g} {unit:<9} {row[1]} of {row[2]}: wall {row[3]:.2f} s, processor {row[4]:.2f} s", flush=True)


def plot(ways: Sequence[Row], choices: Sequence[Row], path: Path) -> None:
    """Time over length, and over the number of footfalls."""
    import matplotlib as mpl
    from matplotlib.figure import Figure as Picture

    mpl.rcParams["svg.hashsalt"] = "footfall"
    picture = Picture(figsize=(9, 3.5), layout="constrained")
    for axes, rows, label in zip(
        picture.subplots(1, 2), (ways, choices), ("length of the walk [m]", "footfalls considered"), strict=True
    ):
        columns = np.array(rows)
        axes.plot(columns[:, 0], columns[:, 3], "o-", label="wall clock")
        axes.plot(columns[:, 0], columns[:, 4], "s--", label="processor")
        axes.set(xscale="log", yscale="log", xlabel=label, ylabel="time to the first walk [s]")
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=8)
    picture.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    raise SystemExit(main())
