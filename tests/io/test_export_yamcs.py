"""Yamcs command stacks: every documented field, and every argument, compared with the sequence. No server is run."""

import html
import json

import pytest
from hypothesis import given

from footfall.core.errors import InvalidSequence
from footfall.io.exports import export
from footfall.sequence.commands import Sequence
from tests.support.sequences import HOSTILE, any_commands, four_kinds, recorded, require_arguments, unchecked

# What each step may hold, from the documented fields of a stack.
FIELDS = {
    "text": {"type", "text"},
    "check": {"type", "parameters"},
    "verify": {"type", "condition", "timeout"},
    "command": {"type", "name", "arguments", "comment"},
}


def require_stack(sequence: Sequence) -> dict:
    stack = json.loads(export(sequence, "yamcs"), parse_constant=pytest.fail)
    assert set(stack) == {"$schema", "steps", "advancement"}
    assert stack["advancement"] == {"acknowledgment": "CommandComplete", "wait": 0}
    steps = stack["steps"]
    assert [step["type"] for step in steps[:2]] == ["text", "check"]
    assert sequence.digest in steps[0]["text"]
    commands = iter(sequence.commands)
    gated = False
    for step in steps:
        assert set(step) == FIELDS[step["type"]]
        if step["type"] == "verify":
            # "eq" on an enumerated value: its orderings compare a value with itself on some servers
            assert step["condition"] == [{"parameter": "/FootFall/stability", "operator": "eq", "value": "STABLE"}]
            assert isinstance(step["timeout"], int)
            assert step["timeout"] > 0
            gated = True
        if step["type"] == "command":
            command = next(commands)
            assert step["name"] == f"/FootFall/{command.name}"
            names = [one["name"] for one in step["arguments"]]
            assert len(names) == len(set(names))
            require_arguments({one["name"]: one["value"] for one in step["arguments"]}, command)
            assert gated == (command.joints is not None)
            gated = False
    assert next(commands, None) is None
    return stack


@pytest.mark.parametrize("name", ["rock-step", "edited-export"])
def test_a_recorded_step(name):
    require_stack(recorded(name))


@given(commands=any_commands())
def test_any_numbers(commands):
    require_stack(unchecked(commands))


def test_names_from_files_are_no_markdown():
    hostile = "".join(HOSTILE)
    stack = require_stack(four_kinds(robot=hostile, phase=hostile))
    texts = [stack["steps"][0]["text"], *(step["comment"] for step in stack["steps"] if step["type"] == "command")]
    for text in texts:
        assert not set(text) & set("<>\"'`*_[]{}\\|~!=\r\n")
        assert "</title>" in html.unescape(text)


def test_a_broken_rule_is_not_exported():
    with pytest.raises(InvalidSequence, match="no commands"):
        export(unchecked(()), "yamcs")
