"""A kinematic rover: joints follow commands at their speed limits; nothing has inertia, nothing bends or slips.

The chassis stays where it is and the legs move through whatever is in their way: this rover has no physics. Its
wheel forces and joint torques are those of the statics of the moment (:mod:`footfall.sim.statics`). Where no
forces of the standing feet can hold it up, a real rover would tip, and this one faults.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.robot.model import Robot
from footfall.sequence.predict import needed_duration
from footfall.sim.statics import loads
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]


@dataclass
class _Motion:
    """The command under way: a straight joint-space line from ``origin`` to ``target`` in ``duration`` seconds."""

    command: CommandMessage
    origin: Array
    target: Array
    duration: float
    elapsed: float = 0.0


class SimulatedRover:
    """One rover on one terrain, moved on by :meth:`step`.

    It takes a command only when it stands idle, executes each command id at most once, and answers a
    repeated id with what became of the first. :meth:`stop` freezes the posture at once.

    robot, dem, state: what it is, where it stands, and how. Raises InvalidInput where they don't fit.
    """

    def __init__(self, robot: Robot, dem: Dem, state: RobotState, friction: float = 0.6) -> None:
        if state.robot != robot.name or state.leg_count != robot.leg_count:
            raise InvalidInput(f"the state is of {state.robot} with {state.leg_count} legs, the robot is {robot.name}")
        self.robot = robot
        self.dem = dem
        self.time = state.time
        self.posture = np.array(state.posture)
        self.mode = "idle"
        self._start = state
        self._T_site_base = state.T_site_base
        self._friction = friction
        self._motion: _Motion | None = None
        self._last: dict[str, AckMessage] = {}
        self._number = 0
        self._loads = self._statics()

    @property
    def moving_leg(self) -> int | None:
        """The leg that a command is moving, if any."""
        return self._motion.command.leg if self._motion else None

    def command(self, command: CommandMessage) -> list[AckMessage]:
        """Take a command: "received" and "started", or "refused" with the reason.

        A repeated id changes nothing and gives the last acknowledgement of that id again.
        """
        if command.id in self._last:
            return [self._last[command.id]]
        reason = self._objection(command)
        if reason:
            return [self._ack(command.id, "refused", reason)]
        origin = self.posture.copy()
        target = origin.copy()
        duration = float(command.duration)
        if command.leg is not None and command.joints is not None:
            leg = self._leg(command.leg)
            target[leg] = command.joints
            # the limits of the joints come before the wish of the command
            duration = max(duration, needed_duration(target[leg] - origin[leg], self.robot.speed_limits[leg]))
        self._motion = _Motion(command, origin, target, duration)
        self.mode = "moving"
        return [self._ack(command.id, "received"), self._ack(command.id, "started")]

    def refuse(self, command_id: str, reason: str) -> AckMessage:
        """Refuse a command that can't even be read; what became of an earlier one of that id stands."""
        return self._last.get(command_id) or self._ack(command_id, "refused", reason)

    def step(self, dt: float) -> list[AckMessage]:
        """Move on by ``dt`` seconds; "done" where the command ends, "refused" where the rover would tip."""
        if dt < 0:
            raise InvalidInput("time runs forward only", dt=dt)
        self.time += dt
        motion = self._motion
        if motion is None:
            return []
        motion.elapsed += dt
        if motion.elapsed >= motion.duration:
            # exactly the target, not the sum of the steps
            self.posture = motion.target.copy()
            self._motion = None
            self.mode = "idle"
            return [self._tip_over(motion) or self._ack(motion.command.id, "done")]
        share = motion.elapsed / motion.duration
        self.posture = motion.origin + share * (motion.target - motion.origin)
        tipped = self._tip_over(motion)
        return [tipped] if tipped else []

    def stop(self) -> list[AckMessage]:
        """Freeze the posture and take no command until :meth:`clear_stop`; twice is as good as once."""
        if self.mode == "fault":
            return []
        motion, self._motion = self._motion, None
        self.mode = "stopped"
        if motion is None:
            return []
        share = motion.elapsed / motion.duration if motion.duration else 1.0
        return [self._ack(motion.command.id, "refused", f"stopped after {share:.0%} of the motion")]

    def clear_stop(self) -> None:
        """Take commands again after a stop."""
        if self.mode == "stopped":
            self.mode = "idle"

    def state(self) -> RobotState:
        """The rover now. In mode "fault" the forces are those of the last moment it could stand."""
        forces, torques = self._loads
        return RobotState(
            robot=self.robot.name,
            time=self.time,
            posture=self.posture,
            T_site_base=self._T_site_base,
            wheel_forces=forces,
            joint_torques=torques,
            mode=self.mode,
        )

    def frame(self) -> TelemetryFrame:
        """The next telemetry frame; its number counts the calls."""
        commanded = self._motion.target if self._motion else self.posture
        frame = TelemetryFrame(self._number, self.state(), commanded)
        self._number += 1
        return frame

    def _leg(self, leg: int) -> slice:
        return slice(6 * leg, 6 * leg + 6)

    def _ack(self, command_id: str, state: str, reason: str = "") -> AckMessage:
        ack = AckMessage(command_id, state, reason, self.time)
        self._last[command_id] = ack
        return ack

    def _objection(self, command: CommandMessage) -> str:
        """Why a command can't be taken, or ""."""
        if self.mode == "stopped":
            return "the rover is stopped; clear the stop first"
        if self.mode == "fault":
            return "the rover is in fault: its feet can't hold it up"
        if self._motion is not None:
            return f"busy with command {self._motion.command.id}"
        if not (np.isfinite(command.duration) and command.duration >= 0):
            return f"the duration is {command.duration} s; it must be finite and not negative"
        if command.name == "WAIT":
            return "" if command.leg is None and command.joints is None else "WAIT takes no leg and no joints"
        if command.name != "LEG_MOVE":
            return f"{command.name!r} is no command of this rover; it knows LEG_MOVE and WAIT"
        if command.leg is None or not 0 <= command.leg < self.robot.leg_count:
            return f"there is no leg {command.leg}; there are 0…{self.robot.leg_count - 1}"
        if command.joints is None or command.joints.shape != (6,) or not np.isfinite(command.joints).all():
            return "LEG_MOVE needs six finite joint angles"
        leg = self._leg(command.leg)
        lower, upper = self.robot.lower[leg], self.robot.upper[leg]
        beyond = np.maximum(lower - command.joints, command.joints - upper)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 0:
            return f"joint {worst} of leg {command.leg} would be {beyond[worst]:.4f} rad beyond its limits"
        return ""

    def _tip_over(self, motion: _Motion) -> AckMessage | None:
        try:
            self._loads = self._statics()
        except InvalidInput as err:
            self._motion = None
            self.mode = "fault"
            return self._ack(motion.command.id, "refused", err.message)
        return None

    def _statics(self) -> tuple[Array, Array]:
        # a wheel that carried load at the start and has not moved stands there, whatever a coarse terrain says
        unmoved = (self.posture == self._start.posture).reshape(-1, 6).all(axis=1)
        standing = unmoved & (self._start.wheel_forces[:, 2] > 0)
        return loads(self.robot, self.dem, self.posture, self._T_site_base, self.moving_leg, standing, self._friction)
