"""Ask for a step out of reach: read why it is refused, and find the smallest shift that makes it possible."""

import footfall
from footfall.terrain.generate import plane

FAR = (-1.25, 2.65)


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = plane(size=10.0, resolution=0.05)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    result = footfall.plan_step(robot, dem, state, leg=2, target=FAR, seed=1)
    print(f"{result.status.value}: {result.reason}")
    found = footfall.find_shift(robot, dem, state, 2, FAR)
    print(f"a shift of the chassis: {found.status.value}, {found.reason}")
    if found.shift is not None:
        shift = found.shift
        print(f"  {shift.dx:+.3f} m forward, {shift.dy:+.3f} m left, {shift.dz:+.3f} m up; costs {found.cost:.3f} m")


if __name__ == "__main__":
    main()
