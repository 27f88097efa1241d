"""Yamcs command stack (.ycs, version 2 with ``steps``).

===========  ===========================================================================================
step         what
===========  ===========================================================================================
text, check  what the stack is of, and the stability at its start: for the operator, the server skips both
verify       before each command that moves: STABILITY is STABLE. One enumerated parameter and ``eq``, because
             the server's ordering operators compare a value with itself in 5.13.0 to 5.13.2
command      /FootFall/LEG_MOVE and so on; joints are one array argument
===========  ===========================================================================================

The next step comes when the one before is complete (``CommandComplete``), which the mission database has to verify.
Numbers are JSON doubles. Yamcs shows texts and comments as Markdown, so what comes from files is written in entities.
"""

import json

from footfall.core.json_object import JsonObject
from footfall.sequence.commands import Command, Sequence

SPACE_SYSTEM = "/FootFall"
STABILITY = f"{SPACE_SYSTEM}/stability"
"""Enumerated parameter that the mission database must have; STABLE while the rover may move."""

STABLE = "STABLE"
TIMEOUT_MS = 10_000
UNITS = "Angles in rad, durations in s, forces in N."

CHECK = {"type": "check", "parameters": [{"parameter": STABILITY}]}
GATE = {
    "type": "verify",
    "condition": [{"parameter": STABILITY, "operator": "eq", "value": STABLE}],
    "timeout": TIMEOUT_MS,
}
ADVANCEMENT = {"acknowledgment": "CommandComplete", "wait": 0}
"""The next step comes as soon as the command before is complete."""


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """UTF-8 JSON of the stack; angles in rad, durations in s, forces in N."""
    text = (
        f"FootFall sequence {sequence.digest} for {_literal(sequence.robot)}: "
        f"{len(sequence.commands)} commands, {sequence.duration:z.1f} s. {UNITS}"
    )
    steps: list[JsonObject] = [
        {"type": "text", "text": text},
        CHECK,
    ]
    for row, command in enumerate(sequence.commands, first_row):
        if command.kind.moves:
            steps.append(GATE)
        steps.append(_command(row, command))
    document = {
        "$schema": "https://yamcs.org/schema/command-stack.schema.json",
        "steps": steps,
        "advancement": ADVANCEMENT,
    }
    return json.dumps(document, indent=1, allow_nan=False).encode() + b"\n"


def _command(row: int, command: Command) -> JsonObject:
    return {
        "type": "command",
        "name": f"{SPACE_SYSTEM}/{command.name}",
        "arguments": [{"name": argument.name, "value": given} for argument, given in command.arguments],
        "comment": f"row {row} {_literal(command.phase)}".rstrip(),
    }


def _literal(text: str) -> str:
    """Markdown and HTML that show just this text."""
    return "".join(one if one.isascii() and one.isalnum() else " " if one == " " else f"&#{ord(one)};" for one in text)
