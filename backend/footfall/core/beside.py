"""Sizes in words: a measured one beside the limit that it is on the wrong side of, and a rough one."""

import math


def beside(measured: float, limit: float, digits: int = 3) -> tuple[str, str]:
    """Two amounts with so many decimals, rounded apart where both would read the same.

    "0.020 m, 0.020 m is needed" tells an operator nothing: of 0.0198 m beside 0.020 m it says 0.019.

    Args:
        measured: what there is, in any unit; rounded away from the limit where that is needed.
        limit: what it is compared with, in the same unit.
        digits: decimals.

    Returns:
        Both as texts; what is not finite has no size: "–".
    """
    if not math.isfinite(measured):
        return "–", f"{limit:z.{digits}f}"
    unit = 10.0**-digits
    shown, bound = round(measured / unit), round(limit / unit)
    if measured > limit:
        shown = max(shown, bound + 1)
    elif measured < limit:
        shown = min(shown, bound - 1)
    return f"{shown * unit:z.{digits}f}", f"{bound * unit:z.{digits}f}"


def roughly(size: float, digits: int = 2) -> str:
    """A size in so many digits, all those before the point, never as a power of ten: 0.5, 26, 902."""
    return f"{size:z.0f}" if size >= 10.0**digits - 0.5 else f"{max(size, 0.001):.{digits}g}"
