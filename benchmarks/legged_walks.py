"""Walks of robots that others described, rechecked and judged by physics: the tables of docs/robots.md, row by row.

``python -m benchmarks.legged_walks [--metres 3] [--margin 0.02] [--parts commands physics] [--only A1 …]`` prints a
row as soon as it is known. Robots come from example-robot-data (extra dev) and a made hexapod. A part that was not
asked for is told as "not run".
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import footfall
from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.io.exports import export
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.problem import LeggedPlan, LeggedSettings, LeggedState
from footfall.planning.legged.stand import stand
from footfall.planning.legged.walk import plan_walk
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from footfall.sequence.commands import Sequence
from footfall.sim.physics.legged_referee import legged_referee
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane
from tests.support.legged_recheck import Recheck, said
from tests.support.robot_data import QUADRUPEDS, described
from tests.support.walkers import ring

HEXAPOD = "Hexapod (made)"
PARTS = ("commands", "physics")
ROUGH = 0.05
"""Standard deviation of the rough ground's heights, as a share of the longest leg."""
EVERY = 60
"""Waypoints between two rechecks of forces and distances; the weight is looked at in each."""


@dataclass(frozen=True)
class Asked:
    """metres: of each walk. parts: of PARTS. settings: of all plans; no clock ends them."""

    metres: float
    parts: tuple[str, ...]
    settings: LeggedSettings


def rows(only: list[str], asked: Asked) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "robot.urdf"
        made.write_text(ring(6), encoding="utf-8")
        for name in only or [HEXAPOD, *QUADRUPEDS]:
            urdf = made if name == HEXAPOD else described(name)
            yield from _rows_of(name, urdf, asked)


def _rows_of(name: str, urdf: Path, asked: Asked) -> Iterator[str]:
    try:
        model = legged_model(read_urdf(urdf))
        robot = LeggedRobot(model, always=touching(model.tree, 100).always)
        stroke = 2 * at_ease(robot).stroke
    except InvalidRobot as err:
        yield f"| {name} | – | no: {err.message} |"
        return
    size = asked.metres + 4 * robot.length
    for ground, dem in (
        ("smooth", plane((2 * size, size), 0.05)),
        ("rough", fractal((2 * size, size), 0.05, roughness=ROUGH * robot.length, seed=1)),
    ):
        try:
            state = stand(robot, dem)
        except InvalidInput as err:
            yield f"| {name} | {ground} | no: {err.message} |"
            continue
        walked = " | ".join(_walked(robot, urdf, dem, state, asked))
        yield f"| {name} | {ground} | yes | {walked} | {stroke:.2f} |"


def _walked(robot: LeggedRobot, urdf: Path, dem: Dem, state: LeggedState, asked: Asked) -> Iterator[str]:
    """Four cells: the walk, the recheck, its commands, and physics."""
    began = time.process_time()
    result = plan_walk(robot, dem, state, (asked.metres, 0.0), asked.settings)
    seconds = time.process_time() - began
    plan = result.plan or result.partial
    if plan is None:
        yield from [f"no: {result.reason}", *["–"] * 3]
        return
    yield f"{len(plan.moves)} foot moves, {seconds:.0f} s" if result.plan else f"no: {result.reason}"
    yield said(Recheck(urdf, robot, list(urdf.parents[2:5])).walk(dem, plan, EVERY))
    yield from _commanded(robot, dem, plan, asked)


def _commanded(robot: LeggedRobot, dem: Dem, plan: LeggedPlan, asked: Asked) -> Iterator[str]:
    """Two cells: the commands by their rules and as a table, and what physics says of them."""
    if not asked.parts:
        yield from ["not run"] * 2
        return
    sequence = footfall.make_sequence(plan, robot, dem)
    if sequence.valid:
        lines = len(export(sequence, "csv").splitlines()) - 1
        yield f"{lines} rows"
    else:
        yield f"no: {'; '.join(sorted({one.rule for one in sequence.failures}))}"
    yield _judged(robot, sequence, dem) if "physics" in asked.parts else "not run"


def _judged(robot: LeggedRobot, sequence: Sequence, dem: Dem) -> str:
    found = legged_referee(robot, sequence, dem)
    sizes = (
        f"feet off {found.air.max():.2f} s, slip {1e3 * found.slip.max():.0f} mm, chassis {1e3 * found.drift:.0f} mm "
        f"beside and {1e3 * found.sink:.0f} mm below, effort {found.effort:.0%}"
    )
    if found.passed:
        return f"holds: {sizes}"
    first, more = found.failures[0], len(found.failures) - 1
    return f"no: {first}" + (f" (and {more} more)" if more else "") + f"; {sizes}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--metres", type=float, default=3.0)
    parser.add_argument("--margin", type=float, default=LeggedSettings().least_margin)
    parser.add_argument("--parts", nargs="*", choices=PARTS, default=PARTS)
    given = parser.parse_args()
    np.seterr(all="ignore")
    settings = LeggedSettings(time_limit=1e5, least_margin=given.margin)
    for row in rows(given.only, Asked(given.metres, tuple(given.parts), settings)):
        sys.stdout.write(row + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
