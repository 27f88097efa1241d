"""What can be said about a footfall before planning: the ground there, and what the maps think of it."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.maps.binding import NOTHING, binding_text
from footfall.maps.layers import (
    COLLISION,
    NO_SOLUTION,
    NOT_LIFTED,
    OUT_OF_RANGE,
    REACHABLE_STABLE,
    REACHABLE_UNSTABLE,
    UNKNOWN,
    UNSURE,
    MapStack,
)
from footfall.maps.reach_classes import hindrance_text
from footfall.maps.refusals import REFUSALS
from footfall.session.answers.choices import Elsewhere, FootfallAnswer
from footfall.terrain.dem import Dem

FOOTING_NAMES = {
    UNKNOWN: "unknown",
    NO_SOLUTION: "no solution",
    REACHABLE_UNSTABLE: "reachable but unstable",
    REACHABLE_STABLE: "reachable and stable",
    OUT_OF_RANGE: "out of reach",
    COLLISION: "in collision",
    UNSURE: "reachable, not cleared",
    NOT_LIFTED: "leg can't be lifted",
}

_REASONS = {
    UNKNOWN: "the ground around the cell is not known well enough to judge it",
    NO_SOLUTION: "the leg has no joint solution that puts its wheel there",
    REACHABLE_UNSTABLE: "the leg can reach it, but the rover would not stand stably",
    OUT_OF_RANGE: "the leg is too short to get there",
    COLLISION: "the leg can reach it, but with its wheel upright would collide there or where it starts to lower it",
    NOT_LIFTED: "the leg can't be lifted from where it stands, wherever it would step",
    UNSURE: "joint angles exist; whether the leg can get there freely only a plan can tell",
}


def decisive(maps: MapStack) -> NDArray[np.generic]:
    """The footing that decides: with friction where that was computed, else the geometric one."""
    return maps.layers.get("footing_friction", maps.layers["footing"])


def _margins(maps: MapStack) -> tuple[str, str]:
    """Names of the margins that the footing asks for: the geometric one, and the one with friction."""
    suffix = "_conservative" if maps.stability == "conservative" else ""
    return "margin" + suffix, "margin_friction" + suffix


def _against(maps: MapStack, footing: int, row: int, col: int) -> tuple[str, str]:
    """What speaks against a cell, and what exactly, with its size; that is empty where nothing more is known."""
    if "refused_by" in maps.layers:  # a robot that others described
        text = REFUSALS[int(maps.layers["refused_by"][row, col])].text
        return text, maps.not_lifted if footing == NOT_LIFTED else ""
    return _REASONS[footing], _detail(maps, footing, row, col)


def _detail(maps: MapStack, footing: int, row: int, col: int) -> str:
    """What exactly speaks against a cell, with its size; empty where nothing more is known."""
    if footing == NOT_LIFTED:
        return maps.not_lifted
    if footing in (NO_SOLUTION, COLLISION):
        found = hindrance_text(int(maps.layers["hindrance"][row, col]))
        return "" if found == FOOTING_NAMES[footing] else found
    if footing != REACHABLE_UNSTABLE:
        return ""
    geometric, with_friction = _margins(maps)
    texts = {
        geometric: f"{maps.stability} margin {{:z.3f}} m",
        "margin_lifted": "margin while the leg is in the air {:z.3f} m",
        with_friction: "margin with friction {:z.3f} m",
        "torque_ratio": "{:z.2f} of a torque limit",
    }
    amounts = {text: float(maps.layers[name][row, col]) for name, text in texts.items() if name in maps.layers}
    said = [text.format(amount) for text, amount in amounts.items() if math.isfinite(amount)]
    for name in ("binding", "binding_lost"):
        code = int(maps.layers[name][row, col]) if name in maps.layers else NOTHING
        if code != NOTHING:
            said.append(f"binding: {binding_text(name, code)}")
    return ", ".join(said)


def nearest_good(maps: MapStack, x: float, y: float, count: int = 1) -> tuple[tuple[float, float], ...]:
    """Middles of the nearest cells that are reachable and stable, nearest first."""
    rows, cols = np.nonzero(decisive(maps) == REACHABLE_STABLE)
    xs, ys = maps.geometry.xs[cols], maps.geometry.ys[rows]
    best = np.argsort(np.hypot(xs - x, ys - y), kind="stable")[:count]
    return tuple((float(xs[i]), float(ys[i])) for i in best)


def without(maps: MapStack, changed: NDArray[np.bool_]) -> MapStack:
    """The maps with the footing unknown at some cells (rows, cols)."""
    footings = {name: maps.layers[name] for name in ("footing", "footing_friction") if name in maps.layers}
    unknown = {name: np.where(changed, np.uint8(UNKNOWN), layer) for name, layer in footings.items()}
    return replace(maps, layers={**maps.layers, **unknown})


def _nearest(maps: MapStack, x: float, y: float) -> Elsewhere | None:
    """The nearest cell that is reachable and stable, and how far away it is [m]."""
    return next(({"x": a, "y": b, "away": math.hypot(a - x, b - y)} for a, b in nearest_good(maps, x, y)), None)


def _elsewhere(nearest: Elsewhere | None) -> str:
    if nearest is None:
        return "no place on the leg's map is reachable and stable: try another leg, or a shift of the chassis"
    place = f"({nearest['x']:z.2f}, {nearest['y']:z.2f})"
    return f"the nearest place that is reachable and stable is {nearest['away']:z.2f} m away, at {place}"


def judge_footfall(
    dem: Dem, wheel_radius: float, leg: int, x: float, y: float, maps: MapStack | None, outdated: str = ""
) -> FootfallAnswer:
    """Answer for a footfall of ``leg`` at x, y [m]: plain JSON, None for what is not known.

    outdated: why the maps are not of how things are now, "" where they are. acceptable: False where something speaks
    against it, None where nothing is known for or against; reasons: in words. margin [m]: the one that decides, with
    friction where that was computed. nearest: where it is not acceptable, x, y of the nearest cell that is, and how far
    away it is [m]; None where the maps have none.
    """
    from footfall.terrain.ground.surface import height_at, normal_at

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

    footing, margin, nearest = None, None, None
    if maps is None:
        reasons.append(f"there are no maps for leg {leg} yet")
    elif outdated:
        reasons.append(f"the maps for leg {leg} are out of date: {outdated}")
    else:
        if maps.geometry.contains(x, y):
            row, col = (int(i) for i in maps.geometry.cell(x, y))
            footing = int(decisive(maps)[row, col])
            geometric, with_friction = _margins(maps)
            found = float(maps.layers.get(with_friction, maps.layers[geometric])[row, col])
            margin = found if math.isfinite(found) else None
            if known and footing != UNSURE:
                acceptable = footing == REACHABLE_STABLE
            if footing in _REASONS:
                text, detail = _against(maps, footing, row, col)
                reasons.append(f"{text} ({detail})" if detail else text)
        if not acceptable:
            nearest = _nearest(maps, x, y)
            reasons.append(_elsewhere(nearest))
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
        "maps_current": maps is not None and not outdated,
        "acceptable": acceptable,
        "reasons": reasons,
        "nearest": nearest,
    }
