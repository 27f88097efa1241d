"""The same step asked for otherwise: what an operator may compare a plan with."""

from collections.abc import Mapping
from dataclasses import replace

from footfall.core.errors import InvalidInput
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.robot.leg_branches import bend_text, other_knee

HIGHER = 0.1
"""How much higher the wheel is lifted [m]."""
CLEARER = 0.05
"""How much more clearance is asked for; the wheel is lifted as much higher, or it could not keep it [m]."""
KINDS: Mapping[str, str] = {
    "higher_lift": f"the wheel lifted {HIGHER:z.2f} m higher",
    "other_knee": "the knee bent the other way at the goal",
    "more_clearance": f"{CLEARER:z.2f} m more clearance",
}
"""Kinds of alternatives, with what each asks for."""


def asked_otherwise(plan: StepPlan, kind: str) -> tuple[StepSettings, str]:
    """The settings of an alternative to a plan, and what differs, for a person. Raises InvalidInput for other kinds."""
    settings = plan.provenance.settings
    if not isinstance(settings, StepSettings):
        raise InvalidInput("the plan does not say with which settings it was made")
    if kind == "higher_lift":
        other = replace(settings, lift=settings.lift + HIGHER)
        return other, f"lift {other.lift:z.2f} m"
    if kind == "other_knee":
        other = replace(settings, branch=other_knee(plan.branch))
        return other, bend_text(other_knee(plan.branch))
    if kind == "more_clearance":
        other = replace(settings, clearance=settings.clearance + CLEARER, lift=settings.lift + CLEARER)
        return other, f"clearance +{other.clearance:z.2f} m, lift {other.lift:z.2f} m"
    raise InvalidInput(f"alternatives are {', '.join(KINDS)}", kind=kind)
