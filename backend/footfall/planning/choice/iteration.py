"""One iteration: the rover goes on for a piece of its way by a gait or the walk planner, or a check refuses it."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from footfall.balance.support import support_polygon
from footfall.core.arrays import Array
from footfall.core.frames import rotation
from footfall.core.polygon import area
from footfall.planning.answers import Status
from footfall.planning.body.after import state_after
from footfall.planning.choice.actions import WALK, way_of_going
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.reward import Came
from footfall.planning.choice.seconds import seconds_of
from footfall.planning.gait.plan import plan_gait
from footfall.planning.gait.problem import GaitPlan
from footfall.planning.walk.body_kernel import MARGIN, NEAR, TORQUE
from footfall.planning.walk.body_way import NAMES
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkPlan
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Plan: TypeAlias = GaitPlan | WalkPlan

_MISHAPS = {NAMES[MARGIN]: "tip", NAMES[TORQUE]: "torque", NAMES[NEAR]: "collision"}
WITHIN = 0.05
"""Of a walk's goal, so that it goes about as far as a gait does [m]."""


@dataclass(frozen=True, eq=False)
class Iteration:
    """What came of one iteration, and the plan by which it went.

    plan: where it was found; state: of the rover after it. reason: why it was refused, or empty. timed_out: whether the
    clock ended the search, so that it may not come out the same again.
    """

    came: Came
    plan: Plan | None
    state: RobotState
    reason: str = ""
    timed_out: bool = False


def onto_of(state: RobotState, goal: Array, ahead: float, offset: float = 0.0) -> Array:
    """Where the next iteration goes to.

    Args:
        state: how the rover stands.
        goal: (2,) in site [m].
        ahead: how far it goes [m].
        offset: by how much it turns away from the goal, to the left positive [rad].

    Returns:
        (2,) in site [m], straight ahead the goal itself where that is nearer.
    """
    here = state.T_site_base[:2, 3]
    away = float(np.hypot(*(goal - here)))
    if offset:
        return here + rotation("z", offset)[:2, :2] @ (goal - here) * (min(away, ahead) / max(away, 1e-9))
    # what is left after this one is not to be shorter than half of it
    return np.array(goal, np.float64) if away <= 1.5 * ahead else here + (goal - here) * (ahead / away)


def iterate(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    action: str,
    goal: Array,
    settings: ChoiceSettings,
    seed: int = 0,
    offset: float = 0.0,
) -> Iteration:
    """Go on towards a goal by one action.

    Of what checks refuse nothing is carried out: the rover stays. Motions are quasi-static, as they are planned. The
    same arguments come to the same.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        action: one of ACTIONS.
        goal: (2,) in site [m].
        settings: how far an iteration goes, and how fast.
        seed: of the walk planner.
        offset: by how much it turns away from the goal, to the left positive [rad].

    Returns:
        What came of it.

    Raises:
        InvalidInput: arguments make no sense.
    """
    to = onto_of(state, np.asarray(goal, np.float64), settings.ahead, offset)
    way = way_of_going(action)
    if way == WALK:
        asked = WalkGoal(float(to[0]), float(to[1]), within=WITHIN)
        result = plan_walk(robot, dem, state, asked, seed=seed, settings=settings.walks)
        mishap = ""
    else:
        result = plan_gait(robot, dem, state, (float(to[0]), float(to[1])), way, settings.gaits)
        mishap = mishap_of(result.failure.check_name) if result.failure else ""
    plan = result.plan
    if plan is None:
        timed_out = result.status is Status.TIME_LIMIT
        return Iteration(Came(refused=True, mishap=mishap), None, state, result.reason, timed_out)
    after = state_after(robot, dem, state, plan.waypoints[-1], plan.Ts_site_base[-1], plan.digest)
    nearer = np.hypot(*(goal - state.T_site_base[:2, 3])) - np.hypot(*(goal - after.T_site_base[:2, 3]))
    came = Came(float(nearer), support_of(plan), seconds_of(robot, plan, settings), len(plan.groups))
    return Iteration(came, plan, after)


def mishap_of(check_name: str) -> str:
    """What would have happened had a gait gone on where a check fails, one of MISHAPS.

    Empty where it could not have gone on: no footfall, no reach.
    """
    return next((mishap for name, mishap in _MISHAPS.items() if check_name.startswith(name)), "")


def support_of(plan: Plan) -> float:
    """Mean over the foot moves of the area of the polygon of the feet that stand meanwhile [m²]."""
    areas = []
    for stance, group in zip(plan.stances, plan.groups, strict=False):
        standing = [leg for leg in range(len(stance.contacts)) if leg not in group]
        areas.append(area(support_polygon(stance.contacts[standing])))
    return float(np.mean(areas)) if areas else 0.0
