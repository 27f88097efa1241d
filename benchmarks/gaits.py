"""How far gaits come before a check fails, beside walks: ``python -m benchmarks.gaits``."""

import argparse

import footfall
from benchmarks.scenes import robot
from benchmarks.walks.terrains import REPORTED, start_of, terrain
from footfall.core.errors import InvalidInput
from footfall.planning.gait.problem import GAITS
from footfall.planning.walk.problem import WalkSettings

METRES = 2.75


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--terrains", type=int, default=5, help="of each family")
    parser.add_argument("--limit", type=float, default=60.0, help="of a walk's search [s]; 0: no walks")
    asked = parser.parse_args()
    for family in ("smooth", "steep"):
        for number in REPORTED[: asked.terrains]:
            dem, (x, y) = terrain(family, number), start_of(METRES)
            try:
                state = footfall.stand(robot(), dem, x, y)
            except InvalidInput as no:
                print(f"{family} {number}: no start: {no}")
                continue
            goal = (x + METRES, y, 0.0)
            for gait in GAITS:
                found = footfall.plan_gait(robot(), dem, state, goal, gait)
                print(f"{family} {number} {gait}: {found.status.value}, {found.walked:.2f} m; {found.reason}")
            if asked.limit > 0:
                walk = footfall.plan_walk(robot(), dem, state, goal, settings=WalkSettings(time_limit=asked.limit))
                print(f"{family} {number} walk: {walk.status.value}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
