"""Gaits beside walks, on the same ground from the same stance: ``python -m benchmarks.gaits``."""

import argparse
import time
from collections import defaultdict

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.walks.terrains import REPORTED, start_of, terrain
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.gait.problem import GAITS, GaitResult
from footfall.planning.walk.problem import WalkResult, WalkSettings
from footfall.planning.walk.recheck.walk import recheck_walk

METRES = 2.75
WALK = "walk"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", help="family of ground; default: smooth, steep")
    parser.add_argument("--terrains", type=int, default=5, help="of each family")
    parser.add_argument("--metres", type=float, default=METRES, help="straight ahead")
    parser.add_argument("--limit", type=float, default=60.0, help="of a walk's search [s]; 0: no walks")
    parser.add_argument("--recheck", action="store_true", help="judge what was found by other means, too")
    asked = parser.parse_args()
    for family in asked.only or ("smooth", "steep"):
        rows: dict[str, list[tuple[bool, float, float, int, float]]] = defaultdict(list)
        for number in REPORTED[: asked.terrains]:
            dem, (x, y) = terrain(family, number, asked.metres), start_of(asked.metres)
            try:
                state = footfall.stand(robot(), dem, x, y)
            except InvalidInput as no:
                print(f"{family} {number}: no start: {no}", flush=True)
                continue
            goal = (x + asked.metres, y, 0.0)
            for name in (*GAITS, *([WALK] if asked.limit > 0 else [])):
                begun = time.perf_counter()
                result: GaitResult | WalkResult
                if name == WALK:
                    settings = WalkSettings(time_limit=asked.limit)
                    result = footfall.plan_walk(robot(), dem, state, goal, settings=settings)
                else:
                    result = footfall.plan_gait(robot(), dem, state, goal, name)
                took = time.perf_counter() - begun
                made = result.plan or result.partial
                failed = ""
                if asked.recheck and result.plan is not None:
                    wrong = [one.name for one in recheck_walk(robot(), dem, result.plan, state=state) if not one.holds]
                    failed = f"; recheck fails {', '.join(wrong)}" if wrong else "; recheck holds"
                feet = 0 if made is None else sum(len(group) for group in made.groups)
                torque = float("nan") if made is None else float(made.torques.max())
                way = 0.0 if made is None else made.chassis_way
                rows[name].append((result.status is Status.FOUND, took, way, feet, torque))
                told = f"{took:.2f} s, {feet} feet moved, {way:.2f} m, torque {torque:.2f}{failed}"
                print(f"{family} {number} {name}: {result.status.value}, {told}; {result.reason}", flush=True)
        for name, tries in rows.items():
            solved = [one for one in tries if one[0]]
            seconds = np.median([one[1] for one in tries])
            feet = np.median([one[3] for one in solved]) if solved else float("nan")
            torque = np.median([one[4] for one in solved]) if solved else float("nan")
            print(
                f"{family} {name}: {len(solved)} of {len(tries)} solved, median {seconds:.2f} s; of the solved: "
                f"{feet:g} feet moved, largest torque {torque:.2f}",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
