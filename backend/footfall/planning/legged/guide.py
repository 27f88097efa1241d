"""The chassis' straight way from a state to a goal, and in which order the feet follow it."""

from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import heading
from footfall.planning.legged.stance import Ground
from footfall.planning.walk.problem import WalkGoal


class Guide(NamedTuple):
    """start, change: (x, y, yaw) and what is added to it over ``length`` [m], a turn as the feet's way."""

    start: Array
    change: Array
    length: float

    def at(self, s: float) -> tuple[float, float, float]:
        """x, y [m] and yaw [rad] after that much of the way."""
        x, y, yaw = self.start + (s / self.length if self.length else 0.0) * self.change
        return float(x), float(y), float(yaw)


def guide_to(ground: Ground, T_site_base: Array, goal: WalkGoal) -> Guide:
    """The way of the chassis to a goal; a goal without a heading keeps the heading.

    Args:
        ground: robot, terrain and settings.
        T_site_base: pose of the chassis now, (4, 4).
        goal: where it is to be.

    Returns:
        The way.
    """
    yaw = heading(T_site_base)
    turn = 0.0 if goal.yaw is None else float((goal.yaw - yaw + np.pi) % (2 * np.pi) - np.pi)
    change = np.array([goal.x - T_site_base[0, 3], goal.y - T_site_base[1, 3], turn])
    around = float(np.linalg.norm(ground.ease.soles[:, :2], axis=1).max())
    return Guide(np.array([*T_site_base[:2, 3], yaw]), change, float(np.hypot(*change[:2])) + abs(turn) * around)


def wave(ground: Ground, guide: Guide) -> list[int]:
    """Legs in the order of a wave: on each side from the rear to the front as it goes, the right side first.

    R. B. McGhee, A. A. Frank, "On the stability properties of quadruped creeping gaits", Math. Biosciences 3, 1968.
    """
    x, y = guide.change[:2]
    heading = guide.start[2]
    along = np.array([np.cos(heading) * x + np.sin(heading) * y, -np.sin(heading) * x + np.cos(heading) * y])
    length = float(np.linalg.norm(along))
    ahead = along / length if length > 1e-9 else np.array([1.0, 0.0])
    feet = ground.ease.soles[:, :2]
    left = feet @ np.array([-ahead[1], ahead[0]]) > 0
    return sorted(ground.robot.legs, key=lambda leg: (bool(left[leg]), round(float(feet[leg] @ ahead), 6)))
