"""Stereo pairs as cameras took them, each with the calibration that it is to be rectified by."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.value import Value, value
from footfall.telemetry.calibration import PairCalibration


@value
class PhotographedPair(Value):
    """One pair, not yet rectified, grey, (height, width) uint8 each.

    Nothing but their form is checked here: what makes a pair unusable is told when it is rectified.
    time, time_right: when they were taken [s]; time_right None: at the same moment.
    T_site_base: pose of what carries the cameras, (4, 4).
    """

    name: str
    calibration: PairCalibration
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    time: float
    time_right: float | None
    T_site_base: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidImages for images that are not grey, uint8 (height, width)."""
        for image in (self.left, self.right):
            if image.dtype != np.uint8 or image.ndim != 2:
                raise InvalidImages(f"pair {self.name}: needs grey images, uint8 (height, width)", pair=self.name)


@value
class Photographs(Value):
    """Pairs that make one map. left_out: those that came but can't be used, by name, and why."""

    pairs: tuple[PhotographedPair, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)

    def check(self) -> None:
        """Raises InvalidImages where no pair can be used, with why, and where two pairs have one name."""
        if not self.pairs:
            why = "; ".join(self.left_out.values()) or "there are none"
            raise InvalidImages(f"no image pair can be used: {why}", pairs=dict(self.left_out))
        names = [pair.name for pair in self.pairs] + list(self.left_out)
        if len(set(names)) < len(names):
            raise InvalidImages("two pairs have one name", pairs=sorted({n for n in names if names.count(n) > 1}))

    @property
    def pixels(self) -> int:
        """Of all its images."""
        return sum(pair.left.size + pair.right.size for pair in self.pairs)
