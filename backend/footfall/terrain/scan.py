"""Points of a scan, and how they become ground: values only, what computes is in gridding."""

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Value, value

UPS = ("x", "y", "z", "-x", "-y", "-z")
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048, "us-ft": 1200.0 / 3937.0}
"""Names of units and how long they are [m]."""

NOISE = (7, 18)
VEGETATION = (3, 4, 5)
"""Classes that LAS files name."""


@value
class Scan(Value):
    """Points as a file has them.

    points: (n, 3), finite, in a frame and unit of their own. unit, up: as the file declares them, of UNITS and UPS;
    None where it doesn't. classes: (n,) of LAS, or None. dropped: how many points were no return.
    camera: whether the frame is a camera's (z forward), so that only a pose can say where the ground is.
    step: in which the file keeps coordinates, where it says so [its unit].
    """

    points: NDArray[np.float64]
    name: str
    unit: str | None = None
    up: str | None = None
    classes: NDArray[np.uint8] | None = None
    dropped: int = 0
    camera: bool = False
    step: float = field(default=0.0, metadata=LATER)


@value
class ScanSettings(Value):
    """How points become cells.

    resolution: cell size [m]; None: about four points a cell, 0.02 m at the finest.
    outliers: leave out returns that nothing around them supports, and what the file calls noise.
    vegetation: leave out returns above the ground, seen by lowest returns of cells and by few neighbours at their
    height, and what the file calls vegetation. It may take thin things for grass that are none.
    gap: returns of one cell farther apart than this in height are of two surfaces [m].
    least_share: of a cell's returns, so many make a surface; fewer are outliers.
    least_count: cells with fewer returns stay unknown.
    deviation: of one return [m]. time: of the scan [s since 1970].
    """

    resolution: float | None = None
    outliers: bool = True
    vegetation: bool = False
    gap: float = 0.1
    least_share: float = 0.1
    least_count: int = 1
    deviation: float = 0.01
    time: float = 0.0

    def check(self) -> None:
        """Raises InvalidInput for a resolution, gap, deviation, share, count or time out of range."""
        if self.resolution is not None and not 0.001 <= self.resolution < math.inf:
            raise InvalidInput("resolution needs at least 0.001 m", resolution=self.resolution)
        if not (0 < self.gap < math.inf and 0 < self.deviation < math.inf):
            raise InvalidInput("gap and deviation need numbers above zero [m]", gap=self.gap, deviation=self.deviation)
        if not 0 <= self.least_share <= 0.5:
            raise InvalidInput("least_share needs 0 to 0.5", least_share=self.least_share)
        if not 1 <= self.least_count <= 65535:
            raise InvalidInput("least_count needs 1 to 65535", least_count=self.least_count)
        if not math.isfinite(self.time):
            raise InvalidInput("the time of a scan must be finite [s since 1970]")
