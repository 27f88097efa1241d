"""What is measured of a planned step, beyond that it was found: length, clearance, smoothness.

Only the swing is looked at: lift and lowering are the same for every planner that reaches the same goal.

- *length*: Euclidean, in joint space, of the swing's waypoints [rad].
- *clearance*: the least distance of any link to what it must keep clear of, beyond the δ of that pair, at the waypoints
  [m]: the least margin of the collision checks of the plan.
- *smoothness*: the sum of the angles by which the swing's direction in joint space turns at its waypoints [rad]; 0 is a
  straight line.
- *time*: of one thread of the processor, for the whole call: goals, search, shortening, recheck of the whole path.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import footfall
from benchmarks.steps.problem import Scene, StepProblem
from footfall.planning.joint_path import length
from footfall.planning.step.problem import PlanResult, StepPlan, StepSettings


@dataclass(frozen=True)
class Outcome:
    """seconds: of processor time. The rest is NaN where nothing was found. result: the answer itself."""

    found: bool
    seconds: float
    length: float
    clearance: float
    smoothness: float
    result: PlanResult


def planned(
    problem: StepProblem, scene: Scene, planner: str, limit: float, seed: int = 1, goals: str = "motion"
) -> Outcome:
    """Ask one planner for the step; ``limit``: of its wall clock [s]; ``goals``: which it tries first."""
    settings = StepSettings(planner=planner, seed=seed, time_limit=limit, goals=goals)
    begin = time.process_time()
    result = footfall.plan_step(
        scene.robot, scene.dem, scene.state, leg=problem.leg, target=problem.target, settings=settings
    )
    seconds = time.process_time() - begin
    if result.plan is None:
        return Outcome(False, seconds, np.nan, np.nan, np.nan, result)
    path = swing(result.plan)
    clear = min(check.margin for check in result.checks if "collision" in check.name)
    return Outcome(True, seconds, length(path), clear, turning(path), result)


def swing(plan: StepPlan) -> NDArray[np.float64]:
    """The moving leg's waypoints (n, 6) from the end of the lift to the beginning of the lowering."""
    first, last = plan.phases.index("swing") - 1, len(plan.phases) - plan.phases[::-1].index("swing")
    return plan.waypoints[first:last, 6 * plan.leg : 6 * plan.leg + 6]


def turning(path: NDArray[np.float64]) -> float:
    """Sum of the angles between successive segments of waypoints (n, d) [rad]."""
    steps = np.diff(path, axis=0)
    sizes = np.linalg.norm(steps, axis=1)
    ways = steps[sizes > 0] / sizes[sizes > 0, None]
    return float(np.arccos(np.clip(np.sum(ways[1:] * ways[:-1], axis=1), -1.0, 1.0)).sum())
