"""How near the rover comes to the ground and to itself along a walk, part by part; how old its footfalls' ground is.

It is for who looks at a walk: of samples that are ``SAMPLING`` apart, what holds between them its own checks say.
"""

from itertools import groupby
from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.answers import No
from footfall.planning.between_rows import finer
from footfall.planning.motion import Motion
from footfall.planning.scene.ground import nearby, touch_radius
from footfall.planning.scene.whole_body import GROUND_FAR, NOTHING, WholeBody
from footfall.planning.walk.ground_cost import oldest_under
from footfall.planning.walk.problem import SWING, WalkPlan
from footfall.robot.description import link_name
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

SAMPLING = 0.05
"""Largest change of a joint between two samples [rad]."""


class PartSpare(NamedTuple):
    """One phase of one foot move, and what it leaves to spare.

    first, last: the waypoints that it begins and ends at.
    spare: beyond the clearances that the description asks for, at least, of what comes nearest, at most ``GROUND_FAR``
    [m]. It is proven, unknown ground as high as its highest neighbour; NaN: hulls don't show that all is above it.
    waypoint: that it is gone to there. between: what comes nearest there, or why nobody knows.
    """

    first: int
    last: int
    spare: float
    waypoint: int
    between: str


def spare_along(robot: Robot, dem: Dem, plan: WalkPlan) -> tuple[PartSpare, ...]:
    """What each phase of each foot move leaves to spare, of ground and of the rover's own parts.

    A wheel that stands, is lifted or lowered touches the ground by its nature, so that is not counted.

    Args:
        robot: the rover.
        dem: the ground, in site.
        plan: the walk.

    Returns:
        One for each part, in their order.
    """
    motion = plan.motion
    found, bodies = [], dict[int, WholeBody | No]()
    for move, first, last in _parts(plan):
        if move not in bodies:
            bodies = {move: _body_in(robot, dem, plan, move)}
        body = bodies[move]
        if isinstance(body, No):
            found.append(PartSpare(first, last, np.nan, first, body.reason))
        else:
            found.append(_spare(body, motion, first, last))
    return tuple(found)


def seen_before(robot: Robot, dem: Dem, plan: WalkPlan) -> Array:
    """How long before the newest of the map the oldest ground under each placed foot was seen.

    Args:
        robot: the rover.
        dem: the ground, in site.
        plan: the walk.

    Returns:
        (foot moves,) [s]; 0 where the map does not say.
    """
    if not plan.foot_moves:
        return np.zeros(0)
    put = np.array([plan.stances[number + 1].contacts[leg] for number, leg in enumerate(plan.legs)])
    return oldest_under(dem, put, robot.wheel_radius)


def _parts(plan: WalkPlan) -> list[tuple[int, int, int]]:
    """Foot move, first and last waypoint of each part."""
    rows = range(1, len(plan.waypoints))
    runs = [(key, list(run)) for key, run in groupby(rows, lambda row: (int(plan.moves[row]), plan.phases[row]))]
    return [(move, run[0] - 1, run[-1]) for (move, _), run in runs]


def _body_in(robot: Robot, dem: Dem, plan: WalkPlan, move: int) -> WholeBody | No:
    """The rover over the ground of one foot move."""
    centers = plan.Ts_site_base[plan.moves == move, :2, 3]
    middle = 0.5 * (centers.min(axis=0) + centers.max(axis=0))
    gone = float(np.linalg.norm(centers - middle, axis=1).max())
    feet = plan.stances[min(move, plan.foot_moves)].contacts
    ground = nearby(dem, middle, touch_radius(robot) + gone, feet)
    return ground if isinstance(ground, No) else WholeBody(robot, ground)


def _spare(body: WholeBody, motion: Motion, first: int, last: int) -> PartSpare:
    fine, gone_to = finer(motion.rows(range(first, last + 1)), SAMPLING)
    Ts_base_link = body.poses(fine.waypoints)
    swings = motion.lifted(last) if motion.phases[last] == SWING else ()
    on_ground = {link_name(leg, "wheel") for leg in body.robot.legs if leg not in swings}
    links = [link for link in body.links if link not in on_ground]
    over = body.ground_at_least(fine.Ts_site_base[:, None] @ Ts_base_link, links)
    nearest = min(over, body.own_at_least(Ts_base_link), key=lambda one: one.gap.spare)
    spare, between = nearest.gap.spare, nearest.gap.between
    if spare >= GROUND_FAR:
        return PartSpare(first, last, GROUND_FAR, last, NOTHING)
    return PartSpare(first, last, spare if np.isfinite(spare) else np.nan, first + int(gone_to[nearest.at]), between)
