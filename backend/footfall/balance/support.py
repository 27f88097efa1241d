"""Support polygons seen from above, and the margin of a centre of mass to them.

This is the geometric test on the horizontal plane: it holds for feet on level ground that can't
slip. It says nothing of friction or of sloped contacts; :mod:`footfall.balance.forces` does.

The *conservative* support polygon is what survives the loss of any one leg: the intersection of the
hulls of all feet but one. For n feet it is the region of Tukey depth 2: every closed half-plane that
holds a point of it holds at least two feet. It is cut out by those half-planes along ordered pairs of
feet that leave at most one foot outside. Four feet leave a single point, three leave nothing.

References:
----------
J. W. Tukey, "Mathematics and the picturing of data", Proc. Int. Congress of Mathematicians, 1975.
D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int.
Conf. on Systems Engineering, 1990 (the conservative support polygon).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.foot_pairs import MOST_FEET
from footfall.balance.support_kernel import COINCIDENT, ON_LINE, candidate_margins
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.polygon import clip, convex_hull


class Edges(NamedTuple):
    """The lines that bound a support polygon: inside where normal · p ≤ offset for every row.

    normals: (m, 2) unit, outward; offsets: (m,) [m]; start, end: (m,) the feet that the line leads along, the inside to
    its left; lost: (m,) the foot beyond the line, whose loss makes it an edge, or −1 where none is.
    """

    normals: Array
    offsets: Array
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    lost: NDArray[np.int64]


@dataclass(frozen=True)
class SupportMargin:
    """Margin of a centre of mass and what binds it.

    margin: [m], positive inside. feet: the rows of the two feet along the binding edge, or None where there is no
    polygon. edge: (2, 2) where they are [m]. lost: the foot without which that edge bounds the stance; None for an edge
    of all feet. reason: why there is no polygon or no area; else empty.
    """

    margin: float
    feet: tuple[int, int] | None
    edge: Array | None
    lost: int | None
    reason: str


class CandidateMargins(NamedTuple):
    """How far the centre of mass is inside each candidate's support polygon, and what binds it.

    margins: (n,) [m]; pairs: (n,) uint8, codes (balance.foot_pairs) of the binding edge's feet, rows of the fixed feet
    and their count for the candidate; lost: (n,) uint8, the foot whose loss binds. NONE where there is none.
    """

    margins: Array
    pairs: NDArray[np.uint8]
    lost: NDArray[np.uint8]


def support_polygon(contacts: ArrayLike) -> Array:
    """Hull of the feet, counter-clockwise corners (m, 2) [m]; fewer than three where they span no area.

    contacts: (k, 2) or (k, 3) [m]; heights are ignored.
    """
    points = _horizontal(contacts, "contacts")
    corners = convex_hull(points)
    if len(corners) > 2 and len(half_planes(points, conservative=False)[1]) == 0:
        # feet on one line up to rounding: its two ends
        order = np.lexsort(corners.T[::-1])
        return corners[order[[0, -1]]]
    return corners


def conservative_polygon(contacts: ArrayLike) -> Array:
    """What survives the loss of any one leg: counter-clockwise corners (m, 2) [m].

    (0, 2) for fewer than four feet and for feet on one line; one corner where the region is a point
    and two where it is a segment (both have no area: the margin is nowhere positive).
    """
    points = _horizontal(contacts, "contacts")
    if len(half_planes(points, conservative=True)[1]) == 0:
        return np.zeros((0, 2))
    center, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    corners = convex_hull(points) - center
    for lost in range(len(points)):
        hull = convex_hull(np.delete(points, lost, axis=0)) - center
        for start, end in zip(hull, np.roll(hull, -1, axis=0), strict=True):
            normal = np.array([end[1] - start[1], start[0] - end[0]])
            length = float(np.hypot(*normal))
            if length > COINCIDENT * size:
                # the slack keeps regions without area: a point or a segment
                corners = clip(corners, normal / length, float(normal @ start) / length + ON_LINE * size)
    return convex_hull(_merged(corners, COINCIDENT * size)) + center


def half_planes(contacts: ArrayLike, conservative: bool) -> tuple[Array, Array]:
    """Unit outward normals (m, 2) and offsets (m,) [m]: inside where normal · p ≤ offset for every row.

    No rows at all where there is no polygon: feet on one line, fewer than three (conservative: four).
    """
    found = edges(contacts, conservative)
    return found.normals, found.offsets


def edges(contacts: ArrayLike, conservative: bool) -> Edges:
    """:func:`half_planes` and the feet that each of them comes from."""
    points = _horizontal(contacts, "contacts")
    count = len(points)
    nobody = np.zeros(0, np.int64)
    nothing = Edges(np.zeros((0, 2)), np.zeros(0), nobody, nobody, nobody)
    if count < (4 if conservative else 3):
        return nothing
    center = points.mean(axis=0)
    local = points - center
    size = float(np.ptp(local, axis=0).max())
    start, end = np.nonzero(~np.eye(count, dtype=bool))
    along = local[end] - local[start]
    length = np.hypot(along[:, 0], along[:, 1])
    line = length > COINCIDENT * size
    start, end, along, length = start[line], end[line], along[line], length[line]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]
    offsets = np.einsum("ij,ij->i", normals, local[start])
    beyond = local @ normals.T - offsets
    if not (beyond > COINCIDENT * size).any():
        return nothing
    outside = beyond > ON_LINE * size
    kept = outside.sum(axis=0) <= int(conservative)
    lost = np.where(outside.any(axis=0), outside.argmax(axis=0), -1)
    return Edges(normals[kept], offsets[kept] + normals[kept] @ center, start[kept], end[kept], lost[kept])


def margin(contacts: ArrayLike, com_xy: ArrayLike, conservative: bool = False) -> float:
    """Stability margin: signed distance of the centre of mass to the support polygon.

    Inside it is the distance to the nearest edge. Outside it is minus the largest distance beyond an edge's line, which
    is at most the distance to the polygon.

    Args:
        contacts: (k, 2) or (k, 3) [m].
        com_xy: centre of mass, (2,) [m].
        conservative: whether the polygon must survive the loss of any one foot.

    Returns:
        The distance [m], positive inside. −inf where there is no polygon (see :func:`half_planes`); at most 0 where it
        is a point or a segment.

    Raises:
        InvalidInput: numbers are not finite, or shapes don't fit.
    """
    com = np.asarray(com_xy, float)
    if com.shape != (2,):
        raise InvalidInput("the centre of mass needs x and y [m]", shape=list(com.shape))
    return float(margins(contacts, com[None], conservative)[0])


def support_margin(contacts: ArrayLike, com_xy: ArrayLike, conservative: bool = False) -> SupportMargin:
    """As :func:`margin`, with what binds it.

    Args:
        contacts: (k, 2) or (k, 3) [m].
        com_xy: centre of mass, (2,) [m].
        conservative: whether the polygon must survive the loss of any one foot.

    Returns:
        The margin, the feet, the edge between them, and the leg whose loss would count.

    Raises:
        InvalidInput: numbers are not finite, or shapes don't fit.
    """
    points = _horizontal(contacts, "contacts")
    com = np.asarray(com_xy, float)
    if com.shape != (2,) or not np.isfinite(com).all():
        raise InvalidInput("the centre of mass needs finite x and y [m]", shape=list(com.shape))
    found = edges(points, conservative)
    if len(found.offsets) == 0:
        need = 4 if conservative else 3
        reason = f"{len(points)} feet: a{' conservative' if conservative else ''} support polygon needs {need}"
        if len(points) >= need:
            reason = f"the {len(points)} feet stand on one line or in one place"
        return SupportMargin(-np.inf, None, None, None, reason)
    spare = found.offsets - found.normals @ com
    at = int(np.argmin(spare))
    feet = int(found.start[at]), int(found.end[at])
    lost = int(found.lost[at]) if found.lost[at] >= 0 else None
    pointlike = conservative and len(conservative_polygon(points)) < 3
    reason = f"what survives the loss of any one of the {len(points)} feet has no area" if pointlike else ""
    return SupportMargin(float(spare[at]), feet, points[list(feet)], lost, reason)


def margins(contacts: ArrayLike, coms_xy: ArrayLike, conservative: bool = False) -> Array:
    """As :func:`margin`, of many centres of mass over the same feet.

    Args:
        contacts: (k, 2) or (k, 3) [m].
        coms_xy: centres of mass, (n, 2) [m].
        conservative: whether the polygon must survive the loss of any one foot.

    Returns:
        Margins (n,) [m].

    Raises:
        InvalidInput: numbers are not finite, or shapes don't fit.
    """
    coms = np.asarray(coms_xy, float)
    if coms.ndim != 2 or coms.shape[1] != 2 or not np.isfinite(coms).all():
        raise InvalidInput("centres of mass need n × 2 finite numbers [m]", shape=list(coms.shape))
    return margins_inside(*half_planes(contacts, conservative), coms)


def margins_inside(normals: Array, offsets: Array, coms_xy: Array) -> Array:
    """As :func:`margins`, to a polygon that is known by its :func:`half_planes`.

    Args:
        normals: (m, 2) of those.
        offsets: (m,) of those [m].
        coms_xy: centres of mass, (n, 2) [m].

    Returns:
        Margins (n,) [m].
    """
    if len(offsets) == 0:
        return np.full(len(coms_xy), -np.inf)
    return (offsets - coms_xy @ normals.T).min(axis=1)


def margins_for_candidates(
    fixed_contacts: ArrayLike, candidates: ArrayLike, com_xy: ArrayLike, conservative: bool = False
) -> Array:
    """As :func:`margin`, for many places of one foot while the others stay.

    Args:
        fixed_contacts: (k, 2) or (k, 3), the feet that stay [m].
        candidates: (n, 2) [m].
        com_xy: centre of mass, (2,), or (n, 2) where it moves with the candidate [m].
        conservative: whether the polygon must survive the loss of any one foot.

    Returns:
        Margins (n,) [m]; a candidate with NaN, or with a NaN centre of mass, gets NaN.

    Raises:
        InvalidInput: fixed_contacts are not finite, or the shapes don't fit.
    """
    return bindings_for_candidates(fixed_contacts, candidates, com_xy, conservative).margins


def bindings_for_candidates(
    fixed_contacts: ArrayLike, candidates: ArrayLike, com_xy: ArrayLike, conservative: bool = False
) -> CandidateMargins:
    """As :func:`margins_for_candidates`, with the pair of feet that binds, and the lost leg, for each candidate.

    Args:
        fixed_contacts: (k, 2) or (k, 3), the feet that stay [m].
        candidates: (n, 2) [m].
        com_xy: centre of mass, (2,), or (n, 2) where it moves with the candidate [m].
        conservative: whether the polygon must survive the loss of any one foot.

    Returns:
        Margins (n,) [m] and what binds each.

    Raises:
        InvalidInput: fixed_contacts are not finite or too many, or the shapes don't fit.
    """
    fixed = _horizontal(fixed_contacts, "fixed_contacts")
    moved = np.asarray(candidates, float)
    coms = np.asarray(com_xy, float)
    if moved.ndim != 2 or moved.shape[1] != 2:
        raise InvalidInput("candidates need n × 2 numbers [m]", shape=list(moved.shape))
    if coms.shape not in ((2,), moved.shape):
        raise InvalidInput("com_xy needs two numbers, or two for each candidate", shape=list(coms.shape))
    if len(fixed) >= MOST_FEET:
        raise InvalidInput(f"a stance has at most {MOST_FEET} feet", feet=len(fixed) + 1)
    # far from the origin of the site the differences of the products would lose digits
    center = fixed.mean(axis=0) if len(fixed) else np.zeros(2)
    found = CandidateMargins(np.empty(len(moved)), np.empty(len(moved), np.uint8), np.empty(len(moved), np.uint8))
    # a copy, as compiled code takes one place seen n times for another kind of array
    coms = np.broadcast_to(coms - center, moved.shape).copy()
    candidate_margins(fixed - center, moved - center, coms, int(conservative), *found)
    return found


def _merged(corners: Array, distance: float) -> Array:
    """Corners without those nearer than ``distance`` to one already taken."""
    taken: list[Array] = []
    for corner in corners:
        if all(np.hypot(*(corner - other)) > distance for other in taken):
            taken.append(corner)
    return np.array(taken).reshape(-1, 2)


def _horizontal(contacts: ArrayLike, name: str) -> Array:
    points = np.asarray(contacts, float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
        raise InvalidInput(f"{name} need k × 2 or k × 3 finite numbers [m]", shape=list(points.shape))
    return points[:, :2]
