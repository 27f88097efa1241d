"""How far forward the chassis may go, a little lower, while all six wheels stand where they are."""

import footfall
from footfall.terrain.generate import plane

LOWER = 0.3
"""Legs bend more and reach farther [m]."""


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = plane(size=10.0, resolution=0.05)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    for forward in (0.05, 0.1, 0.2, 0.4):
        result = footfall.plan_body_move(robot, dem, state, footfall.BodyShift(dx=forward, dz=-LOWER))
        least = min((check.margin for check in result.checks), default=float("nan"))
        print(f"{forward:.2f} m forward: {result.status.value}, least margin {least:.3f} {result.reason}")


if __name__ == "__main__":
    main()
