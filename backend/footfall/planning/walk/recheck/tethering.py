"""The tether of a walk: its length, its pull, and its way past the ground, the legs and the chassis, by coal."""

from collections.abc import Callable

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.planning.answers import Check
from footfall.planning.walk.problem import CheckedMotion, Tethered
from footfall.planning.walk.recheck.apart import MovingBody
from footfall.planning.walk.recheck.feet import Worst
from footfall.planning.walk.recheck.stretches import MotionStretch
from footfall.robot.description import PARTS, link_name
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.ground.unseen import without_holes_between

SLACK = 0.01
"""What is paid out may differ from the way to the anchor by so much [m]."""
NEWTON = 1.0
"""By how much a pull may be past its limits [N]."""
OFF_DECK = 0.1
"""So far from its attachment the tether is clear of the chassis [m]."""
_THIN = 1e-4
"""Radius of the line that stands for the tether [m]."""


class Tethering:
    """Gathers over all stretches what a tether has to spare."""

    def __init__(self, robot: Robot, dem: Dem, plan: CheckedMotion, tethered: Tethered) -> None:
        self.robot, self.plan, self.tethered = robot, plan, tethered
        self.way, self.length, self.pull = Worst(), Worst(), Worst()
        self._bodies = {part: MovingBody(mesh) for part, mesh in robot_meshes(robot.description).items()}
        self._ground = self._ground_of(dem)
        tether, count = tethered.tether, len(plan.waypoints)
        for at in range(count):
            where = f"waypoint {at}"
            self.pull.take(
                min(float(tethered.pulls[at]), tether.most_force - float(tethered.pulls[at])) + NEWTON, where
            )
            self.length.take(tether.free_length - float(tethered.lengths[at]), where)

    def look(self, stretch: MotionStretch, chosen: list[int], pulse: Callable[[], None]) -> None:
        """Take a stretch into account: lengths at all samples, the way at the chosen ones."""
        tether, lengths = self.tethered.tether, np.asarray(self.tethered.lengths)
        ends = stretch.Ts_site_base[:, :3, :3] @ tether.attachment + stretch.Ts_site_base[:, :3, 3]
        away = np.linalg.norm(ends - tether.anchor, axis=1)
        last = stretch.waypoints
        paid = lengths[np.maximum(last - 1, 0)] * (1 - stretch.fractions) + lengths[last] * stretch.fractions
        spare = np.minimum(SLACK - np.abs(paid - away), tether.free_length - away)
        at = int(np.argmin(spare))
        self.length.take(float(spare[at]), stretch.where(at))
        legs = stretch.moving or self.robot.legs
        for at in chosen:
            pulse()
            self._look_at_way(stretch, at, ends[at], float(away[at]), list(legs))

    def checks(self) -> tuple[Check, ...]:
        """Of the tether's way, length and pull."""
        return (
            self.way.check("tether", "m"),
            self.length.check("tether length", "m"),
            self.pull.check("tether pull", "N"),
        )

    def _look_at_way(self, stretch: MotionStretch, at: int, end: Array, length: float, legs: list[int]) -> None:
        tether = self.tethered.tether
        toward = (tether.anchor - end) / length
        where = stretch.where(at)
        if length > tether.bare:
            line = line_between(end, tether.anchor - tether.bare * toward)
            spare = apart_from(line, self._ground, np.eye(4)) - tether.clearance if self._ground else -np.inf
            self.way.take(spare, f"the ground, {where}")
        if length > OFF_DECK:
            line = line_between(end + OFF_DECK * toward, tether.anchor)
            for name in ("base", PAYLOAD):
                if name in self._bodies:
                    away = apart_from(line, self._bodies[name].shape, stretch.Ts_site_base[at])
                    self.way.take(away if away > 0 else -_THIN, f"the chassis, {where}")
        line = line_between(end, tether.anchor)
        for leg in legs:
            for part in PARTS:
                link, body = link_name(leg, part), self._bodies[part]
                T = stretch.Ts_site_base[at] @ stretch.Ts_base_link[link][at]
                middle = T[:3, :3] @ body.middle + T[:3, 3]
                along = np.clip((middle - end) @ toward, 0.0, length)
                bound = float(np.linalg.norm(middle - end - along * toward)) - body.radius - tether.clearance
                if bound < self.way.spare:
                    self.way.take(apart_from(line, body.shape, T) - tether.clearance, f"{link}, {where}")

    def _ground_of(self, dem: Dem) -> coal.BVHModelOBBRSS | None:
        """All ground between the feet and the anchor."""
        contacts = np.concatenate([stance.contacts for stance in self.plan.stances])
        points = np.vstack([contacts, self.tethered.tether.anchor])[:, :2]
        whole = without_holes_between(dem, points.min(axis=0) - 1.0, points.max(axis=0) + 1.0, contacts)
        return None if whole is None else MovingBody(triangulate(whole.dem)).shape


def line_between(one: Array, other: Array) -> tuple[coal.Capsule, coal.Transform3s]:
    """A thin capsule between two points (3,)."""
    length = float(np.linalg.norm(other - one))
    z = (other - one) / length
    x = np.cross(z, np.eye(3)[int(np.abs(z).argmin())])
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    return coal.Capsule(_THIN, length), coal.Transform3s(R, 0.5 * (one + other))


def apart_from(line: tuple[coal.Capsule, coal.Transform3s], shape: coal.BVHModelOBBRSS, T: Array) -> float:
    """Distance of a line from a surface.

    Args:
        line: a capsule and its pose.
        shape: the surface, as the collision library has it.
        T: pose of the surface, (4, 4).

    Returns:
        [m], 0 where they meet.
    """
    request, found = coal.DistanceRequest(), coal.DistanceResult()
    pose = coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))
    return max(float(coal.distance(shape, pose, *line, request, found)), 0.0)
