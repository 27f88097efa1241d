"""A checked plan becomes commands with durations; nothing is merged, rounded or left out."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.execution.problem import BodyExecution, Execution
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.parts import parts_of
from footfall.planning.walk.problem import Tethered, WalkPlan, WalkSettings
from footfall.planning.walk_execution.problem import WalkExecution
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, Sequence, leg_move, posture_move
from footfall.sequence.drum import on_tether, slow_enough
from footfall.sequence.of_execution import sequence_of_execution
from footfall.sequence.passage import passages, poses, postures
from footfall.sequence.predict import needed_duration
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.telemetry.command_kinds import LEG_MOVE
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

Part = StepPlan | BodyMovePlan


def make_sequence(
    plan: StepPlan | BodyMovePlan | WalkPlan | Execution | BodyExecution | WalkExecution,
    robot: Robot,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
) -> Sequence:
    """One command for each waypoint after the first, at ``speed_fraction`` of the speed limits.

    A step becomes LEG_MOVEs, a move of the chassis POSTURE_MOVEs, a walk both in turn, all as if the rover were rigid.
    An execution becomes what it commands a rover that sags, see :mod:`footfall.sequence.of_execution`. With ``dem`` the
    motion rules (collision, balance, torque…) are checked too. No command drives the drum of a tether: commands of a
    walk on one take as long as its drum does, and fail a rule that says what it would have to pay out. Without
    ``settings`` the clearance, the balance preference and the payload are the plan's own.

    Raises InvalidSequence where the plan was made for another robot, moves more than its leg, or is a walk to where the
    rover is already.
    """
    if isinstance(plan, (Execution, BodyExecution, WalkExecution)):
        return sequence_of_execution(plan, robot, dem, settings)
    parts = parts_of(plan) if isinstance(plan, WalkPlan) else (plan,)
    if not parts:
        raise InvalidSequence("the walk goes nowhere: the rover is where it is to be, there is nothing to command")
    settings = settings or _with_load_of(plan, settings_of(parts[0]))
    for part in parts:
        _require_fit(part, robot)
    limits = robot.speed_limits * settings.speed_fraction
    tethered = plan.tethered if isinstance(plan, WalkPlan) else None
    commands = tuple(command for part in parts for command in _of_part(part, limits, tethered))
    T_site_base = plan.T_site_base if isinstance(plan, StepPlan) else plan.Ts_site_base[0]
    # where there is no terrain to tell: of a walk all stand whenever the chassis moves
    down = next((part.standing for part in parts if isinstance(part, BodyMovePlan)), None)
    start = plan.waypoints[0]
    parents = {"plan": plan.digest, "robot": robot.digest}
    if dem is not None:
        parents["dem"] = dem.digest
    way = passages(robot, start, T_site_base, commands, dem, down)
    sequence = Sequence(
        robot=robot.name,
        commands=commands,
        start=start,
        predicted=postures(way, start),
        T_site_base=T_site_base,
        rules=check_rules(robot, commands, start, T_site_base, dem, settings),
        provenance=Provenance(parents, settings),
        Ts_site_base=poses(way),
    )
    return on_tether(sequence, None if tethered is None else tethered.tether)


def _of_part(part: Part, limits: Array, tethered: Tethered | None) -> tuple[Command, ...]:
    if isinstance(part, StepPlan):
        return _of_step(part, limits)
    commands = _of_body_move(part, limits)
    if tethered is None:
        return commands
    return slow_enough(commands, tethered.tether.lengths(part.Ts_site_base), tethered.tether)


def _of_step(plan: StepPlan, limits: Array) -> tuple[Command, ...]:
    leg = slice(6 * plan.leg, 6 * plan.leg + 6)
    return tuple(
        leg_move(plan.leg, target[leg], needed_duration(target[leg] - before[leg], limits[leg]), phase)
        for before, target, phase in zip(plan.waypoints[:-1], plan.waypoints[1:], plan.phases[1:], strict=True)
    )


def _of_body_move(plan: BodyMovePlan, limits: Array) -> tuple[Command, ...]:
    return tuple(
        posture_move(target, needed_duration(target - before, limits), "shift")
        for before, target in pairwise(plan.waypoints)
    )


def settings_of(plan: Part) -> SequenceSettings:
    """Sequence settings that check what the plan was checked with."""
    made_with = plan.provenance.settings
    if not isinstance(made_with, (StepSettings, BodyMoveSettings)):
        return SequenceSettings()
    return SequenceSettings(
        clearance=made_with.clearance,
        conservative=made_with.conservative,
        least_margin=made_with.least_margin,
        friction=made_with.friction,
    )


def _with_load_of(plan: Part | WalkPlan, settings: SequenceSettings) -> SequenceSettings:
    """The settings with the payload that a walk was planned with."""
    asked = plan.provenance.settings
    if not isinstance(asked, WalkSettings):
        return settings
    return replace(settings, payload_mass=asked.payload_mass, payload_position=asked.payload_position)


def _require_fit(plan: Part, robot: Robot) -> None:
    planned_for = plan.parents.get("robot")
    if planned_for is not None and planned_for != robot.digest:
        raise InvalidSequence(
            f"the plan was made for another robot than {robot.name}; give the one it was planned with",
            planned_for=planned_for,
            given=robot.digest,
        )
    n = 6 * robot.leg_count
    if plan.waypoints.ndim != 2 or plan.waypoints.shape[1] != n or len(plan.waypoints) < 2:
        raise InvalidSequence(
            f"a plan for {robot.name} needs at least two waypoints of {n} angles", shape=list(plan.waypoints.shape)
        )
    if isinstance(plan, BodyMovePlan):
        return
    if not 0 <= plan.leg < robot.leg_count:
        raise InvalidSequence(f"{robot.name} has legs 0…{robot.leg_count - 1}", leg=plan.leg)
    others = np.delete(plan.waypoints, np.s_[6 * plan.leg : 6 * plan.leg + 6], axis=1)
    if not (others == others[0]).all():
        raise InvalidSequence(f"the plan moves more than its leg; a {LEG_MOVE.name} can't say that", leg=plan.leg)
