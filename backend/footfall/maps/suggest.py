"""The best footfalls of a quality map, and why: in words, with numbers, units and limits."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.maps import layers as footing
from footfall.maps import reach_classes
from footfall.maps.binding import binding_text
from footfall.maps.layers import LAYERS
from footfall.maps.quality import (
    COLLISION,
    ELEVATION,
    LIMIT,
    POSTURE,
    RANGE,
    REFUSALS,
    UNKNOWN,
    UNSTABLE,
    UNSURE,
    Layers,
    Quality,
)
from footfall.maps.quality_settings import FACTORS, MOST, factor_of
from footfall.maps.set_apart import MEASURES, Apart, set_apart
from footfall.maps.spoken import spoken

GOOD = 0.8
"""A factor from here up is named as a good one."""

NOT_CLEARED = "not cleared: whether the leg collides here has not been found out"

_FOOTINGS: Mapping[int, str] = {
    footing.UNKNOWN: "unknown",
    footing.NO_SOLUTION: "no solution",
    footing.REACHABLE_UNSTABLE: "reachable but unstable",
    footing.REACHABLE_STABLE: "reachable and stable",
    footing.OUT_OF_RANGE: "out of reach",
    footing.COLLISION: "collision",
    footing.UNSURE: "unsure",
    footing.NOT_LIFTED: "leg can't be lifted",
}


@dataclass(frozen=True)
class Suggestion:
    """One footfall. row, col: its cell; x, y, z: the cell's centre in site [m], z None where the height is unknown.

    score: 0…1; factors: name → 0…1; amounts: name → what was measured, in the factor's unit, NaN = unknown;
    unknown: whether the ground there is unknown; reasons: for a person. apart: what sets it apart from the others that
    are suggested; None where nothing does.
    """

    row: int
    col: int
    x: float
    y: float
    z: float | None
    score: float
    factors: Mapping[str, float]
    amounts: Mapping[str, float]
    unknown: bool
    reasons: tuple[str, ...]
    apart: Apart | None = None


@dataclass(frozen=True)
class Suggestions:
    """What is suggested, and why nothing more is.

    footfalls: best first, maybe none. refused: what refuses → number of cells. left_out: factor → why it does not
    count. reason: why there are none, fewer than asked for, or some nearer to each other, and what to try; else "".
    """

    footfalls: tuple[Suggestion, ...]
    refused: Mapping[str, int]
    left_out: Mapping[str, str]
    reason: str


@dataclass(frozen=True)
class Explanation:
    """What speaks for one cell, and what against it.

    lines: one for each layer and factor, "name amount (limit …)"; verdict: whether it may be stood on and what decides;
    score 0…1, 0 where refused; refused: 0 or a key of ``quality.REFUSALS``.
    """

    row: int
    col: int
    x: float
    y: float
    score: float
    refused: int
    verdict: str
    lines: tuple[str, ...]


def suggest(found: Quality, count: int = 5, separation: float = 0.3, strictly: bool = True) -> Suggestions:
    """The best footfalls that lie far enough apart, best first.

    Greedy: the best cell, then the best that is far enough from those before; of equal ones the first by row, then
    column.

    Args:
        found: quality of a stack.
        count: how many, 1…MOST.
        separation: least distance between two [m].
        strictly: whether there are fewer where no other is far enough; else the rest are those that lie farthest from
            all before.

    Returns:
        The footfalls, and why there are none or fewer.

    Raises:
        InvalidInput: the count is out of range, or the separation negative.
    """
    if not (isinstance(count, int) and 1 <= count <= MOST):
        raise InvalidInput(f"between 1 and {MOST} footfalls can be suggested", count=count)
    if not 0 <= separation < np.inf:
        raise InvalidInput("the separation can't be negative [m]", separation=separation)
    cells = _best_apart(found.score, separation / found.geometry.resolution, count)
    far_enough = len(cells)
    if cells and not strictly:
        cells = _filled(found.score, cells, count)
    numbers = np.bincount(found.refused.ravel(), minlength=len(REFUSALS) + 1)
    reason = ""
    if not cells:
        reason = _nothing(found, numbers)
    elif len(cells) > far_enough:
        reason = f"only {far_enough} lie {spoken(separation, 'm')} or more from each other; the others are nearer"
    elif len(cells) < count:
        reason = (
            f"{len(cells)} of {count}: each of the {int(numbers[0])} acceptable cells lies within "
            f"{spoken(separation, 'm')} of one of these; try a smaller separation"
        )
    return Suggestions(
        footfalls=_suggestions(found, cells),
        refused={what: int(numbers[code]) for code, (what, _) in REFUSALS.items() if numbers[code]},
        left_out=found.left_out,
        reason=reason,
    )


def explain(found: Quality, row: int, col: int) -> Explanation:
    """What every layer says of one cell, and what decides. Raises InvalidInput for a cell outside the grid."""
    geometry, layers = found.geometry, found.layers
    if not (0 <= row < geometry.rows and 0 <= col < geometry.cols):
        raise InvalidInput(f"cell ({row}, {col}) lies outside the grid {geometry.shape}", row=row, col=col)
    factors, amounts = _at(found, row, col)
    lines = [f"{_factor_text(found, name, amounts[name])}, {factors[name]:z.2f} of 1" for name in factors]
    lines += [f"{_name(name)} {_layer_text(name, layers[name][row, col])}" for name in layers if name not in factors]
    lines += [f"{_name(name)} does not count: {why}" for name, why in found.left_out.items()]
    code, score = int(found.refused[row, col]), float(found.score[row, col])
    if code:
        what, remedy = REFUSALS[code]
        verdict = f"refused, {what}{_binding(found, row, col)}; {remedy}"
    else:
        verdict = f"acceptable, score {score:z.2f}; {_weakest(found, factors, amounts)}"
        verdict += f"; {NOT_CLEARED}" if _is_unsure(found, row, col) else ""
    x, y = float(geometry.xs[col]), float(geometry.ys[row])
    return Explanation(row, col, x, y, score, code, verdict, tuple(lines))


def _best_apart(score: NDArray[np.float64], apart: float, count: int) -> list[tuple[int, int]]:
    """Cells by falling score, none nearer than ``apart`` cells to one before; only scores above 0."""
    left = score.copy()
    rows, cols = score.shape
    reach = int(np.ceil(apart))
    chosen: list[tuple[int, int]] = []
    while len(chosen) < count:
        row, col = divmod(int(np.argmax(left)), cols)  # the first of equal ones
        if left[row, col] <= 0:
            break
        chosen.append((row, col))
        near_rows = np.arange(max(row - reach, 0), min(row + reach + 1, rows))
        near_cols = np.arange(max(col - reach, 0), min(col + reach + 1, cols))
        # a distance of just the separation is enough, however the division rounded
        too_near = np.hypot(near_rows[:, None] - row, near_cols - col) < apart * (1 - 1e-9)
        left[near_rows[0] : near_rows[-1] + 1, near_cols[0] : near_cols[-1] + 1][too_near] = 0
        left[row, col] = 0
    return chosen


def _filled(score: NDArray[np.float64], chosen: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """Those cells, and up to ``count`` each that lies farthest from all before, the best of equal ones; best first."""
    cells = np.argwhere(score > 0)
    scores = score[score > 0]
    away = np.min([np.hypot(*(cells - one).T) for one in chosen], axis=0)
    filled = list(chosen)
    while len(filled) < count and away.max() > 0:
        at = np.lexsort((-scores, -away))[0]
        filled.append((int(cells[at, 0]), int(cells[at, 1])))
        away = np.minimum(away, np.hypot(*(cells - cells[at]).T))
    return sorted(filled, key=lambda cell: (-score[cell], *cell))


def _suggestions(found: Quality, cells: list[tuple[int, int]]) -> tuple[Suggestion, ...]:
    judged = _at_each(found, cells)
    apart = set_apart([_measured(found, cell, amounts) for cell, (_, amounts) in zip(cells, judged, strict=True)])
    return tuple(
        _suggestion(found, row, col, *at, one) for (row, col), at, one in zip(cells, judged, apart, strict=True)
    )


def _measured(found: Quality, cell: tuple[int, int], amounts: Mapping[str, float]) -> dict[str, float]:
    """What of ``MEASURES`` is known of a cell, whether or not it counts."""
    (row, col), (x, y, _) = cell, found.situation.foot
    layers = {name: float(found.layers[name][row, col]) for name in MEASURES if name in found.layers}
    away = float(np.hypot(found.geometry.xs[col] - x, found.geometry.ys[row] - y))
    return {**layers, **amounts, "away": away}


def _at(found: Quality, row: int, col: int) -> tuple[dict[str, float], dict[str, float]]:
    """Counted factors at one cell: name → 0…1, and name → amount."""
    (at,) = _at_each(found, [(row, col)])
    return at


def _at_each(found: Quality, cells: list[tuple[int, int]]) -> list[tuple[dict[str, float], dict[str, float]]]:
    """As :func:`_at`, for each of many cells."""
    amounts = found.amounts(np.array([row * found.geometry.cols + col for row, col in cells], np.int64))
    factors = {name: factor_of(name, amount, found.settings).tolist() for name, amount in amounts.items()}
    listed = {name: amount.tolist() for name, amount in amounts.items()}
    return [
        ({name: factors[name][i] for name in factors}, {name: listed[name][i] for name in listed})
        for i in range(len(cells))
    ]


def _suggestion(
    found: Quality, row: int, col: int, factors: dict[str, float], amounts: dict[str, float], apart: Apart | None
) -> Suggestion:
    unknown = bool(found.unknown[row, col])
    reasons = []
    if unknown:
        reasons.append(f"unknown ground, not known: {', '.join(_not_known(found, amounts, row, col))}")
    if _is_unsure(found, row, col):
        reasons.append(NOT_CLEARED)
    good = [_factor_text(found, name, amounts[name]) for name in factors if factors[name] >= GOOD]
    if good:
        reasons.append("good: " + ", ".join(good))
    reasons.append(_weakest(found, factors, amounts))
    height = float(found.layers["height"][row, col])
    return Suggestion(
        row=row,
        col=col,
        x=float(found.geometry.xs[col]),
        y=float(found.geometry.ys[row]),
        z=None if np.isnan(height) else height,
        score=float(found.score[row, col]),
        factors=factors,
        amounts=amounts,
        unknown=unknown,
        reasons=tuple(reasons),
        apart=apart,
    )


def _nothing(found: Quality, numbers: NDArray[np.int64]) -> str:
    """Why no cell is left: what refuses how many, and the remedy for those that came farthest through the checks."""
    parts = [f"{numbers[code]} are {what}" for code, (what, _) in REFUSALS.items() if numbers[code]]
    farthest = max(code for code in REFUSALS if numbers[code])
    text = f"no footfall: of {found.refused.size} cells {', '.join(parts)}"
    if farthest == LIMIT:
        amounts = found.amounts(np.flatnonzero(found.refused == LIMIT))
        beyond = {name: int((factor_of(name, amount, found.settings) == 0).sum()) for name, amount in amounts.items()}
        text += " (" + ", ".join(f"{_name(name)}: {number}" for name, number in beyond.items() if number) + ")"
    return f"{text}; try: {REFUSALS[farthest][1]}"


def _weakest(found: Quality, factors: Mapping[str, float], amounts: Mapping[str, float]) -> str:
    """The factor that lowers the score most, its weight considered."""
    loss = {name: -found.settings.weights[name] * float(np.log(factors[name])) for name in factors}
    name = max(loss, key=lambda one: loss[one])
    if loss[name] <= 0:
        return "nothing speaks against it"
    return f"weakest: {_factor_text(found, name, amounts[name])}"


def _factor_text(found: Quality, name: str, amount: float) -> str:
    """A factor for a person, as in "slope 4° (limit 25°)"."""
    worst, best = found.settings.ramps[name]
    unit = FACTORS[name].unit
    if FACTORS[name].limit:
        bound = f"{'least' if best > worst else 'limit'} {spoken(worst, unit)}"
    else:
        bound = f"best {'from' if best > worst else 'up to'} {spoken(best, unit)}"
    return f"{_name(name)} {spoken(amount, unit)} ({bound})"


def _layer_text(name: str, amount: np.generic) -> str:
    """What a layer that is no counted factor says at a cell."""
    if name in ("footing", "footing_friction"):
        return _FOOTINGS[int(amount)]
    if name == "reach_class":
        return reach_classes.CLASSES[int(amount)][0]
    if name == "hindrance":
        return reach_classes.hindrance_text(int(amount))
    if name.startswith("binding"):
        return binding_text(name, int(amount))
    unit = FACTORS[name].unit if name in FACTORS else "m" if name == "height" else LAYERS.get(name, ("", ""))[0]
    return spoken(float(amount), unit)


def _not_known(found: Quality, amounts: Mapping[str, float], row: int, col: int) -> list[str]:
    """Names of what is not known at a cell of unknown ground."""
    names = [] if np.isfinite(found.layers["height"][row, col]) else ["height"]
    if _has_class(found, row, col, reach_class=reach_classes.UNKNOWN, footing=footing.UNKNOWN):
        names.append("reach")
    return names + [_name(name) for name in amounts if FACTORS[name].limit and np.isnan(amounts[name])]


def _is_unsure(found: Quality, row: int, col: int) -> bool:
    return _has_class(found, row, col, reach_class=reach_classes.UNSURE, footing=footing.UNSURE)


def _has_class(found: Quality, row: int, col: int, **codes: int) -> bool:
    """Whether any of the layers named is given and has its code at the cell."""
    return any(name in found.layers and found.layers[name][row, col] == code for name, code in codes.items())


def _binding(found: Quality, row: int, col: int) -> str:
    """What exactly refuses a cell, to follow the refusal's name."""
    code = int(found.refused[row, col])
    factors, amounts = _at(found, row, col)
    if code == LIMIT:
        return ": " + ", ".join(_factor_text(found, name, amounts[name]) for name in factors if factors[name] == 0)
    if code == UNKNOWN:
        return ": " + ", ".join(_not_known(found, amounts, row, col))
    layers, (x, y, z) = found.layers, found.situation.hip
    over = float(layers["height"][row, col]) - z
    if code == ELEVATION:
        lowest, highest = spoken(found.settings.lowest, "m"), spoken(found.settings.highest, "m")
        return f": {spoken(over, 'm')} over the hip (allowed {lowest} to {highest})"
    if code == RANGE:
        away = np.linalg.norm([found.geometry.xs[col] - x, found.geometry.ys[row] - y, np.nan_to_num(over)])
        return f": {spoken(float(away), 'm')} from the hip (limit {spoken(found.situation.length, 'm')})"
    if code == UNSTABLE:
        return _unsteady(layers, row, col)
    if code in (POSTURE, COLLISION, UNSURE) and "reach_class" in layers:
        hindered = ""
        if "hindrance" in layers:
            hindered = f" ({reach_classes.hindrance_text(int(layers['hindrance'][row, col]))})"
        return f": {reach_classes.CLASSES[int(layers['reach_class'][row, col])][1]}{hindered}"
    return ""


def _unsteady(layers: Layers, row: int, col: int) -> str:
    """The margin that a cell that is not stable has least of, and the torque where that is what refuses."""
    words = {"margin": "stability margin", "margin_lifted": "margin while the leg is in the air"}
    margins = {said: float(layers[name][row, col]) for name, said in words.items() if name in layers}
    least = min(margins, key=lambda said: margins[said], default="")
    torque = float(layers["torque_ratio"][row, col]) if "torque_ratio" in layers else 0.0
    beyond = 1.0 < torque < np.inf
    said = [f"{least} {spoken(margins[least], 'm')}"] if least and not (beyond and margins[least] >= 0) else []
    said += [f"{torque:z.2f} of a torque limit"] if beyond else []
    return f": {', '.join(said)}" if said else ""


def _name(name: str) -> str:
    return name.replace("_", " ")
