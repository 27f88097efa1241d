"""The stack of map layers for one leg, and the names and meanings of its layers."""

from collections.abc import Mapping
from dataclasses import field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.bounds import require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import LATER, Provenance, Value, before, value
from footfall.maps.quality_settings import QualitySettings

# Classes of the footing layers (FootFall paper: green, orange, red; unknown is its own colour).
UNKNOWN, NO_SOLUTION, REACHABLE_UNSTABLE, REACHABLE_STABLE, OUT_OF_RANGE, COLLISION, UNSURE, NOT_LIFTED = range(8)


class LayerInfo(NamedTuple):
    """unit: SI, "class" for a layer of classes, "" for a number without one; group: of the page's menu."""

    unit: str
    title: str
    text: str
    group: str


GROUND, LEG, BALANCE, FOOTFALL = "Ground", "Leg", "Balance", "Footfall"

LAYERS: Mapping[str, LayerInfo] = {
    "goodness": LayerInfo(
        "", "Traversability", "0…1 from slope, roughness and step under a wheel, 1 = easy (Morphin)", GROUND
    ),
    "certainty": LayerInfo("", "Share of ground known", "share of the window's cells that are known, 0…1", GROUND),
    "height_sd": LayerInfo(
        "m", "Certainty of height", "standard deviation of the height; unknown for loaded terrain", GROUND
    ),
    "age": LayerInfo(
        "s",
        "Age",
        "time between the cell's newest measurement and the newest of all; unknown for loaded terrain",
        GROUND,
    ),
    "slope": LayerInfo("rad", "Slope", "tilt of the plane fitted in a wheel-sized window", GROUND),
    "roughness": LayerInfo("m", "Roughness", "RMS distance of the cells from that plane", GROUND),
    "step": LayerInfo("m", "Step", "largest height difference in the window after removing the plane", GROUND),
    "seat": LayerInfo("m", "Wheel above the fitted ground", "height at which a rigid wheel comes to stand", GROUND),
    "support": LayerInfo(
        "", "Share of the wheel that carries", "share of the footprint that the wheel touches", GROUND
    ),
    "reach_class": LayerInfo("class", "Why the leg can't stand there", "what keeps the leg off the cell", LEG),
    "hindrance": LayerInfo("class", "What stops the leg", "the joint at its limit, or what the leg would hit", LEG),
    "solutions": LayerInfo("", "Number of leg solutions", "inverse-kinematics solutions inside the joint limits", LEG),
    "limit_margin": LayerInfo("rad", "Margin to joint limits", "of the best solution, to its nearest limit", LEG),
    "manipulability": LayerInfo(
        "m³", "Manipulability", "√det(J Jᵀ) of the wheel contact, best solution (Yoshikawa)", LEG
    ),
    "margin": LayerInfo(
        "m", "Margin, plain polygon", "geometric: to the support polygon with the leg standing there; + inside", BALANCE
    ),
    "margin_conservative": LayerInfo(
        "m", "Margin, conservative polygon", "geometric: to what survives the loss of any one leg; + inside", BALANCE
    ),
    "binding": LayerInfo(
        "class", "Which feet bind the margin", "the edge that the geometric margin is measured to", BALANCE
    ),
    "binding_lost": LayerInfo("class", "Whose loss binds", "the leg whose loss gives the conservative margin", BALANCE),
    "margin_lifted": LayerInfo(
        "m",
        "Margin while the leg is in the air",
        "geometric: of the other feet, the leg above the cell; + inside",
        BALANCE,
    ),
    "margin_friction": LayerInfo(
        "m", "Margin with friction", "to the equilibrium region on the real contact normals; + inside", BALANCE
    ),
    "margin_friction_conservative": LayerInfo(
        "m", "Margin with friction, any leg lost", "to what of that region survives the loss of any one leg", BALANCE
    ),
    "tip_energy": LayerInfo("J", "Tip-over energy", "least work that tips the rover over an edge of its feet", BALANCE),
    "torque_ratio": LayerInfo(
        "",
        "Torque ratio",
        "least possible largest torque as a share of its limit, all legs standing; held up to 1",
        BALANCE,
    ),
    "footing": LayerInfo(
        "class",
        "Where the leg may stand",
        "reach, collision and the geometric margin; says nothing of friction",
        FOOTFALL,
    ),
    "footing_friction": LayerInfo(
        "class",
        "Where the leg may stand, with friction",
        "the same with friction on real normals and torques",
        FOOTFALL,
    ),
    "quality": LayerInfo("", "Footfall quality", "weighted quality 0…1 of what is acceptable (Ambler)", FOOTFALL),
}

LEGGED_LAYERS: Mapping[str, LayerInfo] = {
    "refused_by": LayerInfo("class", "What refuses a step there", "the check that refused most tries of a step", LEG),
}
"""What maps of robots that others described have, and ATHLETE's have not."""

ALL_LAYERS: Mapping[str, LayerInfo] = {**LAYERS, **LEGGED_LAYERS}


LIFT, RAISE_TERRAIN = 0.2, 0.15
"""How high maps and steps have a wheel over its footfall, and how much higher the ground is for it then, unless asked
otherwise [m]."""


@value
class MapSettings(Value):
    """window: side of the plane-fit window [m], about one wheel.

    slope_limit [rad], roughness_limit [m], step_limit [m]: where goodness reaches 0.
    conservative: footing asks for what survives the loss of any one leg; else for the plain polygon or region.
    stable_margin: least margin to call a footing stable [m].
    lift: the leg must also be free at a waypoint this far above the footfall [m].
    raise_terrain: the ground that the waypoint is checked against is raised by this [m].
    clearance: added to every clearance of the robot description [m].
    collisions: check collisions; without, what the leg reaches is unsure and never green.
    friction: make the layers with friction and torques too; they take seconds.
    lift_off: ask, with the collisions, whether the leg can be lifted from where it stands; where not, no cell is green.
    balance: friction, gravity, tilt and payload. quality: weights and limits of the footfall quality.
    """

    window: float = 0.5
    slope_limit: float = 0.436
    roughness_limit: float = 0.05
    step_limit: float = 0.25
    conservative: bool = False
    stable_margin: float = 0.0
    lift: float = LIFT
    raise_terrain: float = RAISE_TERRAIN
    clearance: float = 0.0
    collisions: bool = True
    friction: bool = False
    balance: BalanceSettings = BalanceSettings()
    quality: QualitySettings = QualitySettings()
    lift_off: bool = field(default=True, metadata=before(False))

    def check(self) -> None:
        """Raises InvalidInput for a window or limit that is not above zero, and margins and clearances below it."""
        if not (self.window > 0 and self.slope_limit > 0 and self.roughness_limit > 0 and self.step_limit > 0):
            raise InvalidInput("window and limits of the map settings must be above zero")
        require_not_negative("m", stable_margin=self.stable_margin, lift=self.lift)
        require_not_negative("m", raise_terrain=self.raise_terrain, clearance=self.clearance)


@value
class MapStack(Value):
    """Layers on one grid for one leg.

    layers: name → (rows, cols) array; float32 with NaN = unknown, uint8 for layers of classes.
    stability: which polygon or region footing asks for, "plain" or "conservative".
    not_lifted: why the leg can't be lifted from where it stands, empty where it can or was not asked for.
    """

    geometry: GridGeometry
    leg: int
    stability: str
    layers: Mapping[str, NDArray[np.generic]]
    provenance: Provenance
    not_lifted: str = field(default="", metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput for a layer of an unknown name, or of another shape than the grid's."""
        for name, layer in self.layers.items():
            if name not in ALL_LAYERS or layer.shape != self.geometry.shape:
                raise InvalidInput(f"layer {name!r} is unknown or does not fit the grid {self.geometry.shape}")

    @property
    def margin(self) -> NDArray[np.generic]:
        """The geometric margin that "footing" was decided by, (rows, cols) [m]."""
        return self.layers["margin" if self.stability == "plain" else "margin_conservative"]
