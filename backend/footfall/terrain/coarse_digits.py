"""Coordinates that were written with too few digits, so that neighbouring points fall onto one place."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain

_MOST_SHARED = 0.01
"""A share of points that lie exactly over others where no digits are lost: edges of tiles, a wall here and there."""
_FAR = (1e4, 1e6)
"""So many steps from the origin six digits may have run out; nearer a mesh is built in such steps."""
_FINEST = 1e-3
_ENOUGH = 1000
"""Points that are looked at first."""
_FEWEST = 50
"""Points that tell; of fewer it may be chance."""
_NEAREST_OF_32 = 2.0**16
"""Nearer numbers of 32 bits are in steps of less than 8 mm, which text with three decimals doesn't show."""
_PRINTED = 5.1e-4
_FINEST_OF_MAPS = 1.0 / 16.0
_MIXED = 0.2
"""Half of the numbers are odd multiples, of a map all or none."""


def require_fine_digits(points: Array, name: str, cell: float | None, unit: float = 1.0, corners: bool = False) -> None:
    """Check that the digits of coordinates tell neighbouring points apart.

    They don't where all x or all y are multiples of a power of ten above the cells, and points lie exactly over others
    of another height: six digits (``%g``) put 4123463.2 to 4123460.

    Args:
        points: (n, 3) [m], z up.
        name: of their file.
        cell: side of the cells [m]; None: of a mesh, whose cells follow its corners.
        unit: in which the file has them [m].
        corners: whether they are of a mesh, whose walls stand over each other: then far from the origin alone.

    Raises:
        InvalidTerrain: they don't; names the step and what to do.
    """
    least = _FINEST if cell is None else cell / unit
    steps = [_step(points[:, axis] / unit, least, corners) for axis in (0, 1)]
    step = max(steps)
    shared = _shared(points) if step else 0.0
    if shared <= _MOST_SHARED:
        return
    axis = steps.index(step)
    far = float(np.abs(points[:, axis]).max()) / unit
    instead = f", or take cells of {step * unit:g} m (--resolution)" if cell is not None else ""
    raise InvalidTerrain(
        f"{name} has all {'xy'[axis]} in steps of {step:g} at {far:z.0f} from the origin, and {shared:.0%} of "
        "its points lie exactly over others: they were written with too few digits; export them with more (%.9g), or "
        f"about an origin near the ground{instead}",
        step=step * unit,
    )


def of_32_bits(points: Array) -> bool:
    """Whether numbers of 32 bits seem to have held coordinates that are written with more digits, as text or doubles.

    They are multiples of a power of two that is greater farther from the origin: 1/32 at 500 km, 1/2 at 5 000 km. In
    text they are so to half a millimetre. Maps in round steps are so too, but none has both odd and even multiples of
    a sixteenth or less.

    Args:
        points: (n, 3) as their file has them.

    Returns:
        False for few points, and near the origin, where such numbers have digits enough.
    """
    far = [numbers[np.abs(numbers) >= _NEAREST_OF_32] for numbers in points[:, :2].T]
    return len(points) >= _FEWEST and all(map(_are_of_32, far)) and any(map(_are_odd_and_even, far))


def _are_of_32(numbers: Array) -> bool:
    return all(
        bool((np.abs(part - part.astype(np.float32)) <= _PRINTED).all()) for part in (numbers[:_ENOUGH], numbers)
    )


def _are_odd_and_even(numbers: Array) -> bool:
    """Of their steps, as far as these are fine."""
    steps = np.spacing(np.abs(numbers).astype(np.float32)).astype(np.float64)
    odd = np.rint(numbers / steps)[steps <= _FINEST_OF_MAPS] % 2.0 == 1.0
    return len(odd) > 0 and _MIXED < float(odd.mean()) < 1.0 - _MIXED


def _step(numbers: Array, least: float, corners: bool) -> float:
    """The largest power of ten above ``least`` that they all are multiples of; 0 where there is none."""
    far = float(np.abs(numbers).max())
    step, power = 0.0, 10.0 ** np.ceil(np.log10(least * (1.0 + 1e-9)))
    while power <= far and _multiples(numbers[:_ENOUGH], power) and _multiples(numbers, power):
        step, power = float(power), power * 10.0
    return 0.0 if corners and not _FAR[0] * step <= far < _FAR[1] * step else step


def _multiples(numbers: Array, power: float) -> bool:
    counts = numbers / power
    return bool((np.abs(counts - np.rint(counts)) < 1e-6).all())


def _shared(points: Array) -> float:
    """The share of points that lie exactly over another one of another height."""
    x, y, z = points[np.lexsort(points.T[::-1])].T
    over = (np.diff(x) == 0.0) & (np.diff(y) == 0.0) & (np.diff(z) != 0.0)
    return float(over.mean()) if len(over) else 0.0
