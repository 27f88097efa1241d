"""SeqJSON through NASA's sequence-language tool: SeqJSON → SeqN → SeqJSON gives the same steps."""

import json

import pytest
from hypothesis import given, settings

from footfall.io.exports import export
from footfall.io.imports import from_seqjson
from footfall.sequence.commands import LEG_JOINTS, Sequence
from tests.support.node import run
from tests.support.sequences import (
    HOSTILE,
    LEGS,
    any_commands,
    bits,
    four_kinds,
    recorded,
    require_same_commands,
    unchecked,
)

LEG = ("leg", *LEG_JOINTS, "duration")
ARGUMENTS = {
    "LEG_MOVE": LEG,
    "WAIT": ("duration",),
    "POSTURE_MOVE": (*(f"leg{leg}_{joint}" for leg in range(LEGS) for joint in LEG_JOINTS), "duration"),
    "LEG_LOWER": (*LEG, "force"),
}
DICTIONARY = {
    "fswCommandMap": {stem: {"arguments": [{"name": one} for one in names]} for stem, names in ARGUMENTS.items()}
}
"""As much of a command dictionary as the tool looks at: SeqN itself has no names of arguments."""


def round_trip(sequence: Sequence, dictionary: dict | None = DICTIONARY) -> tuple[dict, dict]:
    """The document that went in and the one that came back."""
    document = json.loads(export(sequence, "seqjson"))
    told = json.loads(run("seqn.mjs", given=json.dumps({"sequence": document, "dictionary": dictionary})))
    assert told["faults"] == []
    return document, told["back"]


def require_same(sequence: Sequence) -> None:
    document, back = round_trip(sequence)
    assert back["id"] == document["id"]
    assert back["metadata"] == document["metadata"]
    assert back["steps"] == document["steps"]
    for step, command in zip(back["steps"], sequence.commands, strict=True):
        numbers = [arg["value"] for arg in step["args"]]
        joints = [] if command.joints is None else command.joints
        assert bits(numbers[-1 - (command.force is not None) :][:1]) == bits([command.duration])
        # JavaScript writes −0 as 0: the one thing that is lost
        assert bits(number + 0.0 for number in joints) == bits(numbers[command.leg is not None :][: len(joints)])


@pytest.mark.parametrize("name", ["rock-step", "edited-export"])
def test_a_recorded_step_comes_back(name):
    require_same(recorded(name))


@settings(max_examples=3)
@given(commands=any_commands(least=6))
def test_any_numbers_come_back(commands):
    require_same(unchecked(commands))


def test_names_from_files_come_back_as_texts():
    hostile = "".join(HOSTILE)
    require_same(four_kinds(robot=hostile, phase=hostile))


def test_without_a_dictionary_the_order_of_arguments_is_enough():
    sequence = four_kinds()
    _, back = round_trip(sequence, None)
    assert not any("name" in arg for step in back["steps"] for arg in step["args"])
    told = from_seqjson.decode(json.dumps(back).encode())
    require_same_commands(told.commands, sequence.commands)


def test_the_comparison_sees_a_lost_argument():
    document = json.loads(export(four_kinds(), "seqjson"))
    changed = json.loads(json.dumps(document))
    changed["steps"][0]["args"].pop(3)
    told = json.loads(run("seqn.mjs", given=json.dumps({"sequence": changed, "dictionary": DICTIONARY})))
    assert told["faults"] == []
    assert told["back"]["steps"] != document["steps"]
