"""Parts of the rover as glTF with physically based materials: colour, metal, roughness.

One link is one mesh with one material: what each part is made of is a texel of two pictures of one row, so that a link
is drawn at once, and viser can thin it with distance. The light that falls on it is the page's own and assumed.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.meshes.display import DARK, FOIL, MARK, METAL, PAINT, RUBBER, Part
from footfall.robot.meshes.shapes import merged
from footfall_ui.scene.glb import SHORT, Glb

Color = tuple[int, int, int]


class Paint(NamedTuple):
    """color: sRGB of the bare rover; share: its brightness where the link is coloured to be told apart.

    metal, rough: 0…1, as glTF has them.
    """

    color: Color
    share: float
    metal: float
    rough: float


PAINTS = {
    PAINT: Paint((232, 233, 230), 1.0, 0.0, 0.45),
    METAL: Paint((170, 174, 180), 0.8, 0.6, 0.4),
    DARK: Paint((64, 67, 74), 0.45, 0.5, 0.45),
    RUBBER: Paint((34, 34, 36), 0.3, 0.0, 0.95),
    FOIL: Paint((214, 164, 62), 0.9, 0.75, 0.35),
    MARK: Paint((250, 150, 30), 0.7, 0.0, 0.6),
}
CREASE = np.deg2rad(50.0)
"""Faces that meet at more are not smoothed into each other."""


def colors(tint: Color | None) -> NDArray[np.uint8]:
    """Of the materials, (n, 3); tint: the colour that tells a link apart, None: it is as it is."""
    if tint is None:
        return np.array([one.color for one in PAINTS.values()], np.uint8)
    return np.rint([one.share * np.array(tint) for one in PAINTS.values()]).astype(np.uint8)


def creased(mesh: Mesh) -> Mesh:
    """The same triangles; vertices at edges sharper than CREASE are there once for each side, as pages shade smoothly
    around every vertex.
    """
    triangles, count = mesh.triangles.astype(np.int64), len(mesh.triangles)
    corners = mesh.vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    owner = np.repeat(np.arange(count), 3)
    begin, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    edge = np.column_stack([np.minimum(begin, end), np.maximum(begin, end)])
    order = np.lexsort(edge.T)
    same = (edge[order[1:]] == edge[order[:-1]]).all(axis=1)
    one, other = order[:-1][same], order[1:][same]
    smooth = (normals[owner[one]] * normals[owner[other]]).sum(axis=1) > np.cos(CREASE)
    # two faces run along their common edge in opposite directions
    smooth &= begin[one] == end[other]
    one, other = one[smooth], other[smooth]
    after = 3 * owner + (np.arange(3 * count) + 1) % 3
    joined = np.column_stack([np.concatenate([one, after[one]]), np.concatenate([after[other], other])])
    graph = coo_array((np.ones(len(joined)), joined.T), shape=(3 * count, 3 * count))
    number, group = connected_components(graph, directed=False)
    first = np.zeros(number, np.int64)
    first[group] = begin
    return Mesh(mesh.vertices[first], group.reshape(-1, 3).astype(np.int32))


@lru_cache(maxsize=128)
def drawn_mesh(parts: tuple[Part, ...]) -> tuple[Mesh, NDArray[np.int64]]:
    """All parts of a link as one mesh, and the number of the material of each vertex."""
    meshes = [creased(part.mesh) for part in parts]
    numbers = [
        np.full(len(mesh.vertices), list(PAINTS).index(part.material)) for mesh, part in zip(meshes, parts, strict=True)
    ]
    return merged(meshes), np.concatenate(numbers)


def normals_of(mesh: Mesh) -> Array:
    """Of the vertices, (n, 3): each face counts as much as it is large."""
    corners = mesh.vertices[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.zeros_like(mesh.vertices)
    for i in range(3):
        np.add.at(found, mesh.triangles[:, i], faces)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def painted_glb(parts: Sequence[Part], tint: Color | None = None) -> bytes:
    """The parts of one link, in its frame."""
    mesh, number = drawn_mesh(tuple(parts))
    along = np.column_stack([(number + 0.5) / len(PAINTS), np.full(len(number), 0.5)])
    file = Glb()
    fits = np.uint16 if len(mesh.vertices) <= SHORT else np.uint32
    file.paint(
        {
            "attributes": {
                "POSITION": file.numbers(mesh.vertices.astype(np.float32)),
                "NORMAL": file.numbers(normals_of(mesh).astype(np.float32)),
                "TEXCOORD_0": file.numbers(along.astype(np.float32)),
            },
            "indices": file.numbers(mesh.triangles.ravel().astype(fits)),
        },
        colors(tint),
        np.array([(0, round(255 * one.rough), round(255 * one.metal)) for one in PAINTS.values()], np.uint8),
    )
    return file.encoded()
