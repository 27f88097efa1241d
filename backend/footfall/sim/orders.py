"""What a rover does with orders, whatever moves it: takes, refuses, remembers and answers them, stops.

What a command asks of the set points, and what a rover objects to in it.
"""

from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

import numpy as np

from footfall.core.arrays import Array
from footfall.robot.description import JOINTS
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.limits import farthest_past
from footfall.robot.model import Robot
from footfall.robot.tolerance import digits_apart
from footfall.sequence.predict import needed_duration
from footfall.telemetry.command_kinds import KINDS
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link import AckMessage, CommandMessage

TheRobot = TypeVar("TheRobot", Robot, LeggedRobot)
"""Of ATHLETE's build, or one that others described."""


class MotionUnderWay(Protocol):
    """The command under way; share: how much of it is gone, 0…1."""

    command: CommandMessage

    @property
    def share(self) -> float: ...


class OrderedRover(ABC, Generic[TheRobot]):
    """The part of a simulated rover that is the same whatever moves it.

    It takes a command only when it stands idle, executes each command id at most once, and answers a repeated or asked
    id with what became of the first. :meth:`stop` freezes what it drives to at once.

    epoch: the newest that it has heard of since it was started; commands of older ones came too late.
    """

    def __init__(self, robot: TheRobot) -> None:
        self.robot = robot
        self.mode = "idle"
        self.epoch: int | None = None
        self._greeting: str | None = None
        self._motion: MotionUnderWay | None = None
        self._last: dict[str, AckMessage] = {}

    @property
    @abstractmethod
    def time(self) -> float:
        """Rover clock [s]."""

    @property
    @abstractmethod
    def fault(self) -> str:
        """Why it is in mode "fault"."""

    @abstractmethod
    def _begin(self, command: CommandMessage) -> MotionUnderWay:
        """Set out on a command that nothing speaks against."""

    @property
    def described(self) -> JointLayout | None:
        """Legs and joints by name, of a robot that others described; the ground knows those of ATHLETE's build."""
        return self.robot.layout if isinstance(self.robot, LeggedRobot) else None

    @property
    def moving_leg(self) -> int | None:
        """The leg that a command is moving, if it is one."""
        return self._motion.command.leg if self._motion else None

    def command(self, command: CommandMessage) -> list[AckMessage]:
        """Take a command: "received" and "started", or "refused" with the reason.

        A repeated id changes nothing and gives the last acknowledgement of that id again.
        """
        if command.id in self._last:
            return [self._last[command.id]]
        if late := self._outdated(command):
            return [self._ack(command.id, "outdated", late)]
        reason = self._unready() or objection(self.robot, command)
        if reason:
            return [self._ack(command.id, "refused", reason)]
        self._motion = self._begin(command)
        self.mode = "moving"
        return [self._ack(command.id, "received"), self._ack(command.id, "started")]

    def refuse(self, command_id: str, reason: str) -> AckMessage:
        """Refuse a command that can't even be read; what became of an earlier one of that id stands."""
        return self._last.get(command_id) or self._ack(command_id, "refused", reason)

    def became(self, command_id: str) -> AckMessage:
        """The last acknowledgement of a command; "unknown" of one that never came since this rover began."""
        forgotten = "no command of this id has come since the rover was started"
        return self._last.get(command_id) or AckMessage(command_id, "unknown", forgotten, self.time)

    def greets(self, greeting: str) -> None:
        """It says hello on a new connection: it takes no command before the ground has answered ``greeting``."""
        self._greeting = greeting

    def hear_epoch(self, greeting: str, epoch: int) -> None:
        """The ground tells the epoch, in answer to a hello; one of an earlier connection was held back on the way."""
        self._hear(epoch)
        if greeting == self._greeting:
            self._greeting = None

    def stop(self, epoch: int = 0) -> list[AckMessage]:
        """Freeze what it drives to and take no command until :meth:`clear_stop`; twice is as good as once.

        epoch: of the stop. One of an older epoch is obeyed as well: standing still harms nobody.
        """
        self._hear(epoch)
        if self.mode == "fault":
            return []
        motion, self._motion = self._motion, None
        self.mode = "stopped"
        if motion is None:
            return []
        return [self._ack(motion.command.id, "refused", f"stopped after {motion.share:.0%} of the motion")]

    def clear_stop(self, epoch: int = 0) -> str:
        """Take commands again after a stop; why not, or "". epoch: of the clearing, which clears no later stop."""
        if epoch < (self.epoch or 0):
            return f"it clears a stop of epoch {epoch} or earlier; the rover has heard of epoch {self.epoch} since"
        self._hear(epoch)
        if self.mode == "stopped":
            self.mode = "idle"
        return ""

    def _ack(self, command_id: str, state: str, reason: str = "") -> AckMessage:
        ack = AckMessage(command_id, state, reason, self.time)
        self._last[command_id] = ack
        return ack

    def _hear(self, epoch: int) -> None:
        self.epoch = max(epoch, self.epoch or 0)

    def _outdated(self, command: CommandMessage) -> str:
        """Why a command may have been held back on the way for too long, or ""."""
        if self._greeting is not None:
            return "the ground has not told the epoch on this connection yet"
        if command.epoch < (self.epoch or 0):
            return f"it was released in epoch {command.epoch}; the rover has heard of epoch {self.epoch} since"
        self._hear(command.epoch)
        return ""

    def _unready(self) -> str:
        """Why no command can be taken now, or ""."""
        if self.mode == "stopped":
            return "the rover is stopped; clear the stop first"
        if self.mode == "fault":
            return f"the rover is in fault: {self.fault}"
        return f"busy with command {self._motion.command.id}" if self._motion is not None else ""


def objection(robot: Robot | LeggedRobot, command: CommandMessage) -> str:
    """Why the rover can't carry out a command whatever it is doing, or ""."""
    if not (np.isfinite(command.duration) and command.duration >= 0):
        return f"the duration is {command.duration} s; it must be finite and not negative"
    kind, legs = command.kind, len(robot.layout.legs)
    known = [one.name for one in KINDS.values() if not (isinstance(robot, LeggedRobot) and one.ends_by_force)]
    if kind.name not in known:
        return f"{command.name!r} is no command of this rover; it knows {', '.join(known)}"
    if not kind.ends_by_force and command.force is not None:
        return f"{kind.name} takes no force"
    if not kind.moves:
        return "" if command.leg is None and command.joints is None else f"{kind.name} takes no leg and no joints"
    if kind.names_leg and (command.leg is None or not 0 <= command.leg < legs):
        return f"there is no leg {command.leg}; there are 0…{legs - 1}"
    if kind.moves_all and command.leg is not None:
        return f"{kind.name} moves all legs and takes no leg"
    moved = robot.layout.moved(kind, command.leg)
    count = moved.stop - moved.start
    if command.joints is None or command.joints.shape != (count,) or not np.isfinite(command.joints).all():
        return f"{kind.name} needs {'six' if count == len(JOINTS) else count} finite joint angles"
    if kind.ends_by_force and (command.force is None or not 0 < command.force < np.inf):
        return f"{kind.name} needs a force above zero that ends it, not {command.force} N"
    return _beyond_limits(robot, command.joints, moved)


def _beyond_limits(robot: Robot | LeggedRobot, joints: Array, moved: slice) -> str:
    worst = farthest_past(robot, joints, moved)
    if worst.excess <= 0:
        return ""
    digits = digits_apart(worst.excess, 0.0, least=4)
    if isinstance(robot, LeggedRobot):
        unit = "m" if worst.name in robot.layout.sliding else "rad"
        return f"joint {worst.name} would be {worst.excess:z.{digits}f} {unit} beyond its limits"
    leg, joint = divmod(worst.joint, len(JOINTS))
    return f"joint {joint} of leg {leg} would be {worst.excess:z.{digits}f} rad beyond its limits"


def ramp(robot: Robot | LeggedRobot, command: CommandMessage, present: Array) -> tuple[Array, float]:
    """Set points at the end of a command, (joints,) [rad or m], and the seconds until then from those of ``present``.

    The limits of the joints' speeds come before the duration that the command wishes.
    """
    target, duration = present.copy(), float(command.duration)
    if command.joints is not None:
        moved = robot.layout.moved(command.kind, command.leg)
        speeds = robot.speeds if isinstance(robot, LeggedRobot) else robot.speed_limits
        target[moved] = command.joints
        duration = max(duration, needed_duration(target[moved] - present[moved], speeds[moved]))
    return target, duration
