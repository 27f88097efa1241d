"""Raw searches with the wheel looked at as a drum where an end is unsure (the default), never, and always, in turn.

``python -m benchmarks.steps.drum --per-family 8``: of problems without a free straight swing, in processor time; of
each problem five seeds, the quickest of five searches each.
"""

import argparse
from collections import defaultdict

import numba
import numpy as np

from benchmarks.steps.families import MAKERS
from benchmarks.steps.figures import SOLVED_IN, chosen
from benchmarks.steps.problem import StepProblem, build
from benchmarks.steps.quality import planned, swing
from benchmarks.steps.search import raw_search
from footfall.planning.scene.ground import Nearby
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.situation import Situation

ASKED = {"never": False, "by default": None, "always": True}
SEEDS = range(1, 6)
REPEATS = 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("families", nargs="*", metavar="FAMILY", help=f"of {', '.join(MAKERS)}; none: all")
    parser.add_argument("--per-family", type=int, default=8)
    asked = parser.parse_args()
    numba.set_num_threads(1)
    found: dict[str, list[list[float]]] = defaultdict(list)
    for row in chosen(None):
        family = row.problem.family
        own = found[family]
        if row.straight or not row.solvable or family not in (asked.families or MAKERS):
            continue
        if len(own) < asked.per_family and (times := in_turn(row.problem)):
            own.append(times)
    for family, rows in found.items():
        if rows:
            times = np.array(rows)
            medians = "/".join(f"{1e3 * one:.2f}" for one in np.median(times, axis=0))
            default, always = times[:, 1:].sum(axis=0) / times[:, 0].sum()
            print(
                f"{family}, {len(rows)} problems: {'/'.join(ASKED)} {medians} ms; all together {default:.3f} and "
                f"{always:.3f} of never; at the median {np.median(times[:, 1] / times[:, 0]):.3f}"
            )


def in_turn(problem: StepProblem) -> list[float]:
    """Mean seconds of each of ASKED; empty where no step was planned or a search found nothing."""
    scene = build(problem)
    plan = planned(problem, scene, "auto", 10 * SOLVED_IN).result.plan
    near = ground_near(LegStance(scene.robot, scene.dem, scene.state, problem.leg))
    if plan is None or not isinstance(near, Nearby):
        return []
    path = swing(plan)
    start, goal = path[0], path[-1]
    ways = [
        Situation(scene.robot, scene.dem, scene.state, problem.leg, near, StepSettings(steep_ground=steep)).for_swing(
            start, goal
        )
        for steep in ASKED.values()
    ]
    times = []
    for seed in SEEDS:
        turns = [[raw_search(way, start, goal, seed) for way in ways] for _ in range(REPEATS)]
        if any(one is None for turn in turns for one in turn):
            return []
        times.append(np.array(turns, float).min(axis=0))
    return [float(one) for one in np.mean(times, axis=0)]


if __name__ == "__main__":
    main()
