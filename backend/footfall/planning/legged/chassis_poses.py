"""Poses of the chassis that are tried over feet: near where it is wanted, its weight inside what carries it."""

from collections.abc import Iterator, Sequence

import numpy as np

from footfall.balance.support import half_planes
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.polygon import clip, convex_hull
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.whole_check import Feet, Margin, Refusal
from footfall.robot.legged.posture import legs_to, placed

LEANS = (0.5, 0.0, 1.0)
"""Shares of the slope under the feet that the chassis takes on."""
RISES = (1.0, 0.94, 1.04, 0.88, 0.8)
"""Heights, shares of that at ease."""
INWARD = 0.35
"""How far the weight goes inside its polygon at most, beyond the least: share of the way to the polygon's middle."""

Answer = dict[str, Margin] | Refusal


def over_all_feet(
    ground: Ground, soles: Array, contacts: Array, normals: Array, x: float, y: float, yaw: float
) -> Iterator[tuple[Array, Array, Answer]]:
    """Postures with all feet down and the chassis wanted at a place, and what the check says of them.

    Args:
        ground: robot, terrain and settings.
        soles: centres, (legs, 3) in site [m].
        contacts: (legs, 3) in site [m].
        normals: (legs, 3) of the ground there.
        x: east, in site [m].
        y: north, in site [m].
        yaw: heading in site [rad].

    Yields:
        Posture (joints,), pose (4, 4) and answer, the most wanted first.
    """
    feet = Feet(ground.robot.legs, contacts, normals)
    for T_site_base in poses(ground, soles, contacts, feet.standing, x, y, yaw, ground.ease.q):
        q = legs_to(ground.robot, T_site_base, soles, ground.ease.q)
        yield q, T_site_base, ground.check.margins(q, T_site_base, feet)


def poses(
    ground: Ground, soles: Array, contacts: Array, standing: Sequence[int], x: float, y: float, yaw: float, near: Array
) -> Iterator[Array]:
    """Poses of the chassis, the most wanted first: at a place, moved only as far as the weight has to.

    Args:
        ground: robot, terrain and settings.
        soles: centres, (legs, 3) in site [m].
        contacts: (legs, 3) in site [m].
        standing: numbers of the feet that are to carry it.
        x: east, in site [m].
        y: north, in site [m].
        yaw: heading in site [rad].
        near: posture from which the centre of mass is reckoned, (joints,) [rad or m].

    Yields:
        T_site_base, (4, 4).
    """
    com_base = placed(ground.robot, near).com
    for rise in RISES:
        for lean in LEANS:
            T = ground.pose_over(soles, x, y, yaw, lean, rise)
            for inward in (0.0, INWARD):
                shift = shift_inside(ground, contacts[list(standing)], apply(T, com_base)[:2], inward)
                if shift is None:
                    return
                yield ground.pose_over(soles, x + shift[0], y + shift[1], yaw, lean, rise)
            if not _leans(soles, ground):
                break


def shift_inside(ground: Ground, contacts: Array, com_xy: Array, inward: float) -> Array | None:
    """The shortest shift that brings the weight inside the support polygon by the least margin.

    A little is added for what the legs weigh that move along.

    Args:
        ground: robot, terrain and settings.
        contacts: (k, 3) of the polygon, in site [m].
        com_xy: centre of mass, (2,) in site [m].
        inward: share of the way on to the middle.

    Returns:
        (2,) [m]; None where the polygon is too small.
    """
    normals, offsets = half_planes(contacts, conservative=False)
    if not len(offsets):
        return None
    corners = convex_hull(contacts[:, :2])
    least = 1.3 * ground.settings.least_margin * ground.robot.length
    for normal, offset in zip(normals, offsets, strict=True):
        corners = clip(corners, normal, float(offset) - least)
    if len(corners) < 3:
        return None
    middle = corners.mean(axis=0)
    inside = (offsets - least - normals @ com_xy >= 0).all()
    nearest = com_xy if inside else _nearest(corners, com_xy)
    return nearest + inward * (middle - nearest) - com_xy


def _nearest(corners: Array, point: Array) -> Array:
    """The point of a polygon's rim that is nearest."""
    along = np.roll(corners, -1, axis=0) - corners
    share = ((point - corners) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18)
    on = corners + np.clip(share, 0.0, 1.0)[:, None] * along
    return on[int(np.argmin(((on - point) ** 2).sum(axis=1)))]


def _leans(soles: Array, ground: Ground) -> bool:
    """Whether the feet stand at heights so different that leaning with them matters."""
    ends = soles[:, 2] - ground.robot.radii
    return float(np.ptp(ends)) > 0.02 * ground.robot.length
