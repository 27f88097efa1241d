"""Support polygons seen from above, and the margin of a centre of mass to them.

This is the geometric test on the horizontal plane: it holds for feet on level ground that can't
slip. It says nothing of friction or of sloped contacts; :mod:`footfall.balance.forces` does.

The *conservative* support polygon is what survives the loss of any one leg: the intersection of the
hulls of all feet but one. For n feet it is the region of Tukey depth 2: every closed half-plane that
holds a point of it holds at least two feet. It is cut out by those half-planes along ordered pairs of
feet that leave at most one foot outside. Four feet leave a single point, three leave nothing.

References
----------
J. W. Tukey, "Mathematics and the picturing of data", Proc. Int. Congress of Mathematicians, 1975.
D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int.
Conf. on Systems Engineering, 1990 (the conservative support polygon).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.polygon import clip, convex_hull

Array = NDArray[np.float64]

COINCIDENT = 1e-9
"""Feet nearer to each other than this share of the stance's size count as one place."""

ON_LINE = 1e-12
"""A foot nearer to a line than this share of the stance's size lies on it."""


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
    points = _horizontal(contacts, "contacts")
    count = len(points)
    if count < (4 if conservative else 3):
        return np.zeros((0, 2)), np.zeros(0)
    center = points.mean(axis=0)
    local = points - center
    size = float(np.ptp(local, axis=0).max())
    start, end = np.nonzero(~np.eye(count, dtype=bool))
    along = local[end] - local[start]
    length = np.hypot(along[:, 0], along[:, 1])
    line = length > COINCIDENT * size
    normals = np.column_stack([along[line, 1], -along[line, 0]]) / length[line, None]
    offsets = np.einsum("ij,ij->i", normals, local[start[line]])
    beyond = local @ normals.T - offsets
    if not (beyond > COINCIDENT * size).any():
        return np.zeros((0, 2)), np.zeros(0)
    kept = (beyond > ON_LINE * size).sum(axis=0) <= int(conservative)
    return normals[kept], offsets[kept] + normals[kept] @ center


def margin(contacts: ArrayLike, com_xy: ArrayLike, conservative: bool = False) -> float:
    """Stability margin [m]: signed distance of the centre of mass to the polygon, positive inside.

    Inside it is the distance to the nearest edge. Outside it is minus the largest distance beyond an
    edge's line, which is at most the distance to the polygon. Where there is no polygon (see
    :func:`half_planes`) it is −inf; where the polygon is a point or a segment it is at most 0.

    contacts: (k, 2) or (k, 3); com_xy: (2,). Raises InvalidInput for numbers that are not finite.
    """
    com = np.asarray(com_xy, float)
    if com.shape != (2,):
        raise InvalidInput("the centre of mass needs x and y [m]", shape=list(com.shape))
    return float(margins(contacts, com[None], conservative)[0])


def margins(contacts: ArrayLike, coms_xy: ArrayLike, conservative: bool = False) -> Array:
    """:func:`margin` of many centres of mass over the same feet: (n, 2) → (n,)."""
    coms = np.asarray(coms_xy, float)
    if coms.ndim != 2 or coms.shape[1] != 2 or not np.isfinite(coms).all():
        raise InvalidInput("centres of mass need n × 2 finite numbers [m]", shape=list(coms.shape))
    normals, offsets = half_planes(contacts, conservative)
    if len(offsets) == 0:
        return np.full(len(coms), -np.inf)
    return (offsets - coms @ normals.T).min(axis=1)


def margins_for_candidates(
    fixed_contacts: ArrayLike, candidates: ArrayLike, com_xy: ArrayLike, conservative: bool = False
) -> Array:
    """:func:`margin` for many places of one foot while the others stay, (n,) [m].

    fixed_contacts: (k, 2) or (k, 3), the feet that stay; candidates: (n, 2); com_xy: (2,), or (n, 2)
    where the centre of mass moves with the candidate. A candidate with NaN, or with a NaN centre of
    mass, gets NaN. Raises InvalidInput where fixed_contacts are not finite or the shapes don't fit.
    """
    fixed = _horizontal(fixed_contacts, "fixed_contacts")
    moved = np.asarray(candidates, float)
    coms = np.asarray(com_xy, float)
    if moved.ndim != 2 or moved.shape[1] != 2:
        raise InvalidInput("candidates need n × 2 numbers [m]", shape=list(moved.shape))
    if coms.shape not in ((2,), moved.shape):
        raise InvalidInput("com_xy needs two numbers, or two for each candidate", shape=list(coms.shape))
    unknown = np.logical_not(np.isfinite(moved).all(axis=1) & np.isfinite(coms).all(axis=-1))
    count = len(fixed) + 1
    if count < (4 if conservative else 3):
        return np.where(unknown, np.nan, -np.inf)
    center = fixed.mean(axis=0)
    moved = np.where(unknown[:, None], center, moved)
    coms = np.where(unknown[:, None], center, coms)
    # one array of x and one of y per foot: length 1 for a foot that stays, n for the candidates
    feet = [*map(tuple, np.atleast_3d(fixed - center)), tuple((moved - center).T)]
    com_x, com_y = (coms - center).T
    size = _size(feet)
    allowed = int(conservative)
    least = np.full(len(moved), np.inf)
    spread = np.zeros(len(moved))
    for a in range(count):
        for b in range(a + 1, count):
            ax, ay = feet[a]
            nx, ny = feet[b][1] - ay, ax - feet[b][0]
            length = np.hypot(nx, ny)
            line = length > COINCIDENT * size
            scale = np.where(line, length, 1.0)
            nx, ny = nx / scale, ny / scale
            right = np.zeros(1, np.int64)
            left = np.zeros(1, np.int64)
            for c in range(count):
                if c not in (a, b):
                    beyond = (feet[c][0] - ax) * nx + (feet[c][1] - ay) * ny
                    right = right + (beyond > ON_LINE * size)
                    left = left + (beyond < -ON_LINE * size)
                    np.fmax(spread, np.where(line, np.abs(beyond), 0.0), out=spread)
            com_beyond = (com_x - ax) * nx + (com_y - ay) * ny
            np.fmin(least, np.where(line & (right <= allowed), -com_beyond, np.inf), out=least)
            np.fmin(least, np.where(line & (left <= allowed), com_beyond, np.inf), out=least)
    least[spread <= COINCIDENT * size] = -np.inf
    least[unknown] = np.nan
    return least


def _size(feet: list[tuple[Array, ...]]) -> Array:
    """Larger side of the box around the feet, one for each candidate."""
    sides = [np.ptp(np.broadcast_arrays(*axis), axis=0) for axis in zip(*feet, strict=True)]
    return np.maximum(sides[0], sides[1])


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
