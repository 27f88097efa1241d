"""Where the centre of mass may be, with friction: the equilibrium region of a stance, and the margin to it.

A stance holds the rover if some contact forces inside the friction cones balance its weight. Seen along gravity the
centres of mass for which they exist form a convex region, the same for every height of the centre of mass. On level
ground that can't slip it is the hull of the feet; on rough ground it may be smaller than the hull, or reach beyond it.

It is found as a projection: one linear program for each direction gives the farthest centre of mass and a line that
nothing passes. The points span the *inner* polygon, all of which is held; the lines bound the *outer* one, outside of
which nothing is. They are refined until they are within a tolerance. Everything here answers on the safe side: what is
said to be inside is inside the inner polygon, what is said to be outside is beyond the outer one. Friction cones are
pyramids inside the cones, see :mod:`footfall.balance.cones`.

All points are in a frame whose z points against gravity, see
:class:`footfall.balance.balance_settings.BalanceSettings`.

References:
----------
T. Bretl, S. Lall, "Testing static equilibrium for legged robots", IEEE Transactions on Robotics 24, 2008.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import SIDES, require_cone
from footfall.balance.cones import fill_generators, unit_normals
from footfall.balance.friction import FRICTION
from footfall.balance.region_kernel import MERGED, signed_distance, signed_distances, trace
from footfall.balance.simplex import INFEASIBLE, OPTIMAL
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError, InvalidInput

TOLERANCE = 1e-5
"""How far the outer polygon may reach beyond the inner one [m]."""

MOST_DIRECTIONS = 512
"""Where these don't suffice the polygons stay farther apart than asked; both still hold."""

CARRIES = 1e-6
"""A foot carries something where its normal force is above this share of the weight."""


@dataclass(frozen=True)
class EquilibriumRegion:
    """Where the centre of mass may be over a stance, between a polygon from inside and one from outside.

    corners: (m, 2) of the inner polygon, counter-clockwise [m]; none where no forces hold the rover anywhere, one or
    two where the region is a point or a segment. loads: (m, k) normal force of each foot in weights, with the centre of
    mass at that corner. normals (q, 2), offsets (q,) [m]: nothing is held where normal · p > offset for any row. gap:
    how far the outer polygon reaches beyond the inner one, at most [m]. feet: the numbers of the k feet in the stance
    that the region was asked for. reason: why there are no corners, or no area; else empty.
    """

    corners: Array
    loads: Array
    normals: Array
    offsets: Array
    gap: float
    feet: tuple[int, ...]
    reason: str


@dataclass(frozen=True)
class RegionMargin:
    """Signed distance of a centre of mass to the boundary of a region, positive inside.

    margin: to the inner polygon [m], never more than the true one; −inf where nothing is held. most: upper bound [m].
    edge: (2, 2) nearest edge of the inner polygon, or None. carrying: the feet with any load at that edge: two where
    the rover would tip over about them, more where friction gives way. lost: the foot whose loss binds; None where
    none was lost. reason: why there is no margin, else empty.
    """

    margin: float
    most: float
    edge: Array | None
    carrying: tuple[int, ...]
    lost: int | None
    reason: str

    @property
    def held(self) -> bool | None:
        """True inside the inner polygon, False beyond the outer one, None where the tolerance decides."""
        if self.margin >= 0:
            return True
        return False if self.most < 0 else None


def equilibrium_region(
    contacts: ArrayLike,
    normals: ArrayLike,
    friction: float = FRICTION,
    sides: int = SIDES,
    tolerance: float = TOLERANCE,
) -> EquilibriumRegion:
    """The region in which feet hold the centre of mass.

    Args:
        contacts: (k, 3) [m], z up.
        normals: (k, 3) out of the ground.
        friction: coefficient between feet and ground.
        sides: of the friction pyramids: 4, 8 or 16.
        tolerance: largest gap between the polygons from inside and from outside [m].

    Returns:
        Both polygons, and the loads at the corners.

    Raises:
        InvalidInput: numbers are not finite, normals don't point up, or shapes or settings don't fit.
    """
    points, unit = require_stance(contacts, normals)
    require_cone(friction, sides)
    if not 0 < tolerance < np.inf:
        raise InvalidInput("the tolerance must be above zero [m]", tolerance=tolerance)
    return _region(points, unit, tuple(range(len(points))), friction, sides, tolerance)


def regions_without_each(
    contacts: ArrayLike,
    normals: ArrayLike,
    friction: float = FRICTION,
    sides: int = SIDES,
    tolerance: float = TOLERANCE,
) -> tuple[EquilibriumRegion, ...]:
    """The regions that are left when the first, the second … foot is lost.

    What lies in all of them survives the loss of any one leg: the conservative form with friction.

    Args:
        contacts: (k, 3) [m], z up.
        normals: (k, 3) out of the ground.
        friction: coefficient between feet and ground.
        sides: of the friction pyramids: 4, 8 or 16.
        tolerance: largest gap between the polygons from inside and from outside [m].

    Returns:
        k regions.

    Raises:
        InvalidInput: numbers are not finite, normals don't point up, or shapes or settings don't fit.
    """
    points, unit = require_stance(contacts, normals)
    require_cone(friction, sides)
    if not 0 < tolerance < np.inf:
        raise InvalidInput("the tolerance must be above zero [m]", tolerance=tolerance)
    everyone = range(len(points))
    rests = [tuple(foot for foot in everyone if foot != lost) for lost in everyone]
    return tuple(_region(points[list(rest)], unit[list(rest)], rest, friction, sides, tolerance) for rest in rests)


def region_margin(region: EquilibriumRegion, com_xy: ArrayLike) -> RegionMargin:
    """The margin of one centre of mass (2,) [m] and what binds it. Raises InvalidInput where it is not finite."""
    com = np.asarray(com_xy, float)
    if com.shape != (2,) or not np.isfinite(com).all():
        raise InvalidInput("the centre of mass needs finite x and y [m]", shape=list(com.shape))
    if len(region.corners) == 0:
        return RegionMargin(-np.inf, -np.inf, None, (), None, region.reason)
    least, edge, _, _ = signed_distance(region.corners, len(region.corners), com[0], com[1])
    after = (edge + 1) % len(region.corners)
    loaded = np.maximum(region.loads[edge], region.loads[after]) > CARRIES
    carrying = tuple(foot for foot, one in zip(region.feet, loaded, strict=True) if one)
    most = float((region.offsets - region.normals @ com).min())
    ends = region.corners[[edge, after]]
    return RegionMargin(float(least), max(most, float(least)), ends, carrying, None, region.reason)


def region_margins(region: EquilibriumRegion, coms_xy: ArrayLike) -> Array:
    """Margins to the inner polygon (n,) [m] of many centres of mass (n, 2); NaN where one is unknown (NaN)."""
    coms = np.ascontiguousarray(coms_xy, float)
    if coms.ndim != 2 or coms.shape[1] != 2:
        raise InvalidInput("centres of mass need n × 2 numbers [m]", shape=list(coms.shape))
    return signed_distances(region.corners, coms)


def surviving_margin(regions: tuple[EquilibriumRegion, ...], com_xy: ArrayLike) -> RegionMargin:
    """The least margin to the regions of :func:`regions_without_each`, and which lost leg binds."""
    if not regions:
        return RegionMargin(-np.inf, -np.inf, None, (), None, "no foot stands")
    found = [region_margin(region, com_xy) for region in regions]
    lost = int(np.argmin([one.margin for one in found]))
    one = found[lost]
    most = min(one.most for one in found)
    return RegionMargin(one.margin, most, one.edge, one.carrying, lost, one.reason)


def require_stance(contacts: ArrayLike, normals: ArrayLike, upward: bool = True) -> tuple[Array, Array]:
    """Refuse contacts and normals that no stance can have.

    Args:
        contacts: (k, 3) [m], z up.
        normals: (k, 3) out of the ground, of any length above zero.
        upward: False where a program decides what ground carries whose normal points elsewhere.

    Returns:
        Contacts (k, 3) and unit normals (k, 3).

    Raises:
        InvalidInput: they are not finite, not as many, or a normal does not point up.
    """
    points = np.ascontiguousarray(contacts, float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InvalidInput("contacts need k × 3 finite numbers [m]", shape=list(points.shape))
    unit = unit_normals(normals)
    if len(unit) != len(points):
        raise InvalidInput("each contact needs one normal", contacts=len(points), normals=len(unit))
    down = np.flatnonzero(unit[:, 2] <= 0)
    if upward and down.size:
        foot = int(down[0])
        raise InvalidInput(
            f"the normal of contact {foot} must point up, out of the ground, against gravity",
            contact=foot,
            normal=unit[foot].tolist(),
        )
    return points, unit


def frame(points: Array) -> tuple[Array, float]:
    """Centre (3,) and size of some contacts: in units of it, from there, forces and moments compare."""
    center = points.sum(axis=0) / len(points)
    return center, max(float(np.abs(points - center).max()), 1e-6)


def _region(
    points: Array, unit: Array, feet: tuple[int, ...], friction: float, sides: int, tolerance: float
) -> EquilibriumRegion:
    nothing = np.zeros((0, 2))
    if len(points) == 0:
        return EquilibriumRegion(nothing, np.zeros((0, 0)), nothing, np.zeros(0), 0.0, feet, "no foot stands")
    center, size = frame(points)
    edges = np.empty((len(points), sides, 3))
    fill_generators(unit, friction, edges)
    local = (points - center) / size
    # corners that are left out because they are next to another cost the inner polygon as much as MERGED
    within = max(tolerance / size - MERGED, MERGED)
    status, around, offsets, corners, loads, gap = trace(local, edges, within, MOST_DIRECTIONS)
    if status == INFEASIBLE:
        reason = f"no forces inside friction {friction:g} hold the rover on {len(points)} feet: the ground is too steep"
        return EquilibriumRegion(nothing, np.zeros((0, len(points))), nothing, np.zeros(0), 0.0, feet, reason)
    if status != OPTIMAL:
        raise FootFallError("the equilibrium program was not solved", status=int(status), contacts=points.tolist())
    reason = "" if len(corners) > 2 else f"{len(points)} feet leave a point or a line, without area"
    center_xy = center[:2]
    offsets = size * offsets + around @ center_xy
    return EquilibriumRegion(
        center_xy + size * corners, loads, around, offsets, float(size * (gap + MERGED)), feet, reason
    )
