"""Commands on the link: every kind comes back bit for bit, and a wrong shape is refused by its name."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidTelemetry
from footfall.telemetry.link import CommandMessage, decode, encode, message_object
from tests.support.sequences import any_commands, bits


@given(commands=any_commands(most=4))
def test_every_command_comes_back_bit_for_bit(commands):
    for row, command in enumerate(commands):
        message = CommandMessage(
            f"c{row}", "s", row, command.name, command.leg, command.joints, command.duration, command.force
        )
        again = decode(encode(message), legs=6)
        assert isinstance(again, CommandMessage)
        assert again.digest == message.digest
        assert bits([again.duration]) == bits([command.duration])
        if command.joints is not None:
            assert again.joints is not None
            assert bits(again.joints) == bits(command.joints)


def message(**changes) -> str:
    good = message_object(CommandMessage("a", "b", 0, "POSTURE_MOVE", None, np.zeros(36), 1.0))
    return json.dumps({**good, **changes})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (message(joints=[0.0] * 35), "joints needs 36 numbers, not 35"),
        (message(joints=[0.0] * 6), "joints needs 36 numbers, not 6"),
        (message(joints=[[0.0] * 6] * 6), "joints needs 36 numbers, not 6"),
        (message(joints=[True] * 36), "joints must be a number"),
        (message(name="LEG_MOVE"), "joints needs 6 numbers, not 36"),
        (message(name="LEG_LOWER", leg=1, force=1.0), "joints needs 6 numbers, not 36"),
        (message(name="WAIT"), "joints needs 6 numbers, not 36"),
        (message(force="300"), "force must be a number"),
        (message(force=True), "force must be a number"),
        (message(force=[1.0]), "force must be a number"),
        (message(force=1.0).replace("1.0", "1e999"), "force must be a finite number|duration must be a finite"),
        (message(newtons=1.0), "unknown fields newtons"),
    ],
)
def test_wrong_shapes_are_named(text, says):
    with pytest.raises(InvalidTelemetry, match=says):
        decode(text, legs=6)


def test_a_command_without_a_force_field_is_of_another_protocol():
    told = json.loads(message())
    del told["force"]
    with pytest.raises(InvalidTelemetry, match="force is missing"):
        decode(json.dumps(told))


@given(legs=st.integers(1, 8))
def test_all_legs_are_as_many_as_the_rover_has(legs):
    text = message(joints=[0.0] * (6 * legs))
    assert isinstance(decode(text, legs=legs), CommandMessage)
    assert isinstance(decode(text), CommandMessage)
    with pytest.raises(InvalidTelemetry, match=f"joints needs {6 * legs + 6} numbers"):
        decode(text, legs=legs + 1)
    with pytest.raises(InvalidTelemetry, match="six numbers for each leg"):
        decode(message(joints=[0.0] * (6 * legs + 1)))
