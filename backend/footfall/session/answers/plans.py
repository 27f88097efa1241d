"""What is told of plans, and of the commands made of them."""

from typing import Annotated, Literal, TypedDict

from footfall.session.answers.choices import FootfallChosen
from footfall.session.answers.notes import DigestText, OneOf
from footfall.session.products.kinds import KINDS

WayMode = Literal["pose_held", "rigid"]
"""How planned steps are commanded unless an order says otherwise."""


class PlanInSummary(TypedDict):
    """The present plan. doubt: what is doubtful of one that was found, "" where nothing is."""

    digest: DigestText | None
    status: str | None
    reason: str
    compared: list[str]
    doubt: str


class PlanFigures(TypedDict):
    """length: of the wheel centre's way [m]; duration: of commands made of it [s]; clearance: least to spare at a
    waypoint beyond the robot's own clearances [m]; margin: of balance, least along the path [m].
    """

    length: float
    duration: float
    clearance: float | None
    margin: float | None
    waypoints: int


class PlanListed(TypedDict):
    """A plan beside others, with the figures that they are compared by."""

    digest: DigestText
    kind: str
    text: str
    status: str
    reason: str
    chosen: bool
    figures: PlanFigures | None


class ExecutionInSummary(TypedDict):
    """The present execution."""

    digest: DigestText | None
    status: str | None
    reason: str


class ExportInSummary(TypedDict):
    """One export: which sequence, as what, and the digest of its bytes."""

    sequence: DigestText
    format: str
    digest: DigestText


class EndAnswer(TypedDict):
    """Something with a predicted end. `sags`: whether it knows how the rover gives way, or takes it as rigid."""

    digest: DigestText
    of: Annotated[str, OneOf(lambda: ("plan", "execution", "queue", "commands"))]
    sags: bool


class EndsAnswer(TypedDict):
    """go_on: what `PUT what-if/after` starts from unless it is told otherwise; after: what it is planned after."""

    go_on: EndAnswer | None
    after: EndAnswer | None


class WayAnswer(TypedDict):
    """How a planned step is commanded unless an order says otherwise, and why."""

    mode: WayMode
    reason: str


class WayOfCommands(TypedDict):
    """mode: of the execution that commands were made of; "rigid": they take the rover as rigid.

    text: for a person. doubt: whether the rover sags otherwise than they know, so that touch-down is not predicted.
    """

    mode: str
    text: str
    doubt: bool


class ToCommand(TypedDict):
    """What commands are to be made of: what was planned last, can be carried out and was not.

    step: the planned step that it is or is made of, null for a move or walk; plan: the step, move or walk; leg null:
    all of them.
    """

    digest: DigestText
    kind: Annotated[str, OneOf(lambda: (one.name for one in KINDS.values() if one.offered))]
    step: DigestText | None
    plan: DigestText
    leg: int | None
    text: str


class GoalPlannedFor(TypedDict):
    """Where a walk is to go, site [m]; yaw [rad], null: whichever way the chassis faces."""

    x: float
    y: float
    yaw: float | None


class PlannedFor(TypedDict):
    """What the latest step and the latest walk were asked for; null where none was."""

    footfall: FootfallChosen | None
    goal: GoalPlannedFor | None


class MatchAnswer(TypedDict):
    """Whether the rover stands where what was planned last starts; null: unknown. difference: of the farthest joint."""

    ok: bool | None
    joint: str | None
    difference: float | None
    reason: str
    older_ground: bool
