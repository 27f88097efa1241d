"""What a measured joint may be off by, against hard limits: the one place that says so.

A joint that is measured past its limit by no more is at its limit: what is planned from there starts at the limit, and
stays inside. What is commanded is no measurement and has no tolerance.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from footfall.robot.limits import farthest_past
from footfall.telemetry.state import RobotState

if TYPE_CHECKING:
    from footfall.robot.model import Robot

JOINT_TOLERANCE = 1e-3
"""Between a joint's angle and what its encoder says, in steps and in play [rad]: 2 mm at the end of a leg of 2 m."""

_S = TypeVar("_S", bound=RobotState)


class Limited(Protocol):
    """Of a robot: the limits of its joints."""

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower limits (joints,) [rad]."""
        ...

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper limits (joints,) [rad]."""
        ...


def inside(robot: Limited, measured: NDArray[np.float64], reserve: float = 0.0) -> NDArray[np.float64]:
    """Move measured angles that are a little past a limit to it.

    A little is what a measurement may be off. Where plans keep a reserve from the limits, angles that are nearer to a
    limit, or past it by that little, are moved to the reserve's end.

    Args:
        robot: its limits.
        measured: (…, joints) [rad].
        reserve: that plans keep [rad].

    Returns:
        (…, joints) [rad].
    """
    q = np.asarray(measured, float)
    nearest = np.clip(q, robot.lower + reserve, robot.upper - reserve)
    return np.where(np.abs(q - nearest) <= JOINT_TOLERANCE + reserve, nearest, q)


def state_inside(robot: "Robot", state: _S) -> _S:
    """A measured state with its posture :func:`inside`; the same one where nothing is past a limit."""
    posture = inside(robot, state.posture)
    return state if np.array_equal(posture, state.posture) else replace(state, posture=posture)


def outside_in_words(robot: "Robot", posture: NDArray[np.float64]) -> str:
    """The joint of a posture (legs × 6,) that is farthest outside its limits, by how much and the way back; else ""."""
    worst = farthest_past(robot, posture)
    if not worst.excess > 0:
        return ""
    joint = worst.joint
    q, lower, upper = float(posture[joint]), float(robot.lower[joint]), float(robot.upper[joint])
    back, end = ("down to", upper) if q > upper else ("up to", lower)
    digits = digits_apart(q, end)
    return (
        f"{worst.name} is {worst.excess:.2g} rad outside its limits, at {q:z.{digits}f} rad "
        f"({lower:z.{digits}f}…{upper:z.{digits}f} rad); turn it {back} {end:z.{digits}f} rad"
    )


def within_in_words(robot: "Robot", joint: int, q: float) -> str:
    """An angle beside the limits of its joint, with as many decimals as tell it from the one it is past.

    Args:
        robot: the rover.
        joint: its number.
        q: the angle [rad].

    Returns:
        Words for a person.
    """
    lower, upper = float(robot.lower[joint]), float(robot.upper[joint])
    past = upper if q > upper else lower if q < lower else None
    digits = 4 if past is None else digits_apart(q, past, least=4)
    return f"{q:z.{digits}f} rad, limits {lower:z.{digits}f} … {upper:z.{digits}f} rad"


def digits_apart(one: float, other: float, least: int = 3) -> int:
    """How many decimals tell two numbers apart when they are read.

    Args:
        one: number.
        other: number.
        least: decimals there are at least.

    Returns:
        Decimals.
    """
    return next((n for n in range(least, 17) if f"{one:z.{n}f}" != f"{other:z.{n}f}"), 17)
