"""Whether a place lies on a map, and what the map spans, in words: for refusals."""

from footfall.core.grid import GridGeometry


def outside(grid: GridGeometry, x: float, y: float) -> float:
    """How far a place lies off the map.

    Args:
        grid: of the map.
        x: east, in site [m].
        y: north, in site [m].

    Returns:
        Along x or y, whichever is more [m]; at most 0 on the map, NaN for NaN.
    """
    west, south, east, north = grid.bounds
    return max(west - x, x - east, south - y, y - north)


def spans(grid: GridGeometry) -> str:
    """What the map spans, as a clause of a sentence."""
    west, south, east, north = grid.bounds
    return f"the map spans x {west:z.2f}…{east:z.2f} m, y {south:z.2f}…{north:z.2f} m"
