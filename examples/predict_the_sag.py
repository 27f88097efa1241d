"""Plan a step, then what to command so that a rover whose joints give way makes that step."""

import footfall
from footfall.terrain.generate import plane


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = plane(size=8.0, resolution=0.05)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    step = footfall.plan_step(robot, dem, state, leg=2, target=(-1.0, 1.7), seed=1)
    if step.plan is None:
        raise SystemExit(step.reason)
    result = footfall.plan_execution(robot, dem, state, step.plan)
    print(f"{result.status.value}: {result.reason}")
    if result.execution is not None:
        execution = result.execution
        print(f"mode {execution.mode}, touches down {1000 * execution.touch_down_offset:.1f} mm from the plan")
        print(f"least clearance on the way {1000 * execution.clearance.min():.0f} mm")


if __name__ == "__main__":
    main()
