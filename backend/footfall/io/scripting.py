"""Calls for scripts that look up what the pure functions below want handed to them."""

from footfall.core.errors import InvalidSequence
from footfall.io.robot_files import load_robot, robot_names
from footfall.planning.execution.problem import BodyExecution, Execution
from footfall.planning.legged.problem import LeggedPlan
from footfall.planning.stance.move import BodyMovePlan
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
    """Commands of a step or walk, an execution of one, or a move of the chassis.

    As :func:`footfall.sequence.make.make_sequence`, and :func:`footfall.sequence.of_legged.make_legged_sequence` for a
    robot that others described, which needs ``robot`` and ``dem``.

    Without ``robot`` the one that the plan names by digest is taken, where it ships with FootFall.
    Raises InvalidSequence where it does not, and where plan and robot are of different kinds.
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
