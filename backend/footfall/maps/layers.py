"""The stack of map layers for one leg, and the names and meanings of its layers."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance, Value, value

# Classes of the layer "footing" (FootFall paper: green, orange, red; unknown is its own colour).
UNKNOWN, NO_SOLUTION, REACHABLE_UNSTABLE, REACHABLE_STABLE, OUT_OF_RANGE = 0, 1, 2, 3, 4

LAYERS: Mapping[str, tuple[str, str]] = {
    "slope": ("rad", "tilt of the plane fitted in a wheel-sized window"),
    "roughness": ("m", "RMS distance of the cells from that plane"),
    "step": ("m", "largest height difference in the window after removing the plane"),
    "goodness": ("", "traversability 0…1 from slope, roughness and step, 1 = easy (Morphin)"),
    "certainty": ("", "share of the window's cells that are known, 0…1"),
    "age": ("s", "time between the cell's newest measurement and the newest of all; unknown for loaded terrain"),
    "height_sd": ("m", "standard deviation of the height; unknown for loaded terrain"),
    "solutions": ("", "number of inverse-kinematics solutions inside the joint limits"),
    "margin": ("m", "stability margin if the leg stood there; positive inside the polygon"),
    "footing": ("class", "unknown, no solution, reachable but unstable, reachable and stable, out of range"),
}


@value
class MapSettings(Value):
    """window: side of the plane-fit window [m], about one wheel.

    slope_limit [rad], roughness_limit [m], step_limit [m]: where goodness reaches 0.
    conservative: support polygon that survives the loss of any one leg; else the plain one.
    stable_margin: least margin to call a footing stable [m].
    """

    window: float = 0.5
    slope_limit: float = 0.436
    roughness_limit: float = 0.05
    step_limit: float = 0.25
    conservative: bool = False
    stable_margin: float = 0.0

    def check(self) -> None:
        if not (self.window > 0 and self.slope_limit > 0 and self.roughness_limit > 0 and self.step_limit > 0):
            raise InvalidInput("window and limits of the map settings must be above zero")
        if not 0 <= self.stable_margin < np.inf:
            raise InvalidInput("stable_margin can't be negative [m]", stable_margin=self.stable_margin)


@value
class MapStack(Value):
    """Layers on one grid for one leg.

    layers: name → (rows, cols) array; float32 with NaN = unknown, uint8 for "footing".
    stability: which polygon "margin" was measured to, "plain" or "conservative".
    """

    geometry: GridGeometry
    leg: int
    stability: str
    layers: Mapping[str, NDArray[np.generic]]
    provenance: Provenance

    def check(self) -> None:
        for name, layer in self.layers.items():
            if name not in LAYERS or layer.shape != self.geometry.shape:
                raise InvalidInput(f"layer {name!r} is unknown or does not fit the grid {self.geometry.shape}")
