"""Where the chassis of a robot with stacks may go: inside conservative support polygons and the stacks' reach.

A foot may be lifted while the weight is inside what is left of the support polygon after the loss of any one leg. With
the weight there for the feet before a foot move and for those after it, each stance leads to the next: the polygons are
a chain, and the chassis glides from link to link.

D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int. Conf. on Systems
Engineering, 1990.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from footfall.balance.support import margins
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.problem import LeggedState
from footfall.planning.legged.stacks import Stack, ring_margins
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.whole_check import Refusal
from footfall.robot.legged.posture import chassis_pose, legs_to, placed

ALONG, ACROSS, APART = 0.9, 0.4, 0.1
"""How far from where the chassis is wanted it may be, and how far apart the places are that are looked at [m]."""
KEPT = 1.3
"""Margin of places to the polygons, as a share of the least one: the weight moves a little as the legs do."""
REACHED = 0.03
"""Stacks are so far inside their reachable space [m]."""
RISES = (1.0, 0.95, 1.05)
"""Heights, shares of that at ease."""
TRIED = 5
"""Places that are tried for a foot move."""


class Feet(NamedTuple):
    """Centres of soles and contacts of all feet, (legs, 3) in site [m]."""

    soles: Array
    contacts: Array


def feet_of(state: LeggedState) -> Feet:
    """The feet as a state has them, soles and contacts (legs, 3) in site [m]."""
    return Feet(state.soles, state.contacts)


def places(
    ground: Ground,
    stacks: tuple[Stack, Stack],
    state: LeggedState,
    stances: list[Feet],
    pose: tuple[float, float, float],
) -> list[tuple[float, float]] | Refusal:
    """Places of the chassis with a heading at which every one of some stances holds it.

    Args:
        ground: robot, terrain and settings.
        stacks: of the robot.
        state: how the robot stands.
        stances: where the feet are in each.
        pose: x, y [m] and yaw [rad] where the chassis is wanted.

    Returns:
        (x, y) in site [m], the nearest first; refused with the best margin where there is none.
    """
    x, y, yaw = pose
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    steps = [np.arange(-round(most / APART), round(most / APART) + 1) * APART for most in (ALONG, ACROSS)]
    along, across = (part.ravel() for part in np.meshgrid(*steps, indexing="ij"))
    offsets = along[:, None] * ahead + across[:, None] * np.array([-ahead[1], ahead[0]])
    least = KEPT * ground.settings.least_margin * ground.robot.length
    coms = _com(ground, state, pose) + offsets
    held = np.min([margins(feet.contacts, coms, conservative=True) for feet in stances], axis=0) - least
    reached = np.full(len(offsets), np.inf)
    legs = tuple(ground.robot.legs)
    for stack in stacks:
        axis = apply(chassis_pose(x, y, 0.0, yaw), np.array([*stack.axis, 0.0]))[:2] + offsets
        reached = np.min([reached, *(ring_margins(stack, feet.soles, axis, legs) for feet in stances)], axis=0)
    fits = (held >= 0) & (reached >= REACHED)
    if not fits.any():
        both = np.minimum(held, reached - REACHED)
        best = int(np.argmax(both))
        name = "support" if held[best] < reached[best] - REACHED else "reach"
        reason = f"no place of the chassis near ({x:z.2f}, {y:z.2f}) m holds the stances before and after"
        return Refusal(name, float(both[best]), reason)
    far = np.round(np.hypot(along, across), 9)
    return [(x + float(offsets[k, 0]), y + float(offsets[k, 1])) for k in np.lexsort((across, far)) if fits[k]]


def level_poses(ground: Ground, state: LeggedState, near: list[tuple[float, float]], yaw: float) -> Iterator[Array]:
    """Level poses of the chassis over a state's feet.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        near: places (x, y) in site, which are tried in their order [m].
        yaw: heading in site [rad].

    Yields:
        T_site_base (4, 4), at several heights over each place.
    """
    for rise in RISES:
        for x, y in near[:TRIED]:
            yield ground.pose_over(state.soles, x, y, yaw, 0.0, rise)


def _com(ground: Ground, state: LeggedState, pose: tuple[float, float, float]) -> Array:
    """Where the centre of mass is with the chassis at a pose over the state's feet, (2,) in site [m]."""
    T = ground.pose_over(state.soles, *pose, 0.0, 1.0)
    q = legs_to(ground.robot, T, state.soles, state.q)
    # out of reach of a foot it is reckoned by the posture that the legs have now
    return apply(T, placed(ground.robot, q if np.isfinite(q).all() else state.q).com)[:2]
