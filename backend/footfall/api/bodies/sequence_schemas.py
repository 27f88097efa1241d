"""What requests about sequences may contain; as strict as those of ``schemas``."""

from typing import Annotated, Literal

from annotated_types import Len
from pydantic import ConfigDict, Field

from footfall.api.bodies.execution_schemas import ExecutionSettingsModel
from footfall.api.bodies.schemas import Leg, Name, Number
from footfall.api.bodies.settings_models import FromNumber, Strictly
from footfall.sequence.edit import EDIT_KINDS
from footfall.telemetry.command_kinds import FORCE, KINDS, LEG_LOWER, WAIT

Row = Annotated[int, Field(ge=0, le=10**6), FromNumber]


class NewSequence(Strictly):
    """Make commands of a plan: digest of a planned step, of a move of the chassis, of a queue or of a walk, null for
    the latest step.

    execution: of an execution instead, by digest; ``current`` is that of the present plan. A step is commanded with the
    pose held, or as ``settings`` say, and a move of the chassis or a queue with the pose held, where it is known how
    the rover sags; as_commanded: as it was planned all the same, where it ends not predicted. A walk is commanded as if
    the rover were rigid, without settings.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"plan": None},
                {"plan": "0f3c6bb6a1d24c5f8f6f2d1c9a7e4b30"},
                {"settings": {"mode": "droop_aware"}},
                {"as_commanded": True},
                {"execution": "current"},
            ]
        }
    )
    plan: Name | None = None
    execution: Name | None = None
    settings: ExecutionSettingsModel | None = None  # type: ignore[valid-type]
    as_commanded: bool = False


class CommandModel(Strictly):
    """One command: LEG_MOVE and LEG_LOWER (which has a ``force`` [N]) with the joints of a leg [rad, or m where one
    slides], six of ATHLETE's, POSTURE_MOVE with those of all legs, or WAIT."""

    name: Annotated[str, Field(pattern=f"^({'|'.join(KINDS)})$")]
    leg: Leg | None = None
    joints: Annotated[list[Number], Len(1, 384)] | None = None
    duration: Number = Field(description="[s]")
    phase: Annotated[str, Field(max_length=20)] = ""
    force: Number | None = Field(default=None, description=f"of {LEG_LOWER.name} [{FORCE.unit}]")


class EditModel(Strictly):
    """One change of the command list; rows count from 0."""

    kind: Annotated[str, Field(pattern=f"^({'|'.join(EDIT_KINDS)})$")]
    row: Row
    command: CommandModel | None = None
    to: Row | None = None
    joint: Annotated[int, Field(ge=0, le=383), FromNumber] | None = None
    number: Number | None = None


class SequenceEdit(Strictly):
    """An edit; If-Match must name the version that it changes."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"edit": {"kind": "insert", "row": 1, "command": {"name": WAIT.name, "duration": 2.0}}},
                {"edit": {"kind": "duration", "row": 1, "number": 4.0}},
                {"edit": {"kind": "delete", "row": 1}},
            ]
        }
    )
    edit: EditModel


class SendOrder(Strictly):
    """Send what was armed; the token comes from arming and serves once. mode `steps`: every row waits for `next`."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"arming": "the token of the arm request"},
                {"arming": "the token of the arm request", "mode": "steps"},
            ]
        }
    )
    arming: Name
    mode: Literal["whole", "steps"] = "whole"
