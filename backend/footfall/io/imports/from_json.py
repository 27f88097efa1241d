"""FootFall's own JSON, as ``io.exports.as_json`` writes it. Predictions and rules are not read: they are made anew."""

from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_json import VERSION
from footfall.io.imports.parsed import (
    ParsedSequence,
    array,
    items,
    json_of,
    layout_in,
    member,
    number,
    only,
    require_rows,
    text,
    text_of,
    whole,
    with_start,
)
from footfall.sequence.commands import Command

_READ = ("format", "version", "robot", "start", "T_site_base", "at_rest", "commands", "layout")
_DOCUMENT = (*_READ, "digest", "software", "parents", "duration", "rules")
_COMMAND = ("row", "name", "leg", "joints", "duration", "phase", "force", "predicted", "predicted_T_site_base")


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence, naming the place, where the file is not such a JSON."""
    return of_document(json_of(text_of(data)))


def of_document(document: Any) -> ParsedSequence:
    """The same from parsed JSON."""
    if member(document, "format", "the file") != "footfall-sequence":
        raise InvalidSequence("its format must be 'footfall-sequence'", format=document["format"])
    if (version := member(document, "version", "the file")) != VERSION:
        raise InvalidSequence(f"this FootFall reads version {VERSION} of its JSON, not {version!r}")
    only(document, _DOCUMENT, "the file")
    commands = items(member(document, "commands", "the file"), "commands")
    places = [(one, f"commands[{i}]") for i, one in enumerate(commands)]
    require_rows([(where, whole(member(one, "row", where), f"{where}, row")) for one, where in places])
    parsed = ParsedSequence(
        robot=text(member(document, "robot", "the file"), "robot"),
        commands=tuple(_command(one, where) for one, where in places),
        described=layout_in(document, "the file"),
    )
    return with_start(parsed, document, "the file")


def _command(document: Any, where: str) -> Command:
    only(document, _COMMAND, where)
    leg, joints, force = member(document, "leg", where), member(document, "joints", where), document.get("force")
    return Command(
        name=text(member(document, "name", where), f"{where}, name"),
        leg=None if leg is None else whole(leg, f"{where}, leg"),
        joints=None if joints is None else array(joints, f"{where}, joints"),
        duration=number(member(document, "duration", where), f"{where}, duration"),
        phase=text(member(document, "phase", where), f"{where}, phase"),
        force=None if force is None else number(force, f"{where}, force"),
    )
