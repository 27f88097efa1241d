"""How an execution begins: what is asked, whether the rover is where the plan starts, and how it rests there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance
from footfall.planning.answers import No, Status
from footfall.planning.body.body_move import stance_of
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.scene.whole_body import WholeBody
from footfall.planning.step.problem import StepPlan
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

REACH_OUT = 0.5
"""Ground beyond feet and chassis that the leg may step onto [m]."""
MOVED_Q, MOVED = 0.02, 0.03
"""A joint [rad] and the chassis [m] may be so far from where the plan starts: more, and it is another stance."""


@dataclass(frozen=True)
class Beginning:
    """The yielding rover at rest. body: its chassis and links over the ground around, which has no holes."""

    rover: CompliantRover
    body: WholeBody
    rest: RestingRover


def asked_of(
    robot: Robot, dem: Dem, state: RobotState, plan: StepPlan | BodyMovePlan, settings: ExecutionSettings | None
) -> tuple[ExecutionSettings, Provenance]:
    """The settings, as delivered where there are none, and the provenance of an execution with them.

    Raises InvalidInput where plan, state or settings are of another robot or make no sense.
    """
    settings = settings or ExecutionSettings()
    if not isinstance(settings, ExecutionSettings):
        raise InvalidInput("an execution takes ExecutionSettings")
    require_fit(robot, state, plan.parents)
    parents = {"plan": plan.digest, "state": state.digest, "dem": dem.digest, "robot": robot.digest}
    return settings, Provenance(parents, settings)


def require_fit(robot: Robot, state: RobotState, parents: Mapping[str, str]) -> None:
    """Raises InvalidInput where the state, or a plan of these parents, is of another robot."""
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    planned_for = parents.get("robot")
    if planned_for is not None and planned_for != robot.digest:
        raise InvalidInput(
            f"the plan was made for another robot than {robot.name}; give the one it was planned with",
            planned_for=planned_for,
            given=robot.digest,
        )


def moved(state: RobotState, posture: Array, T_site_base: Array) -> str:
    """How far the rover is from where a plan starts, for a person.

    Args:
        state: how the rover stands.
        posture: that the plan starts from, (legs × 6,) [rad].
        T_site_base: pose of the chassis that it starts from, (4, 4).

    Returns:
        One sentence; empty where the rover is there.
    """
    joints = float(np.abs(state.posture - posture).max())
    chassis = float(np.linalg.norm(state.T_site_base[:3, 3] - T_site_base[:3, 3]))
    if joints > MOVED_Q or chassis > MOVED:
        return f"a joint is {joints:z.3f} rad and the chassis {chassis:z.3f} m from where the plan starts"
    return ""


def beginning(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    settings: ExecutionSettings,
    commanded: ArrayLike | None,
    reach_out: float = 0.0,
    rest: RestingRover | None = None,
) -> Beginning | No:
    """The rover of a state, or why it can't begin there.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: telemetered, or of a predicted rest.
        settings: how the rover sags, and what is asked of it.
        commanded: the present set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        reach_out: ground is seen so far beyond feet and chassis [m].
        rest: the predicted one that the state is of; None: it was measured.

    Returns:
        The rover at rest on its ground, or the refusal.
    """
    stance = stance_of(robot, dem, state, settings.clearance, reach_out)
    if isinstance(stance, No):
        return stance
    ground = stance.body.ground
    rover = CompliantRover(robot, ground.dem, settings.compliance, ground.filled)
    if rest is None:
        try:
            rest = measured(rover, state, commanded)
        except InvalidInput as err:
            return No(Status.START_INVALID, f"{err.message}; put the legs down first")
    return Beginning(rover, stance.body, rest)
