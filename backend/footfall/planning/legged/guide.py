"""The chassis' way from a state to a goal, straight or along a route, and in which order the feet follow it."""

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


class GuideLine(NamedTuple):
    """parts: one after the other, at least one."""

    parts: tuple[Guide, ...]

    @property
    def length(self) -> float:
        """Of all parts [m]."""
        return sum(part.length for part in self.parts)

    def part_at(self, s: float) -> tuple[Guide, float]:
        """The part that is gone along after that much of the way, and how much of it then is behind [m]."""
        for part in self.parts[:-1]:
            if s < part.length:
                return part, s
            s -= part.length
        return self.parts[-1], s

    def at(self, s: float) -> tuple[float, float, float]:
        """x, y [m] and yaw [rad] after that much of the way."""
        part, behind = self.part_at(s)
        return part.at(behind)


def guide_to(ground: Ground, T_site_base: Array, goal: WalkGoal, route: Array | None = None) -> GuideLine:
    """The way of the chassis to a goal; a goal without a heading keeps the heading, else it turns evenly on the way.

    Args:
        ground: robot, terrain and settings.
        T_site_base: pose of the chassis now, (4, 4).
        goal: where it is to be.
        route: points that it passes between, (n, 2) in site [m]; None: it goes straight.

    Returns:
        The way.
    """
    yaw, here = heading(T_site_base), T_site_base[:2, 3]
    turn = 0.0 if goal.yaw is None else float((goal.yaw - yaw + np.pi) % (2 * np.pi) - np.pi)
    around = float(np.linalg.norm(ground.ease.soles[:, :2], axis=1).max())
    corners = np.array([here, *(np.zeros((0, 2)) if route is None else route), (goal.x, goal.y)])
    far = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    shares = far / far.sum() if far.any() else np.full(len(far), 1 / len(far))
    parts, start = [], np.array([*here, yaw])
    for after, share in zip(corners[1:], shares, strict=True):
        change = np.array([*(after - start[:2]), turn * share])
        parts.append(Guide(start, change, float(np.hypot(*change[:2])) + abs(float(change[2])) * around))
        start = start + change
    return GuideLine(tuple(parts))


def wave(ground: Ground, guide: Guide) -> list[int]:
    """Legs in the order of a wave: on each side from the rear to the front as a part goes, the right side first.

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
