"""Factors of footfall quality, and the settings by which the operator moves them.

A *factor* maps one layer to 0…1 along a straight ramp from its worst to its best amount. A *limit* ends at 0, a veto. A
*preference* (how old the data are, which way the body advances) ends at PREFERENCE_LEAST: it orders footfalls and
forbids none.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value

MOST = 50
"""Most footfalls that one question may ask for."""

PREFERENCE_LEAST = 0.1
UNKNOWN_COUNTS_AS = 0.25
"""A limit's factor where it is not known, on ground that is offered all the same: poor, yet no veto."""


@dataclass(frozen=True)
class Factor:
    """What one factor measures. title: for the page. limit: reaching the worst amount is a veto; else a preference."""

    title: str
    unit: str
    meaning: str
    limit: bool


FACTORS: Mapping[str, Factor] = MappingProxyType(
    {
        "slope": Factor("Slope", "rad", "tilt of the ground under the wheel", True),
        "roughness": Factor("Roughness", "m", "roughness of the ground under the wheel", True),
        "step": Factor("Step", "m", "largest step under the wheel", True),
        "support": Factor("Support under the wheel", "share", "share of the wheel's footprint that carries", True),
        "limit_margin": Factor("Joint limits", "rad", "distance to the nearest joint limit", True),
        "margin": Factor("Stability", "m", "stability margin on the new footfall", True),
        "certainty": Factor("Ground known", "share", "share of the ground under the wheel that was seen", False),
        "age": Factor("Age", "s", "age of the measurement", False),
        "height_sd": Factor("Certainty", "m", "standard deviation of the height", False),
        "advance": Factor("Advance", "m", "how far the foot moves towards the goal", False),
    }
)

WEIGHTS: Mapping[str, float] = MappingProxyType(
    {
        "slope": 1.0,
        "roughness": 1.0,
        "step": 1.0,
        "support": 2.0,
        "limit_margin": 1.0,
        "margin": 2.0,
        "certainty": 0.5,
        "age": 0.25,
        "height_sd": 0.5,
        "advance": 1.0,
    }
)
"""Weights unless given: what carries the wheel and the rover counts twice, how well it is known half. Chosen, not
measured; meant to be moved."""

RAMPS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "slope": (0.436, 0.0),
        "roughness": (0.05, 0.0),
        "step": (0.25, 0.0),
        "support": (0.5, 1.0),
        "limit_margin": (0.0, 1.2),
        "margin": (0.0, 2.0),
        "certainty": (0.25, 1.0),
        "age": (3600.0, 0.0),
        "height_sd": (0.05, 0.0),
        "advance": (-0.5, 0.5),
    }
)
"""(worst, best) of every factor: 0 (a preference: PREFERENCE_LEAST) at the worst and beyond, 1 at the best and beyond.
Slope, roughness and step end where ``MapSettings`` has their limits. Room in the joints and stability are best where
ATHLETE hardly has more of them: a ramp that ends before would call most of what a leg reaches equally good."""


@value
class QualitySettings(Value):
    """weights: factor → weight ≥ 0, relative to the others; 0 leaves the factor out, its veto included.

    ramps: factor → (worst, best) in the factor's unit. Names left out of either keep WEIGHTS and RAMPS.
    lowest, highest: allowed height of the cell over the hip-yaw joint [m], negative below it.
    allow_unknown: offer unknown ground too, marked. accept_unsure: offer cells of class UNSURE.
    """

    weights: Mapping[str, float] = field(default_factory=dict)
    ramps: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    lowest: float = -2.3
    highest: float = -0.5
    allow_unknown: bool = False
    accept_unsure: bool = False

    def __post_init__(self) -> None:
        for name, defaults in (("weights", WEIGHTS), ("ramps", RAMPS)):
            given = getattr(self, name)
            if not isinstance(given, Mapping):
                raise InvalidInput(f"{name} must name factors", allowed=list(FACTORS))
            odd = [factor for factor in given if factor not in FACTORS]
            if odd:
                raise InvalidInput(f"no factor is called {odd[0]!r}; there are {', '.join(FACTORS)}", names=odd)
            # one form for equal settings, whatever was left out and in whatever order it came
            merged = {factor: given.get(factor, defaults[factor]) for factor in FACTORS}
            try:
                merged = {factor: np.asarray(item, float).tolist() for factor, item in merged.items()}
            except (TypeError, ValueError) as err:
                raise InvalidInput(f"{name} must be numbers: {err}") from err
            object.__setattr__(self, name, merged)
        Value.__post_init__(self)

    def check(self) -> None:
        """Raises InvalidInput for weights below 0 or all 0, ramps without two numbers, and heights out of order."""
        for factor, weight in self.weights.items():
            if not (isinstance(weight, float) and 0 <= weight < np.inf):
                raise InvalidInput(f"the weight of {factor} must be a finite number of at least 0", weight=weight)
        if not any(self.weights.values()):
            raise InvalidInput("every weight is 0; at least one factor must count")
        for factor, ramp in self.ramps.items():
            if np.shape(ramp) != (2,) or not np.isfinite(ramp).all() or ramp[0] == ramp[1]:
                raise InvalidInput(f"the ramp of {factor} needs two different finite numbers (worst, best)", ramp=ramp)
        if not self.lowest < self.highest:
            raise InvalidInput(
                "lowest must be below highest [m over the hip]", lowest=self.lowest, highest=self.highest
            )


def factor_of(name: str, amount: NDArray[np.float64] | float, settings: QualitySettings) -> NDArray[np.float64]:
    """Factor of amounts, from the worst to the best of the settings' ramp.

    Args:
        name: of the factor, one of FACTORS.
        amount: (…) in the factor's unit; NaN: unknown.
        settings: whose ramp counts.

    Returns:
        Factors (…) 0…1; of NaN, what an unknown amount counts as.
    """
    worst, best = settings.ramps[name]
    share = np.clip((amount - worst) / (best - worst), 0.0, 1.0)
    if FACTORS[name].limit:
        return np.where(np.isnan(share), UNKNOWN_COUNTS_AS, share)
    return np.where(np.isnan(share), PREFERENCE_LEAST, PREFERENCE_LEAST + (1 - PREFERENCE_LEAST) * share)
