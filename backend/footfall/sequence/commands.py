"""Commands and sequences of them: what the rover is told, with what it is predicted to do."""

from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.value import LATER, Provenance, Value, value
from footfall.planning.motion import BODY, Motion
from footfall.robot.description import JOINTS, athlete_layout
from footfall.telemetry.command_kinds import (
    LEG_LOWER,
    LEG_MOVE,
    POSTURE_MOVE,
    WAIT,
    Argument,
    CommandKind,
    kind_named,
)
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.state import RobotState

LEG_JOINTS = tuple(name for name, _ in JOINTS)
"""The six joints of a leg, in the order of a command's ``joints``."""


@value
class Command(Value):
    """One command.

    ============  ==========================================================================================
    name          what it does
    ============  ==========================================================================================
    LEG_MOVE      one leg's joints in a straight joint-space line to ``joints``, (6,)
    LEG_LOWER     the same, but done as soon as the wheel's force along the site's up has risen by ``force``
    POSTURE_MOVE  the joints of all legs in one straight joint-space line to ``joints``, (legs × 6,); the
                  chassis goes where the standing wheels let it
    WAIT          nothing
    ============  ==========================================================================================

    leg: which leg; None for POSTURE_MOVE and WAIT.
    joints: target angles [rad]; None for WAIT.
    duration: seconds from its start to its end.
    phase: "lift", "swing", "lower", "shift", or "" where an operator wrote it.
    force: of LEG_LOWER, above a moving baseline of what the wheel bore before it touched [N]; None for the others.

    Raises InvalidSequence where a field has the wrong type. Numbers that break a rule are accepted
    here, so that an operator sees which rule they break.
    """

    name: str
    leg: int | None
    joints: NDArray[np.float64] | None
    duration: float
    phase: str = ""
    force: float | None = field(default=None, metadata=LATER)

    @property
    def kind(self) -> CommandKind:
        """What kind it is by its name; UNKNOWN where there is none of that name."""
        return kind_named(self.name)

    @property
    def arguments(self) -> list[tuple[Argument, Any]]:
        """What it takes, in the order of its kind, each with what it is here: a number, or a list of angles."""
        given = [(argument, getattr(self, argument.name)) for argument in self.kind.arguments]
        return [(argument, one.tolist() if isinstance(one, np.ndarray) else one) for argument, one in given]

    def check(self) -> None:
        """Raises InvalidSequence for fields of other types than the rows of a sequence have."""
        if not isinstance(self.name, str) or not isinstance(self.phase, str):
            raise InvalidSequence("the name and the phase of a command are texts")
        if self.leg is not None and (not isinstance(self.leg, int) or isinstance(self.leg, bool)):
            raise InvalidSequence("the leg of a command is a whole number, or None", leg=repr(self.leg))
        if self.joints is not None and not (
            isinstance(self.joints, np.ndarray) and self.joints.dtype == np.float64 and self.joints.ndim == 1
        ):
            raise InvalidSequence("the joints of a command are a flat float64 array [rad], or None")
        if not isinstance(self.duration, (int, float)) or isinstance(self.duration, bool):
            raise InvalidSequence("the duration of a command is a number of seconds", duration=repr(self.duration))
        if self.force is not None and (not isinstance(self.force, (int, float)) or isinstance(self.force, bool)):
            raise InvalidSequence("the force of a command is a number of newtons, or None", force=repr(self.force))


def leg_move(leg: int, joints: Array, duration: float, phase: str = "") -> Command:
    """Move one leg to joint angles.

    Args:
        leg: number of the leg, from 0.
        joints: (6,) [rad].
        duration: how long it takes [s].
        phase: "lift", "swing", "lower", "shift", or "" where an operator wrote it.

    Returns:
        The command.
    """
    return Command(LEG_MOVE.name, leg, joints, duration, phase)


def leg_lower(leg: int, joints: Array, duration: float, force: float, phase: str = "") -> Command:
    """Move one leg towards joint angles until its wheel bears more.

    Args:
        leg: number of the leg, from 0.
        joints: (6,) [rad].
        duration: how long all of the way takes [s].
        force: so much more than before it touched [N].
        phase: "lift", "swing", "lower", "shift", or "" where an operator wrote it.

    Returns:
        The command.
    """
    return Command(LEG_LOWER.name, leg, joints, duration, phase, force)


def posture_move(joints: Array, duration: float, phase: str = "") -> Command:
    """Move the joints of all legs.

    Args:
        joints: (legs × 6,) [rad].
        duration: how long it takes [s].
        phase: "lift", "swing", "lower", "shift", or "" where an operator wrote it.

    Returns:
        The command.
    """
    return Command(POSTURE_MOVE.name, None, joints, duration, phase)


def wait(duration: float) -> Command:
    """Do nothing for ``duration`` seconds."""
    return Command(WAIT.name, None, None, duration)


def by_leg(command: Command, layout: JointLayout) -> list[tuple[int, Array]]:
    """The legs whose joints it moves, each with its places [rad or m]; none where it moves nothing."""
    if command.joints is None:
        return []
    if command.kind.names_leg:
        return [] if command.leg is None else [(command.leg, command.joints)]
    return layout.by_leg(command.joints)


@value
class RuleResult(Value):
    """One rule checked on one row. row: index of the command, −1 for the whole sequence.

    margin: positive = held by that much, in ``unit``; NaN where the rule has no size.
    """

    rule: str
    row: int
    holds: bool
    margin: float
    unit: str
    text: str


@value
class AtRest(Value):
    """How a rover that sags stood at rest: what it measured, and the set points of its joints, (legs × 6,) [rad]."""

    state: RobotState
    set_points: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidSequence where there is not one finite set point for each joint."""
        if self.set_points.shape != self.state.posture.shape or not np.isfinite(self.set_points).all():
            raise InvalidSequence("set_points needs as many finite angles as the posture of the state")


@value
class Sequence(Value):
    """Commands in order, the posture they start from, and the posture and chassis pose predicted after each.

    start: (legs × 6,) [rad]; predicted: (len(commands), legs × 6) [rad]; T_site_base: (4, 4), where it starts.
    rules: every rule's result; a sequence may be exported and sent only when all hold.
    Ts_site_base: (len(commands), 4, 4), or None where the chassis stays at T_site_base.
    at_rest: how the rover stood that ``predicted`` lets sag; None: it was taken as rigid, its joints where they are
    commanded. Only with it, commanded: set points after each command, (len(commands), legs × 6) [rad].
    tether: that the rover hangs on.
    described: legs and joints of a robot that others described; None: of ATHLETE's build.
    """

    robot: str
    commands: tuple[Command, ...]
    start: NDArray[np.float64]
    predicted: NDArray[np.float64]
    T_site_base: NDArray[np.float64]
    rules: tuple[RuleResult, ...]
    provenance: Provenance
    Ts_site_base: NDArray[np.float64] | None = field(default=None, metadata=LATER)
    at_rest: AtRest | None = field(default=None, metadata=LATER)
    commanded: NDArray[np.float64] | None = field(default=None, metadata=LATER)
    tether: Tether | None = field(default=None, metadata=LATER)
    described: JointLayout | None = field(default=None, metadata=LATER)

    @property
    def layout(self) -> JointLayout:
        """Its robot's legs and joints by name."""
        return self.described or athlete_layout(len(self.start) // len(LEG_JOINTS))

    @property
    def valid(self) -> bool:
        """Whether every rule holds."""
        return all(rule.holds for rule in self.rules)

    @property
    def poses(self) -> NDArray[np.float64]:
        """T_site_base after each command, (len(commands), 4, 4)."""
        if self.Ts_site_base is not None:
            return self.Ts_site_base
        return np.tile(self.T_site_base, (len(self.commands), 1, 1))

    @property
    def motion(self) -> Motion:
        """What is predicted to move, row by row; while all joints are moved no foot is known to stay."""
        stays = np.ones((len(self.commands) + 1, len(self.layout.legs)), bool)
        for row, command in enumerate(self.commands, 1):
            if command.kind.moves_all:
                stays[row] = False
            elif command.leg in range(stays.shape[1]):
                stays[row, command.leg] = False
        phases = (BODY, *(BODY if command.kind.moves_all else command.phase for command in self.commands))
        poses = np.concatenate([self.T_site_base[None], self.poses])
        return Motion(np.vstack([self.start, self.predicted]), poses, stays, phases)

    @property
    def tether_lengths(self) -> NDArray[np.float64] | None:
        """What is paid out of its tether before the first command and after each, (len(commands) + 1,) [m]."""
        if self.tether is None:
            return None
        return self.tether.lengths(np.concatenate([self.T_site_base[None], self.poses]))

    def set_points_before(self, row: int) -> NDArray[np.float64]:
        """Set points of the joints when a command begins, (legs × 6,) [rad]."""
        if row == 0:
            return self.start if self.at_rest is None else self.at_rest.set_points
        return (self.predicted if self.commanded is None else self.commanded)[row - 1]

    @property
    def failures(self) -> tuple[RuleResult, ...]:
        """The rules that don't hold, in row order."""
        return tuple(rule for rule in self.rules if not rule.holds)

    @property
    def duration(self) -> float:
        """Sum of the durations [s]."""
        return float(sum(command.duration for command in self.commands))
