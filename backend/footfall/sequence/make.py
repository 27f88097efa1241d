"""A checked plan becomes commands with durations; nothing is merged, rounded or left out."""

from collections.abc import Iterator

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.execution.problem import BodyExecution, Execution
from footfall.planning.motion import BODY, Motion
from footfall.planning.queue.problem import PlanQueue
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.problem import WalkPlan, WalkSettings
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

RigidPlan = StepPlan | BodyMovePlan | WalkPlan | PlanQueue


def make_sequence(
    plan: RigidPlan | Execution | BodyExecution | WalkExecution,
    robot: Robot,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
) -> Sequence:
    """One command for each waypoint after the first, at ``speed_fraction`` of the speed limits.

    A step becomes LEG_MOVEs, a move of the chassis POSTURE_MOVEs, a walk or a queue both in turn, all as if the rover
    were rigid.
    An execution becomes what it commands a rover that sags, see :mod:`footfall.sequence.of_execution`. With ``dem`` the
    motion rules (collision, balance, torque…) are checked too. No command drives the drum of a tether: commands of a
    walk on one take as long as its drum does, and fail a rule that says what it would have to pay out. Without
    ``settings`` the clearance, the balance preference and the payload are the plan's own; of a queue each row is held
    to the strictest that an entry was planned with.

    Raises InvalidSequence where the plan was made for another robot, moves more than its leg, or is a walk to where the
    rover is already.
    """
    if isinstance(plan, (Execution, BodyExecution, WalkExecution)):
        return sequence_of_execution(plan, robot, dem, settings)
    settings = settings or settings_of(plan)
    motion = _fitting(plan, robot)
    commands = tuple(_commands(motion, robot.speed_limits * settings.speed_fraction))
    tether = plan.tethered.tether if isinstance(plan, WalkPlan) and plan.tethered is not None else None
    if tether is not None:
        commands = slow_enough(commands, tether.lengths(motion.Ts_site_base), tether)
    start, T_site_base = motion.waypoints[0], motion.Ts_site_base[0]
    # where there is no terrain to tell: of a plan the same stand whenever the chassis moves
    carrying = motion.stays[1:][[phase == BODY for phase in motion.phases[1:]]]
    down = np.flatnonzero(carrying[0]).tolist() if len(carrying) else None
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
    return on_tether(sequence, tether)


def _commands(motion: Motion, limits: Array) -> Iterator[Command]:
    """Of each row but the first."""
    for row in range(1, len(motion.phases)):
        before, target = motion.waypoints[row - 1 : row + 1]
        lifted = motion.lifted(row)
        if not lifted:
            yield posture_move(target, needed_duration(target - before, limits), "shift")
            continue
        (leg,) = lifted
        own = slice(6 * leg, 6 * leg + 6)
        yield leg_move(leg, target[own], needed_duration(target[own] - before[own], limits[own]), motion.phases[row])


def settings_of(plan: RigidPlan) -> SequenceSettings:
    """Sequence settings that check what the plan was checked with, under the payload that it was planned with."""
    if isinstance(plan, PlanQueue):
        return _strictest([settings_of(one.plan) for one in plan.entries])
    made_with = plan.provenance.settings
    if isinstance(plan, WalkPlan):
        asked = made_with if isinstance(made_with, WalkSettings) else WalkSettings()
        return SequenceSettings(
            clearance=asked.clearance,
            conservative=asked.support == "required",
            least_margin=asked.least_margin,
            friction=asked.friction,
            payload_mass=asked.payload_mass,
            payload_position=asked.payload_position,
        )
    if not isinstance(made_with, (StepSettings, BodyMoveSettings)):
        return SequenceSettings()
    return SequenceSettings(
        clearance=made_with.clearance,
        conservative=made_with.conservative,
        least_margin=made_with.least_margin,
        friction=made_with.friction,
    )


def _strictest(each: list[SequenceSettings]) -> SequenceSettings:
    return SequenceSettings(
        clearance=max(one.clearance for one in each),
        conservative=any(one.conservative for one in each),
        least_margin=max(one.least_margin for one in each),
        friction=min(one.friction for one in each),
    )


def _fitting(plan: RigidPlan, robot: Robot) -> Motion:
    """The plan's motion. Raises InvalidSequence where it is not one of this robot that commands can say."""
    planned_for = plan.parents.get("robot")
    if planned_for is not None and planned_for != robot.digest:
        raise InvalidSequence(
            f"the plan was made for another robot than {robot.name}; give the one it was planned with",
            planned_for=planned_for,
            given=robot.digest,
        )
    n = 6 * robot.leg_count
    if isinstance(plan, WalkPlan) and len(plan.waypoints) < 2:
        raise InvalidSequence("the walk goes nowhere: the rover is where it is to be, there is nothing to command")
    if plan.waypoints.ndim != 2 or plan.waypoints.shape[1] != n or len(plan.waypoints) < 2:
        raise InvalidSequence(
            f"a plan for {robot.name} needs at least two waypoints of {n} angles", shape=list(plan.waypoints.shape)
        )
    legs = plan.legs if isinstance(plan, (WalkPlan, PlanQueue)) else (plan.leg,) if isinstance(plan, StepPlan) else ()
    for leg in legs:
        if not 0 <= leg < robot.leg_count:
            raise InvalidSequence(f"{robot.name} has legs 0…{robot.leg_count - 1}", leg=leg)
    motion = plan.motion
    turned = (np.diff(motion.waypoints, axis=0) != 0.0).reshape(-1, robot.leg_count, 6).any(axis=2)
    for row in range(1, len(motion.phases)):
        if (lifted := motion.lifted(row)) and (turned[row - 1] & motion.stays[row]).any():
            raise InvalidSequence(f"the plan moves more than its leg; a {LEG_MOVE.name} can't say that", leg=lifted[0])
    return motion
