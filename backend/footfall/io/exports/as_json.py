"""FootFall's own JSON: the commands, what they start from and lead to, and every rule's result."""

import json
import math
from typing import Any

from footfall.sequence.commands import Command, RuleResult, Sequence

VERSION = 1


def encode(sequence: Sequence) -> bytes:
    """UTF-8 JSON; angles in rad, durations in s, lengths in m."""
    document = {
        "format": "footfall-sequence",
        "version": VERSION,
        "digest": sequence.digest,
        "robot": sequence.robot,
        "software": sequence.provenance.software,
        "parents": dict(sequence.provenance.parents),
        "T_site_base": sequence.T_site_base.tolist(),
        "start": sequence.start.tolist(),
        "duration": sequence.duration,
        "commands": [
            command_object(row, command) | {"predicted": sequence.predicted[row].tolist()}
            for row, command in enumerate(sequence.commands)
        ],
        "rules": [_rule(rule) for rule in sequence.rules],
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def command_object(row: int, command: Command) -> dict[str, Any]:
    """One command, JSON-ready."""
    return {
        "row": row,
        "name": command.name,
        "leg": command.leg,
        "joints": None if command.joints is None else command.joints.tolist(),
        "duration": command.duration,
        "phase": command.phase,
    }


def _rule(rule: RuleResult) -> dict[str, Any]:
    return {
        "rule": rule.rule,
        "row": rule.row,
        "holds": rule.holds,
        "margin": rule.margin if math.isfinite(rule.margin) else None,
        "unit": rule.unit,
        "text": rule.text,
    }
