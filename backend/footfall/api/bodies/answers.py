"""What answers that are made by hand hold; those that are values tell it themselves. Members may be added later."""

from typing import Annotated, Any, Literal, NotRequired, TypedDict

from numpy.typing import NDArray
from pydantic import Field

from footfall.api.bodies.answer_models import Each, OneOf
from footfall.api.bodies.fit_answers import UpToDateAnswer
from footfall.core.value import Value
from footfall.session.products.kinds import KINDS
from footfall.session.view import ViewState

Array = NDArray[Any]
DigestText = Annotated[str, Field(description="name of a product by its content")]
Url = Annotated[str, Field(description="path on this server")]
Share = Annotated[float, Field(ge=0, le=1)]


class Digested(TypedDict):
    """A product was made or taken in."""

    digest: DigestText


class JobFault(TypedDict):
    """Why a job has no result; as a problem document would say it."""

    kind: str
    message: str
    details: dict[str, Any]


class JobInSummary(TypedDict):
    """Long work: how far it is, and how it ended; `GET jobs/{id}` has its addresses."""

    id: str
    session: str
    kind: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    fraction: Share
    text: Annotated[str, Field(description="what is being done, or why it ended")]
    result: DigestText | None
    error: JobFault | None


class JobAnswer(JobInSummary):
    """Long work, and where its result is once it is done."""

    url: Url
    result_url: Url | None


class PhotographJob(JobAnswer):
    """A job over photographs, and which of them it uses."""

    pairs: list[str]
    left_out: Annotated[dict[str, str], Field(description="pair → why it is not used")]


class SessionListed(TypedDict):
    """One session of the working folder."""

    id: str
    name: str
    created: float | None
    robot: str | None
    events: int | None
    latest: Annotated[float | None, Field(description="when its last event was; null where that is not known")]
    open: bool
    problem: NotRequired[Annotated[str, Field(description="why it can't be read")]]


class RobotNamed(TypedDict):
    """Which robot a session is for."""

    name: str
    digest: DigestText


class GateAnswer(TypedDict):
    """The command gate, and whether stop is latched. Nothing is armed before the rover has confirmed the `epoch`."""

    state: str
    stopped: bool
    stop_acknowledged: bool
    epoch: int
    epoch_known: bool
    run: int | None
    row: int | None
    sequence: DigestText | None
    expires_in: float | None
    mode: str | None
    waiting: bool
    why: str
    aborted: bool


class HolderAnswer(TypedDict):
    """Somebody, and the page or program that acts."""

    name: str
    role: str
    client: str
    page: str


class ConnRequestAnswer(TypedDict):
    """Somebody asks for the conn, and has it in `granted_in` [s] unless the holder answers before."""

    by: HolderAnswer
    granted_in: float


class ConnAnswer(TypedDict):
    """Who holds the conn. `number` counts its holders; `expires_in` [s] where it is not renewed."""

    number: int
    holder: HolderAnswer | None
    expires_in: float | None
    request: ConnRequestAnswer | None


class NoteAnswer(TypedDict):
    """A remark."""

    time: float
    text: str


class Elsewhere(TypedDict):
    """The middle of a cell, site frame [m], and how far away it is [m]."""

    x: float
    y: float
    away: float


class FootfallAnswer(TypedDict):
    """What is known of the ground at a chosen footfall and, if it is not acceptable, why.

    slope [rad]. margin [m]: the one that decides. nearest: where it is not acceptable, the nearest place that is.
    """

    leg: int
    x: float
    y: float
    z: float | None
    known: bool
    normal: list[float] | None
    slope: float | None
    footing: str | None
    margin: float | None
    maps_current: bool
    acceptable: bool | None
    reasons: list[str]
    nearest: Elsewhere | None


class PointsAnswer(TypedDict):
    """Points that the wheel's centre of a leg is to pass, site frame [m]."""

    leg: int
    points: list[list[float]]


class ChoiceAnswer(TypedDict):
    """A choice that can be taken back or made again: `choice` is the number of its event, `by` who made it."""

    choice: int
    kind: Literal["footfall", "points", "plan", "edit", "stiffness"]
    leg: int | None
    by: str


class ReadOutAnswer(TypedDict):
    """What is told of a place. `good`: null where nothing is known for or against; `lines`: of every layer."""

    good: bool | None
    brief: str
    text: str
    reasons: list[str]
    lines: list[str]


class HeldAnswer(TypedDict):
    """What is in hand, whose, and what is told of the place where it is. `moved`: not where it was taken up."""

    what: Literal["footfall", "point", "chassis"]
    index: int
    leg: int | None
    place: list[float]
    moved: bool
    by: HolderAnswer
    read: ReadOutAnswer
    refused: Annotated[str, Field(description="why it could not be chosen where it was let go")]


class PlanInSummary(TypedDict):
    """The present plan."""

    digest: DigestText | None
    status: str | None
    reason: str
    compared: list[str]


class EndAnswer(TypedDict):
    """Something with a predicted end. `sags`: whether it knows how the rover gives way, or takes it as rigid."""

    digest: DigestText
    of: Literal["plan", "execution", "commands"]
    sags: bool


class EndsAnswer(TypedDict):
    """go_on: what `PUT what-if/after` starts from unless it is told otherwise; after: what it is planned after."""

    go_on: EndAnswer | None
    after: EndAnswer | None


class WayAnswer(TypedDict):
    """How a planned step is commanded unless an order says otherwise, and why."""

    mode: Literal["pose_held", "rigid"]
    reason: str


class ToCommand(TypedDict):
    """What commands are to be made of: what was planned last, can be carried out and was not.

    step: the planned step that it is or is made of, null for a move; plan: the step or move; leg null: all of them.
    """

    digest: DigestText
    kind: Annotated[str, OneOf(lambda: (one.name for one in KINDS.values() if one.offered))]
    step: DigestText | None
    plan: DigestText
    leg: int | None
    text: str


class LookAnswer(TypedDict):
    """When the newest images reached the server [s since 1970]. moved: the rover stands otherwise; null: not known."""

    taken: float
    moved: bool | None
    reason: str


class MatchAnswer(TypedDict):
    """Whether the rover stands where what was planned last starts; null: unknown. difference: of the farthest joint."""

    ok: bool | None
    joint: str | None
    difference: float | None
    reason: str
    older_ground: bool


class SessionAnswer(TypedDict):
    """What the events of a session fold to; products are named by digest."""

    id: str
    name: str
    robot: RobotNamed
    events: int
    state: DigestText | None
    what_if: dict[str, Any] | None
    after: DigestText | None
    ends: EndsAnswer
    answers: Annotated[DigestText | None, Each(lambda: (one.name for one in KINDS.values() if one.is_answer))]
    snapshot: DigestText | None
    pairs: list[str]
    look: LookAnswer | None
    dem: DigestText | None
    terrain: dict[str, Any] | None
    can_undo_terrain: bool
    maps: Annotated[dict[str, str], Field(description="leg → digest")]
    maps_current: Annotated[dict[str, bool], Field(description="leg → whether they fit the present state")]
    up_to_date: UpToDateAnswer
    footfall: dict[str, Any] | None
    footfall_answer: FootfallAnswer | None
    points: PointsAnswer | None
    hand: HeldAnswer | None
    undo: ChoiceAnswer | None
    redo: ChoiceAnswer | None
    plan: PlanInSummary
    execution: dict[str, Any]
    joint_scale: float
    way_of_commands: WayAnswer
    sequence: DigestText | None
    commands_carried_out: bool
    to_command: ToCommand | None
    commands_of_another_plan: bool
    played: Annotated[DigestText | None, Field(description="what a ghost plays")]
    walking: Annotated[dict[str, Any] | None, Field(description="how far the latest walk is")]
    walk_loop: Annotated[dict[str, Any] | None, Field(description="the latest walk in a closed loop")]
    can_undo: bool
    can_redo: bool
    exports: list[dict[str, Any]]
    stop: dict[str, Any]
    gate: GateAnswer
    conn: ConnAnswer
    run: dict[str, Any] | None
    commands: list[dict[str, Any]]
    notes: list[NoteAnswer]
    view: ViewState
    link: dict[str, Any]
    jobs: list[JobInSummary]
    plan_matches_rover: MatchAnswer
    unrecorded: Annotated[int, Field(ge=0, description="events that the disk could not take yet")]


class EventAnswer(TypedDict):
    """One event as its line in the log; `hash` chains it to the one before."""

    seq: Annotated[int, Field(ge=0)]
    time: float
    type: str
    payload: dict[str, Any]
    previous: str
    hash: str


class HeightErrorAnswer(TypedDict):
    """How far the cells' surface is from the mesh that was read, vertically [m]: 95 % of it, and the most."""

    p95: float
    most: float


class TerrainAnswer(TypedDict):
    """What a terrain is, without its cells."""

    digest: DigestText
    name: str
    rows: int
    cols: int
    resolution: float
    bounds: dict[str, float]
    known: Share
    lowest: float
    highest: float
    texture: bool
    remembers: bool
    sources: list[str]
    left_out: dict[str, str]
    true_north_deg: tuple[float, float, float] | None
    height_error: HeightErrorAnswer | None
    parents: dict[str, str]


class TelemetryAnswer(TypedDict):
    """One telemetry frame, and how old it is."""

    number: int
    time: float
    mode: str
    posture: Array
    T_site_base: Array
    wheel_forces: Array
    joint_torques: Array
    age_s: float | None


class StateNamed(TypedDict):
    """The state that is planned from."""

    state: DigestText


class WhatIfAnswer(StateNamed):
    """Where the rover would stand after a shift of its chassis."""

    shift: Value | None
    posture: Array
    T_site_base: Array
    predicted: list[str]
    wheel_forces: Array
    joint_torques: Array


class PlanListed(TypedDict):
    """A plan beside others, with the figures that they are compared by."""

    digest: DigestText
    kind: str
    text: str
    status: str
    reason: str
    chosen: bool
    figures: dict[str, Any] | None
