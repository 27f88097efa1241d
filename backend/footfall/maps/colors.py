"""Colours of the map layers, for the scene, the pictures and the legend alike.

Footing has the colours of FootFall: green, orange, red. They are hard to tell apart for some, so each
also has a mark in the legend, and they differ in lightness. Unknown ground has a grey-blue of its own in
every layer, ground out of reach a neutral grey. The ramp for amounts is viridis (S. van der
Walt, N. Smith, 2015, CC0), the diverging one for margins purple to green (C. Brewer, ColorBrewer).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import NotFound
from footfall.maps import binding, reach_classes, refusals
from footfall.maps.layers import (
    ALL_LAYERS,
    BALANCE,
    COLLISION,
    FOOTFALL,
    LAYERS,
    LEG,
    NO_SOLUTION,
    NOT_LIFTED,
    OUT_OF_RANGE,
    REACHABLE_STABLE,
    REACHABLE_UNSTABLE,
    UNKNOWN,
    UNSURE,
    MapSettings,
    MapStack,
)

Rgb = tuple[int, int, int]

HATCH_RGB: Rgb = (255, 201, 77)
HATCH = 6
"""Cells from one stripe to the next where the ground has changed since."""
UNKNOWN_RGB: Rgb = (134, 150, 178)
BARE_RGB: Rgb = (176, 170, 160)
"""Level, open ground without a layer; no layer has a grey so warm."""
OUT_OF_RANGE_RGB: Rgb = (116, 112, 108)
NO_SOLUTION_RGB: Rgb = (190, 38, 45)

COLLISION_RGB: Rgb = (128, 26, 92)
UNSURE_RGB: Rgb = (226, 214, 150)
NOT_LIFTED_RGB: Rgb = (92, 84, 140)

FOOTING: dict[int, tuple[str, Rgb]] = {
    REACHABLE_STABLE: ("● reachable and stable", (64, 176, 84)),
    REACHABLE_UNSTABLE: ("▲ reachable, not stable", (250, 160, 30)),
    COLLISION: ("■ collides", COLLISION_RGB),
    NO_SOLUTION: ("✕ no solution", NO_SOLUTION_RGB),
    UNSURE: ("◌ reachable, not cleared: plan to find out", UNSURE_RGB),
    NOT_LIFTED: ("⊘ the leg can't be lifted from where it stands", NOT_LIFTED_RGB),
    OUT_OF_RANGE: ("· out of reach", OUT_OF_RANGE_RGB),
    UNKNOWN: ("? unknown ground", UNKNOWN_RGB),
}
"""Class of the layers "footing" and "footing_friction" → text with its mark, colour."""

REACH: dict[int, tuple[str, Rgb]] = {
    reach_classes.FREE: ("● free", (64, 176, 84)),
    reach_classes.FOOT_COLLISION: ("■ collides there", COLLISION_RGB),
    reach_classes.WAYPOINT_COLLISION: ("◪ collides above", (176, 92, 158)),
    reach_classes.NO_LIFT: ("⊤ can't be raised from there", (214, 120, 92)),
    reach_classes.JOINT_LIMIT: ("⟂ past a joint limit", (232, 96, 60)),
    reach_classes.NO_GEOMETRY: ("✕ no solution", NO_SOLUTION_RGB),
    reach_classes.UNSURE: ("◌ collisions not checked", UNSURE_RGB),
    reach_classes.NOT_LIFTED: ("⊘ the leg can't be lifted from where it stands", NOT_LIFTED_RGB),
    reach_classes.OUT_OF_RANGE: ("· out of reach", OUT_OF_RANGE_RGB),
    reach_classes.UNKNOWN: ("? unknown ground", UNKNOWN_RGB),
}
"""Class of the layer "reach_class" → text with its mark, colour."""

HUES: tuple[Rgb, ...] = (
    (31, 119, 180),
    (255, 127, 14),
    (148, 103, 189),
    (140, 86, 75),
    (227, 119, 194),
    (188, 189, 34),
    (23, 190, 207),
    (174, 199, 232),
    (255, 187, 120),
    (197, 176, 213),
    (196, 156, 148),
    (247, 182, 210),
    (219, 219, 141),
    (158, 218, 229),
    (99, 60, 20),
    (20, 60, 120),
    (255, 255, 255),
)
"""For classes without an order (after the categories of matplotlib's tab20, BSD-style licence)."""


def hindrance_colors(codes: Iterable[int]) -> dict[int, tuple[str, Rgb]]:
    """Class of the layer "hindrance" → text with its mark, colour, for the codes that occur."""
    fixed = {
        reach_classes.NO_HINDRANCE: ("●", (64, 176, 84)),
        reach_classes.NOT_PLACED: ("✕", NO_SOLUTION_RGB),
        reach_classes.BEYOND: ("·", OUT_OF_RANGE_RGB),
        reach_classes.UNSEEN: ("?", UNKNOWN_RGB),
    }
    table = {}
    for code in sorted(codes):
        mark, color = fixed.get(code, (f"{code}:", HUES[code % len(HUES)]))
        table[code] = (f"{mark} {reach_classes.hindrance_text(code)}", color)
    return table


REFUSED: dict[int, tuple[str, Rgb]] = {
    refusals.NOTHING: ("● a step leads there", (64, 176, 84)),
    refusals.GROUND: ("■ a body too near the ground", COLLISION_RGB),
    refusals.FOOT: ("◪ the foot in the ground", (176, 92, 158)),
    refusals.SELF: ("◫ two bodies too near", (206, 140, 196)),
    refusals.SUPPORT: ("▲ the weight leaves the feet", (250, 160, 30)),
    refusals.EFFORT: ("△ too much effort", (252, 200, 110)),
    refusals.LIMITS: ("⟂ past a joint limit", (232, 96, 60)),
    refusals.DISC: ("⦸ a disc leans", (214, 120, 92)),
    refusals.NOT_REACHED: ("✕ not reached", NO_SOLUTION_RGB),
    refusals.STEEP: ("╱ too steep", (150, 60, 40)),
    refusals.EDGE: ("∟ on an edge", (196, 156, 148)),
    refusals.ROUGH: ("≈ too rough", (219, 219, 141)),
    refusals.NOT_LIFTED: ("⊘ the leg can't be lifted from where it stands", NOT_LIFTED_RGB),
    refusals.NOT_PROVEN: ("◌ not proven", UNSURE_RGB),
    refusals.OUT_OF_RANGE: ("· out of reach", OUT_OF_RANGE_RGB),
    refusals.UNKNOWN: ("? unknown ground", UNKNOWN_RGB),
}
"""Class of the layer "refused_by" → text with its mark, colour."""

CLASSES = {"footing": FOOTING, "footing_friction": FOOTING, "reach_class": REACH, "refused_by": REFUSED}
BINDING_LAYERS = ("binding", "binding_lost")
CLASS_LAYERS = (*CLASSES, "hindrance", *BINDING_LAYERS)


def binding_colors(layer: str, codes: Iterable[int]) -> dict[int, tuple[str, Rgb]]:
    """Class of the layers "binding" and "binding_lost" → text with its mark, colour, for the codes that occur."""
    hues = iter(HUES * 4)
    table = {binding.NOTHING: (f"· {binding.binding_text(layer, binding.NOTHING)}", OUT_OF_RANGE_RGB)}
    for code in sorted(set(codes) - {binding.NOTHING}):
        table[code] = (f"{code}: {binding.binding_text(layer, code)}", next(hues))
    return table


VIRIDIS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    float,
)
PURPLE_GREEN = np.array([(118, 42, 131), (175, 141, 195), (247, 247, 247), (127, 191, 123), (27, 120, 55)], float)

_OF_LEG = tuple(name for name, info in LAYERS.items() if info.group in (LEG, BALANCE, FOOTFALL))
_SIGNED = tuple(name for name in LAYERS if name.startswith("margin"))
_STOPS = 5


@dataclass(frozen=True)
class Scale:
    """Numbers from low to high along a ramp; what lies beyond takes the colour of the end."""

    low: float
    high: float
    ramp: NDArray[np.float64]
    unit: str


def scale(stack: MapStack, layer: str) -> Scale:
    """The scale of a continuous layer; slope, roughness and step end where goodness reaches 0."""
    settings = stack.provenance.settings
    limits = settings if isinstance(settings, MapSettings) else MapSettings()
    low, high = {
        "slope": (0.0, limits.slope_limit),
        "roughness": (0.0, limits.roughness_limit),
        "step": (0.0, limits.step_limit),
        "goodness": (0.0, 1.0),
        "certainty": (0.0, 1.0),
        "age": (0.0, _oldest(stack)),
        "height_sd": (0.0, 0.05),
        "seat": (0.0, 0.1),
        "support": (0.0, 1.0),
        "solutions": (0.0, 4.0),
        "limit_margin": (0.0, 0.5),
        "manipulability": (0.0, 0.5),
        "tip_energy": (0.0, 4000.0),
        "torque_ratio": (0.0, 1.0),
        "quality": (0.0, 1.0),
    }.get(layer, (-1.0, 1.0))
    return Scale(low, high, PURPLE_GREEN if layer in _SIGNED else VIRIDIS, ALL_LAYERS[layer].unit)


def _oldest(stack: MapStack) -> float:
    """Largest age in the stack [s], at least a minute."""
    ages = stack.layers.get("age")
    known = ages[np.isfinite(ages)] if ages is not None else np.zeros(0)
    return max(60.0, float(known.max())) if len(known) else 60.0


def class_colors(stack: MapStack, layer: str) -> dict[int, tuple[str, Rgb]]:
    """Class → text with its mark, colour, of a layer of classes."""
    if layer == "hindrance":
        return hindrance_colors(int(code) for code in np.unique(_layer(stack, layer)))
    if layer in BINDING_LAYERS:
        return binding_colors(layer, (int(code) for code in np.unique(_layer(stack, layer))))
    return CLASSES[layer]


def layer_rgb(stack: MapStack, layer: str) -> NDArray[np.uint8]:
    """Colours of a layer, (rows, cols, 3) uint8, row 0 south. Raises NotFound for a layer the stack lacks."""
    numbers = _layer(stack, layer)
    if layer in CLASS_LAYERS:
        table = np.zeros((256, 3), np.uint8)
        for one, (_, rgb) in class_colors(stack, layer).items():
            table[one] = rgb
        return table[numbers]
    known = ~np.isnan(numbers)
    rgb = _along(scale(stack, layer), np.where(known, numbers, 0.0))
    rgb[~known] = UNKNOWN_RGB
    if layer in _OF_LEG:
        footing = stack.layers["footing"]
        rgb[footing == OUT_OF_RANGE] = OUT_OF_RANGE_RGB
        rgb[footing == NO_SOLUTION] = NO_SOLUTION_RGB
        rgb[(footing == COLLISION) & ~known] = COLLISION_RGB
    return rgb


def hatched(changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the changed cells, (rows, cols), are drawn as stripes: the others show what is below them."""
    rows, cols = changed.shape
    diagonals = np.add.outer(np.arange(rows), np.arange(cols))
    return changed & (diagonals % HATCH < HATCH // 2)


def layer_legend(stack: MapStack, layer: str) -> list[tuple[str, Rgb]]:
    """Texts with units or marks, and their colours, from first to last line of a legend."""
    _layer(stack, layer)
    if layer in CLASS_LAYERS:
        return list(class_colors(stack, layer).values())
    along = scale(stack, layer)
    stops = np.linspace(along.low, along.high, _STOPS)
    lines = [
        (_text(layer, float(stop), along), _rgb(color)) for stop, color in zip(stops, _along(along, stops), strict=True)
    ]
    if layer in _OF_LEG:
        lines += [FOOTING[COLLISION], FOOTING[NO_SOLUTION], FOOTING[OUT_OF_RANGE]]
    if layer != "certainty":
        lines.append(FOOTING[UNKNOWN])
    return lines


def _layer(stack: MapStack, layer: str) -> NDArray[Any]:
    if layer not in stack.layers:
        raise NotFound(f"there is no layer {layer!r}; the stack has {', '.join(stack.layers)}", layer=layer)
    return stack.layers[layer]


def _along(along: Scale, numbers: NDArray[np.floating]) -> NDArray[np.uint8]:
    position = np.clip((numbers - along.low) / (along.high - along.low), 0.0, 1.0)
    at = np.linspace(0.0, 1.0, len(along.ramp))
    channels = [np.interp(position, at, along.ramp[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def _text(layer: str, number: float, along: Scale) -> str:
    digits = ".0f" if layer == "age" else ".2g"
    text = f"{number:{digits}} {along.unit}".strip()
    if layer == "slope":
        text = f"{text} ({np.degrees(number):z.0f}°)"
    bounded = layer in ("goodness", "certainty", "support", "quality")
    if number == along.high and not bounded:
        text += " and more"
    if number == along.low and layer in _SIGNED:
        text += " and less"
    return text


def _rgb(color: NDArray[np.uint8]) -> Rgb:
    return int(color[0]), int(color[1]), int(color[2])
