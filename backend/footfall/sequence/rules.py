"""The rules of a sequence, checked on every row: form, joint limits, speeds and, over terrain, the motion itself.

Rule names are stable; the page, exports and the command gate show them.

=================  ==============================================================  =========
rule               what it asks                                                    margin
=================  ==============================================================  =========
not-empty          there is at least one command (row −1)                          –
known-command      the name is one of those of ``commands``                        –
leg-exists         the robot has the leg; WAIT and POSTURE_MOVE name none          –
six-joints         a move of one leg has six joints, WAIT none                     –
all-joints         POSTURE_MOVE has six joints for each leg                        –
force              LEG_LOWER's is above zero, at most the rover's weight on Earth; N
                   the others have none
finite             joints, duration and force are finite numbers                   –
duration           not negative                                                    s
joint-limits       every joint within its limits                                   rad
speed              no joint faster than its limit                                  s
self-collision     dense samples keep the clearances between links                 m
terrain-collision  dense samples keep the clearances to the true terrain; the      m
                   set point of a lowered wheel is at most so far under it
no-drag            a wheel that is down on the ground is not moved sideways        m
balance            centre of mass inside the polygon of the feet on the ground     m
torque             some contact forces keep every joint within its torque limit    ratio
ends-on-ground     a leg that was moved by itself, or stood, is down at the end    m
terrain-given      an edit without a terrain left the checked motion as it was     –
=================  ==============================================================  =========

The six before the last need a terrain; the last stands only where it fails (row −1).
What a LEG_LOWER of a sequence leads to is where its wheel first touches the terrain, as if wheel and ground were rigid.
A sequence that knows how the rover stood at rest is asked where the sagging rover is predicted to be, and for two more
rules: ``yielding_rules``. Its set points have the rules joint-limits and speed.
A rule that can't be asked because an earlier one of the same row failed (the speed of NaN, the motion to 40 rad) is
left out for that row.
"""

from collections.abc import Iterator

import numpy as np

from footfall.balance.balance_settings import GRAVITY
from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.frames import require_transform
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot
from footfall.robot.tolerance import within_in_words
from footfall.sequence.commands import LEG_JOINTS, Command, RuleResult
from footfall.sequence.motion import check_motion
from footfall.sequence.passage import passages
from footfall.sequence.predict import FARTHEST, addressed, needed_duration, predict, target
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import Yielding
from footfall.sequence.yielding_rules import check_yielding
from footfall.telemetry.command_kinds import KINDS, UNKNOWN
from footfall.terrain.dem import Dem

TERRAIN_GIVEN = "terrain-given"
FARTHEST_OFF = 1e8
"""Where a rover may start from the site's origin, along any axis [m]: as far as vertices of meshes."""
SPEED_TOLERANCE = 1e-9
"""Seconds by which a duration may miss the least one: rounding of a split row, nothing more."""


def check_rules(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
    set_points: Array | None = None,
    yielding: Yielding | None = None,
) -> tuple[RuleResult, ...]:
    """Check every rule on every row; see the module.

    Args:
        robot: the rover.
        commands: the rows.
        start: posture before the first, (legs × 6,) [rad].
        T_site_base: pose of the chassis before the first, (4, 4).
        dem: the ground, in site; None: motion is not checked.
        settings: how closely is looked, and what is asked for; None: as delivered.
        set_points: of a rover that sags, before the first command and after each, (commands + 1, legs × 6) [rad]; None:
            those of a rigid one.
        yielding: the prediction over the terrain of a rover that sags, instead of that of ``dem``; None: it is rigid.

    Returns:
        The results.

    Raises:
        InvalidSequence: the start doesn't fit the robot.
    """
    require_start(robot, start, T_site_base)
    n = 6 * robot.leg_count
    results = [RuleResult("not-empty", -1, bool(commands), np.nan, "", f"{len(commands)} commands")]
    if set_points is None:
        reached = (
            predict(start, commands)
            if dem is None
            else np.array([one.after for one in passages(robot, start, T_site_base, commands, dem)])
        )
        set_points = np.vstack([start, reached.reshape(-1, n)])
    for row, command in enumerate(commands):
        results += _row_rules(robot, row, command, set_points[row])
    if yielding is not None:
        results += check_yielding(robot, commands, yielding, settings or SequenceSettings())
    elif dem is not None:
        results += check_motion(robot, commands, start, T_site_base, dem, settings or SequenceSettings())
    return tuple(sorted(results, key=lambda result: result.row))


def require_start(robot: Robot, start: Array, T_site_base: Array) -> None:
    """Refuse a start that no commands of the robot can have.

    Args:
        robot: the rover.
        start: posture, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).

    Raises:
        InvalidSequence: another shape, no number, an angle that no joint has, or no pose.
    """
    n = 6 * robot.leg_count
    if start.shape != (n,) or not np.isfinite(start).all():
        raise InvalidSequence(f"the start posture needs {n} finite joint angles [rad]", shape=list(start.shape))
    if (farthest := float(np.abs(start).max())) > FARTHEST:
        raise InvalidSequence(f"the start posture has an angle of {farthest:z.6g} rad: were these degrees?")
    require_transform(T_site_base, "T_site_base")
    if (off := float(np.abs(T_site_base[:3, 3]).max())) > FARTHEST_OFF:
        raise InvalidSequence(f"T_site_base lies {off:z.6g} m from the site's origin, {FARTHEST_OFF:z.0e} m at most")


def _row_rules(robot: Robot, row: int, command: Command, before: Array) -> Iterator[RuleResult]:
    def result(rule: str, holds: bool, text: str, margin: float = np.nan, unit: str = "") -> RuleResult:
        return RuleResult(rule, row, bool(holds), float(margin), unit, text)

    kind = command.kind
    known = kind is not UNKNOWN
    yield result("known-command", known, command.name if known else f"{command.name!r} is none of {', '.join(KINDS)}")
    if not known:
        return
    count, needed_count = 0 if command.joints is None else len(command.joints), kind.joint_count(robot.leg_count)
    if kind.names_leg:
        last = robot.leg_count - 1
        leg_exists = command.leg is not None and 0 <= command.leg <= last
        yield result("leg-exists", leg_exists, f"leg {command.leg} of 0…{last}")
    else:
        moved = "all legs" if kind.moves else "no leg"
        yield result("leg-exists", command.leg is None, f"{kind.name} moves {moved}: its leg is None")
    if kind.moves:
        rule = "all-joints" if kind.moves_all else "six-joints"
        yield result(rule, count == needed_count, f"{count} joints of {needed_count}")
    else:
        yield result("six-joints", command.joints is None, f"{kind.name} moves nothing: its joints are None")
    joints = np.array([]) if command.joints is None else command.joints
    numbers = [*joints, command.duration, *([] if command.force is None else [command.force])]
    finite = bool(np.isfinite(numbers).all())
    yield result(
        "finite", finite, "all numbers are finite" if finite else "a joint, the duration or the force is not finite"
    )
    if finite and (checked := _force(robot, command)) is not None:
        yield result("force", *checked, "N")
    if np.isfinite(command.duration):
        yield result("duration", command.duration >= 0, f"{command.duration:z.3f} s", command.duration, "s")
    asked = addressed(command, robot.leg_count)
    if finite and asked is not None:
        own = asked[0]
        spare = room_to_limits(robot, joints, own)
        worst = int(np.argmin(spare))
        name = LEG_JOINTS[worst] if kind.names_leg else robot.joint_names[worst]
        yield result(
            "joint-limits",
            spare[worst] >= 0,
            f"{name} at {within_in_words(robot, own.start + worst, float(joints[worst]))}",
            spare[worst],
            "rad",
        )
        if target(command, robot.leg_count) is None:
            return
        needed = needed_duration(joints - before[own], robot.speed_limits[own])
        yield result(
            "speed",
            command.duration >= needed - SPEED_TOLERANCE,
            f"takes {command.duration:z.3f} s, the speed limits need {needed:z.3f} s",
            command.duration - needed,
            "s",
        )


def _force(robot: Robot, command: Command) -> tuple[bool, str, float] | None:
    """The rule force: whether it holds, in words, and its margin [N]. None where there is nothing to ask."""
    if not command.kind.ends_by_force:
        given = f"{command.name} waits for no force: its force is None"
        return None if command.force is None else (False, given, np.nan)
    if command.force is None:
        return False, f"{command.name} needs the force that ends it", np.nan
    most = robot.mass * GRAVITY
    text = f"{command.force:z.1f} N, above zero and at most the rover's weight on Earth, {most:z.0f} N"
    return 0 < command.force <= most, text, min(command.force, most - command.force)
