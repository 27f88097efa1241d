"""F Prime: a text sequence for ``fprime-seqgen``, and the dictionary of our commands that it compiles with.

Times are all R00:00:00, relative to the end of the command before; durations are arguments. Every number is an F64.
The compiler reads comments too (a line break would end one), so names from files stand there as ASCII JSON.
"""

import json
from collections.abc import Mapping

from footfall.core.errors import InvalidSequence
from footfall.core.json_object import JsonObject
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.exports.as_json import at_rest, described
from footfall.sequence.commands import LEG_JOINTS, Command, Sequence
from footfall.telemetry.command_kinds import ALL_ANGLES, KINDS, LEG, LEG_ANGLES, Argument, CommandKind

COMPONENT = "FootFall"
HEADER = "; footfall-sequence "
"""Begins the comment with what the commands start from, which the format has no place for."""

VERSION = 1
_U8 = {"name": "U8", "kind": "integer", "size": 8, "signed": False}
_F64 = {"name": "F64", "kind": "float", "size": 64}
_LEG_JOINTS, _POSTURE = f"{COMPONENT}.LegJoints", f"{COMPONENT}.Posture"


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """The text sequence (.seq), ASCII: one command a line, in rad, s and N."""
    values = {
        "version": VERSION,
        "digest": sequence.digest,
        "robot": sequence.robot,
        **described(sequence),
        "software": sequence.provenance.software,
        "start": sequence.start.tolist(),
        "T_site_base": sequence.T_site_base.tolist(),
        **at_rest(sequence),
    }
    lines = [
        "; FootFall: compile with  fprime-seqgen --dictionary <its dictionary> <this file>",
        f"; Every command starts when the one before is done. {_units(sequence)}, durations in s, forces in N.",
        HEADER + json.dumps(values, allow_nan=False),
        *(_line(row, command) for row, command in enumerate(sequence.commands, first_row)),
    ]
    return "\n".join(lines).encode("ascii") + b"\n"


def dictionary(sequence: Sequence) -> bytes:
    """The JSON dictionary of the commands, for robots with as many legs and joints as the sequence's.

    Raises InvalidSequence where its legs have unlike numbers of joints: one type holds those of any leg.
    """
    counts = {len(own) for own in sequence.layout.joints}
    if len(counts) > 1:
        listed = ", ".join(map(str, sorted(counts)))
        raise InvalidSequence(f"an F Prime dictionary has one type for the joints of a leg; the legs have {listed}")
    means, measured = _means(sequence), _measured(sequence)
    document = {
        "metadata": {
            "deploymentName": COMPONENT,
            "projectVersion": SOFTWARE_VERSION,
            "frameworkVersion": "4.0.0",
            "libraryVersions": [],
            "dictionarySpecVersion": "1.0.0",
        },
        "typeDefinitions": [
            _array(_LEG_JOINTS, counts.pop(), measured),
            _array(_POSTURE, len(sequence.start), measured),
        ],
        "constants": [],
        "commands": [_command(kind, means) for kind in KINDS.values()],
        "parameters": [],
        "events": [],
        "telemetryChannels": [],
        "records": [],
        "containers": [],
        "telemetryPacketSets": [],
    }
    return json.dumps(document, indent=1).encode() + b"\n"


def _line(row: int, command: Command) -> str:
    arguments = [
        f"[{', '.join(map(repr, given))}]" if isinstance(given, list) else repr(given) for _, given in command.arguments
    ]
    comment = json.dumps({"row": row, "phase": command.phase})
    return f"R00:00:00 {COMPONENT}.{command.name} {', '.join(arguments)} ; {comment}"


def _named(qualified: str) -> dict[str, str]:
    return {"name": qualified, "kind": "qualifiedIdentifier"}


def _units(sequence: Sequence) -> str:
    return f"Angles in rad{', ways of joints that slide in m' if sequence.layout.sliding else ''}"


def _measured(sequence: Sequence) -> str:
    return f"joint angles [rad]{', of joints that slide ways [m]' if sequence.layout.sliding else ''}"


def _means(sequence: Sequence) -> dict[Argument, str]:
    """What arguments mean, where that depends on the robot: which legs it has, and which joints in which unit."""
    layout = sequence.described
    if layout is None:
        return {LEG_ANGLES: f"{LEG_ANGLES.means}: {', '.join(LEG_JOINTS)}"}
    legs = [f"{number} {name}" for number, name in enumerate(layout.legs)]
    joints = [
        ", ".join(f"{joint} [{'m' if joint in layout.sliding else 'rad'}]" for joint in own) for own in layout.joints
    ]
    of_legs = "; ".join(f"leg {leg}: {own}" for leg, own in zip(legs, joints, strict=True))
    return {
        LEG: f"{LEG.means}: {', '.join(legs)}",
        LEG_ANGLES: f"targets of the joints of the leg; {of_legs}",
        ALL_ANGLES: f"targets of all joints, leg by leg: {', '.join(joints)}",
    }


def _array(qualified: str, size: int, measured: str) -> JsonObject:
    return {
        "kind": "array",
        "qualifiedName": qualified,
        "size": size,
        "elementType": _F64,
        "default": [0.0] * size,
        "annotation": measured,
    }


_TYPES = {LEG: _U8, LEG_ANGLES: _named(_LEG_JOINTS), ALL_ANGLES: _named(_POSTURE)}
"""Types of arguments that are no F64."""


def _param(argument: Argument, means: Mapping[Argument, str]) -> JsonObject:
    return {
        "name": argument.name,
        "type": _TYPES.get(argument, _F64),
        "ref": False,
        "annotation": means.get(argument, argument.means),
    }


def _command(kind: CommandKind, means: Mapping[Argument, str]) -> JsonObject:
    return {
        "name": f"{COMPONENT}.{kind.name}",
        "commandKind": "async",
        "opcode": 0x46460000 + kind.code,
        "annotation": kind.does,
        "formalParams": [_param(argument, means) for argument in kind.arguments],
        "queueFullBehavior": "assert",
    }
