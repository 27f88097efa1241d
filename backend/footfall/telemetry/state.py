"""What the rover says of itself: one telemetry frame, and the state that planning starts from."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTelemetry
from footfall.core.frames import require_transform
from footfall.core.value import LATER, Value, value
from footfall.telemetry.joint_layout import JointLayout

MODES = ("idle", "moving", "stopped", "fault")
MOST_MISSING = 864_000
"""Frames that may be missing between two: a day of them."""


@value
class RobotState(Value):
    """The rover at one moment.

    robot: name of the robot description.
    time: rover clock, seconds since 1970-01-01 UTC.
    posture: measured joint angles, (legs × 6,) [rad], leg by leg.
    T_site_base: pose of the chassis, (4, 4).
    wheel_forces: force of the ground on each wheel, or foot, site frame, (legs, 3) [N].
    joint_torques: measured joint torques, (legs × 6,) [N·m].
    mode: one of MODES.
    described: legs and joints, by name, of a robot that others described: posture and joint_torques are (joints,) in
    that order, [m] and [N] of those that slide. None: of ATHLETE's build.
    """

    robot: str
    time: float
    posture: NDArray[np.float64]
    T_site_base: NDArray[np.float64]
    wheel_forces: NDArray[np.float64]
    joint_torques: NDArray[np.float64]
    mode: str
    described: JointLayout | None = field(default=None, kw_only=True, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidTelemetry for arrays of other shapes, numbers that are not finite, and an unknown mode."""
        n = self.posture.shape[0] if self.posture.ndim == 1 else -1
        if self.described is not None:
            if n != len(self.described.joint_names) or not np.isfinite(self.posture).all():
                raise InvalidTelemetry(f"posture needs {len(self.described.joint_names)} finite numbers", posture=n)
        elif n <= 0 or n % 6 or not np.isfinite(self.posture).all():
            raise InvalidTelemetry("posture needs six finite joint angles [rad] for each leg", posture=n)
        if self.joint_torques.shape != (n,) or not np.isfinite(self.joint_torques).all():
            raise InvalidTelemetry(f"joint_torques needs {n} finite numbers [N·m]")
        if self.wheel_forces.shape != (self.leg_count, 3) or not np.isfinite(self.wheel_forces).all():
            raise InvalidTelemetry(f"wheel_forces needs {self.leg_count} × 3 finite numbers [N]")
        if not np.isfinite(self.time):
            raise InvalidTelemetry("time needs a finite number of seconds")
        if self.mode not in MODES:
            raise InvalidTelemetry(f"mode is one of {', '.join(MODES)}", mode=self.mode)
        require_transform(self.T_site_base, "T_site_base")

    @property
    def leg_count(self) -> int:
        """How many legs the rover has: six joints are one leg, unless its joints are named."""
        return len(self.posture) // 6 if self.described is None else len(self.described.legs)

    def leg(self, leg: int) -> NDArray[np.float64]:
        """Joint angles of one leg, (6,) [rad], or as many as it has."""
        own = slice(6 * leg, 6 * leg + 6) if self.described is None else self.described.slices[leg]
        return self.posture[own]


@value
class TelemetryFrame(Value):
    """One message of the rover link: a state with its sequence number and what was commanded.

    number: counts up by one a frame since the rover started.
    commanded: the joint angles that the rover is driving to, (legs × 6,) [rad].
    """

    number: int
    state: RobotState
    commanded: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidTelemetry for a negative number, and where commanded is not one finite angle for each joint."""
        if self.number < 0:
            raise InvalidTelemetry("the frame number can't be negative", number=self.number)
        if self.commanded.shape != self.state.posture.shape or not np.isfinite(self.commanded).all():
            raise InvalidTelemetry("commanded needs as many finite angles as posture")


def counted_anew(before: int, number: int) -> bool:
    """Whether the rover's count of frames began anew between two numbers; else those between are missing."""
    return number <= before or number - before > MOST_MISSING
