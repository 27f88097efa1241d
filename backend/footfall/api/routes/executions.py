"""Executions: what a rover that sags is commanded for a planned step, as a job, and what is expected of it."""

from fastapi import Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.bodies.answers import JobAnswer
from footfall.api.bodies.execution_schemas import ExecutionOrder, TakeOver
from footfall.api.bodies.sequence_answers import (
    ClearancesAnswer,
    ExecutionAnswer,
    ExecutionFigures,
)
from footfall.api.execution_orders import settings_of_order
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes
from footfall.planning.execution.problem import Execution, ExecutionResult
from footfall.session.products.sag import Calibration, MeasuredSag
from footfall.session.wheel_clearance import clearances

router = Routes(tags=["executions"])


@router.post("/sessions/{session}/executions", status_code=202)
def order_execution(live: OneSession, order: ExecutionOrder, response: Response) -> JobAnswer:
    """Plan how to command a planned step, as a job. Its result is an ExecutionResult even where the answer is no.

    Where the order does not say `joint_scale`, it is what was taken over last.
    """
    return accepted(live.executions.plan(order.plan, settings_of_order(live, order.settings)), response)


@router.get("/sessions/{session}/executions/{digest}")
def read_execution(live: OneSession, digest: Digest) -> ExecutionAnswer:
    """Status, reason, checks, and the execution waypoint by waypoint; ``current`` names that of the present plan."""
    result = product(live, digest, ExecutionResult, live.state.execution)
    return {
        "digest": result.digest,
        "status": result.status,
        "reason": result.reason,
        "checks": result.checks,
        "parents": dict(result.provenance.parents),
        "settings": result.provenance.settings,
        "execution": result.execution,
        "figures": None if result.execution is None else _figures(result.execution),
    }


@router.get("/sessions/{session}/sag")
def read_sag(live: OneSession) -> MeasuredSag:
    """How far the rover gave way in the latest run: measured over predicted, and how stiff its joints are by that."""
    return live.executions.sag()


@router.post("/sessions/{session}/sag/take-over")
def take_over(live: OneSession, order: TakeOver) -> Calibration:
    """Take the joints to be as stiff as was measured, in orders that don't say; `POST undo` takes it back.

    409 where something else was measured by now.
    """
    return live.executions.take_over_stiffness(order.joint_scale)


@router.get("/sessions/{session}/clearance")
def read_clearance(live: OneSession) -> ClearancesAnswer:
    """By how much the wheels in the air clear the ground now: commanded, predicted, and measured by telemetry."""
    found = clearances(live, live.rover)
    return {
        "time": found.time,
        "reason": found.reason,
        "wheels": [one.as_dict() for one in found.wheels],
    }


def _figures(done: Execution) -> ExecutionFigures:
    """seconds: of all; clearance, with how much less it may be: least with the leg up [m]; sag: how much lower the
    chassis is than at the start, waypoint by waypoint [m]; touch_down_offset [m]; friction_use: largest of a wheel that
    stands.
    """
    lowest = min(done.aloft, key=lambda at: done.clearance[at])
    standing = [leg for leg in range(done.loads.shape[1]) if leg != done.leg]
    return {
        "seconds": done.seconds,
        "clearance": float(done.clearance[lowest]),
        "clearance_uncertainty": float(done.clearance_uncertainty[lowest]),
        "touch_down_offset": done.touch_down_offset,
        "friction_use": float(done.friction_use[:, standing].max()),
        "sag": done.Ts_site_base[0, 2, 3] - done.Ts_site_base[:, 2, 3],
    }
