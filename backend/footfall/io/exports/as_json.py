"""FootFall's own JSON: the commands, what they start from and lead to, and every rule's result."""

import json
import math

from footfall.core.json_object import JsonObject
from footfall.sequence.commands import Command, RuleResult, Sequence

VERSION = 1


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """UTF-8 JSON; angles in rad, durations in s, lengths, and joints that slide, in m.

    A rule of the whole sequence is one of row −1.
    """
    document = {
        "format": "footfall-sequence",
        "version": VERSION,
        "digest": sequence.digest,
        "robot": sequence.robot,
        **described(sequence),
        "software": sequence.provenance.software,
        "parents": dict(sequence.provenance.parents),
        "T_site_base": sequence.T_site_base.tolist(),
        "start": sequence.start.tolist(),
        **at_rest(sequence),
        "duration": sequence.duration,
        "commands": [
            command_object(first_row + i, command) | _predicted(sequence, i)
            for i, command in enumerate(sequence.commands)
        ],
        "rules": [_rule(rule, first_row) for rule in sequence.rules],
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def described(sequence: Sequence) -> JsonObject:
    """Legs and joints by name, where the robot is one that others described: ``sliding`` ones go by metres."""
    layout = sequence.described
    if layout is None:
        return {}
    legs = [{"name": name, "joints": list(own)} for name, own in zip(layout.legs, layout.joints, strict=True)]
    return {"layout": {"legs": legs, "sliding": list(layout.sliding)}}


def at_rest(sequence: Sequence) -> JsonObject:
    """How a rover that sags stood: set points and efforts of its joints, forces on its feet [rad or m, N·m or N]."""
    rest = sequence.at_rest
    if rest is None:
        return {}
    members = {
        "set_points": rest.set_points.tolist(),
        "joint_torques": rest.state.joint_torques.tolist(),
        "wheel_forces": rest.state.wheel_forces.tolist(),
    }
    return {"at_rest": members}


def command_object(row: int, command: Command) -> JsonObject:
    """One command, JSON-ready; ``force`` [N] only where it has one."""
    members = {
        "row": row,
        "name": command.name,
        "leg": command.leg,
        "joints": None if command.joints is None else command.joints.tolist(),
        "duration": command.duration,
        "phase": command.phase,
    }
    return members if command.force is None else members | {"force": command.force}


def _predicted(sequence: Sequence, row: int) -> JsonObject:
    """What a command leads to; where the chassis is then only in a sequence that moves it."""
    members = {"predicted": sequence.predicted[row].tolist()}
    if sequence.Ts_site_base is None:
        return members
    return members | {"predicted_T_site_base": sequence.Ts_site_base[row].tolist()}


def _rule(rule: RuleResult, first_row: int) -> JsonObject:
    return {
        "rule": rule.rule,
        "row": rule.row if rule.row < 0 else first_row + rule.row,
        "holds": rule.holds,
        "margin": rule.margin if math.isfinite(rule.margin) else None,
        "unit": rule.unit,
        "text": rule.text,
    }
