"""Where the standing wheels are: on the ground, where their stance says, on the branch that it says, inside limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.planning.answers import Check
from footfall.planning.walk.problem import CheckedMotion, Stance, part_name
from footfall.planning.walk.recheck.stretches import MotionStretch
from footfall.robot.description import link_name
from footfall.robot.leg_branches import elbow_of, shoulder_of
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

DRIFT = 0.002
"""How far the centre of a standing wheel may be from where its stance has it [m]."""
TURNED = np.deg2rad(0.5)
"""How far such a wheel may be turned [rad]."""
OFF_GROUND = 0.005
"""How far the lowest point of the rim may be from the ground, beyond what the wheel may sink in [m]."""
OFF_NORMAL = np.deg2rad(3.0)
"""How far a stance's normal may be from that of the plane through the ground under the wheel [rad]."""
_TURNING_OVER = 1e-3
"""Within this of straight, or of the hip's axis, a leg is on both branches [rad], [m]."""


@dataclass
class Worst:
    """The least spare so far, in one unit, and where."""

    spare: float = float("inf")
    where: str = "nowhere"

    def take(self, spare: float, where: str) -> None:
        """Keeps a spare that is less than all so far, and where."""
        if spare < self.spare:
            self.spare, self.where = float(spare), where

    def check(self, name: str, unit: str) -> Check:
        """As a check of that name and unit, which holds where nothing is lacking."""
        return Check(name, self.spare >= 0, self.spare, unit, self.where)


def limits(robot: Robot, plan: CheckedMotion) -> Check:
    """Least room to a joint's limit; between waypoints joints move in straight lines, so waypoints are enough."""
    spare = np.minimum(plan.waypoints - robot.lower, robot.upper - plan.waypoints)
    at, joint = np.unravel_index(int(np.argmin(spare)), spare.shape)
    called = part_name(int(plan.moves[at]), len(plan.groups))
    where = f"{robot.joint_names[joint]} at waypoint {at}, {called} ({plan.phases[at]})"
    return Check("joint limits", bool(spare.min() >= 0), float(spare.min()), "rad", where)


class ContactCheck:
    """Gathers over all stretches how well wheels stand where their stances say; turns count at the wheel's rim [m]."""

    def __init__(self, robot: Robot, plan: CheckedMotion) -> None:
        self.robot, self.plan, self.worst = robot, plan, Worst()

    def grounded(self, dem: Dem, number: int) -> None:
        """Whether the wheels of a stance touch the ground, in one of its contacts each, with its normal."""
        stance, radius = self.plan.stances[number], self.robot.wheel_radius
        most = OFF_GROUND + self.robot.description.clearances.wheel_sink
        # a stance differs from the last one by the feet that were moved
        legs = self.robot.legs if number == 0 else self.plan.groups[number - 1]
        for leg in legs:
            where = f"leg {leg} in stance {number}"
            rim = lowest_rim_point(stance.Ts_site_wheel[leg], stance.normals[leg], radius)
            self.worst.take(OFF_GROUND - float(np.linalg.norm(rim - stance.contacts[leg])), f"contact of {where}")
            height = float(height_at(dem, rim[0], rim[1]))
            if np.isfinite(height):
                self.worst.take(most - abs(rim[2] - height), f"rim of {where}, to the ground")
            normal = plane_normal(dem, stance.contacts[leg], radius)
            if normal is not None:
                apart = np.arccos(np.clip(normal @ stance.normals[leg], -1.0, 1.0))
                self.worst.take(radius * (OFF_NORMAL - float(apart)), f"normal of {where}, at the rim")

    def stood(self, stretch: MotionStretch) -> None:
        """Whether wheels that stand are all the time where their stance has them; the moving ones at both ends."""
        stance, count = self.plan.stances[stretch.move], len(stretch.qs)
        for leg in stretch.standing:
            self._compare(stretch, leg, stance, np.arange(count))
        for leg in stretch.moving:
            self._compare(stretch, leg, stance, np.array([0]))
            self._compare(stretch, leg, self.plan.stances[stretch.move + 1], np.array([count - 1]))

    def _compare(self, stretch: MotionStretch, leg: int, stance: Stance, chosen: NDArray[np.int64]) -> None:
        Ts = stretch.Ts_site_base[chosen] @ stretch.Ts_base_link[link_name(leg, "wheel")][chosen]
        T = stance.Ts_site_wheel[leg]
        away = DRIFT - np.linalg.norm(Ts[:, :3, 3] - T[:3, 3], axis=1)
        turned = Rotation.from_matrix(Ts[:, :3, :3] @ T[:3, :3].T).magnitude()
        spare = np.minimum(away, self.robot.wheel_radius * (TURNED - turned))
        at = int(np.argmin(spare))
        self.worst.take(float(spare[at]), f"wheel of leg {leg}, {stretch.where(int(chosen[at]))}")


class Branches:
    """Gathers whether standing legs keep the shoulder and elbow that their stance says; a straight wrist joins two."""

    def __init__(self, plan: CheckedMotion) -> None:
        self.plan, self.fault = plan, ""

    def look(self, stretch: MotionStretch) -> None:
        """Compares standing legs at all samples with their stance, and moving ones where they begin and end."""
        stance, count = self.plan.stances[stretch.move], len(stretch.qs)
        for leg in stretch.standing:
            self._compare(stretch, leg, stance, np.arange(count))
        for leg in stretch.moving:
            self._compare(stretch, leg, stance, np.array([0]))
            self._compare(stretch, leg, self.plan.stances[stretch.move + 1], np.array([count - 1]))

    def check(self) -> Check:
        """Whether no leg turned over in all that was looked at."""
        return Check("continuity", not self.fault, float("nan"), "", self.fault or "no leg turns over")

    def _compare(self, stretch: MotionStretch, leg: int, stance: Stance, chosen: NDArray[np.int64]) -> None:
        hips = stretch.Ts_base_link[link_name(leg, "hip_yaw")][chosen]
        ankles = stretch.Ts_base_link[link_name(leg, "ankle_pitch")][chosen]
        # out along the leg's plane, from the axis of the hip
        out = ((ankles - hips)[:, :3, 3] * hips[:, :3, 0]).sum(axis=1)
        knee, branch = stretch.qs[chosen, 6 * leg + 2], int(stance.branches[leg])
        for name, sign, over in (("shoulder", out, shoulder_of(branch)), ("elbow", knee, elbow_of(branch))):
            wrong = sign > _TURNING_OVER if over else sign < -_TURNING_OVER
            if wrong.any() and not self.fault:
                where = stretch.where(int(chosen[int(np.argmax(wrong))]))
                self.fault = f"the {name} of leg {leg} is not on branch {branch} of its stance, {where}"


def lowest_rim_point(T_site_wheel: Array, normal: Array, radius: float) -> Array:
    """Point of a wheel's rim, a circle about the wheel's y, that is lowest along a normal.

    Args:
        T_site_wheel: pose of the wheel, (4, 4).
        normal: (3,) in site.
        radius: of the wheel [m].

    Returns:
        (3,) in site [m].
    """
    axle = T_site_wheel[:3, 1]
    down = -(normal - (normal @ axle) * axle)
    return T_site_wheel[:3, 3] + radius * down / max(float(np.linalg.norm(down)), 1e-12)


def plane_normal(dem: Dem, contact: Array, radius: float) -> Array | None:
    """Unit normal of the plane fitted to the surface around a contact, by least squares.

    Args:
        dem: the ground, in site.
        contact: (3,) in site [m].
        radius: how far around [m].

    Returns:
        (3,); None where some of the surface is unseen.
    """
    steps = np.linspace(-radius, radius, 2 * max(4, int(np.ceil(radius / dem.geometry.resolution))) + 1)
    dx, dy = (one.ravel() for one in np.meshgrid(steps, steps))
    inside = np.hypot(dx, dy) <= radius * (1 + 1e-9)
    dx, dy = dx[inside], dy[inside]
    z = height_at(dem, contact[0] + dx, contact[1] + dy)
    known = np.isfinite(z)
    if known.mean() < 0.5:
        return None
    (a, b, _), *_ = np.linalg.lstsq(np.column_stack([dx, dy, np.ones(len(dx))])[known], z[known], rcond=None)
    return np.array([-a, -b, 1.0]) / np.sqrt(1 + a * a + b * b)
