"""Numbers that must be above zero or not negative, refused in the same words wherever they come from."""

import math

from footfall.core.errors import InvalidInput


def require_above_zero(unit: str = "", error: type[InvalidInput] = InvalidInput, /, **numbers: float) -> None:
    """Raises ``error`` naming the first of ``numbers`` (in ``unit``) that is not finite or not above zero."""
    for name, number in numbers.items():
        if not 0 < number < math.inf:
            raise error(_said(f"{name} must be above zero{_finite(number)}", unit), **{name: number})


def require_not_negative(unit: str = "", error: type[InvalidInput] = InvalidInput, /, **numbers: float) -> None:
    """Raises ``error`` naming the first of ``numbers`` (in ``unit``) that is not finite or negative."""
    for name, number in numbers.items():
        if not 0 <= number < math.inf:
            raise error(_said(f"{name} can't be negative{_finite(number)}", unit), **{name: number})


def require_distances(**distances: float) -> None:
    """Raises InvalidInput naming the first of ``distances`` [m] that is not finite or negative."""
    for name, distance in distances.items():
        if not 0 <= distance < math.inf:
            raise InvalidInput(f"{name} must be finite and not negative [m]", **{name: distance})


def _finite(number: float) -> str:
    return "" if math.isfinite(number) else f", and must be finite, not {number}"


def _said(text: str, unit: str) -> str:
    return f"{text} [{unit}]" if unit else text
