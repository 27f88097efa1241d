"""What a mesh refuses, by name."""

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.mesh import Mesh

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
FACE = np.array([[0, 1, 2]], np.int32)


def spoiled(number):
    out = CORNERS.copy()
    out[1, 2] = number
    return out


def test_a_triangle_and_an_empty_mesh_are_meshes():
    assert Mesh(CORNERS, FACE).triangles.tolist() == [[0, 1, 2]]
    assert Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)).vertices.shape == (0, 3)
    assert Mesh(CORNERS.astype(np.float32), FACE).vertices.dtype == np.float64  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("vertices", "triangles", "text"),
    [
        (CORNERS[:, :2], FACE, "vertices"),
        (CORNERS.ravel(), FACE, "vertices"),
        (spoiled(np.nan), FACE, "vertices"),
        (spoiled(np.inf), FACE, "vertices"),
        (CORNERS.tolist(), FACE, "vertices"),
        (CORNERS, FACE.astype(np.int64), "int32"),
        (CORNERS, FACE.astype(float), "int32"),
        (CORNERS, FACE[0], "triangles"),
        (CORNERS, FACE[:, :2], "triangles"),
        (CORNERS, FACE + 1, "past the vertices"),
        (CORNERS, FACE - 1, "past the vertices"),
        (np.zeros((0, 3)), FACE, "past the vertices"),
        (CORNERS, None, "triangles"),
    ],
    ids=range(13),
)
def test_other_arrays_are_refused(vertices, triangles, text):
    with pytest.raises(InvalidInput, match=text):
        Mesh(vertices, triangles)
