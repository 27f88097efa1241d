"""Plans of one step: asked for as a job, read with every check and waypoint, compared, chosen, gone on from."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypedDict

from fastapi import Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.bodies.answers import JobAnswer, StateNamed
from footfall.api.bodies.schemas import AlternativesOrder, GoOn, PlanChoice, PlanOrder
from footfall.api.bodies.settings_models import settings_value
from footfall.api.routes.jobs import accepted, job_body
from footfall.api.routing import Routes
from footfall.core.arrays import Array
from footfall.core.errors import Conflict
from footfall.planning.step.alternatives import KINDS
from footfall.planning.step.problem import GOAL_ORDERS, PLANNERS, PlanResult, StepSettings
from footfall.session.answers.plans import PlanListed
from footfall.session.core import present

router = Routes(tags=["plans"])


class PlannersAnswer(TypedDict):
    """What a plan can be asked for with."""

    planners: Mapping[str, str]
    goals: Mapping[str, str]
    settings: dict[str, Any]
    alternatives: Mapping[str, str]


class WheelPath(TypedDict):
    """Where the wheel's centre is at each waypoint, site frame [m], and in which phase that is."""

    points: Array
    phases: list[str]


class JobsAnswer(TypedDict):
    """One job for each kind."""

    jobs: list[JobAnswer]


@router.get("/planners")
def planners() -> PlannersAnswer:
    """What a plan can be asked for with: planners, orders of goals, settings with defaults, kinds of alternatives."""
    defaults = StepSettings()
    return {
        "planners": PLANNERS,
        "goals": GOAL_ORDERS,
        "settings": {field.name: getattr(defaults, field.name) for field in fields(defaults)},  # type: ignore[arg-type]
        "alternatives": KINDS,
    }


@router.post("/sessions/{session}/plans", status_code=202)
def order_plan(live: OneSession, order: PlanOrder, response: Response) -> JobAnswer:
    """Plan a step, as a job. Its result is a PlanResult even where the answer is no."""
    settings = settings_value(StepSettings, order.settings)
    target = None if order.target is None else (order.target[0], order.target[1])
    through = [(x, y, z) for x, y, z in order.through]
    leg = live.robot.require_leg(order.leg)
    return accepted(live.plans.step(leg, target, settings, through=through, after=order.after), response)


@router.get("/sessions/{session}/plans")
def list_plans(live: OneSession) -> list[PlanListed]:
    """The present plan and the alternatives to it, each with what differs and the figures that they are compared by."""
    return live.plans.shown()


@router.put("/sessions/{session}/plans/current")
def choose_plan(live: OneSession, choice: PlanChoice) -> list[PlanListed]:
    """Take one of the listed plans as the session's plan."""
    live.plans.choose(choice.plan)
    return live.plans.shown()


@router.get("/sessions/{session}/plans/{digest}")
def read_plan(live: OneSession, digest: Digest) -> PlanResult:
    """Status, reason, checks with margins, and the plan with its waypoints; ``current`` names the newest."""
    return product(live, digest, PlanResult, live.state.plan)


@router.get("/sessions/{session}/plans/{digest}/wheel-path")
def read_wheel_path(live: OneSession, digest: Digest) -> WheelPath:
    """Where the wheel's centre is at each waypoint, site frame [m]."""
    from footfall.session.products.plan_figures import wheel_path

    result = product(live, digest, PlanResult, live.state.plan)
    if result.plan is None:
        raise Conflict(f"there is no plan, so no wheel moves: {result.reason}")
    return {"points": wheel_path(live.robot, result.plan), "phases": list(result.plan.phases)}


@router.post("/sessions/{session}/plans/{digest}/alternatives", status_code=202)
def order_alternatives(live: OneSession, digest: Digest, order: AlternativesOrder) -> JobsAnswer:
    """Ask for a plan otherwise, a job for each kind. What they find is listed beside the plan and replaces nothing."""
    jobs = live.plans.alternatives(None if digest == "current" else digest, order.kinds or ())
    return {"jobs": [job_body(job) for job in jobs]}


@router.put("/sessions/{session}/what-if/after")
def go_on(live: OneSession, order: GoOn) -> StateNamed:
    """Plan from where a plan, execution or sequence is predicted to end, until the what-if is ended.

    Nothing is sent meanwhile.
    """
    after = order.after or live.plans.planned_end() or present(live.state.plan, "there is no plan yet")
    return {"state": live.plans.go_on_after(after)}
