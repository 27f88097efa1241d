"""SeqJSON 1.3.1 of NASA-AMMOS (Aerie). It has no array argument, so every joint is a number argument.

Every step is COMMAND_COMPLETE: the first starts with the sequence, each next one when the one before
is done. A tagged time would have to round the durations, which travel as arguments instead.
"""

import json

from footfall.core.json_object import JsonObject
from footfall.io.exports.as_json import at_rest, described
from footfall.sequence.commands import LEG_JOINTS, Command, Sequence
from footfall.telemetry.command_kinds import ALL_ANGLES, LEG_ANGLES, CommandKind
from footfall.telemetry.joint_layout import JointLayout


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """UTF-8 SeqJSON. Arguments in their order, angles in rad, durations in s, forces in N:

    LEG_MOVE(leg, six joints, duration), LEG_LOWER(leg, six joints, duration, force), WAIT(duration),
    POSTURE_MOVE(six joints of each leg, named leg0_hip_yaw and so on, duration).

    A robot that others described has its own joints, by their names, in m where they slide.
    """
    document = {
        "id": f"footfall-{sequence.digest}",
        "metadata": {
            "format": "footfall-sequence",
            "schema": "seq-json-schema 1.3.1",
            "digest": sequence.digest,
            "robot": sequence.robot,
            **described(sequence),
            "software": sequence.provenance.software,
            "parents": dict(sequence.provenance.parents),
            "units": {"angle": "rad", "duration": "s", "length": "m"} | _newtons(sequence),
            "start": sequence.start.tolist(),
            "T_site_base": sequence.T_site_base.tolist(),
            **at_rest(sequence),
            "final": sequence.predicted[-1].tolist(),
            **_final_pose(sequence),
        },
        "steps": [_step(row, command, sequence) for row, command in enumerate(sequence.commands, first_row)],
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def _newtons(sequence: Sequence) -> dict[str, str]:
    return {"force": "N"} if any(command.force is not None for command in sequence.commands) else {}


def _final_pose(sequence: Sequence) -> dict[str, list[list[float]]]:
    if sequence.Ts_site_base is None:
        return {}
    return {"final_T_site_base": sequence.Ts_site_base[-1].tolist()}


def names(kind: CommandKind, leg: int | None, layout: JointLayout | None, leg_count: int = 0) -> list[str]:
    """The arguments of a command by name, every joint one of its own.

    layout: of a robot that others described; None: ATHLETE's build with so many legs, which call their joints alike.
    """
    found: list[str] = []
    for argument in kind.arguments:
        if argument is LEG_ANGLES:
            found += LEG_JOINTS if layout is None or leg is None else layout.joints[leg]
        elif argument is ALL_ANGLES and layout is not None:
            found += layout.joint_names
        elif argument is ALL_ANGLES:
            found += [f"leg{leg}_{joint}" for leg in range(leg_count) for joint in LEG_JOINTS]
        else:
            found.append(argument.name)
    return found


def _step(row: int, command: Command, sequence: Sequence) -> JsonObject:
    numbers: list[float] = []
    for _, given in command.arguments:
        numbers += given if isinstance(given, list) else [given]
    named = names(command.kind, command.leg, sequence.described, len(sequence.start) // len(LEG_JOINTS))
    args = zip(named, numbers, strict=True)
    return {
        "type": "command",
        "stem": command.name,
        "time": {"type": "COMMAND_COMPLETE"},
        "args": [{"type": "number", "name": name, "value": number} for name, number in args],
        "metadata": {"row": row, "phase": command.phase},
    }
