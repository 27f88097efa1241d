"""Calls for scripts that look up what the pure functions below want handed to them."""

from footfall.core.errors import InvalidSequence
from footfall.io.robot_files import load_robot, robot_names
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.execution.problem import BodyExecution, Execution
from footfall.planning.legged.problem import LeggedPlan
from footfall.planning.step.problem import StepPlan
from footfall.planning.walk.problem import WalkPlan
from footfall.planning.walk_execution.problem import WalkExecution
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sequence import make
from footfall.sequence.commands import Sequence
from footfall.sequence.of_legged import make_legged_sequence
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem


def make_sequence(
    plan: StepPlan | BodyMovePlan | WalkPlan | Execution | BodyExecution | WalkExecution | LeggedPlan,
    robot: Robot | LeggedRobot | None = None,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
) -> Sequence:
    """Make the commands of a step or walk, of an execution of one, or of a move of the chassis.

    As :func:`footfall.sequence.make.make_sequence`, and :func:`footfall.sequence.of_legged.make_legged_sequence` for a
    robot that others described.

    Args:
        plan: what is to be commanded; of a result it is ``result.plan``.
        robot: the one that it was planned with; None: the one that the plan names by digest, where it ships with
            FootFall. A robot that others described must be given.
        dem: the ground, in site; None: what the motion hits and what holds the rover is not checked. A robot that
            others described needs it.
        settings: with what commands are made and checked; None: clearance, balance preference and payload are the
            plan's own, all else as delivered.

    Returns:
        The commands in order, with what each rule says of each row.

    Raises:
        InvalidSequence: the plan is another robot's, goes nowhere or moves more than its leg; or its robot, needed
            here, is not given and does not ship with FootFall.
    """
    if isinstance(plan, LeggedPlan):
        if not isinstance(robot, LeggedRobot) or dem is None:
            raise InvalidSequence(f"commands for {plan.start.robot} need its description, robot=, and terrain, dem=")
        return make_legged_sequence(plan, robot, dem, settings)
    if isinstance(robot, LeggedRobot):
        raise InvalidSequence(f"the plan is none of {robot.name}")
    return make.make_sequence(plan, robot or _shipped_robot(plan), dem, settings)


def _shipped_robot(plan: StepPlan | BodyMovePlan | WalkPlan | Execution | BodyExecution | WalkExecution) -> Robot:
    digest = plan.parents.get("robot")
    for name in robot_names():
        robot = load_robot(name)
        if robot.digest == digest:
            return robot
    raise InvalidSequence(
        f"the plan was made for none of the robots that ship with FootFall ({', '.join(robot_names())}); "
        "give the robot it was planned with: make_sequence(plan, robot=robot)",
        planned_for=digest,
    )
