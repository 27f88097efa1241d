"""A walk in a closed loop: begun with a goal, watched, held, ended. Commands go as whoever began it."""

from typing import Annotated, Literal, TypedDict, cast

from fastapi import Path

from footfall.api.access import AllSessions, OneSession
from footfall.api.acting import Actor
from footfall.api.bodies.settings_models import changed, settings_value
from footfall.api.bodies.walk_schemas import WalkLoopOrder
from footfall.api.routing import Routes
from footfall.core.errors import NotFound
from footfall.planning.route.problem import RouteSettings
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk_execution.decision import WayOnSettings
from footfall.session.live import LiveSession
from footfall.session.loop_settings import LoopSettings

router = Routes(tags=["run"])

Act = Annotated[
    Literal["hold", "resume", "cancel"],
    Path(
        description="`hold`: nothing more is begun, a row that is out is carried out; `resume`: go on from there; "
        "`cancel`: nothing more is sent, the rover is left to whoever commands it"
    ),
]


class LoopGoalAnswer(TypedDict):
    """Where the chassis is to be, site [m], [rad]."""

    x: float
    y: float
    yaw: float | None


class GaitRefusedAnswer(TypedDict):
    """The check that ended a gait. step: number of its foot move, counted from 1; lacks: by how much it fails, in
    ``unit``; null where the gait was refused as a whole, or that is not known. reason: all of it, for a person.
    """

    gait: str
    reason: str
    step: int | None
    leg: int | None
    check: str
    lacks: float | None
    unit: str


class WayChosenAnswer(TypedDict):
    """How a piece is gone. action: by a `wave`, or a `walk` of the walk planner; by: as `choose_by`; why: what that
    chose first, and why; refused: that, where it was a gait that does not hold. planners: that were asked, in their
    order. walk: what came of it; found: whether there is one; motion: how long it takes as planned [s]. table: digest
    of the learned table.
    """

    action: Literal["wave", "walk"]
    by: str
    why: str
    refused: GaitRefusedAnswer | None
    planners: list[str]
    walk: str
    found: bool
    foot_moves: int
    motion: float | None
    table: str | None


class WalkLoopAnswer(TypedDict):
    """The latest walk in a closed loop. act: what was decided last (`go`, `look`, `lift`, `replan`, `stop`, `arrived`),
    for the `reason` given; outcome: of one that has ended. part: of the walk that is planned, which is next or under
    way; waits_for: what has to come first. foot_moves: parts of walks carried out; decided: how often each was. limits,
    farthest, choose_by: as it was begun with. planners: how often each was asked; chosen: how the latest piece is gone.
    """

    goal: LoopGoalAnswer
    state: Literal["going", "held", "ended"]
    outcome: Literal["", "arrived", "stopped", "cancelled"]
    act: str
    reason: str
    part: str
    waits_for: str
    foot_moves: int
    decided: dict[str, int]
    limits: dict[str, float]
    farthest: float
    choose_by: Literal["planner", "gaits", "table"]
    planners: dict[str, int]
    chosen: WayChosenAnswer | None


@router.post("/sessions/{session}/walk-loop", status_code=202, name="begin")
def begin_walk_loop(live: OneSession, sessions: AllSessions, order: WalkLoopOrder, who: Actor) -> WalkLoopAnswer:
    """Walk to a goal by images and telemetry: look, plan, some foot moves, measure, and so on until the rover is there.

    409 where it walks so already, or there is no rover. Each decision is an event, `walk_decided`, with its reason, and
    how each piece is gone one, `way_chosen`.
    """
    settings = LoopSettings(
        way_on=settings_value(WayOnSettings, order.limits) or WayOnSettings(),
        walk=settings_value(WalkSettings, order.walk) or WalkSettings(),
        terrain=changed(LoopSettings().terrain, order.terrain),
        pairs=None if order.pairs is None else tuple(order.pairs),
        farthest=order.farthest,
        route=settings_value(RouteSettings, order.route),
        choose_by=order.choose_by,
        policy=sessions.policy,
    )
    goal = settings_value(WalkGoal, order.goal)
    live.walk_to(cast(WalkGoal, goal), settings, who)
    return _answer(live)


@router.get("/sessions/{session}/walk-loop")
def read_walk_loop(live: OneSession) -> WalkLoopAnswer:
    """The latest walk in a closed loop since the session was opened, also when it has ended."""
    return _answer(live)


@router.post("/sessions/{session}/walk-loop/{act}")
def act_on_walk_loop(live: OneSession, act: Act, who: Actor) -> WalkLoopAnswer:
    """Hold it, let it go on, or end it. 409 where it has ended."""
    loop = live.walk_loop
    if loop is None:
        raise NotFound("no walk in a closed loop was begun yet")
    {"hold": loop.hold, "resume": loop.go_on, "cancel": loop.cancel}[act](who)
    return _answer(live)


def _answer(live: LiveSession) -> WalkLoopAnswer:
    loop = live.walk_loop
    if loop is None:
        raise NotFound("no walk in a closed loop was begun yet")
    return cast(WalkLoopAnswer, loop.as_dict())
