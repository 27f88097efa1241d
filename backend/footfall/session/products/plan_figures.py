"""What plans are compared by: how far the wheel travels, how long it takes, how near it comes, how well it balances."""

import itertools
import math

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.scene.solids import part_poses
from footfall.planning.step.problem import PlanResult, StepPlan, StepSettings
from footfall.robot.model import Robot
from footfall.sequence.predict import needed_duration
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.session.answers.plans import PlanFigures

PARTS = 8
"""Between two waypoints the wheel's way is measured in this many straight pieces."""


def wheel_path(robot: Robot, plan: StepPlan) -> Array:
    """Where the wheel's centre is at each waypoint, site, (n, 3) [m]."""
    own = slice(6 * plan.leg, 6 * plan.leg + 6)
    return apply(plan.T_site_base, part_poses(robot, plan.leg, plan.waypoints[:, own])["wheel"][:, :3, 3])


def plan_figures(robot: Robot, result: PlanResult) -> PlanFigures | None:
    """Plain JSON, None without a plan; see the module's docstring.

    length: of the wheel centre's way [m]; duration: of the commands that would be made of it [s]; clearance: what is
    least to spare at a waypoint beyond the robot's own clearances, of all of them, so that plans with different extra
    clearances compare [m]; margin: of balance, least along the path [m].
    """
    plan = result.plan
    if plan is None:
        return None
    own = slice(6 * plan.leg, 6 * plan.leg + 6)
    limits = robot.speed_limits[own] * SequenceSettings().speed_fraction
    q = plan.waypoints[:, own]
    least, settings = _least(result, "collision"), plan.provenance.settings
    extra = settings.clearance if isinstance(settings, StepSettings) else 0.0
    return {
        "length": float(np.linalg.norm(np.diff(swing(robot, plan)[0], axis=0), axis=1).sum()),
        "duration": sum(needed_duration(b - a, limits) for a, b in itertools.pairwise(q)),
        "clearance": None if least is None else least + extra,
        "margin": _least(result, "balance"),
        "waypoints": len(q),
    }


def swing(robot: Robot, plan: StepPlan) -> tuple[Array, Array]:
    """The wheel's way in PARTS pieces between waypoints: its centre, site, (m, 3) [m], and the largest turn of a joint
    that has been made until there, as a share of the whole, (m,)."""
    own = slice(6 * plan.leg, 6 * plan.leg + 6)
    q = plan.waypoints[:, own]
    along = np.arange(PARTS)[:, None] / PARTS
    dense = np.concatenate([*(a + along * (b - a) for a, b in itertools.pairwise(q)), q[-1:]])
    centers = apply(plan.T_site_base, part_poses(robot, plan.leg, dense)["wheel"][:, :3, 3])
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(dense, axis=0)).max(axis=1))])
    return centers, turned / max(turned[-1], 1e-12)


def _least(result: PlanResult, word: str) -> float | None:
    """The least margin of the checks whose names hold a word; None where none has a size."""
    sizes = [check.margin for check in result.checks if word in check.name and math.isfinite(check.margin)]
    return min(sizes, default=None)
