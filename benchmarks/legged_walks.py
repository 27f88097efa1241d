"""What robots that others described can do, from standing to physics: the tables of docs/robots.md, row by row.

``python -m benchmarks.legged_walks [--metres 3] [--margin 0.05] [--ground smooth …] [--parts maps …] [--only A1 …]``
``[--rigid]`` prints a row as soon as it is known: robot, ground, whether it stands; green cells of each leg's map, and
how much of it is judged; of 30 steps, each from where the one before ended, how many are found and hold in the recheck;
the walk, its recheck, its commands and the files that they were read back from, physics; whether another process plans
the recorded walk again to the same digest; the stride [m]; how long the walk takes to plan [s of the processor]. Robots
come from example-robot-data (extra dev) and a made hexapod. A part that was not asked for is told as "not run".

Their URDFs do not say how stiff joints are. They walk as if a robot.toml said what physics assumes, so that commands
hold the pose; with ``--rigid`` nobody knows it, and they are commanded as planned.
"""

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import footfall
from footfall.core.errors import InvalidInput, InvalidRobot, InvalidSequence
from footfall.io.artifacts import decode, encode
from footfall.io.exports import SUFFIXES, TITLES, export, formats_for
from footfall.io.imports import sequence_of
from footfall.io.urdf.read import read_urdf
from footfall.maps.refusals import NOTHING, UNKNOWN
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.leg_maps import compute_maps
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings, LeggedState
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.walk import plan_walk
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from footfall.sequence.commands import Sequence
from footfall.sim.physics.legged_model import assumed_stiffness
from footfall.sim.physics.legged_referee import legged_referee
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane
from tests.support.described import sprung
from tests.support.legged_recheck import Recheck, faults, said
from tests.support.robot_data import QUADRUPEDS, described
from tests.support.sequences import require_same_commands
from tests.support.walkers import ring

HEXAPOD = "Hexapod (made)"
GROUNDS = ("smooth", "rough")
PARTS = ("maps", "steps", "walk", "commands", "physics", "replay")
ROUGH = 0.05
"""Standard deviation of the rough ground's heights, as a share of the longest leg."""
EVERY = 60
"""Waypoints between two rechecks of forces and distances; the weight is looked at in each."""


WRITTEN_ONLY = ("fprime-dictionary",)
"""Formats that nothing is read from: what the F Prime dictionary names stands in the F Prime sequence."""
STEPS, SEED = 30, 5
NEAR, CELLS = 4.0, 32
"""Side of the ground of maps and steps, in longest legs, and how many cells it has."""


@dataclass(frozen=True)
class Asked:
    """metres: of each walk. grounds: of GROUNDS. parts: of PARTS. settings: of all plans; no clock ends them.

    rigid: whether nobody knows how stiff the joints are.
    """

    metres: float
    grounds: tuple[str, ...]
    parts: tuple[str, ...]
    settings: LeggedSettings
    rigid: bool = False


def rows(only: list[str], asked: Asked) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "robot.urdf"
        made.write_text(ring(6), encoding="utf-8")
        for name in only or [HEXAPOD, *QUADRUPEDS]:
            urdf = made if name == HEXAPOD else described(name)
            yield from _rows_of(name, urdf, asked)


def read(urdf: Path, rigid: bool = False) -> LeggedRobot:
    model = legged_model(read_urdf(urdf))
    robot = LeggedRobot(model, always=touching(model.tree, 100).always)
    return robot if rigid else sprung(robot, assumed_stiffness(robot))


def made_ground(kind: str, robot: LeggedRobot, size: float | tuple[float, float], resolution: float) -> Dem:
    if kind == "smooth":
        return plane(size, resolution)
    return fractal(size, resolution, roughness=ROUGH * robot.length, seed=1)


def _rows_of(name: str, urdf: Path, asked: Asked) -> Iterator[str]:
    try:
        robot = read(urdf, asked.rigid)
        stroke = 2 * at_ease(robot).stroke
    except InvalidRobot as err:
        yield f"| {name} | – | no: {err.message} |"
        return
    size, near = asked.metres + 4 * robot.length, NEAR * robot.length
    for kind in asked.grounds:
        dem = made_ground(kind, robot, (2 * size, size), 0.05)
        small = made_ground(kind, robot, near, near / CELLS)
        try:
            state, there = stand(robot, dem), stand(robot, small)
        except InvalidInput as err:
            yield f"| {name} | {kind} | no: {err.message} |"
            continue
        maps = _mapped(robot, small, there, asked) if "maps" in asked.parts else "not run"
        steps = _stepped(robot, urdf, small, there, asked) if "steps" in asked.parts else "not run"
        began = time.process_time()
        result = plan_walk(robot, dem, state, (asked.metres, 0.0), asked.settings) if "walk" in asked.parts else None
        seconds = "–" if result is None else f"{time.process_time() - began:.0f}"
        walked = " | ".join(_walked(robot, urdf, dem, state, result, asked))
        yield f"| {name} | {kind} | yes | {maps} | {steps} | {walked} | {stroke:.2f} | {seconds} |"


def _mapped(robot: LeggedRobot, dem: Dem, state: LeggedState, asked: Asked) -> str:
    """Green cells of each leg's map, of how many cells, and which share of these is judged."""
    codes = np.array([compute_maps(robot, dem, state, leg, asked.settings).layers["refused_by"] for leg in robot.legs])
    greens = ", ".join(str(int((code == NOTHING).sum())) for code in codes)
    return f"{greens} of {codes[0].size} cells, {(codes != UNKNOWN).mean():.0%} judged"


def _stepped(robot: LeggedRobot, urdf: Path, dem: Dem, state: LeggedState, asked: Asked) -> str:
    """Steps to seeded places within a stroke of where each foot stood first, one after the other.

    Told is how many were found and hold in the recheck; after one that is not found the next begins where it did.
    """
    first = state
    rng, stroke = np.random.default_rng(SEED), at_ease(robot).stroke
    recheck, held, wrong = _recheck(robot, urdf), 0, Counter[str]()
    for number in range(STEPS):
        leg, angle = number % len(robot.legs), rng.uniform(-np.pi, np.pi)
        away = stroke * np.sqrt(rng.uniform()) * np.array([np.cos(angle), np.sin(angle)])
        x, y = (float(part) for part in first.soles[leg, :2] + away)
        result = plan_step(robot, dem, state, leg, (x, y), asked.settings)
        if result.plan is None:
            wrong[result.status.value] += 1
            continue
        found = faults(recheck.walk(dem, result.plan, EVERY))
        held += not found
        wrong.update(found)
        state = result.plan.end
    return ", ".join([f"{held} of {STEPS}", *(f"{count} {reason}" for reason, count in wrong.items())])


def _walked(
    robot: LeggedRobot, urdf: Path, dem: Dem, state: LeggedState, result: LeggedResult | None, asked: Asked
) -> Iterator[str]:
    """Five cells: the walk, the recheck, its commands, physics, and whether it is planned again to the same bits."""
    if result is None:
        yield from ["not run"] * 5
        return
    plan = result.plan or result.partial
    if plan is None:
        yield from [f"no: {result.reason}", *["–"] * 4]
        return
    yield f"{len(plan.moves)} foot moves" if result.plan else f"no: {result.reason}"
    yield said(_recheck(robot, urdf).walk(dem, plan, EVERY))
    yield from _commanded(robot, dem, plan, asked)
    yield _replayed(urdf, dem, state, result, asked) if "replay" in asked.parts else "not run"


def _recheck(robot: LeggedRobot, urdf: Path) -> Recheck:
    return Recheck(urdf, robot, list(urdf.parents[2:5]))


def _replayed(urdf: Path, dem: Dem, state: LeggedState, result: LeggedResult, asked: Asked) -> str:
    """Whether another process, that has the URDF and what was recorded, comes to the same digest."""
    recorded = [encode(one) for one in (dem, state, result)]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        again = pool.apply(_planned_again, (urdf, recorded, asked))
    return "same digest" if again == result.digest else f"no: {again[:12]} for {result.digest[:12]}"


def _planned_again(urdf: Path, recorded: list[bytes], asked: Asked) -> str:
    dem, state, result = (decode(one) for one in recorded)
    if not isinstance(result, LeggedResult) or not isinstance(state, LeggedState) or not isinstance(dem, Dem):
        raise TypeError("a walk is recorded as its ground, its start and its answer")
    settings = result.provenance.settings
    if not isinstance(settings, LeggedSettings):
        raise TypeError("a walk is planned again with its own settings")
    np.seterr(all="ignore")
    return plan_walk(read(urdf, asked.rigid), dem, state, (asked.metres, 0.0), settings).digest


def _commanded(robot: LeggedRobot, dem: Dem, plan: LeggedPlan, asked: Asked) -> Iterator[str]:
    """Two cells: the commands by their rules and as a table, and what physics says of them."""
    if not {"commands", "physics"} & set(asked.parts):
        yield from ["not run"] * 2
        return
    sequence = footfall.make_sequence(plan, robot, dem)
    if sequence.valid:
        yield f"{len(sequence.commands)} rows; {_read_back(robot, sequence, dem, plan.start)}"
    else:
        yield f"no: {'; '.join(sorted({one.rule for one in sequence.failures}))}"
    yield _judged(robot, sequence, dem) if "physics" in asked.parts else "not run"


def _read_back(robot: LeggedRobot, sequence: Sequence, dem: Dem, state: LeggedState) -> str:
    """Which files of the commands say the same when they are read, which do not, and which nobody reads."""
    told: dict[str, list[str]] = {"read back alike": [], "written": [], "NOT ALIKE": []}
    for format, lack in formats_for(sequence).items():
        if lack:
            continue
        data = export(sequence, format)
        if format in WRITTEN_ONLY:
            told["written"].append(TITLES[format])
            continue
        told["read back alike" if _is_alike(format, data, robot, sequence, dem, state) else "NOT ALIKE"].append(
            TITLES[format]
        )
    return "; ".join(f"{', '.join(titles)} {what}" for what, titles in told.items() if titles)


def _is_alike(format: str, data: bytes, robot: LeggedRobot, sequence: Sequence, dem: Dem, state: LeggedState) -> bool:
    try:
        # a table alone does not say from where its commands start
        found = sequence_of(f"walk{SUFFIXES[format]}", data, robot, dem, state if format == "csv" else None)
        require_same_commands(found.commands, sequence.commands)
    except (InvalidSequence, AssertionError) as error:
        sys.stderr.write(f"{robot.name}, {format}: {error}\n")
        return False
    return found.valid


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
    parser.add_argument("--ground", nargs="*", choices=GROUNDS, default=GROUNDS)
    parser.add_argument("--parts", nargs="*", choices=PARTS, default=PARTS)
    parser.add_argument("--rigid", action="store_true")
    given = parser.parse_args()
    np.seterr(all="ignore")
    settings = LeggedSettings(time_limit=1e5, least_margin=given.margin)
    for row in rows(given.only, Asked(given.metres, tuple(given.ground), tuple(given.parts), settings, given.rigid)):
        sys.stdout.write(row + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
