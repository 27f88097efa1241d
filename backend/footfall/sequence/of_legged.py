"""The commands of a step or walk of a robot that others described, with its own legs and joints."""

from itertools import pairwise

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance
from footfall.planning.legged.problem import LeggedPlan
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.sequence.commands import Command, Sequence, leg_move, posture_move
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

    Each takes as long as ``speed_fraction`` of the speed limits, and FASTEST_TURN and FASTEST_SLIDE, need, longer where
    its motion begins and ends (RAMP). Raises InvalidSequence for another robot's plan and one that goes nowhere.
    """
    joints = len(robot.joint_names)
    if plan.start.robot != robot.name or plan.waypoints.shape[1:] != (joints,):
        raise InvalidSequence(f"the plan is one of {plan.start.robot}, not of {robot.name} with its {joints} joints")
    if len(plan.waypoints) < 2:
        raise InvalidSequence("the plan goes nowhere: there is nothing to command")
    settings = settings or SequenceSettings(sample=COARSEST)
    sliding = np.isin(robot.joint_names, robot.layout.sliding)
    fastest = np.where(sliding, FASTEST_SLIDE, FASTEST_TURN)
    speeds = np.minimum(settings.speed_fraction * robot.speeds, fastest)
    durations = _durations(plan, speeds)
    commands = tuple(
        _command(robot, int(leg), phase, target, float(duration))
        for target, leg, phase, duration in zip(
            plan.waypoints[1:], plan.legs[1:], plan.phases[1:], durations, strict=True
        )
    )
    parents = {"plan": plan.digest, "robot": robot.digest, "dem": dem.digest}
    return legged_sequence(robot, commands, plan.waypoints[0], plan.start.T_site_base, dem, settings, parents)


def legged_sequence(
    robot: LeggedRobot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
    parents: dict[str, str],
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

    Returns:
        The sequence.
    """
    rules, way = check_legged_rules(robot, commands, start, T_site_base, dem, settings)
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
    )


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
