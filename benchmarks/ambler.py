"""Walks of the Ambler: how long 20 m over gentle ground take to plan, and what the walk comes to.

``python -m benchmarks.ambler [--metres 20] [--ground 0.15] [--each 1] [--recheck]`` prints a row for its circulating
walk and one for a wave of foot moves; ``--only circulating`` leaves the wave out. ``--ground`` is the standard
deviation of the heights [m], ``--recheck`` judges each walk by other means (slow). Seconds are of the processor.
"""

import argparse
import sys
import time

from footfall.io.any_robot import load_legged
from footfall.io.robot_files import robot_toml
from footfall.planning.legged.circulate import MARGIN, plan_circulating
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.walk import plan_walk
from footfall.terrain.generate import fractal
from tests.support.legged_recheck import Recheck, said

PLANNERS = {"circulating": plan_circulating, "wave": plan_walk}
EVERY = 60
"""Waypoints between two rechecks of forces and distances."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--metres", type=float, default=20.0)
    parser.add_argument("--ground", type=float, default=0.15)
    parser.add_argument("--each", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=PLANNERS, default=list(PLANNERS))
    parser.add_argument("--recheck", action="store_true")
    given = parser.parse_args()
    robot = load_legged("ambler")
    settings = LeggedSettings(least_margin=MARGIN, time_limit=1e5)
    for seed in range(1, 1 + given.each):
        dem = fractal((2 * given.metres + 20, 16.0), 0.1, roughness=given.ground, seed=seed)
        state = stand(robot, dem)
        for name in given.only:
            # compiles, and loads what a first plan loads
            PLANNERS[name](robot, dem, state, (0.2, 0.0), settings)
            began = time.process_time()
            result = PLANNERS[name](robot, dem, state, (given.metres, 0.0), settings)
            seconds = time.process_time() - began
            plan = result.plan or result.partial
            told = f"| {name} | {given.ground:g} m, seed {seed} | {result.status.value} {result.reason} |"
            told += f" {seconds:.1f} s |"
            if plan is not None:
                told += f" {len(plan.moves)} foot moves, {len(plan.waypoints)} waypoints |"
                if given.recheck:
                    urdf = robot_toml("ambler").with_name("ambler.urdf")
                    told += f" {said(Recheck(urdf, robot, []).walk(dem, plan, EVERY))} |"
            sys.stdout.write(told + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
