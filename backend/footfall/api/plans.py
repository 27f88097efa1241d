"""Plans of one step: asked for as a job, read with every check and waypoint."""

from typing import Any

from fastapi import Response

from footfall.api.access import OneSession, product
from footfall.api.jobs import accepted
from footfall.api.routing import Routes
from footfall.api.schemas import PlanOrder, settings_value
from footfall.planning.step.problem import PlanResult, StepSettings

router = Routes(tags=["plans"])


@router.post("/sessions/{session}/plans", status_code=202)
def order_plan(live: OneSession, order: PlanOrder, response: Response) -> dict[str, Any]:
    """Plan a step, as a job. Its result is a PlanResult even where the answer is no."""
    settings = settings_value(StepSettings, order.settings)
    target = None if order.target is None else (order.target[0], order.target[1])
    return accepted(live.plan_step(live.robot.require_leg(order.leg), target, settings), response)


@router.get("/sessions/{session}/plans/{digest}")
def read_plan(live: OneSession, digest: str) -> Any:
    """Status, reason, checks with margins, and the plan with its waypoints; ``current`` names the newest."""
    return product(live, digest, PlanResult, live.state.plan)
