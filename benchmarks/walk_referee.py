"""Whole walks planned on random ground, executed with the pose held, and judged by the rover in physics.

A walk is drawn by its number, as the steps of :mod:`benchmarks.referee` are: ground, gravity, payload, and whether
parameters are known or physics differs from the description. With known parameters the walk's executions are all
planned from one telemetry before anything moves; with others each foot move is planned from what telemetry says then,
the walk kept while it fits and planned anew where it does not. What the planner refuses is counted, not judged.
``python -m benchmarks.walk_referee --walks 24 --state FILE`` prints a row for each walk and the worst of each quantity.
"""

import argparse
import multiprocessing
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import footfall
from benchmarks.kept import KeptRun, digest_of
from benchmarks.referee import CALM, JUDGED, Case, at_rest, case_of, physics_of, rover_with, settings_of, spread
from benchmarks.timing import SEED
from footfall.core.errors import InvalidInput
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.walk.problem import WalkPlan
from footfall.planning.walk_execution.onward import onward
from footfall.planning.walk_execution.plan import plan_walk_execution
from footfall.planning.walk_execution.unpressed import unpressed
from footfall.robot.model import Robot
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.walked import FootMoveReport, carry_out, longest_slip
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane, rock_field

WALKS = 24
METRES = 1.5
"""How far each walk goes."""
PLACES = 6
"""Places to stand that are tried for one walk."""
MOST_ANEW = 3
"""Times that a walk may be planned anew."""
MODE = "pose_held"
FLOORS: dict[bool, dict[str, float]] = {
    True: {"slip": 0.02, "touch": 0.005, "rest": 0.005, "chassis": 0.05},
    False: {"slip": 0.02, "touch": 0.03, "rest": 0.02, "chassis": 0.05},
}
"""Largest of each quantity of a walk, by whether the parameters are known; none may tip, touch, or miss a foot."""
COUNTS = ("tips", "contacts", "stayed")
QUANTITIES = ("slip", "touch", "rest", "chassis")


@dataclass(frozen=True)
class Walked:
    """What came of a walk. refused: why it was not, or not all, executed; what was executed is judged.

    moves: foot moves carried out, of ``planned`` in the walk as it was first planned. anew: how often a walk was
    planned again. tips, contacts, stayed: see :class:`footfall.sim.physics.walked.FootMoveReport`. slip: of a wheel
    while it stands, over all foot moves; touch: of the worst touch-down from the planned contact; rest: of the chassis,
    at the end of a foot move, from the prediction; chassis: the same on the way [m]. load: least on a supporting wheel
    [N]. goal: from where the chassis ends to the goal, seen from above [m]; NaN where the walk was not ended.
    """

    case: Case
    refused: str = ""
    planned: int = 0
    moves: int = 0
    anew: int = 0
    tips: int = 0
    contacts: int = 0
    stayed: int = 0
    slip: float = 0.0
    touch: float = 0.0
    rest: float = 0.0
    chassis: float = 0.0
    load: float = np.inf
    goal: float = np.nan
    said: tuple[str, ...] = ()

    def missed(self) -> list[str]:
        """The floors that it does not hold."""
        out = [name for name in COUNTS if getattr(self, name)]
        floors = FLOORS[self.case.known]
        return out + [
            f"{name} {getattr(self, name):.4f}" for name, most in floors.items() if getattr(self, name) > most
        ]


def ground_of(case: Case) -> Dem:
    """As that of a step, large enough for a walk."""
    seed = SEED + case.number
    if case.ground == "flat":
        return plane(size=14.0, resolution=0.05)
    if case.ground == "fractal":
        return fractal(size=14.0, resolution=0.05, roughness=0.03, seed=seed)
    return rock_field(size=14.0, resolution=0.05, abundance=0.03, largest=0.4, seed=seed)


def walked(number: int) -> Walked:
    """One walk from its number."""
    case = case_of(number)
    rng = np.random.default_rng([SEED, 1, number])
    robot, dem, physics = rover_with(case.payload), ground_of(case), physics_of(case, rng)
    reason = ""
    for _ in range(PLACES):
        x, y = rng.uniform(-0.6, 0.6, 2)
        yaw, heading = rng.uniform(-np.pi, np.pi, 2)
        try:
            stood = footfall.stand(robot, dem, float(x), float(y), float(yaw))
            rover = at_rest(robot, dem, stood, physics)
        except InvalidInput as err:
            reason = err.message
            continue
        goal = float(x + METRES * np.cos(heading)), float(y + METRES * np.sin(heading))
        found = footfall.plan_walk(robot, dem, unpressed(robot, rover.state()), goal, seed=number)
        if found.plan is None:
            reason = found.reason
            continue
        settings = settings_of(case, MODE)
        go = _at_once if case.known else _by_telemetry
        return go(case, robot, dem, rover, found.plan, settings)
    return Walked(case, refused=reason)


def _at_once(
    case: Case, robot: Robot, dem: Dem, rover: PhysicalRover, walk: WalkPlan, settings: ExecutionSettings
) -> Walked:
    """All foot moves planned from one telemetry, then carried out."""
    result = plan_walk_execution(robot, dem, rover.state(), walk, settings, np.array(rover.commanded))
    moves = () if result.execution is None else result.execution.moves
    reports: list[FootMoveReport] = []
    for move in moves:
        reports.append(carry_out(rover, move))
        if reports[-1].tipped:
            break
    return _judged(case, walk, rover, reports, result.reason, 0)


def _by_telemetry(
    case: Case, robot: Robot, dem: Dem, rover: PhysicalRover, walk: WalkPlan, settings: ExecutionSettings
) -> Walked:
    """Each foot move planned from what was measured before it."""
    reports: list[FootMoveReport] = []
    first, number, anew = walk, 0, 0
    while True:
        rover.step(CALM)
        now = onward(robot, dem, rover.state(), walk, number, settings, np.array(rover.commanded))
        anew += bool(now.anew)
        if now.move is None or anew > MOST_ANEW:
            reason = now.reason or (f"planned anew {anew} times: {now.anew}" if anew > MOST_ANEW else "")
            return _judged(case, first, rover, reports, reason, anew)
        reports.append(carry_out(rover, now.move))
        walk, number = now.walk, now.number + 1
        if reports[-1].tipped:
            return _judged(case, first, rover, reports, "", anew)


def _judged(
    case: Case, walk: WalkPlan, rover: PhysicalRover, reports: list[FootMoveReport], refused: str, anew: int
) -> Walked:
    if not reports:
        return Walked(case, refused, walk.foot_moves, anew=anew)
    away = rover.T_site_base[:2, 3] - (walk.goal.x, walk.goal.y)
    touches = [one.touch for one in reports if one.leg is not None]
    return Walked(
        case=case,
        refused=refused,
        planned=walk.foot_moves,
        moves=sum(one.leg is not None for one in reports),
        anew=anew,
        tips=sum(one.tipped for one in reports),
        contacts=sum(one.contacts for one in reports),
        stayed=sum(one.stayed for one in reports),
        slip=longest_slip(reports),
        touch=float(np.nanmax(touches)) if np.isfinite(touches).any() else 0.0,
        rest=max(one.rest for one in reports),
        chassis=max(float(one.report.chassis.max()) for one in reports),
        load=min(one.load for one in reports),
        goal=np.nan if refused else float(np.linalg.norm(away)),
        said=tuple(f"foot move {one.number}: {text}" for one in reports for text in one.report.failures),
    )


def run(numbers: Sequence[int], workers: int, state: Path | None = None) -> Iterator[Walked]:
    """All walks; those that ``state`` keeps are not run again.

    Raises InvalidInput where the state is of another seed or of other code than this.
    """
    if state is None:
        yield from _each(numbers, workers)
        return
    kept = KeptRun(state, {"seed": SEED, "code": digest_of(JUDGED, ("referee.py", "walk_referee.py"))})
    done = {part["case"]["number"]: _walked(part) for part in kept.parts}
    yield from (done[number] for number in numbers if number in done)
    todo = [number for number in numbers if number not in done]
    for found in _each(todo, workers):
        kept.add(asdict(found))
        yield found


def _each(numbers: Sequence[int], workers: int) -> Iterator[Walked]:
    if workers == 1:
        yield from map(walked, numbers)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap(walked, numbers)


def _walked(row: dict[str, Any]) -> Walked:
    return Walked(**(row | {"case": Case(**row["case"]), "said": tuple(row["said"])}))


def table(found: Sequence[Walked]) -> Iterator[str]:
    """By parameters: how many walks were executed to their end, and the worst of each quantity."""
    yield f"{'parameters':<12}{'walks':>6}{'to end':>8}{'moves':>7}{'anew':>6}" + "".join(
        f"{name:>10}" for name in (*COUNTS, *QUANTITIES, "least load")
    )
    for known in (True, False):
        asked = [one for one in found if one.case.known == known]
        ran = [one for one in asked if one.moves]
        if not ran:
            continue
        ended, moves, anew = (
            sum(not one.refused for one in asked),
            sum(one.moves for one in ran),
            sum(one.anew for one in ran),
        )
        yield (
            f"{'known' if known else 'others':<12}{len(asked):>6}{ended:>8}{moves:>7}{anew:>6}"
            + "".join(f"{sum(getattr(one, name) for one in ran):>10}" for name in COUNTS)
            + "".join(f"{1000 * max(getattr(one, name) for one in ran):>7.1f} mm" for name in QUANTITIES)
            + f"{min(one.load for one in ran):>8.0f} N"
        )


def main() -> None:
    """Execute walks, a row each as they come, then print the worst of each quantity."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--walks", type=int, default=WALKS)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of walks")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--state", type=Path, help="file that a run is kept in, and gone on with")
    asked = parser.parse_args()
    found = []
    for one in run(asked.only or spread(asked.walks), asked.workers, asked.state):
        found.append(one)
        told = "; ".join(one.missed()) or "holds"
        numbers = " ".join(f"{name} {1000 * getattr(one, name):.1f}" for name in QUANTITIES)
        print(
            f"{one.case!s:<44}{one.moves}/{one.planned} anew {one.anew}  {numbers} mm, load {one.load:.0f} N, "
            f"goal {one.goal:.3f} m: {told}",
            *([f"refused: {one.refused}"] if one.refused else []),
            *one.said,
            sep="\n    ",
            flush=True,
        )
    print(*table(found), sep="\n")


if __name__ == "__main__":
    sys.exit(main())
