"""An execution, with set points and the predicted motion, becomes commands: nothing is left out.

It may be that of a step, of a move of the chassis, or of foot moves of a walk, which are one after the other.
"""

from dataclasses import dataclass

import numpy as np

from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.problem import BodyExecution, Execution, Predicted
from footfall.planning.walk_execution.problem import FootMoveExecution, WalkExecution
from footfall.robot.model import Robot
from footfall.sequence.commands import AtRest, Command, Sequence, leg_lower, leg_move, posture_move, wait
from footfall.sequence.from_rest import sequence_at_rest
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Executed = Execution | BodyExecution | FootMoveExecution | WalkExecution
"""What becomes commands here."""


@dataclass(frozen=True)
class _Row:
    """A command, and the waypoint that it ends at: of which part of the execution, and which of its waypoints."""

    command: Command
    part: Predicted
    at: int


def sequence_of_execution(
    execution: Executed, robot: Robot, dem: Dem | None = None, settings: SequenceSettings | None = None
) -> Sequence:
    """LEG_MOVEs and POSTURE_MOVEs to the set points, WAITs for the pauses, one LEG_LOWER for the guarded lowering.

    With ``dem`` the motion is predicted anew, from the commands alone, and the rules of motion are checked on it;
    without it the predicted motion is the execution's. Without ``settings`` they are the execution's own.

    Raises InvalidSequence where the execution is of another robot.
    """
    parts = execution.parts if isinstance(execution, (FootMoveExecution, WalkExecution)) else (execution,)
    for part in parts:
        _require_fit(part, robot)
    settings = settings or settings_of(parts[0])
    rows = [row for part in parts for row in _rows(part)]
    commands = tuple(row.command for row in rows)
    at_rest = _at_rest(parts[0], robot, settings)
    parents = {"execution": execution.digest, "robot": robot.digest}
    if dem is not None:
        return sequence_at_rest(robot, at_rest, commands, dem, settings, parents | {"dem": dem.digest})
    commanded = np.array([row.part.commanded[row.at] for row in rows])
    start, T_site_base = at_rest.state.posture, at_rest.state.T_site_base
    set_points = np.vstack([at_rest.set_points, commanded])
    return Sequence(
        robot=robot.name,
        commands=commands,
        start=start,
        predicted=np.array([row.part.predicted[row.at] for row in rows]),
        T_site_base=T_site_base,
        rules=check_rules(robot, commands, start, T_site_base, None, settings, set_points),
        provenance=Provenance(parents, settings),
        Ts_site_base=np.array([row.part.Ts_site_base[row.at] for row in rows]),
        at_rest=at_rest,
        commanded=commanded,
    )


def settings_of(execution: Predicted) -> SequenceSettings:
    """Sequence settings that check what the execution was checked with."""
    made_with = execution.provenance.settings
    if not isinstance(made_with, ExecutionSettings):
        return SequenceSettings()
    return SequenceSettings(
        speed_fraction=made_with.speed_fraction,
        clearance=made_with.clearance,
        conservative=made_with.conservative,
        friction=made_with.compliance.balance.friction,
        compliance=made_with.compliance,
    )


def _at_rest(execution: Predicted, robot: Robot, settings: SequenceSettings) -> AtRest:
    """How the rover stood when the execution starts."""
    posture, T_site_base = execution.predicted[0], execution.Ts_site_base[0]
    stiffness = (1.0 if settings.compliance is None else settings.compliance.joint_scale) * robot.stiffness
    torques = stiffness * (execution.commanded[0] - posture)
    state = RobotState(robot.name, 0.0, posture, T_site_base, execution.forces[0], torques, "idle")
    return AtRest(state, execution.commanded[0])


def _rows(execution: Predicted) -> list[_Row]:
    lowering = _lowered(execution) if isinstance(execution, Execution) else range(0)
    rows: list[_Row] = []
    for at in range(1, len(execution.phases)):
        if at in lowering[:-1]:
            continue
        if isinstance(execution, BodyExecution):
            command = posture_move(execution.commanded[at], float(execution.durations[at]), execution.phases[at])
        else:
            command = _lowering(execution, at) if at in lowering else _move(execution, at)
        rows.append(_Row(command, execution, at))
        if execution.pauses[at] > 0:
            rows.append(_Row(wait(float(execution.pauses[at])), execution, at))
    return rows


def _lowered(execution: Execution) -> range:
    """The waypoints of the guarded lowering, which is one command to the last of them."""
    stopped = execution.stopped_at if execution.stopped_at >= 0 else len(execution.phases) - 1
    return range(execution.guarded_from + 1, stopped + 1)


def _move(execution: Execution, at: int) -> Command:
    """To the set points of a waypoint; of one leg where only that moves."""
    leg, (before, target) = execution.leg, execution.commanded[at - 1 : at + 1]
    own = slice(6 * leg, 6 * leg + 6)
    seconds, phase = float(execution.durations[at]), execution.phases[at]
    if np.array_equal(np.delete(before, np.s_[own]), np.delete(target, np.s_[own])):
        return leg_move(leg, target[own], seconds, phase)
    return posture_move(target, seconds, phase)


def _lowering(execution: Execution, stopped: int) -> Command:
    """Its duration is that of all the way to ``lowest``, at the speed of the part that is predicted."""
    leg, guarded = execution.leg, execution.guarded_from
    own = slice(6 * leg, 6 * leg + 6)
    origin = execution.commanded[guarded, own]
    whole, part = (float(np.abs(q - origin).max()) for q in (execution.lowest, execution.commanded[stopped, own]))
    seconds = float(execution.durations[guarded + 1 : stopped + 1].sum()) * whole / part
    return leg_lower(leg, execution.lowest, seconds, execution.stop_force, "lower")


def _require_fit(execution: Predicted, robot: Robot) -> None:
    planned_for = execution.parents.get("robot")
    if planned_for is not None and planned_for != robot.digest:
        raise InvalidSequence(
            f"the execution was planned for another robot than {robot.name}; give the one it was planned with",
            planned_for=planned_for,
            given=robot.digest,
        )
    if execution.commanded.shape[1] != 6 * robot.leg_count:
        raise InvalidSequence(
            f"an execution for {robot.name} has set points of {6 * robot.leg_count} joints",
            shape=list(execution.commanded.shape),
        )
