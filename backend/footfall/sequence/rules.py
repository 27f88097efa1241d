"""The rules of a sequence, checked on every row: form, joint limits, speeds and, over terrain, the motion itself.

Rule names are stable; the page, exports and the command gate show them.

=================  ==============================================================  =========
rule               what it asks                                                    margin
=================  ==============================================================  =========
not-empty          there is at least one command (row −1)                          –
known-command      the name is LEG_MOVE or WAIT                                    –
leg-exists         the robot has the leg; WAIT names none                          –
six-joints         LEG_MOVE has six joints, WAIT none                              –
finite             joints and duration are finite numbers                          –
duration           not negative                                                    s
joint-limits       every joint within its limits                                   rad
speed              no joint faster than its limit                                  s
self-collision     dense samples keep the clearances between links                 m
terrain-collision  dense samples keep the clearances to the true terrain           m
no-drag            a wheel that is down on the ground is not moved sideways        m
balance            centre of mass inside the polygon of the feet on the ground     m
torque             some contact forces keep every joint within its torque limit    ratio
ends-on-ground     a leg that was moved is down after its last row                 m
terrain-given      an edit without a terrain left the checked motion as it was     –
=================  ==============================================================  =========

The six before the last need a terrain; the last stands only where it fails (row −1).
A rule that can't be asked because an earlier one of the same row failed (the speed of NaN) is left out for that row.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidSequence
from footfall.core.frames import require_transform
from footfall.robot.model import Robot
from footfall.sequence.commands import COMMAND_NAMES, LEG_JOINTS, Command, RuleResult
from footfall.sequence.motion import check_motion
from footfall.sequence.predict import after, needed_duration, target
from footfall.sequence.settings import SequenceSettings
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

TERRAIN_GIVEN = "terrain-given"
SPEED_TOLERANCE = 1e-9
"""Seconds by which a duration may miss the least one: rounding of a split row, nothing more."""


def check_rules(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
) -> tuple[RuleResult, ...]:
    """Check every rule on every row; see the module docstring.

    start: (legs × 6,) [rad]; T_site_base: (4, 4). Raises InvalidSequence where the start doesn't fit the robot.
    """
    n = 6 * robot.leg_count
    if start.shape != (n,) or not np.isfinite(start).all():
        raise InvalidSequence(f"the start posture needs {n} finite joint angles [rad]", shape=list(start.shape))
    require_transform(T_site_base, "T_site_base")
    results = [RuleResult("not-empty", -1, bool(commands), np.nan, "", f"{len(commands)} commands")]
    before = start
    for row, command in enumerate(commands):
        results += _row_rules(robot, row, command, before)
        before = after(before, command)
    if dem is not None:
        results += check_motion(robot, commands, start, T_site_base, dem, settings or SequenceSettings())
    return tuple(sorted(results, key=lambda result: result.row))


def _row_rules(robot: Robot, row: int, command: Command, before: Array) -> Iterator[RuleResult]:
    def result(rule: str, holds: bool, text: str, margin: float = np.nan, unit: str = "") -> RuleResult:
        return RuleResult(rule, row, bool(holds), float(margin), unit, text)

    known = command.name in COMMAND_NAMES
    yield result(
        "known-command", known, command.name if known else f"{command.name!r} is none of {', '.join(COMMAND_NAMES)}"
    )
    if not known:
        return
    wait = command.name == "WAIT"
    if wait:
        yield result("leg-exists", command.leg is None, "WAIT moves no leg: its leg is None")
        yield result("six-joints", command.joints is None, "WAIT moves nothing: its joints are None")
    else:
        last = robot.leg_count - 1
        leg_exists = command.leg is not None and 0 <= command.leg <= last
        yield result("leg-exists", leg_exists, f"leg {command.leg} of 0…{last}")
        count = 0 if command.joints is None else len(command.joints)
        yield result("six-joints", count == 6, f"{count} joints of 6")
    joints = np.array([]) if command.joints is None else command.joints
    finite = bool(np.isfinite(joints).all()) and bool(np.isfinite(command.duration))
    yield result("finite", finite, "all numbers are finite" if finite else "a joint or the duration is not finite")
    if np.isfinite(command.duration):
        yield result("duration", command.duration >= 0, f"{command.duration:.3f} s", command.duration, "s")
    moved = target(command, robot.leg_count)
    if finite and moved is not None:
        leg = slice(6 * moved[0], 6 * moved[0] + 6)
        room = np.minimum(joints - robot.lower[leg], robot.upper[leg] - joints)
        worst = int(np.argmin(room))
        yield result(
            "joint-limits",
            room[worst] >= 0,
            f"{LEG_JOINTS[worst]} at {joints[worst]:.4f} rad, "
            f"limits {robot.lower[leg][worst]:.4f} … {robot.upper[leg][worst]:.4f} rad",
            room[worst],
            "rad",
        )
        needed = needed_duration(joints - before[leg], robot.speed_limits[leg])
        yield result(
            "speed",
            command.duration >= needed - SPEED_TOLERANCE,
            f"takes {command.duration:.3f} s, the speed limits need {needed:.3f} s",
            command.duration - needed,
            "s",
        )
