"""Whether maps of robots that others described say what the planner says: ``python -m benchmarks.legged_maps``.

Each robot of example-robot-data (extra dev) that can be mapped stands on smooth and on rough ground. Of the maps of its
first leg seeded green cells are planned to, and seeded cells that a check refused. A row tells how long the maps took
[s of the processor], how many cells are green, how many of those planned to were refused, and how many of the refused
cells a step leads to. Exit code 1 where a green one was refused.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.io.urdf.read import read_urdf
from footfall.maps import refusals
from footfall.maps.layers import MapStack
from footfall.planning.legged.leg_maps import compute_maps
from footfall.planning.legged.problem import LeggedSettings, LeggedState
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane
from tests.support.robot_data import QUADRUPEDS, described

SEED, LEG = 7, 0
ROUGH = 0.05
"""Standard deviation of the rough ground's heights, as a share of the longest leg."""
SIZE, CELLS = 4.0, 64
"""Side of the ground, in longest legs, and how many cells it has."""
UNHURRIED = LeggedSettings(time_limit=1e5)
NO_GROUND = (refusals.UNKNOWN, refusals.OUT_OF_RANGE, refusals.NOTHING)


def rows(only: list[str], each: int, cells: int) -> Iterator[tuple[str, int]]:
    """A row of the table, and how many green cells of it were refused."""
    for name in only or QUADRUPEDS:
        try:
            model = legged_model(read_urdf(described(name)))
            robot = LeggedRobot(model, always=touching(model.tree, 100).always)
        except InvalidRobot as err:
            yield f"| {name} | – | no: {err.message} |", 0
            continue
        size = SIZE * robot.length
        made = {
            "smooth": plane(size, size / cells),
            "rough": fractal(size, size / cells, roughness=ROUGH * robot.length, seed=1),
        }
        for ground, dem in made.items():
            told, wrong = _mapped(robot, dem, each)
            yield f"| {name} | {ground} | {told} |", wrong


def _mapped(robot: LeggedRobot, dem: Dem, each: int) -> tuple[str, int]:
    try:
        state = stand(robot, dem)
    except (InvalidInput, InvalidRobot) as err:
        return f"no: {err.message}", 0
    began = time.process_time()
    stack = compute_maps(robot, dem, state, LEG, UNHURRIED)
    seconds = time.process_time() - began
    code = stack.layers["refused_by"]
    greens = _planned(robot, dem, state, stack, code == refusals.NOTHING, each)
    others = _planned(robot, dem, state, stack, ~np.isin(code, NO_GROUND), each)
    counts = Counter(code.ravel().tolist())
    why = ", ".join(f"{refusals.REFUSALS[one].name} {counts[one]}" for one in sorted(set(counts) - set(NO_GROUND)))
    wrong = greens.count(False)
    return (
        f"{seconds:.0f} s | {counts[refusals.NOTHING]} | {wrong} of {len(greens)} | "
        f"{others.count(True)} of {len(others)} | {why}"
    ), wrong


def _planned(
    robot: LeggedRobot, dem: Dem, state: LeggedState, stack: MapStack, which: np.ndarray, each: int
) -> list[bool]:
    """Of seeded cells whether a step leads to them."""
    found = np.random.default_rng(SEED).permutation(np.argwhere(which))[:each]
    targets = [(float(stack.geometry.xs[col]), float(stack.geometry.ys[row])) for row, col in found]
    return [plan_step(robot, dem, state, LEG, target, UNHURRIED).plan is not None for target in targets]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--each", type=int, default=5)
    parser.add_argument("--cells", type=int, default=CELLS)
    asked, refused = parser.parse_args(), 0
    for row, wrong in rows(asked.only, asked.each, asked.cells):
        refused += wrong
        sys.stdout.write(row + "\n")
        sys.stdout.flush()
    sys.exit(refused > 0)


if __name__ == "__main__":
    main()
