"""What can be said about a footfall before planning: the ground there, and what the maps think of it."""

import math
from typing import Any

import numpy as np

from footfall.maps.layers import NO_SOLUTION, OUT_OF_RANGE, REACHABLE_STABLE, REACHABLE_UNSTABLE, UNKNOWN, MapStack
from footfall.terrain.dem import Dem
from footfall.terrain.surface import height_at, normal_at

FOOTING_NAMES = {
    UNKNOWN: "unknown",
    NO_SOLUTION: "no solution",
    REACHABLE_UNSTABLE: "reachable but unstable",
    REACHABLE_STABLE: "reachable and stable",
    OUT_OF_RANGE: "out of range",
}

_REASONS = {
    UNKNOWN: "the ground around the cell is not known well enough to judge it",
    NO_SOLUTION: "the leg has no joint solution that puts its wheel there",
    REACHABLE_UNSTABLE: "the leg can reach it, but the rover would not stand stably on it",
    OUT_OF_RANGE: "it is farther away than the leg is long",
}


def judge_footfall(
    dem: Dem, wheel_radius: float, leg: int, x: float, y: float, maps: MapStack | None, maps_current: bool
) -> dict[str, Any]:
    """Answer for a footfall of ``leg`` at x, y [m]: plain JSON, None for what is not known.

    acceptable: False where something speaks against it, None where nothing is known for or against;
    reasons: in words. margin [m] as in the maps.
    """
    reasons: list[str] = []
    z = float(height_at(dem, x, y))
    known = math.isfinite(z)
    normal = np.asarray(normal_at(dem, x, y, wheel_radius), float) + 0.0  # no −0.0
    has_normal = known and bool(np.isfinite(normal).all())
    acceptable: bool | None = None
    if not known:
        acceptable = False
        on_map = bool(dem.geometry.contains(x, y))
        reasons.append("the ground there is not known" if on_map else "the point is not on the terrain map")
    elif not has_normal:
        reasons.append("too little of the ground around the point is known to say how it slopes")

    footing, margin = None, None
    if maps is None:
        reasons.append(f"there are no maps for leg {leg} yet")
    elif not maps_current:
        reasons.append(f"the maps for leg {leg} were made from an older terrain or state")
    elif maps.geometry.contains(x, y):
        row, col = (int(i) for i in maps.geometry.cell(x, y))
        footing = int(maps.layers["footing"][row, col])
        found = float(maps.layers["margin"][row, col])
        margin = found if math.isfinite(found) else None
        if known:
            acceptable = footing == REACHABLE_STABLE
        if footing in _REASONS:
            text = _REASONS[footing]
            reasons.append(text if margin is None or acceptable else f"{text} ({maps.stability} margin {margin:.3f} m)")
    return {
        "leg": leg,
        "x": x,
        "y": y,
        "z": z if known else None,
        "known": known,
        "normal": normal.tolist() if has_normal else None,
        "slope": float(np.arccos(np.clip(normal[2], -1.0, 1.0))) if has_normal else None,
        "footing": None if footing is None else FOOTING_NAMES[footing],
        "margin": margin,
        "maps_current": maps is not None and maps_current,
        "acceptable": acceptable,
        "reasons": reasons,
    }
