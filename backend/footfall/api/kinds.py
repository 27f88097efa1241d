"""Which kinds of products the interface makes: by which route, for whom, and where the result is read.

Beside :mod:`footfall.session.products.kinds`, which says what a kind is; keyed by its entries. An :class:`Asked` kind
needs no routes of its own: :mod:`footfall.api.routes.products` makes them, and roles, jobs and answers read this table.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel

from footfall.api.bodies.described_schemas import DescribedStepOrder, DescribedWalkOrder
from footfall.api.bodies.execution_schemas import HeldMoveOrder
from footfall.api.bodies.queue_schemas import QueueOrder
from footfall.api.bodies.route_schemas import RouteOrder
from footfall.api.bodies.schemas import BodyMoveOrder, ShiftOrder
from footfall.api.bodies.settings_models import changed, settings_value
from footfall.api.bodies.walk_schemas import GaitOrder, WalkOrder
from footfall.api.execution_orders import settings_of_order
from footfall.balance.tether import Tether
from footfall.core.value import Value
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.find_problem import FindShiftSettings, ShiftResult
from footfall.planning.body.move import BodyMoveResult, BodyMoveSettings
from footfall.planning.execution.problem import BodyExecutionResult
from footfall.planning.gait.problem import GaitResult, GaitSettings
from footfall.planning.legged.problem import LeggedResult, LeggedSettings
from footfall.planning.queue.problem import QueueResult
from footfall.planning.route.problem import RouteResult
from footfall.planning.walk.problem import WalkGoal, WalkResult, WalkSettings
from footfall.planning.walk_execution.problem import WalkExecutionResult
from footfall.session.access.identity import Role
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import RouteRequest
from footfall.session.live import LiveSession
from footfall.session.products import kinds
from footfall.session.products.kinds import Kind

_SESSION = "/sessions/{session}"


@dataclass(frozen=True)
class Served:
    """A kind that can be asked for. route: ``METHOD /path`` that makes one; role: who may.

    folder: below a session, where its results are read; "" where a job's result has no address.
    """

    route: str
    folder: str = ""
    role: Role = Role.PLANNER


@dataclass(frozen=True, kw_only=True)
class Asked(Served):
    """A kind that is ordered with a POST to its folder, made by a job, and read as it is.

    tag: part of the interface; verb: what the order does, ``verb_kind`` names the operation; text: what one gets.
    order: body of the request; answer: the value; ask: has it made for an order.
    """

    route: str = field(init=False)
    tag: str
    verb: str
    text: str
    order: type[BaseModel]
    answer: type[Value]
    ask: Callable[[LiveSession, Any], Job]

    def __post_init__(self) -> None:
        object.__setattr__(self, "route", f"POST {self.path}")

    @property
    def path(self) -> str:
        """Of its orders; its results are read below."""
        return f"{_SESSION}/{self.folder}"


def _find_shift(live: LiveSession, order: ShiftOrder) -> Job:
    leg = live.robot.require_leg(order.leg)
    target = None if order.target is None else (order.target[0], order.target[1])
    return live.stances.find_shift(leg, target, settings_value(FindShiftSettings, order.settings))


def _plan_body_move(live: LiveSession, order: BodyMoveOrder) -> Job:
    shift = settings_value(BodyShift, order.shift) or BodyShift()
    if order.after is not None:
        live.plans.go_on_after(order.after)
    settings = settings_value(BodyMoveSettings, order.settings)
    return live.stances.plan_body_move(shift, settings, as_planned_from=order.after is not None)


def _plan_held_move(live: LiveSession, order: HeldMoveOrder) -> Job:
    return live.executions.plan_held_move(order.plan, settings_of_order(live, order.settings))


def _join_queue(live: LiveSession, order: QueueOrder) -> Job:
    return live.queues.add(order.plan)


def _plan_held_queue(live: LiveSession, order: HeldMoveOrder) -> Job:
    return live.executions.plan_held_queue(order.plan, settings_of_order(live, order.settings))


def _plan_walk(live: LiveSession, order: WalkOrder) -> Job:
    goal, settings = WalkGoal(**order.goal.model_dump()), settings_value(WalkSettings, order.settings)
    return live.walks.plan(goal, settings, settings_value(Tether, order.tether))


def _plan_gait(live: LiveSession, order: GaitOrder) -> Job:
    return live.walks.plan_gait(WalkGoal(**order.goal.model_dump()), settings_value(GaitSettings, order.settings))


def _plan_route(live: LiveSession, order: RouteOrder) -> Job:
    settings = changed(live.described_plans.route_settings(), order.settings)
    return live.stances.ask(kinds.ROUTE, RouteRequest((order.goal.x, order.goal.y), settings))


def _plan_described_step(live: LiveSession, order: DescribedStepOrder) -> Job:
    target = None if order.target is None else (order.target[0], order.target[1])
    return live.described_plans.step(order.leg, target, settings_value(LeggedSettings, order.settings))


def _plan_described_walk(live: LiveSession, order: DescribedWalkOrder) -> Job:
    goal = WalkGoal(**order.goal.model_dump())
    return live.described_plans.walk(goal, settings_value(LeggedSettings, order.settings), order.route)


SERVED: dict[Kind, Served] = {
    kinds.TERRAIN: Served(f"POST {_SESSION}/terrains", "terrains"),
    kinds.PHOTOGRAPHS: Served(f"POST {_SESSION}/terrains/photographs", "terrains"),
    kinds.BLEND: Served(f"POST {_SESSION}/terrains/blend", "terrains"),
    kinds.CLEAR: Served(f"POST {_SESSION}/terrains/clear", "terrains"),
    kinds.MAPS: Served(f"POST {_SESSION}/maps", "maps"),
    kinds.PLAN: Served(f"POST {_SESSION}/plans", "plans"),
    kinds.AFTER: Served(f"PUT {_SESSION}/what-if/after"),
    kinds.WHAT_IF: Served(f"PUT {_SESSION}/what-if"),
    kinds.EXECUTION: Served(f"POST {_SESSION}/executions", "executions"),
    kinds.SHIFT: Asked(
        folder="shifts",
        tag="stances",
        verb="find",
        text="The smallest shift of the chassis that makes a footfall reachable and stable, as a job.",
        order=ShiftOrder,
        answer=ShiftResult,
        ask=_find_shift,
    ),
    kinds.BODY_MOVE: Asked(
        folder="body-moves",
        tag="stances",
        verb="plan",
        text="A checked move of the chassis over its standing feet, as a job.",
        order=BodyMoveOrder,
        answer=BodyMoveResult,
        ask=_plan_body_move,
    ),
    kinds.HELD_MOVE: Asked(
        folder="held-moves",
        tag="stances",
        verb="plan",
        text="What to command for a planned move of the chassis with the pose held, as a job; plan null: the latest.",
        order=HeldMoveOrder,
        answer=BodyExecutionResult,
        ask=_plan_held_move,
    ),
    kinds.QUEUE: Asked(
        folder="queues",
        tag="plans",
        verb="join",
        text="Put a planned step or move of the chassis at the end of the queue, as a job. Its result tells a refusal.",
        order=QueueOrder,
        answer=QueueResult,
        ask=_join_queue,
    ),
    kinds.HELD_QUEUE: Asked(
        folder="held-queues",
        tag="plans",
        verb="plan",
        text="What to command for a queue with the pose held, as a job; plan null: the present queue.",
        order=HeldMoveOrder,
        answer=WalkExecutionResult,
        ask=_plan_held_queue,
    ),
    kinds.WALK: Asked(
        folder="walks",
        tag="plans",
        verb="plan",
        text="A checked walk of many foot moves to a goal, as a job. Its result is a WalkResult even where it is no.",
        order=WalkOrder,
        answer=WalkResult,
        ask=_plan_walk,
    ),
    kinds.GAIT: Asked(
        folder="gaits",
        tag="plans",
        verb="plan",
        text="A gait to a goal, to be compared with a walk, as a job. Its result is a GaitResult even where it is no.",
        order=GaitOrder,
        answer=GaitResult,
        ask=_plan_gait,
    ),
    kinds.ROUTE: Asked(
        folder="routes",
        tag="plans",
        verb="plan",
        text="The cheapest way of the chassis over the map, as a job. Its result is a RouteResult even where it is no.",
        order=RouteOrder,
        answer=RouteResult,
        ask=_plan_route,
    ),
    kinds.DESCRIBED_MAPS: Served(f"POST {_SESSION}/maps", "maps"),
    kinds.DESCRIBED_STEP: Asked(
        folder="described-steps",
        tag="plans",
        verb="plan",
        text="A checked step of a robot that others described, as a job. Its result tells a refusal, too.",
        order=DescribedStepOrder,
        answer=LeggedResult,
        ask=_plan_described_step,
    ),
    kinds.DESCRIBED_WALK: Asked(
        folder="described-walks",
        tag="plans",
        verb="plan",
        text="A checked walk of a robot that others described, as a job. Its result tells a refusal, too.",
        order=DescribedWalkOrder,
        answer=LeggedResult,
        ask=_plan_described_walk,
    ),
    kinds.FOOT_MOVES: Served(f"POST {_SESSION}/walks/{{digest}}/sequence"),
    kinds.SEQUENCE: Served(f"POST {_SESSION}/sequences"),
    kinds.EDIT: Served("PATCH /sequences/{sequence}"),
    kinds.IMPORT: Served(f"POST {_SESSION}/sequences/import"),
    kinds.EXPORT: Served("POST /sequences/{sequence}/export"),
}
"""Kind → how it is served; one that only the session itself asks for is not in here."""


def role_for(route: str) -> Role | None:
    """Who may have made what a route makes; None where it makes none of these."""
    return next((one.role for one in SERVED.values() if one.route == route), None)


def folder_of(name: str) -> str:
    """Where results of a job of this kind are read, below its session; "" where they have no address."""
    kind = kinds.KINDS.get(name)
    return SERVED[kind].folder if kind in SERVED else ""
