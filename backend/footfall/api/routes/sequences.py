"""Sequences: made from a plan, edited under If-Match, exported, armed and sent."""

from dataclasses import asdict
from typing import Annotated, Literal, cast

import numpy as np
from fastapi import Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from footfall.api.access import BASE, AllSessions, OneSession, SequenceId
from footfall.api.acting import Actor
from footfall.api.bodies.sequence_answers import ExportedAnswer, FootMoveRows, SequenceAnswer
from footfall.api.bodies.sequence_schemas import EditModel, NewSequence, SendOrder, SequenceEdit
from footfall.api.door.multipart import file_of, form_of, multipart_doc
from footfall.api.door.problems import Problem
from footfall.api.execution_orders import settings_of_order
from footfall.api.lineage import Lineage, find, made_in
from footfall.api.routing import Routes, files
from footfall.core.errors import InvalidInput, NotFound
from footfall.io.exports import MEDIA, SUFFIXES, formats_for
from footfall.io.exports import export as encode
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.edit import Edit
from footfall.sequence.moved_legs import moved_legs
from footfall.session.answers.commands import ArmedAnswer, SentAnswer
from footfall.session.live import LiveSession
from footfall.session.products.kinds import IMPORT
from footfall.session.storage.artifact_folder import bytes_digest
from footfall.session.walking import CommandedFootMove

router = Routes(tags=["sequences"])

IfMatch = Annotated[str | None, Header(description="the ETag of the version that this changes")]
ExportFormat = Literal["json", "csv", "seqjson", "fprime", "fprime-dictionary", "yamcs", "ros2", "html"]


@router.post("/sessions/{session}/sequences", status_code=201)
def make(live: OneSession, order: NewSequence, response: Response) -> SequenceAnswer:
    """Turn a planned step, its execution, a move of the chassis, a queue or a walk into the session's commands.

    `way` of the answer says how it is commanded. 422 where the step can't be commanded so: nothing is made otherwise
    than was asked for.
    """
    chosen, settings = order.plan, settings_of_order(live, order.settings)
    if order.execution is not None:
        if chosen is not None:
            raise InvalidInput("a sequence is made of a plan or of an execution, not of both")
        if settings is not None or order.as_commanded:
            raise InvalidInput("an execution says already how it is commanded: leave out settings and as_commanded")
        chosen = live.executions.found(None if order.execution == "current" else order.execution)
    return answer_with(live, live.sequences.make(chosen, settings, as_commanded=order.as_commanded), response)


@router.post(
    "/sessions/{session}/sequences/import",
    status_code=201,
    openapi_extra=multipart_doc({"file": "JSON, SeqJSON, CSV, F Prime text (.seq), Yamcs stack (.ycs) or MCAP"}, {}),
)
async def read_in(
    live: OneSession,
    request: Request,
    response: Response,
    as_commanded: Annotated[bool, Query(description="made as planned: no sag is predicted")] = False,
) -> SequenceAnswer:
    """Commands from a file, every rule checked anew. They take the place of those before; undo brings these back.

    A file that doesn't say from where its commands start is taken to start where the rover stands, or is looked at in a
    what-if: `starts_from`. There the rover sags as it is known to, unless the commands are `as_commanded`.
    """
    async with form_of(request, ("file",)) as form:
        name, content = await file_of(form, "file")
    digest = await run_in_threadpool(live.sequences.import_file, name, content, as_commanded=as_commanded)
    return answer_with(live, digest, response)


@router.get("/sequences/{sequence}")
def read(sequence: SequenceId, sessions: AllSessions, response: Response) -> SequenceAnswer:
    """Commands, what each leads to, and every rule. An id means the newest version, a digest that one."""
    lineage, digest = find(sessions, sequence, look=True)
    return sequence_body(lineage, digest, response)


@router.patch("/sequences/{sequence}")
def change(
    sequence: SequenceId, order: SequenceEdit, sessions: AllSessions, response: Response, if_match: IfMatch = None
) -> SequenceAnswer:
    """Apply one edit; every rule is checked again. A broken rule makes the sequence invalid, not the request."""
    lineage = _matched(*find(sessions, sequence), if_match)
    return _changed(lineage.live, lineage.live.sequences.edit(lineage.head, _edit(order.edit)), response)


@router.post("/sequences/{sequence}/undo")
def undo(sequence: SequenceId, sessions: AllSessions, response: Response, if_match: IfMatch = None) -> SequenceAnswer:
    """Take back the last edit."""
    lineage = _matched(*find(sessions, sequence), if_match)
    return _changed(lineage.live, lineage.live.sequences.undo(lineage.head), response)


@router.post("/sequences/{sequence}/redo")
def redo(sequence: SequenceId, sessions: AllSessions, response: Response, if_match: IfMatch = None) -> SequenceAnswer:
    """Make the edit again that was taken back last, unless another came since."""
    lineage = _matched(*find(sessions, sequence), if_match)
    return _changed(lineage.live, lineage.live.sequences.redo(lineage.head), response)


def _drawn(live: LiveSession) -> Robot | None:
    """The robot that a page to print shows; it draws none that others described."""
    return None if live.described is not None else live.robot


@router.get("/sequences/{sequence}/export", response_class=Response, responses=files(*sorted(set(MEDIA.values()))))
def export(
    sequence: SequenceId,
    sessions: AllSessions,
    format: Annotated[ExportFormat, Query(description="file format")] = "seqjson",
) -> Response:
    """The sequence as a file; refused while a rule does not hold. For machines, its numbers keep their bits.

    Nothing is recorded: POST to this address records what was exported.
    """
    lineage, digest = find(sessions, sequence, look=True)
    content = encode(_sequence(lineage, digest), format, robot=_drawn(lineage.live))
    name = f"sequence-{digest[:8]}{SUFFIXES[format]}"
    headers = {"Content-Disposition": f'attachment; filename="{name}"', "ETag": f'"{digest}"'}
    return Response(content, media_type=MEDIA[format], headers=headers)


@router.post("/sequences/{sequence}/export", status_code=201)
def record_export(
    sequence: SequenceId,
    sessions: AllSessions,
    response: Response,
    format: Annotated[ExportFormat, Query(description="file format")] = "seqjson",
) -> ExportedAnswer:
    """Export for somebody: the session records the file, GET of this address gives it.

    The page to print (`html`) is not recorded: replay would hold later versions to how this one draws it.
    """
    lineage, digest = find(sessions, sequence)
    recorded = None
    if format == "html":
        encode(_sequence(lineage, digest), format, robot=_drawn(lineage.live))
    else:
        recorded = bytes_digest(lineage.live.sequences.export(digest, format))
    url = f"{BASE}/sequences/{digest}/export?format={format}"
    response.headers["Location"] = url
    return {"format": format, "digest": recorded, "url": url}


@router.post("/sequences/{sequence}/arm")
def arm(sequence: SequenceId, sessions: AllSessions, who: Actor) -> ArmedAnswer:
    """Check the sequence against the rover as it is now. The token is good for one send within seconds.

    Takes the conn where nobody holds it; refused where another does.
    """
    lineage, digest = find(sessions, sequence)
    return lineage.live.commands.arm(digest, who)


@router.post("/sequences/{sequence}/send", status_code=202)
def send(sequence: SequenceId, order: SendOrder, sessions: AllSessions, who: Actor) -> SentAnswer:
    """Send what was armed, if it is this very version of the sequence. Acknowledgements arrive as events."""
    lineage, digest = find(sessions, sequence)
    return lineage.live.commands.send(order.arming, digest, who, step_by_step=order.mode == "steps")


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


def _changed(live: LiveSession, digest: str, response: Response) -> SequenceAnswer:
    # this version, also where somebody has made another one since
    return sequence_body(made_in(live, digest), digest, response)


def _sequence(lineage: Lineage, digest: str) -> Sequence:
    sequence = lineage.live.get(digest)
    if not isinstance(sequence, Sequence):
        raise NotFound(f"{digest} is a {type(sequence).__name__}, not a sequence")
    return sequence


def _foot_moves(live: LiveSession, digest: str) -> tuple[CommandedFootMove, ...]:
    return live.walks.foot_moves_in(digest) or live.queues.foot_moves_in(digest)


def _starts_from(lineage: Lineage, digest: str) -> Literal["plan", "file", "rover"]:
    state = lineage.live.state
    first = state.before_edits(digest)
    made = state.products.get(first)
    if made is None or made.kind != IMPORT.name:
        return "plan"
    return "rover" if "state" in _sequence(lineage, first).provenance.parents else "file"


def answer_with(live: LiveSession, digest: str, response: Response) -> SequenceAnswer:
    """The sequence that was made, also where somebody has made another one since; its address set."""
    lineage = made_in(live, digest)
    response.headers["Location"] = f"{BASE}/sequences/{lineage.id}"
    return sequence_body(lineage, digest, response)


def sequence_body(lineage: Lineage, digest: str, response: Response) -> SequenceAnswer:
    """One version, its ETag set."""
    sequence = _sequence(lineage, digest)
    response.headers["ETag"] = f'"{digest}"'
    return {
        "id": lineage.id,
        "digest": digest,
        "session": lineage.live.id,
        "robot": sequence.robot,
        "valid": sequence.valid,
        "duration": sequence.duration,
        "commands": sequence.commands,
        "legs": moved_legs(sequence),
        "start": sequence.start,
        "predicted": sequence.predicted,
        "set_points_before": None if sequence.at_rest is None else sequence.at_rest.set_points,
        "commanded": sequence.commanded,
        "T_site_base": sequence.T_site_base,
        "Ts_site_base": sequence.poses,
        "tether_lengths": sequence.tether_lengths,
        "rules": sequence.rules,
        "parents": dict(sequence.provenance.parents),
        "starts_from": _starts_from(lineage, digest),
        "way": lineage.live.executions.way_of(digest),
        "export_formats": formats_for(sequence),
        "foot_moves": [cast(FootMoveRows, asdict(one)) for one in _foot_moves(lineage.live, digest)],
        "current": digest == lineage.head,
        "can_undo": digest == lineage.head and lineage.head != lineage.root,
    }
