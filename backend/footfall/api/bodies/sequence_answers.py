"""What answers about sequences and their executions hold."""

from typing import Annotated, Literal, TypedDict

from pydantic import Field

from footfall.core.arrays import Array
from footfall.core.value import Value
from footfall.planning.answers import Check, Status
from footfall.planning.execution.problem import Execution
from footfall.sequence.commands import Command, RuleResult
from footfall.session.answers.commands import WheelAnswer
from footfall.session.answers.notes import DigestText
from footfall.session.answers.plans import WayOfCommands


class RestAnswer(TypedDict):
    """How a rover that sags is predicted to rest after a foot move.

    off: how far the chassis' origin is from where the walk has it [m]; sag: how much lower it is than there [m].
    torque: largest share of a joint's limit at the ends of its rows; joint: whose.
    """

    T_site_base: Array
    off: float
    sag: float
    torque: float
    joint: str


class FootMoveRows(TypedDict):
    """Rows ``first_row`` … that belong to one foot move of a walk or a queue; text: what it is called.

    rest: where they are predicted to end; null: they take the rover as rigid.
    """

    first_row: int
    rows: int
    text: str
    rest: RestAnswer | None


class SequenceAnswer(TypedDict):
    """Commands, what each leads to, and every rule.

    legs: that each row is about: the one it names, or, where all joints move, the one that steps; null where there is
    none.
    way: how the rover is commanded, and whether its sag is predicted.
    export_formats: format → why it can't carry these commands, "" where it can.
    starts_from: what says from where they start: their plan, the file that they were read from, or the rover as it
    stood then (or was looked at in a what-if), where the file doesn't say.
    tether_lengths: what is paid out of the tether before the first command and after each [m]; null: there is none.
    """

    id: Annotated[str, Field(description="stays over edits")]
    digest: DigestText
    session: str
    robot: str
    valid: bool
    duration: float
    commands: tuple[Command, ...]
    legs: list[int | None]
    start: Array
    predicted: Array
    set_points_before: Array | None
    commanded: Array | None
    T_site_base: Array
    Ts_site_base: Array
    tether_lengths: Array | None
    rules: tuple[RuleResult, ...]
    parents: dict[str, str]
    starts_from: Literal["plan", "file", "rover"]
    way: WayOfCommands
    export_formats: dict[str, str]
    foot_moves: list[FootMoveRows]
    current: bool
    can_undo: bool


class ExportedAnswer(TypedDict):
    """What was exported; digest: of the recorded file, null for a page to print. url: gives the file."""

    format: str
    digest: DigestText | None
    url: str


class ExecutionFigures(TypedDict):
    """SI units; see `GET executions`."""

    seconds: float
    clearance: float
    clearance_uncertainty: float
    touch_down_offset: float
    friction_use: float
    sag: Array


class ExecutionAnswer(TypedDict):
    """How a step is commanded to a rover that sags, and what is expected of it."""

    digest: DigestText
    status: Status
    reason: str
    checks: tuple[Check, ...]
    parents: dict[str, str]
    settings: Value | None
    execution: Execution | None
    figures: ExecutionFigures | None


class ClearancesAnswer(TypedDict):
    """time: of the telemetry, rover clock [s]; null: there is none that counts, for the `reason` given."""

    time: float | None
    reason: str
    wheels: list[WheelAnswer]
