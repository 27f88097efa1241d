"""Closed meshes of what machines are made of: beams with rounded edges, turned drums, rings; for pictures alone."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh

ARC = 2
"""Pieces of a rounded edge."""
LEFT = 0.3
"""What is left of an edge's radius at the ends of a beam, share of it: no triangle is without area."""


def beam(low: ArrayLike, high: ArrayLike, radius: float, taper: float = 1.0) -> Mesh:
    """A box whose edges are all rounded, along its longest side.

    Args:
        low: the corner with the least coordinates, (3,) [m].
        high: the one with the greatest, (3,) [m].
        radius: of the edges [m].
        taper: thickness at the far end, share of that at the near one; thinner is the smaller of the other two sides.

    Returns:
        The closed mesh.
    """
    first, last = np.asarray(low, float), np.asarray(high, float)
    size = last - first
    along = int(np.argmax(size))
    across = [(along + 1) % 3, (along + 2) % 3]
    middle, half = (0.5 * (first + last))[across], (0.5 * size)[across]
    radius = min(radius, 0.9 * float(half.min()) * taper, 0.4 * float(size[along]))
    slimmer = np.where(half == half.min(), taper, 1.0)
    bow = np.linspace(0.0, np.pi / 2, ARC + 1)
    begins = first[along] + radius * (1 - np.sin(bow[::-1]))
    insets = (1 - LEFT) * radius * (1 - np.cos(bow[::-1]))
    places = np.concatenate([begins, first[along] + last[along] - begins[::-1]])
    rings = []
    for place, inset in zip(places, np.concatenate([insets, insets[::-1]]), strict=True):
        share = (place - first[along]) / size[along]
        ring = np.empty((4 * (ARC + 1), 3))
        ring[:, along] = place
        ring[:, across] = middle + _rounded(half * (1 + share * (slimmer - 1)) - inset, radius - inset)
        rings.append(ring)
    return skinned(rings)


def _rounded(half: Array, radius: float) -> Array:
    """Corners (n, 2) of a rectangle with rounded corners about the origin, counter-clockwise."""
    bow = np.linspace(0.0, np.pi / 2, ARC + 1)
    quarter = np.column_stack([np.cos(bow), np.sin(bow)])
    corners = []
    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        turned = quarter * (a, b)
        corners.append((half - radius) * (a, b) + radius * (turned if a * b > 0 else turned[::-1]))
    return np.concatenate(corners)


def turned(profile: ArrayLike, axis: int, sides: int = 24) -> Mesh:
    """A body turned about an axis through the origin.

    Args:
        profile: (place along the axis, radius) of each ring, (k, 2) [m], one after the other.
        axis: its number, 0…2.
        sides: how many corners a ring has.

    Returns:
        The closed mesh.
    """
    return skinned([ring(axis, place, np.full(sides, radius)) for place, radius in np.asarray(profile, float)])


def drum(begin: float, end: float, radius: float, axis: int, edge: float = 0.12) -> Mesh:
    """A cylinder on an axis through the origin, its rims rounded.

    Args:
        begin: where on the axis [m].
        end: where on the axis, farther on [m].
        radius: of the drum [m].
        axis: its number, 0…2.
        edge: radius of the rims, share of the drum's.

    Returns:
        The closed mesh.
    """
    bow = np.linspace(0.0, np.pi / 2, ARC + 1)
    rim = min(edge * radius, 0.3 * (end - begin))
    first = [(begin + rim * (1 - np.sin(one)), radius - rim * (1 - np.cos(one))) for one in bow[::-1]]
    return turned([*first, *((begin + end - place, reach) for place, reach in reversed(first))], axis)


def ring(axis: int, place: float, radii: Array) -> Array:
    """Points about an axis, the first on the next axis.

    Args:
        axis: its number, 0…2.
        place: along it [m].
        radii: how far from it each is, (n,) [m].

    Returns:
        (n, 3) [m].
    """
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    points = np.empty((len(radii), 3))
    points[:, axis] = place
    points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = radii * np.cos(angle), radii * np.sin(angle)
    return points


def skinned(rings: ArrayLike) -> Mesh:
    """Closed: quads from ring to ring (k, n, 3), counter-clockwise seen from their end, and a fan on both ends."""
    stacked = np.asarray(rings, float)
    count, n, _ = stacked.shape
    fan = np.arange(1, n - 1)
    last = (count - 1) * n
    ends = [
        np.column_stack([np.zeros_like(fan), fan + 1, fan]),
        np.column_stack([np.full_like(fan, last), last + fan, last + fan + 1]),
    ]
    return Mesh(stacked.reshape(-1, 3), np.concatenate([*_quads(count, n, count - 1), *ends]).astype(np.int32))


def looped(rings: ArrayLike) -> Mesh:
    """Closed without ends: the last ring goes on into the first, as a tyre does."""
    stacked = np.asarray(rings, float)
    count, n, _ = stacked.shape
    return Mesh(stacked.reshape(-1, 3), np.concatenate(_quads(count, n, count)).astype(np.int32))


def _quads(count: int, n: int, pieces: int) -> list[NDArray[np.int64]]:
    """Two triangles for each side of each of so many pieces between rings of n points."""
    triangles = []
    for piece in range(pieces):
        here, beside = piece * n + np.arange(n), piece * n + (np.arange(n) + 1) % n
        after = (piece + 1) % count * n - piece * n
        triangles += [
            np.column_stack([here, beside, beside + after]),
            np.column_stack([here, beside + after, here + after]),
        ]
    return triangles
