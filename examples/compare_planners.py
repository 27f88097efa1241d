"""Plan the same step with every planner: status, waypoints, and how far the joints travel."""

import numpy as np

import footfall
from footfall.planning.step.problem import PLANNERS
from footfall.terrain.generate import rock_field


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = rock_field(size=8.0, resolution=0.02, abundance=0.03, largest=0.4, seed=4)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    for planner in PLANNERS:
        result = footfall.plan_step(robot, dem, state, leg=2, target=(-1.0, 1.7), planner=planner, seed=1)
        if result.plan is None:
            print(f"{planner}: {result.status.value}, {result.reason}")
            continue
        joints = result.plan.waypoints
        travel = float(np.linalg.norm(np.diff(joints, axis=0), axis=1).sum())
        print(f"{planner}: {len(joints)} waypoints, joints travel {travel:.2f} rad")


if __name__ == "__main__":
    main()
