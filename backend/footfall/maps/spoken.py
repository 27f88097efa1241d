"""Amounts as they are told to a person, in units of their size."""

import numpy as np


def spoken(amount: float, unit: str) -> str:
    """An amount for a person: degrees, mm, cm or m, percent, s, min or h."""
    if np.isnan(amount):
        return "unknown"
    size = abs(amount)
    if unit == "rad":
        return f"{np.degrees(amount):.3g}°"
    if unit == "m":
        scale, name = (1000, "mm") if size < 0.01 else (100, "cm") if size < 1 else (1, "m")
        return f"{scale * amount:.3g} {name}"
    if unit == "share":
        return f"{100 * amount:.3g} %"
    if unit == "s":
        scale, name = (1, "s") if size < 120 else (60, "min") if size < 7200 else (3600, "h")
        return f"{amount / scale:.3g} {name}"
    return f"{amount:.3g} {unit}".rstrip()
