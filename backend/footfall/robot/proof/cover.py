"""Ball trees that cover the surfaces of a leg's parts: what the compiled check asks about instead of triangles.

Cover. A part's triangles are cut along planes into pieces. A piece is a triangle, so it lies in a ball as soon as its
three corners do (balls are convex). Every ball's radius is *computed from its pieces*: the largest distance from its
centre to a corner. The pieces of one part make up its whole surface, so the balls of one level cover it, whatever
centres were chosen; the choice decides only how tight the cover is. A ball's pieces are divided among its children,
each piece going to exactly one. So if a set of balls is such that every path from the root down to a leaf meets one of
them, they cover the surface together: a walk that looks at a ball's children only where the ball itself fails
sees a cover.

Rounding moves the corners of a cut by about 1e-16 m; SLACK is far above that.

Order. A tree is kept in preorder with the index of what follows each subtree (``skip``), so that walking it needs no
stack: a ball that is clear goes on at ``skip``, any other at the next index, and where the two are one the ball
is a leaf.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh

SLACK = 1e-6
"""Added to every radius [m]."""

_DRUM_ROUNDNESS = 1.05
"""A mesh is covered in sectors about y where its corners lie that evenly about it: largest over least radius."""


@dataclass(frozen=True)
class BallTree:
    """Balls in preorder. centers: (n, 3) [m] in the part's frame; radii: (n,) [m]; skip: (n,) int64."""

    centers: Array
    radii: Array
    skip: NDArray[np.int64]

    @property
    def leaves(self) -> NDArray[np.bool_]:
        """Which balls have no children, (n,)."""
        return self.skip == np.arange(len(self.skip)) + 1


@dataclass(frozen=True)
class _Cell:
    """Pieces that one ball has to cover, where its centre shall be, and the cells that they are divided into."""

    center: Array
    pieces: Array
    children: "list[_Cell]"


Edges = tuple[float | tuple[float, float, float], ...]
"""Longest edges of cells, level by level, the same along x, y and z or of each [m]."""

EDGES: Edges = (0.2, 0.07)
"""Of a link."""


def ball_tree(mesh: Mesh, edges: Edges = EDGES) -> BallTree:
    """Cover of a mesh's surface in levels: one ball, thick slices, and small balls near the surface.

    edges: longest edges of the cells of each further level of what is no wheel [m].
    """
    cell = _drum(mesh) if _is_drum(mesh) else _box(mesh, edges)
    centers: list[Array] = []
    radii: list[float] = []
    skip: list[int] = []
    _append(cell, centers, radii, skip)
    return BallTree(np.array(centers), np.array(radii), np.array(skip, np.int64))


def cut(triangles: Array, normal: Array, offset: float) -> Array:
    """Triangles divided where they cross a plane: the same surface.

    Args:
        triangles: (n, 3, 3) [m].
        normal: (3,) of the plane.
        offset: the plane has normal · x = offset.

    Returns:
        (m, 3, 3) [m].
    """
    side = triangles @ np.asarray(normal, float) - offset
    crossing = (side.max(axis=1) > 1e-12) & (side.min(axis=1) < -1e-12)
    kept, across, side = triangles[~crossing], triangles[crossing], side[crossing]
    if not len(across):
        return kept
    above = side > 0
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(across))
    a, b, c = (across[rows, (lone + i) % 3] for i in range(3))
    sa, sb, sc = (side[rows, (lone + i) % 3][:, None] for i in range(3))
    p, q = a + (b - a) * (sa / (sa - sb)), a + (c - a) * (sa / (sa - sc))
    return np.concatenate([kept, *(np.stack(three, axis=1) for three in ((a, p, q), (p, b, c), (p, c, q)))])


def _append(cell: _Cell, centers: list[Array], radii: list[float], skip: list[int]) -> None:
    index = len(centers)
    centers.append(cell.center)
    radii.append(float(np.linalg.norm(cell.pieces.reshape(-1, 3) - cell.center, axis=1).max()) + SLACK)
    skip.append(0)
    for child in cell.children:
        _append(child, centers, radii, skip)
    skip[index] = len(centers)


def _corners(mesh: Mesh) -> Array:
    return mesh.vertices[mesh.triangles]


def _divided(pieces: Array, keys: NDArray[np.int64], center, children) -> list[_Cell]:
    """Cells of the pieces with equal keys (n, k): center(key) → (3,), children(key, pieces) → cells."""
    cells = []
    for key in np.unique(keys, axis=0):
        mine = pieces[(keys == key).all(axis=1)]
        cells.append(_Cell(center(key), mine, children(key, mine)))
    return cells


# Boxes and whatever else is not round


def _box(mesh: Mesh, edges: Edges) -> _Cell:
    """One ball, and level by level cells whose edges are no longer than said [m]."""
    pieces = _corners(mesh)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    counts = [np.ones(3, int)]
    for edge in edges:
        counts.append(counts[-1] * np.maximum(np.ceil((high - low) / counts[-1] / np.asarray(edge)).astype(int), 1))
    for axis in range(3):
        for offset in np.linspace(low[axis], high[axis], counts[-1][axis] + 1)[1:-1]:
            pieces = cut(pieces, np.eye(3)[axis], offset)

    def divided(pieces: Array, level: int) -> list[_Cell]:
        if level == len(counts):
            return []
        count = counts[level]
        at = (pieces.mean(axis=1) - low) / (high - low) * count
        keys = np.clip(np.floor(at), 0, count - 1).astype(np.int64)
        return _divided(
            pieces,
            keys,
            lambda key: low + (key + 0.5) * (high - low) / count,
            lambda _key, mine: divided(mine, level + 1),
        )

    return _Cell((low + high) / 2, pieces, divided(pieces, 1))


# Wheels


def _is_drum(mesh: Mesh) -> bool:
    around = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])
    return bool(around.min() > 0 and around.max() <= _DRUM_ROUNDNESS * around.min() and len(around) >= 16)


def _drum(mesh: Mesh, slabs: int = 4, sectors: int = 12) -> _Cell:
    """One ball, balls on the axle that each cover a slab, and in each slab sectors of an outer ring and the middle."""
    pieces = _corners(mesh)
    low, high = mesh.vertices[:, 1].min(), mesh.vertices[:, 1].max()
    radius, middle = float(np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2]).max()), (low + high) / 2
    inner, width = 0.55 * radius, high - low
    for offset in np.linspace(low, high, slabs + 1)[1:-1]:
        pieces = cut(pieces, np.array([0.0, 1.0, 0.0]), offset)
    for i in range(sectors):
        angle = 2 * np.pi * i / sectors
        pieces = cut(pieces, np.array([-np.sin(angle), 0.0, np.cos(angle)]), 0.0)
        half = angle + np.pi / sectors
        pieces = cut(pieces, np.array([np.cos(half), 0.0, np.sin(half)]), inner)

    def slab(pieces: Array) -> NDArray[np.int64]:
        return np.clip(np.floor((pieces.mean(axis=1)[:, 1] - low) / width * slabs), 0, slabs - 1).astype(np.int64)

    def sector(pieces: Array) -> NDArray[np.int64]:
        x, _, z = pieces.mean(axis=1).T
        return np.floor(np.arctan2(z, x) % (2 * np.pi) * sectors / (2 * np.pi)).astype(np.int64) % sectors

    def on_axle(key: Array) -> Array:
        return np.array([0.0, low + (key[0] + 0.5) * width / slabs, 0.0])

    def small(key: Array, mine: Array) -> list[_Cell]:
        x, _, z = mine.mean(axis=1).T
        angle = (sector(mine) + 0.5) * 2 * np.pi / sectors
        ring = (x * np.cos(angle) + z * np.sin(angle) > inner).astype(np.int64)

        def center(which: Array) -> Array:
            angle = (which[0] + 0.5) * 2 * np.pi / sectors
            out = (0.55 if which[1] else 0.25) * radius
            y = on_axle(key)[1] if which[1] else middle
            return np.array([out * np.cos(angle), y, out * np.sin(angle)])

        return _divided(mine, np.column_stack([sector(mine), ring]), center, lambda _k, _p: [])

    return _Cell(np.array([0.0, middle, 0.0]), pieces, _divided(pieces, slab(pieces)[:, None], on_axle, small))
