"""A wave as a walk: it moves one foot at a time, keeps to the settings of a walk, and is commanded like any other."""

from collections.abc import Mapping

import numpy as np

from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.gait.plan import plan_gait
from footfall.planning.gait.problem import WAVE, GaitFailure, GaitPlan, GaitSettings
from footfall.planning.walk.problem import Blocked, Place, WalkGoal, WalkResult, WalkSettings
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

SHARED = (
    "steepest",
    "least_margin",
    "friction",
    "most_torque",
    "clearance",
    "reach_reserve",
    "joint_reserve",
    "lift",
    "raise_terrain",
    "height",
)
"""Settings that mean the same of a gait and of a walk."""
_BEYOND: Mapping[str, str] = {
    "support": "stances with a conservative support polygon are required",
    "pinned": "feet are to be put on pinned places",
    "payload_mass": "the rover carries a payload",
}
"""What a gait does not know, in words."""
TRY = "the walk planner heeds it"


def beyond_gaits(settings: WalkSettings) -> str:
    """Which setting of a walk no gait can keep to, and why; empty where a gait can keep to all."""
    asked = {
        "support": settings.support == "required",
        "pinned": bool(settings.pinned),
        "payload_mass": settings.payload_mass is not None,
    }
    return next((f"{words} (`{name}`), which no gait heeds" for name, words in _BEYOND.items() if asked[name]), "")


def wave_like(settings: WalkSettings, gait: GaitSettings) -> GaitSettings:
    """The wave with stride and tolerance of ``gait`` that is checked as walks of these settings are."""
    shared = {name: getattr(settings, name) for name in SHARED}
    return GaitSettings(WAVE, min(gait.stride, settings.longest), gait.tolerance, **shared)


def plan_wave(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: WalkGoal,
    gait: GaitSettings,
    settings: WalkSettings,
    progress: Progress = no_progress,
) -> WalkResult:
    """The walk to ``goal`` that is a wave, with stride and tolerance of ``gait`` and otherwise the settings of a walk.

    Its footfalls are not searched: where a check fails there is no walk, and ``reason`` and ``blocked`` say at which
    step which check fails by how much. Nor is there one where a footfall is on a forbidden place, where a foot goes
    farther than ``longest``, or where the settings ask for what no gait heeds. Raises InvalidInput and what
    ``progress`` raises, as :func:`.plan_gait`.
    """
    settings.require_legs(robot.description)
    parents = {"robot": robot.digest, "dem": dem.digest, "state": state.digest}
    if beyond := beyond_gaits(settings):
        reason = f"no wave is tried: {beyond}; {TRY}"
        return WalkResult(Status.NO_PATH, None, reason, (), goal, Provenance(parents, settings))
    result = plan_gait(robot, dem, state, goal, settings=wave_like(settings, gait), progress=progress)
    if result.plan is not None and (barred := _barred(result.plan, settings.forbidden) or _far(result.plan, settings)):
        reason, blocked = barred
        return WalkResult(Status.NO_PATH, None, reason, (), goal, result.provenance, None, (blocked,))
    return WalkResult(
        result.status,
        None if result.plan is None else result.plan.walk,
        result.reason,
        result.checks,
        goal,
        result.provenance,
        None if result.partial is None else result.partial.walk,
        () if result.failure is None else (_blocked(result.failure),),
    )


def _barred(plan: GaitPlan, places: tuple[Place, ...]) -> tuple[str, Blocked] | None:
    """The first foot move of a wave that ends on a forbidden place, with the reason; None where none does."""
    for move, (leg,) in enumerate(plan.groups):
        x, y = (float(at) for at in plan.stances[move + 1].contacts[leg, :2])
        for place in places:
            inside = place.radius - float(np.hypot(x - place.x, y - place.y))
            if inside >= 0.0 and place.leg in (None, leg):
                reason = (
                    f"step {move + 1} (leg {leg}) puts its foot at ({x:z.2f}, {y:z.2f}), {inside:z.2f} m inside the "
                    f"forbidden place around ({place.x:z.2f}, {place.y:z.2f}); {TRY}"
                )
                return reason, Blocked("forbidden place", leg, x, y, 1, move, inside, "m")
    return None


def _far(plan: GaitPlan, settings: WalkSettings) -> tuple[str, Blocked] | None:
    """The first foot move of a wave that is longer than one may be, as its feet are put beside their ideal places."""
    for move, (leg,) in enumerate(plan.groups):
        (x, y), (old_x, old_y) = (plan.stances[at].contacts[leg, :2] for at in (move + 1, move))
        far = float(np.hypot(x - old_x, y - old_y))
        if far > settings.longest:
            reason = (
                f"step {move + 1} (leg {leg}) moves its foot {far:z.3f} m, at most {settings.longest:g} m are allowed; "
                f"{TRY}"
            )
            return reason, Blocked("longest foot move", leg, float(x), float(y), 1, move, far - settings.longest, "m")
    return None


def _blocked(failure: GaitFailure) -> Blocked:
    at = failure.check_name, failure.leg, failure.x, failure.y
    return Blocked(*at, 1, failure.move, failure.lacks, failure.unit)
