"""SeqJSON 1.3.1 of NASA-AMMOS (Aerie). It has no array argument, so six joints are six number arguments.

Every step is COMMAND_COMPLETE: the first starts with the sequence, each next one when the one before
is done. A tagged time would have to round the durations, which travel as arguments instead.
"""

import json
from typing import Any

from footfall.sequence.commands import LEG_JOINTS, Command, Sequence


def encode(sequence: Sequence) -> bytes:
    """UTF-8 SeqJSON: LEG_MOVE(leg, six joints [rad], duration [s]), WAIT(duration [s])."""
    document = {
        "id": f"footfall-{sequence.digest}",
        "metadata": {
            "format": "footfall-sequence",
            "schema": "seq-json-schema 1.3.1",
            "digest": sequence.digest,
            "robot": sequence.robot,
            "software": sequence.provenance.software,
            "parents": dict(sequence.provenance.parents),
            "units": {"angle": "rad", "duration": "s", "length": "m"},
            "start": sequence.start.tolist(),
            "T_site_base": sequence.T_site_base.tolist(),
            "final": sequence.predicted[-1].tolist(),
        },
        "steps": [_step(row, command) for row, command in enumerate(sequence.commands)],
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def _step(row: int, command: Command) -> dict[str, Any]:
    args: list[tuple[str, float]] = []
    if command.leg is not None and command.joints is not None:
        args = [("leg", command.leg), *zip(LEG_JOINTS, command.joints.tolist(), strict=True)]
    args.append(("duration", command.duration))
    return {
        "type": "command",
        "stem": command.name,
        "time": {"type": "COMMAND_COMPLETE"},
        "args": [{"type": "number", "name": name, "value": number} for name, number in args],
        "metadata": {"row": row, "phase": command.phase},
    }
