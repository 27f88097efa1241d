"""Sequences: made from a plan, edited under If-Match, exported, armed and sent."""

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import Header, Query, Response

from footfall.api.access import BASE, AllSessions, OneSession
from footfall.api.lineage import Lineage, find, head_of
from footfall.api.problems import Problem
from footfall.api.routing import Routes
from footfall.api.schemas import EditModel, NewSequence, SendOrder, SequenceEdit
from footfall.core.errors import NotFound
from footfall.io.exports import SUFFIXES
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.edit import Edit

router = Routes(tags=["sequences"])

IfMatch = Annotated[str | None, Header(description="the ETag of the version that this changes")]
_MEDIA = {"json": "application/json", "seqjson": "application/json", "csv": "text/csv"}


@router.post("/sessions/{session}/sequences", status_code=201)
def make(live: OneSession, order: NewSequence, response: Response) -> dict[str, Any]:
    """Turn a plan into commands. It becomes the session's sequence."""
    live.make_sequence(order.plan)
    lineage = head_of(live)
    response.headers["Location"] = f"{BASE}/sequences/{lineage.id}"
    return _body(lineage, lineage.head, response)


@router.get("/sequences/{sequence}")
def read(sequence: str, sessions: AllSessions, response: Response) -> dict[str, Any]:
    """Commands, the posture predicted after each, every rule. An id means the newest version, a digest that one."""
    lineage, digest = find(sessions, sequence)
    return _body(lineage, digest, response)


@router.patch("/sequences/{sequence}")
def change(
    sequence: str, order: SequenceEdit, sessions: AllSessions, response: Response, if_match: IfMatch = None
) -> dict[str, Any]:
    """Apply one edit; every rule is checked again. A broken rule makes the sequence invalid, not the request."""
    lineage = _matched(*find(sessions, sequence), if_match)
    lineage.live.edit_sequence(lineage.head, _edit(order.edit))
    return _now(lineage, response)


@router.post("/sequences/{sequence}/undo")
def undo(sequence: str, sessions: AllSessions, response: Response, if_match: IfMatch = None) -> dict[str, Any]:
    """Take back the last edit."""
    lineage = _matched(*find(sessions, sequence), if_match)
    lineage.live.undo_sequence()
    return _now(lineage, response)


@router.get("/sequences/{sequence}/export", response_class=Response)
def export(
    sequence: str,
    sessions: AllSessions,
    format: Annotated[Literal["json", "csv", "seqjson"], Query(description="file format")] = "seqjson",
) -> Response:
    """The sequence as a file; refused while a rule does not hold. The numbers are bit for bit those checked."""
    lineage, digest = find(sessions, sequence)
    content = lineage.live.export_sequence(digest, format)
    name = f"sequence-{digest[:8]}{SUFFIXES[format]}"
    headers = {"Content-Disposition": f'attachment; filename="{name}"', "ETag": f'"{digest}"'}
    return Response(content, media_type=_MEDIA[format], headers=headers)


@router.post("/sequences/{sequence}/arm")
def arm(sequence: str, sessions: AllSessions) -> Any:
    """Check the sequence against the rover as it is now. The token is good for one send within seconds."""
    lineage, digest = find(sessions, sequence)
    return lineage.live.arm(digest)


@router.post("/sequences/{sequence}/send", status_code=202)
def send(sequence: str, order: SendOrder, sessions: AllSessions) -> Any:
    """Send what was armed, if it is this very version of the sequence. Acknowledgements arrive as events."""
    lineage, digest = find(sessions, sequence)
    return lineage.live.send(order.arming, digest)


def _edit(model: EditModel) -> Edit:
    command = None
    if model.command is not None:
        members = model.command.model_dump()
        joints = members.pop("joints")
        command = Command(joints=None if joints is None else np.array(joints, float), **members)
    return Edit(model.kind, model.row, command, model.to, model.joint, model.number)


def _matched(lineage: Lineage, digest: str, if_match: str | None) -> Lineage:
    if if_match is None:
        raise Problem("precondition-required", 428, "say with If-Match which version you change; GET shows its ETag")
    tags = [tag.strip().removeprefix("W/").strip('"') for tag in if_match.split(",")]
    if digest != lineage.head or (lineage.head not in tags and "*" not in tags):
        raise Problem(
            "precondition-failed",
            412,
            "the sequence has changed since you read it; read it again",
            current=lineage.head,
            given=tags,
        )
    return lineage


def _now(lineage: Lineage, response: Response) -> dict[str, Any]:
    changed = head_of(lineage.live)
    return _body(changed, changed.head, response)


def _body(lineage: Lineage, digest: str, response: Response) -> dict[str, Any]:
    sequence = lineage.live.get(digest)
    if not isinstance(sequence, Sequence):
        raise NotFound(f"{digest} is a {type(sequence).__name__}, not a sequence")
    response.headers["ETag"] = f'"{digest}"'
    return {
        "id": lineage.id,
        "digest": digest,
        "session": lineage.live.id,
        "robot": sequence.robot,
        "valid": sequence.valid,
        "duration": sequence.duration,
        "commands": sequence.commands,
        "start": sequence.start,
        "predicted": sequence.predicted,
        "T_site_base": sequence.T_site_base,
        "rules": sequence.rules,
        "parents": sequence.provenance.parents,
        "current": digest == lineage.head,
        "can_undo": digest == lineage.head and lineage.head != lineage.root,
    }
