"""Colours of the map layers, for the scene, the pictures and the legend alike.

Footing has the colours of FootFall: green, orange, red. They are hard to tell apart for some, so each
also has a mark in the legend, and they differ in lightness. Unknown ground has a grey-blue of its own in
every layer, ground out of the leg's range a neutral grey. The ramp for amounts is viridis (S. van der
Walt, N. Smith, 2015, CC0), the diverging one for margins purple to green (C. Brewer, ColorBrewer).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import NotFound
from footfall.maps.layers import (
    LAYERS,
    NO_SOLUTION,
    OUT_OF_RANGE,
    REACHABLE_STABLE,
    REACHABLE_UNSTABLE,
    UNKNOWN,
    MapSettings,
    MapStack,
)

Rgb = tuple[int, int, int]

UNKNOWN_RGB: Rgb = (134, 150, 178)
OUT_OF_RANGE_RGB: Rgb = (116, 112, 108)
NO_SOLUTION_RGB: Rgb = (190, 38, 45)

FOOTING: dict[int, tuple[str, Rgb]] = {
    REACHABLE_STABLE: ("● reachable and stable", (64, 176, 84)),
    REACHABLE_UNSTABLE: ("▲ reachable, not stable", (250, 160, 30)),
    NO_SOLUTION: ("✕ no solution", NO_SOLUTION_RGB),
    OUT_OF_RANGE: ("· out of the leg's range", OUT_OF_RANGE_RGB),
    UNKNOWN: ("? unknown ground", UNKNOWN_RGB),
}
"""Class of the layer "footing" → text with its mark, colour."""

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

_OF_LEG = ("solutions", "margin")
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
        "solutions": (0.0, 4.0),
        "margin": (-1.0, 1.0),
    }[layer]
    return Scale(low, high, PURPLE_GREEN if layer == "margin" else VIRIDIS, LAYERS[layer][0])


def _oldest(stack: MapStack) -> float:
    """Largest age in the stack [s], at least a minute."""
    ages = stack.layers.get("age")
    known = ages[np.isfinite(ages)] if ages is not None else np.zeros(0)
    return max(60.0, float(known.max())) if len(known) else 60.0


def layer_rgb(stack: MapStack, layer: str) -> NDArray[np.uint8]:
    """Colours of a layer, (rows, cols, 3) uint8, row 0 south. Raises NotFound for a layer the stack lacks."""
    numbers = _layer(stack, layer)
    if layer == "footing":
        table = np.zeros((256, 3), np.uint8)
        for footing, (_, rgb) in FOOTING.items():
            table[footing] = rgb
        return table[numbers]
    known = ~np.isnan(numbers)
    rgb = _along(scale(stack, layer), np.where(known, numbers, 0.0))
    rgb[~known] = UNKNOWN_RGB
    if layer in _OF_LEG:
        footing = stack.layers["footing"]
        rgb[footing == OUT_OF_RANGE] = OUT_OF_RANGE_RGB
        rgb[footing == NO_SOLUTION] = NO_SOLUTION_RGB
    return rgb


def layer_legend(stack: MapStack, layer: str) -> list[tuple[str, Rgb]]:
    """Texts with units or marks, and their colours, from first to last line of a legend."""
    _layer(stack, layer)
    if layer == "footing":
        return list(FOOTING.values())
    along = scale(stack, layer)
    stops = np.linspace(along.low, along.high, _STOPS)
    lines = [
        (_text(layer, float(stop), along), _rgb(color)) for stop, color in zip(stops, _along(along, stops), strict=True)
    ]
    if layer in _OF_LEG:
        lines += [FOOTING[NO_SOLUTION], FOOTING[OUT_OF_RANGE]]
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
        text = f"{text} ({np.degrees(number):.0f}°)"
    bounded = layer in ("goodness", "certainty")
    if number == along.high and not bounded:
        text += " and more"
    if number == along.low and layer == "margin":
        text += " and less"
    return text


def _rgb(color: NDArray[np.uint8]) -> Rgb:
    return int(color[0]), int(color[1]), int(color[2])
