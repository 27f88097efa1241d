"""What is told of a session as a whole, of its events and images, and of those that there are."""

from typing import Annotated, Any, NotRequired, TypedDict

from annotated_types import Ge

from footfall.session.answers.choices import ChoiceAnswer, FootfallAnswer, FootfallChosen, HeldAnswer, PointsAnswer
from footfall.session.answers.commands import CommandAnswer, ConnAnswer, GateAnswer, LinkAnswer, RunAnswer, StopAnswer
from footfall.session.answers.fits import UpToDateAnswer
from footfall.session.answers.jobs import JobInSummary
from footfall.session.answers.notes import DigestText, Each, Says
from footfall.session.answers.plans import (
    EndsAnswer,
    ExecutionInSummary,
    ExportInSummary,
    MatchAnswer,
    PlanInSummary,
    PlannedFor,
    ToCommand,
    WayAnswer,
)
from footfall.session.answers.queues import QueueAnswer
from footfall.session.answers.walks import WalkingAnswer
from footfall.session.products.kinds import KINDS
from footfall.session.view import ViewState


class SessionListed(TypedDict):
    """One session of the working folder."""

    id: str
    name: str
    created: float | None
    robot: str | None
    events: int | None
    latest: Annotated[float | None, Says("when its last event was; null where that is not known")]
    open: bool
    problem: NotRequired[Annotated[str, Says("why it can't be read")]]


class RobotNamed(TypedDict):
    """Which robot a session is for."""

    name: str
    digest: DigestText | None


class NoteAnswer(TypedDict):
    """A remark."""

    time: float
    text: str


class SinceThen(TypedDict):
    """Whether the rover stands otherwise by now than in the images; null where that is not known."""

    moved: bool | None
    reason: str


class LookAnswer(TypedDict):
    """When the newest images reached the server [s since 1970]. moved: the rover stands otherwise; null: not known."""

    taken: float
    moved: bool | None
    reason: str


class ShiftAnswer(TypedDict):
    """A shift of the chassis from how the rover stands: east, north, up [m]; roll, pitch, yaw [rad]."""

    dx: float
    dy: float
    dz: float
    droll: float
    dpitch: float
    dyaw: float


class TerrainInSummary(TypedDict):
    """The present terrain. bounds: west, south, east, north [m]; known: share of it; time: since when it is it; seen:
    when its newest images reached the server, where it is made of none, when it was loaded.
    """

    name: str
    rows: int
    cols: int
    resolution: float
    bounds: list[float]
    known: float
    left_out: dict[str, str]
    time: float
    seen: float


class SessionAnswer(TypedDict):
    """What the events of a session fold to; products are named by digest."""

    id: str
    name: str
    robot: RobotNamed
    events: int
    state: DigestText | None
    what_if: ShiftAnswer | None
    after: DigestText | None
    ends: EndsAnswer
    answers: Annotated[DigestText | None, Each(lambda: (one.name for one in KINDS.values() if one.is_answer))]
    snapshot: DigestText | None
    pairs: list[str]
    look: LookAnswer | None
    dem: DigestText | None
    terrain: TerrainInSummary | None
    can_undo_terrain: bool
    maps: Annotated[dict[str, str], Says("leg → digest")]
    maps_current: Annotated[dict[str, bool], Says("leg → whether they fit the present state")]
    up_to_date: UpToDateAnswer
    footfall: FootfallChosen | None
    footfall_answer: FootfallAnswer | None
    points: PointsAnswer | None
    hand: HeldAnswer | None
    undo: ChoiceAnswer | None
    redo: ChoiceAnswer | None
    plan: PlanInSummary
    execution: ExecutionInSummary
    queue: QueueAnswer | None
    joint_scale: float
    way_of_commands: WayAnswer
    sequence: DigestText | None
    commands_carried_out: bool
    to_command: ToCommand | None
    commands_of_another_plan: bool
    played: Annotated[DigestText | None, Says("what a ghost plays")]
    planned_for: PlannedFor
    walking: WalkingAnswer | None
    walk_loop: Annotated[dict[str, Any] | None, Says("the latest walk in a closed loop")]
    can_undo: bool
    can_redo: bool
    exports: list[ExportInSummary]
    stop: StopAnswer
    gate: GateAnswer
    conn: ConnAnswer
    run: RunAnswer | None
    commands: list[CommandAnswer]
    notes: list[NoteAnswer]
    view: ViewState
    link: LinkAnswer
    jobs: list[JobInSummary]
    plan_matches_rover: MatchAnswer
    unrecorded: Annotated[int, Ge(0), Says("events that the disk could not take yet")]


class EventAnswer(TypedDict):
    """One event as its line in the log; `hash` chains it to the one before."""

    seq: Annotated[int, Ge(0)]
    time: float
    type: str
    payload: dict[str, Any]
    previous: str
    hash: str
