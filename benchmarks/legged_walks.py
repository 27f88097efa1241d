"""Walks of robots that others described, each rechecked: the table of docs/robots.md, row by row.

``python -m benchmarks.legged_walks [--metres 3] [--only A1 …]`` prints a row as soon as it is known. Robots come from
example-robot-data (extra dev) and a made hexapod.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.io.urdf.read import read_urdf
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.walk import plan_walk
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane
from tests.support.legged_recheck import Recheck, said
from tests.support.robot_data import QUADRUPEDS, described
from tests.support.walkers import ring

HEXAPOD = "Hexapod (made)"
ROUGH = 0.05
"""Standard deviation of the rough ground's heights, as a share of the longest leg."""
UNHURRIED = LeggedSettings(time_limit=1e5)
"""The processor's time is told; what else the machine does may not end a walk."""
EVERY = 60
"""Waypoints between two rechecks of forces and distances."""


def rows(only: list[str], metres: float) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "robot.urdf"
        made.write_text(ring(6), encoding="utf-8")
        for name in only or [HEXAPOD, *QUADRUPEDS]:
            urdf = made if name == HEXAPOD else described(name)
            yield from _rows_of(name, urdf, metres)


def _rows_of(name: str, urdf: Path, metres: float) -> Iterator[str]:
    try:
        model = legged_model(read_urdf(urdf))
        robot = LeggedRobot(model, always=touching(model.tree, 100).always)
        ease = at_ease(robot)
    except InvalidRobot as err:
        yield f"| {name} | – | no: {err.message} | – | – | – |"
        return
    size, stroke = metres + 4 * robot.length, 2 * ease.stroke
    for ground, dem in (
        ("smooth", plane((2 * size, size), 0.05)),
        ("rough", fractal((2 * size, size), 0.05, roughness=ROUGH * robot.length, seed=1)),
    ):
        yield f"| {name} | {ground} | {_walked(robot, urdf, dem, metres)} | {stroke:.2f} |"


def _walked(robot: LeggedRobot, urdf: Path, dem: Dem, metres: float) -> str:
    """Stand, walk, and what the recheck says, as three cells."""
    try:
        state = stand(robot, dem)
    except InvalidInput as err:
        return f"no: {err.message} | – | –"
    began = time.process_time()
    result = plan_walk(robot, dem, state, (metres, 0.0), UNHURRIED)
    seconds = time.process_time() - began
    plan = result.plan or result.partial
    if plan is None:
        return f"yes | no: {result.reason} | –"
    found = Recheck(urdf, robot, list(urdf.parents[2:5])).walk(dem, plan, EVERY)
    walked = f"{len(plan.moves)} foot moves, {seconds:.0f} s" if result.plan else f"no: {result.reason}"
    return f"yes | {walked} | {said(found)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--metres", type=float, default=3.0)
    asked = parser.parse_args()
    np.seterr(all="ignore")
    for row in rows(asked.only, asked.metres):
        sys.stdout.write(row + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
