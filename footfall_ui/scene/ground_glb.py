"""The ground as glTF of few bytes: 12 for a cell instead of 44, and the same triangles.

Where a cell is, and where on the picture, is its column and row; its height is a number of equal steps
(KHR_mesh_quantization, KHR_texture_transform). The triangles of a row are strips: two numbers for a cell, not six.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate
from footfall_ui.scene.glb import SHORT, Glb, unlit_glb

STRIP = 5
"""glTF's number for triangles of which each shares two corners with the one before."""
LONGEST = SHORT // 2
"""Cells of a row or column: the least that is drawn at once are two rows."""
COARSEST = 0.01
"""Longest step of heights beside the length of a cell; ground that is higher in all is sent as it is."""


def ground_glb(dem: Dem, picture: NDArray[np.uint8], cells: GridGeometry) -> bytes:
    """The terrain's triangulation with a picture of ``cells`` on it, (rows, cols, 3)."""
    grid = dem.geometry
    low = float(np.nanmin(dem.heights))
    step = max(float(np.nanmax(dem.heights)) - low, 1e-6) / SHORT
    if max(grid.shape) > LONGEST or step > COARSEST * grid.resolution:
        mesh = triangulate(dem)
        return unlit_glb(mesh, _share(mesh.vertices[:, 0], mesh.vertices[:, 1], cells), picture)
    steps = np.rint((np.nan_to_num(dem.heights, nan=low) - low) / step).astype(np.uint16)
    known, file, high = np.isfinite(dem.heights), Glb(), SHORT // grid.cols
    file.needs("KHR_mesh_quantization", "KHR_texture_transform")
    bands = [_band(file, known, steps, first, first + high) for first in range(0, grid.rows - 1, high - 1)]
    (begin,) = _share(np.array([grid.x0]), np.array([grid.y0]), cells)
    along = grid.resolution / cells.resolution / np.array([cells.cols, cells.rows])
    turned = {"offset": [begin[0], 1.0 - begin[1]], "scale": [along[0], -along[1]]}
    file.draw(
        [band for band in bands if band],
        picture,
        (grid.x0, grid.y0, low),
        (grid.resolution, grid.resolution, step),
        {"extensions": {"KHR_texture_transform": turned}},
    )
    return file.encoded()


def _share(x: Array, y: Array, cells: GridGeometry) -> Array:
    """Where places are on a picture of ``cells``, (n, 2), from its south-west corner, 0 to 1."""
    along = [((one - begin) / cells.resolution + 0.5) for one, begin in ((x, cells.x0), (y, cells.y0))]
    return np.column_stack([along[0] / cells.cols, along[1] / cells.rows])


def _band(
    file: Glb, known: NDArray[np.bool_], steps: NDArray[np.uint16], first: int, end: int
) -> dict[str, Any] | None:
    """The triangles between two rows; None where there are none.

    Vertices are column, row, height, and two bytes so that each begins at a multiple of four.
    """
    known, steps = known[first:end], steps[first:end]
    block = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    if not block.any():
        return None
    square = np.pad(block, 1)
    # a vertex is a corner of any of the four squares around it
    used = square[:-1, :-1] | square[:-1, 1:] | square[1:, :-1] | square[1:, 1:]
    row, col = np.nonzero(used)
    vertices = np.column_stack([col, row + first, steps[used], np.zeros_like(row)]).astype(np.uint16)
    view = file.view(vertices.tobytes(), stride=vertices.itemsize * vertices.shape[1])
    place = {"POSITION": file.numbers(vertices[:, :3], view), "TEXCOORD_0": file.numbers(vertices[:, :2], view)}
    number = np.cumsum(used).reshape(used.shape) - 1
    return {"attributes": place, "indices": file.numbers(_strip(block, number)), "mode": STRIP}


def _strip(block: NDArray[np.bool_], number: NDArray[np.int64]) -> NDArray[np.uint16]:
    """All squares as one strip: row after row, north and south corner by turns, from west to east.

    Each square is cut from south-west to north-east. From one run of squares to the next the last and the first corner
    are there twice: triangles without area, of an even count, so that all others keep facing up.
    """
    before, behind = np.pad(block, ((0, 0), (1, 0))), np.pad(block, ((0, 0), (0, 1)))
    row, col = np.nonzero(before | behind)
    pairs = np.column_stack([number[row + 1, col], number[row, col]])
    times = 1 + np.column_stack([~before[row, col], ~behind[row, col]])
    times[0, 0] = times[-1, 1] = 1
    return np.repeat(pairs.ravel(), times.ravel()).astype(np.uint16)
