"""What a frame of telemetry holds, number by number, for plots; and series of it told shorter without losing a peak."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.frames import rpy
from footfall.telemetry.state import TelemetryFrame

_LARGEST = float(np.finfo(np.float32).max)


def _tilt(frame: TelemetryFrame) -> NDArray[np.float64]:
    """How far the chassis' own up leans from the vertical [rad]."""
    return np.arccos(np.clip(frame.state.T_site_base[2:3, 2], -1.0, 1.0))


def _share(frame: TelemetryFrame) -> NDArray[np.float64]:
    """Each wheel's share of all that the wheels bear; 0 where they bear nothing."""
    up = frame.state.wheel_forces[:, 2]
    weight = float(up.sum())
    return up / weight if 0 < weight < np.inf else np.zeros(len(up))


QUANTITIES: Mapping[str, Callable[[TelemetryFrame], ArrayLike]] = MappingProxyType(
    {
        "torque": lambda frame: frame.state.joint_torques,
        "position": lambda frame: frame.state.posture,
        "error": lambda frame: frame.commanded - frame.state.posture,
        "force": lambda frame: frame.state.wheel_forces[:, 2],
        "share": _share,
        "place": lambda frame: frame.state.T_site_base[:3, 3],
        "lean": lambda frame: rpy(frame.state.T_site_base),
        "tilt": _tilt,
    }
)
"""Name → its numbers in a frame, in SI units: of each joint; of each wheel; x, y, z; roll, pitch, yaw; one alone."""


def numbers_of(frame: TelemetryFrame) -> dict[str, NDArray[np.float32]]:
    """Every quantity of a frame; what is no number of a rover is as large as can be written."""
    with np.errstate(over="ignore"):
        return {name: np.clip(of(frame), -_LARGEST, _LARGEST).astype(np.float32) for name, of in QUANTITIES.items()}


def extremes(
    times: NDArray[np.float64], rows: NDArray[np.float32], edges: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Of each block of rows, one or two: the least and the greatest number of every column.

    They come in the order in which the two were, at the first and the last time of the block. NaN is no number, and
    stays only where a block has no other.

    Args:
        times: (n,) of the rows [s], rising.
        rows: (n, columns), each column in a unit of its own.
        edges: numbers of the rows between which the blocks lie, rising.

    Returns:
        Times (m,) [s], and rows (m, columns).
    """
    moments: list[float] = []
    numbers: list[NDArray[np.float32]] = []
    for begin, end in pairwise(edges):
        block = rows[begin:end]
        if end - begin == 1:
            moments.append(float(times[begin]))
            numbers.append(block[0])
            continue
        least, greatest = np.fmin.reduce(block), np.fmax.reduce(block)
        least_first = (block == least).argmax(axis=0) <= (block == greatest).argmax(axis=0)
        moments += [float(times[begin]), float(times[end - 1])]
        numbers += [np.where(least_first, least, greatest), np.where(least_first, greatest, least)]
    return np.array(moments), np.array(numbers, np.float32).reshape(len(numbers), rows.shape[1])
