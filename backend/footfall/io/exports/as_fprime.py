"""F Prime: a text sequence for ``fprime-seqgen``, and the dictionary of our commands that it compiles with.

Times are all R00:00:00, relative to the end of the command before; durations are arguments. Every number is an F64.
The compiler reads comments too (a line break would end one), so names from files stand there as ASCII JSON.
"""

import json
from typing import Any

from footfall.core.value import SOFTWARE_VERSION
from footfall.sequence.commands import LEG_JOINTS, Command, Sequence

COMPONENT = "FootFall"
HEADER = "; footfall-sequence "
"""Begins the comment with what the commands start from, which the format has no place for."""

VERSION = 1
_U8 = {"name": "U8", "kind": "integer", "size": 8, "signed": False}
_F64 = {"name": "F64", "kind": "float", "size": 64}
_LEG_JOINTS, _POSTURE = f"{COMPONENT}.LegJoints", f"{COMPONENT}.Posture"


def encode(sequence: Sequence) -> bytes:
    """The text sequence (.seq), ASCII: one command a line, in rad, s and N."""
    told = {
        "version": VERSION,
        "digest": sequence.digest,
        "robot": sequence.robot,
        "software": sequence.provenance.software,
        "start": sequence.start.tolist(),
        "T_site_base": sequence.T_site_base.tolist(),
    }
    lines = [
        "; FootFall: compile with  fprime-seqgen --dictionary <its dictionary> <this file>",
        "; Every command starts when the one before is done. Angles in rad, durations in s, forces in N.",
        HEADER + json.dumps(told, allow_nan=False),
        *(_line(row, command) for row, command in enumerate(sequence.commands)),
    ]
    return "\n".join(lines).encode("ascii") + b"\n"


def dictionary(sequence: Sequence) -> bytes:
    """The JSON dictionary of the commands, for rovers with as many legs as the sequence's."""
    leg = _param("leg", _U8, "leg, counted from 0")
    joints = _param("joints", _named(_LEG_JOINTS), f"target angles [rad]: {', '.join(LEG_JOINTS)}")
    posture = _param("joints", _named(_POSTURE), "target angles of all legs [rad], leg by leg")
    duration = _param("duration", _F64, "from its start to its end [s]")
    force = _param("force", _F64, "rise of the wheel's force along the site's up that ends it [N]")
    document = {
        "metadata": {
            "deploymentName": COMPONENT,
            "projectVersion": SOFTWARE_VERSION,
            "frameworkVersion": "4.0.0",
            "libraryVersions": [],
            "dictionarySpecVersion": "1.0.0",
        },
        "typeDefinitions": [_array(_LEG_JOINTS, len(LEG_JOINTS)), _array(_POSTURE, len(sequence.start))],
        "constants": [],
        "commands": [
            _command(0, "LEG_MOVE", "one leg in a straight joint-space line", leg, joints, duration),
            _command(1, "WAIT", "nothing moves", duration),
            _command(2, "POSTURE_MOVE", "all joints in one straight joint-space line", posture, duration),
            _command(3, "LEG_LOWER", "like LEG_MOVE, done when the wheel bears more", leg, joints, duration, force),
        ],
        "parameters": [],
        "events": [],
        "telemetryChannels": [],
        "records": [],
        "containers": [],
        "telemetryPacketSets": [],
    }
    return json.dumps(document, indent=1).encode() + b"\n"


def _line(row: int, command: Command) -> str:
    arguments: list[str] = [] if command.leg is None else [str(command.leg)]
    if command.joints is not None:
        arguments.append(f"[{', '.join(map(repr, command.joints.tolist()))}]")
    arguments.append(repr(command.duration))
    if command.force is not None:
        arguments.append(repr(command.force))
    comment = json.dumps({"row": row, "phase": command.phase})
    return f"R00:00:00 {COMPONENT}.{command.name} {', '.join(arguments)} ; {comment}"


def _named(qualified: str) -> dict[str, Any]:
    return {"name": qualified, "kind": "qualifiedIdentifier"}


def _array(qualified: str, size: int) -> dict[str, Any]:
    return {
        "kind": "array",
        "qualifiedName": qualified,
        "size": size,
        "elementType": _F64,
        "default": [0.0] * size,
        "annotation": "joint angles [rad]",
    }


def _param(name: str, type: dict[str, Any], annotation: str) -> dict[str, Any]:
    return {"name": name, "type": type, "ref": False, "annotation": annotation}


def _command(opcode: int, name: str, annotation: str, *params: dict[str, Any]) -> dict[str, Any]:
    return {
        "name": f"{COMPONENT}.{name}",
        "commandKind": "async",
        "opcode": 0x46460000 + opcode,
        "annotation": annotation,
        "formalParams": list(params),
        "queueFullBehavior": "assert",
    }
