"""Plan one step and print what was checked, and by how much it holds."""

import footfall
from footfall.terrain.generate import rock_field


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = rock_field(size=8.0, resolution=0.02, abundance=0.03, largest=0.4, seed=4)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    result = footfall.plan_step(robot, dem, state, leg=2, target=(-1.0, 1.7), seed=1)
    print(f"{result.status.value}: {result.reason}")
    for check in result.checks:
        print(f"  {check.name}: {check.margin:.3f} {check.unit}, least at {check.where}")
    if result.plan is not None:
        print(f"{len(result.plan.waypoints)} waypoints, digest {result.plan.digest}")


if __name__ == "__main__":
    main()
