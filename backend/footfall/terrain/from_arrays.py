"""A Dem from an array of heights, with the refusals that every reader and generator shares."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import MAX_CELLS, Dem

MAX_HEIGHT = 100_000.0
"""Heights beyond this [m] are no ground: mostly an undeclared "no value" number."""


NO_VALUE = (-9999.0, -32768.0, -32767.0, -99999.0, 32767.0, 65535.0)
"""Numbers that files hold where there is no height; each is no ground, whatever planet."""


_MEND = "let the file declare it as its no-data value, or make those cells NaN"


def check_no_value_numbers(heights: ArrayLike, name: str, mend: str = _MEND) -> None:
    """Refuse numbers that stand for "no value" where nothing declares them so: read as heights they are pits.

    Args:
        heights: (rows, cols) [m].
        name: what they are called.
        mend: what to do about it, for a person.

    Raises:
        InvalidTerrain: there are such numbers.
    """
    array = np.asarray(heights)
    for number in NO_VALUE:
        count = int(np.count_nonzero(array == number))
        if count:
            raise InvalidTerrain(
                f"{count} heights of {name} are {number:z.0f}, which stands for no value; {mend}",
                count=count,
            )


def check_lone_no_value(stored: ArrayLike, name: str) -> None:
    """Refuse such numbers among those that a file stores scaled, where nothing is near them.

    In the midst of the others they are heights: 32767 among 30000 … 35000 centimetres. Alone they are not: -9999 below
    40000 … 50000.
    """
    array = np.asarray(stored)
    others = array[np.isfinite(array) & ~np.isin(array, NO_VALUE)]
    spread = float(np.ptp(others)) if len(others) else 0.0
    for number in NO_VALUE:
        count = int(np.count_nonzero(array == number))
        if not count:
            continue
        gap = float(np.abs(others - number).min()) if len(others) else np.inf
        if gap > max(spread, 1.0):
            raise InvalidTerrain(
                f"{count} cells of {name} hold {number:z.0f} before scaling, {gap:.6g} from all others, which differ "
                f"by {spread:.6g}: it may stand for no value; let the file declare it as its no-data value, "
                "or declare another one, if these are heights",
                count=count,
            )


def check_fill(heights: ArrayLike, name: str) -> None:
    """Refuse one number in several cells that lies far below or above all others, such as 0 around 1500 … 1900 m.

    Programs that turn or join maps fill with 0 what they have no height for, where they know no number for that.

    Args:
        heights: (rows, cols) [m].
        name: what they are called.

    Raises:
        InvalidTerrain: there is such a number.
    """
    array = np.asarray(heights)
    known = array[np.isfinite(array)]
    for number in (known.min(), known.max()) if len(known) else ():
        count = int(np.count_nonzero(known == number))
        if not 2 <= count < len(known):
            continue
        others = known[known != number]
        low, high = float(others.min()), float(others.max())
        gap, spread = max(low - float(number), float(number) - high), high - low
        if gap > max(spread, _FARTHEST_FILL):
            raise InvalidTerrain(
                f"{count} cells of {name} are {number:z.6g} m, {gap:.6g} m from all others, which differ by "
                f"{spread:.6g} m: it stands for no value; {_MEND} (gdal_edit.py -a_nodata {number:z.6g} …)",
                count=count,
            )


def _check_no_radii(heights: Array, name: str) -> None:
    """Raise InvalidTerrain where all heights lie as far as the surface of a planet from its centre."""
    known = heights[np.isfinite(heights)]
    if len(known) and known.min() > MAX_HEIGHT and np.ptp(known) < MAX_HEIGHT:
        raise InvalidTerrain(
            f"all heights of {name} are {known.min():.5e} to {known.max():.5e} m: they seem to be radii, from the "
            "centre of a planet, or in another unit than metres; take the radius of a reference off, such as by "
            "gdal_edit.py -offset 0 … where the file adds it",
            least=float(known.min()),
            most=float(known.max()),
        )


_FARTHEST_FILL = 50.0
"""Walls [m] that are higher, between two levels with nothing between them, are none of a rover's ground."""


def check_cell_count(rows: float, cols: float) -> None:
    """Refuse a grid over the limit before its memory is asked for."""
    if not 0 < rows * cols <= MAX_CELLS:
        raise InvalidTerrain(
            f"{rows:z.0f} × {cols:z.0f} cells can't be a terrain: from 1 to {MAX_CELLS} cells are accepted; "
            "choose a coarser resolution or crop",
            rows=int(rows),
            cols=int(cols),
            limit=MAX_CELLS,
        )


def from_heights(
    heights: ArrayLike,
    resolution: float,
    x0: float = 0.0,
    y0: float = 0.0,
    name: str = "array",
    *,
    provenance: Provenance | None = None,
    texture: np.ndarray | None = None,
) -> Dem:
    """A terrain of heights in an array.

    Args:
        heights: (rows, cols) in site [m], row 0 south, NaN = unknown.
        resolution: side of the cells [m].
        x0: east, of the centre of cell (0, 0) in site [m].
        y0: north, of the centre of cell (0, 0) in site [m].
        name: what it is called.
        provenance: digests of what it is made of; None: of nothing.
        texture: (rows, cols) uint8, grey of each cell; None: none.

    Returns:
        The ground.

    Raises:
        InvalidTerrain: the array is not a map of real, finite or NaN, plausible heights.
    """
    array = np.asarray(heights)
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise InvalidTerrain(
            f"heights need a rows × cols array of real numbers, this is {array.dtype} {array.shape}",
            shape=list(array.shape),
        )
    check_cell_count(*array.shape)
    if array.dtype.kind != "f" or array.dtype.itemsize < 4:
        array = array.astype(np.float64)
    with np.errstate(invalid="ignore"):
        beyond = np.abs(array) > MAX_HEIGHT
    if beyond.any():
        _check_no_radii(array, name)
        raise InvalidTerrain(
            f"{int(beyond.sum())} heights lie beyond ±{MAX_HEIGHT:z.0f} m, such as {array[beyond][0]:g}; "
            "unknown cells must be NaN or the file's declared no-data value",
            count=int(beyond.sum()),
        )
    check_no_value_numbers(array, name)
    if not (np.isfinite([x0, y0, resolution]).all() and resolution > 0):
        raise InvalidTerrain(
            f"a terrain needs a positive resolution and a finite origin [m], not {resolution}, ({x0}, {y0})"
        )
    rows, cols = array.shape
    geometry = GridGeometry(float(x0), float(y0), float(resolution), rows, cols)
    if provenance is None:
        provenance = Provenance(parents={})
    return Dem(array.astype(np.float32), geometry, name, provenance, texture)
