"""The commands of a step or walk of a robot that others described, with its own legs and joints.

A robot of which it is known how its joints give way is commanded set points that hold its chassis where the plan has
it: before a foot is lifted its load goes to the others, and once it is down it takes its share again.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput, InvalidSequence
from footfall.core.frames import apply, require_transform
from footfall.core.value import Provenance
from footfall.planning.legged.footing import rest
from footfall.planning.legged.measured import as_measured, set_points_of
from footfall.planning.legged.problem import LeggedPlan
from footfall.planning.legged.sagging import held_set_points
from footfall.planning.legged.under_feet import ground_under
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import AtRest, Command, Sequence, leg_move, posture_move
from footfall.sequence.foot_moves import LOADS
from footfall.sequence.legged_passage import asked_for, landed
from footfall.sequence.legged_rules import check_legged_rules
from footfall.sequence.predict import needed_duration
from footfall.sequence.sequence_settings import COARSEST, SequenceSettings
from footfall.terrain.dem import Dem

FASTEST_TURN, FASTEST_SLIDE = 0.5, 0.05
"""How fast joints go at most [rad/s, m/s], also where no limit is said: walks are planned for statics, and the speed
limits of motors are not made for them."""
RAMP = 0.5
"""In so many seconds a motion comes to its full speed, and at its end to rest [s]: a chassis that starts or stops at
once takes feet off the ground."""


def make_legged_sequence(
    plan: LeggedPlan, robot: LeggedRobot, dem: Dem, settings: SequenceSettings | None = None
) -> Sequence:
    """One command for each waypoint after the first: a LEG_MOVE where a foot is in the air, else a POSTURE_MOVE.

    Of a robot that sags there is one more before and after each foot move, by which the load changes feet. Each takes
    as long as ``speed_fraction`` of the speed limits, and FASTEST_TURN and FASTEST_SLIDE, need, longer where its motion
    begins and ends (RAMP). The ground is where the plan's feet have it at first. Raises InvalidSequence for another
    robot's plan, one that goes nowhere, and one that nothing holds.
    """
    joints = len(robot.joint_names)
    if plan.start.robot != robot.name or plan.waypoints.shape[1:] != (joints,):
        raise InvalidSequence(f"the plan is one of {plan.start.robot}, not of {robot.name} with its {joints} joints")
    if len(plan.waypoints) < 2:
        raise InvalidSequence("the plan goes nowhere: there is nothing to command")
    settings = settings or SequenceSettings(sample=COARSEST)
    ground = ground_under(robot, dem, plan.start.soles, robot.legs)
    sliding = np.isin(robot.joint_names, robot.layout.sliding)
    fastest = np.where(sliding, FASTEST_SLIDE, FASTEST_TURN)
    speeds = np.minimum(settings.speed_fraction * robot.speeds, fastest)
    durations = _durations(plan, speeds)
    rows = [
        _Row(int(leg), phase, target, T, float(duration))
        for target, T, leg, phase, duration in zip(
            plan.waypoints[1:], plan.Ts_site_base[1:], plan.legs[1:], plan.phases[1:], durations, strict=True
        )
    ]
    if robot.sags:
        commands = _holding(robot, ground, plan, rows, settings.speed_fraction * robot.speeds)
    else:
        commands = tuple(_command(robot, row.leg, row.phase, row.posture, row.duration) for row in rows)
    parents = {"plan": plan.digest, "robot": robot.digest, "dem": dem.digest}
    start = plan.waypoints[0]
    return legged_sequence(
        robot, commands, start, plan.start.T_site_base, ground, settings, parents, plan.start.set_points
    )


class _Row(NamedTuple):
    """A waypoint that a command leads to: leg in the air or −1, phase, posture (joints,), T_site_base, seconds."""

    leg: int
    phase: str
    posture: Array
    T_site_base: Array
    duration: float


def legged_sequence(
    robot: LeggedRobot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
    parents: dict[str, str],
    set_points: Array | None = None,
) -> Sequence:
    """Commands with what they lead to and every rule's result.

    Args:
        robot: the robot.
        commands: the rows.
        start: posture before the first, (joints,) [rad or m].
        T_site_base: pose of the chassis before the first, (4, 4).
        dem: the ground, in site.
        settings: how closely is looked, and what is asked for.
        parents: name → digest of what the commands were made of.
        set_points: of a robot that sags, before the first, (joints,) [rad or m]; None: those that hold it.

    Returns:
        The sequence.

    Raises:
        InvalidSequence: the start doesn't fit the robot, or nothing holds it there.
    """
    if start.shape != (len(robot.joint_names),) or not np.isfinite(start).all():
        raise InvalidSequence(f"the start posture needs {len(robot.joint_names)} finite numbers", shape=[*start.shape])
    require_transform(T_site_base, "T_site_base")
    at_rest = _at_rest(robot, dem, start, T_site_base, set_points) if robot.sags else None
    rules, way = check_legged_rules(robot, commands, start, T_site_base, dem, settings, at_rest)
    commanded = np.array([row.asked for row in way]).reshape(len(way), len(start))
    return Sequence(
        robot=robot.name,
        commands=commands,
        start=start,
        predicted=np.array([row.after for row in way]).reshape(len(way), len(start)),
        T_site_base=T_site_base,
        rules=rules,
        provenance=Provenance(parents, settings),
        Ts_site_base=np.array([row.T_after for row in way]).reshape(len(way), 4, 4),
        described=robot.layout,
        at_rest=at_rest,
        commanded=None if at_rest is None else commanded,
    )


def _at_rest(robot: LeggedRobot, dem: Dem, start: Array, T_site_base: Array, set_points: Array | None) -> AtRest:
    """How the robot stands before the first command. Raises InvalidSequence where nothing holds it there."""
    places = landed(robot, dem, start, T_site_base, robot.legs)
    standing = [leg for leg, (sole, _, _) in zip(robot.legs, places, strict=True) if np.isfinite(sole).all()]
    try:
        state = as_measured(robot, start, T_site_base, _feet(robot, dem, start, T_site_base, standing))
    except InvalidInput as err:
        raise InvalidSequence(f"the commands can't start: {err.message}") from err
    return AtRest(state, set_points_of(robot, state) if set_points is None else set_points)


def _feet(robot: LeggedRobot, dem: Dem, q: Array, T_site_base: Array, standing: list[int]) -> Feet:
    """Feet that stand where a posture has them, on the ground below."""
    soles = apply(T_site_base, placed(robot, q).soles)
    rests = [rest(dem, float(x), float(y), float(r)) for (x, y, _), r in zip(soles, robot.radii, strict=True)]
    return Feet(standing, np.array([one.contact for one in rests]), np.array([one.normal for one in rests]))


def _holding(robot: LeggedRobot, dem: Dem, plan: LeggedPlan, rows: list[_Row], speeds: Array) -> tuple[Command, ...]:
    """Commands to set points that hold each waypoint, none faster than speeds (joints,) [rad/s or m/s].

    Raises InvalidSequence where nothing holds one.
    """

    def held(q: Array, T: Array, leg: int) -> Array:
        standing = [one for one in robot.legs if one != leg]
        try:
            return held_set_points(robot, q, T, _feet(robot, dem, q, T, standing))
        except InvalidInput as err:
            raise InvalidSequence(f"the plan can't be held: {err.message}") from err

    commands: list[Command] = []
    before = _Row(-1, "body", plan.waypoints[0], plan.Ts_site_base[0], 0.0)
    for row, after in zip(rows, [*rows[1:], None], strict=True):
        if row.leg >= 0 and row.leg != before.leg:
            commands.append(posture_move(held(before.posture, before.T_site_base, row.leg), RAMP, "unload"))
        target = held(row.posture, row.T_site_base, row.leg)
        commands.append(_command(robot, row.leg, row.phase, target, row.duration))
        if row.leg >= 0 and (after is None or after.leg != row.leg):
            commands.append(posture_move(held(row.posture, row.T_site_base, -1), RAMP, LOADS))
        before = row
    told = plan.start.set_points
    begins = held(plan.waypoints[0], plan.Ts_site_base[0], -1) if told is None else told
    return _slow_enough(robot, commands, begins, speeds)


def _slow_enough(robot: LeggedRobot, commands: list[Command], begins: Array, speeds: Array) -> tuple[Command, ...]:
    """Commands that take as long as their set points need: these go farther than the joints where loads change legs.

    begins: set points before the first, (joints,) [rad or m].
    """
    slowed, before = [], begins
    for command in commands:
        after = asked_for(robot, before, command)
        slowed.append(replace(command, duration=max(command.duration, needed_duration(after - before, speeds))))
        before = after
    return tuple(slowed)


def _durations(plan: LeggedPlan, speeds: Array) -> Array:
    """Seconds of each command; what one leg, or the chassis, does in one phase is a motion from rest to rest."""
    needed = np.array([needed_duration(after - before, speeds) for before, after in pairwise(plan.waypoints)])
    kinds = list(zip(plan.legs[1:].tolist(), plan.phases[1:], strict=True))
    begins = [k for k, kind in enumerate(kinds) if k == 0 or kind != kinds[k - 1]]
    return np.concatenate([ramped(part, RAMP) for part in np.split(needed, begins[1:])])


def ramped(needed: Array, ramp: float) -> Array:
    """Seconds of the parts of a motion that comes to full speed in ``ramp`` seconds, and to rest again in as many.

    needed: (n,) seconds of each part at full speed. A motion that is over before comes to less than full speed.
    """
    done = np.concatenate([[0.0], np.cumsum(needed)])
    half = done[-1] / 2

    def since_rest(way: Array) -> Array:
        return np.where(way < ramp / 2, np.sqrt(2 * ramp * np.minimum(way, ramp / 2)), way + ramp / 2)

    whole = 2 * since_rest(np.array(half))
    return np.diff(np.where(done <= half, since_rest(done), whole - since_rest(np.maximum(done[-1] - done, 0.0))))


def _command(robot: LeggedRobot, leg: int, phase: str, target: Array, duration: float) -> Command:
    if leg < 0:
        return posture_move(target, duration, "shift")
    return leg_move(leg, target[robot.slices[leg]], duration, phase)
