"""Rover-link messages: encoding and decoding are inverse, and decoding is strict."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidTelemetry
from footfall.core.frames import rotation_rpy, transform
from footfall.telemetry.link import (
    ACK_STATES,
    AckMessage,
    ClearStopMessage,
    CommandMessage,
    EpochMessage,
    ErrorMessage,
    HelloMessage,
    ImageRequestMessage,
    QueryMessage,
    StopAckMessage,
    StopMessage,
    decode,
    encode,
    message_object,
)
from footfall.telemetry.state import MODES, RobotState, TelemetryFrame

numbers = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(min_size=1, max_size=64)
epochs = st.integers(0, 2**53 - 1)
six = st.lists(numbers, min_size=6, max_size=6).map(np.array)


@st.composite
def telemetry(draw) -> TelemetryFrame:
    legs = draw(st.integers(1, 8))
    angles = st.lists(numbers, min_size=6 * legs, max_size=6 * legs).map(np.array)
    rpy = [draw(st.floats(-3, 3)) for _ in range(3)]
    state = RobotState(
        robot=draw(names),
        time=draw(numbers),
        posture=draw(angles),
        T_site_base=transform(rotation_rpy(*rpy), [draw(st.floats(-1e6, 1e6)) for _ in range(3)]),
        wheel_forces=draw(st.lists(numbers, min_size=3 * legs, max_size=3 * legs).map(np.array)).reshape(legs, 3),
        joint_torques=draw(angles),
        mode=draw(st.sampled_from(MODES)),
    )
    return TelemetryFrame(draw(st.integers(0, 2**53 - 1)), state, draw(angles))


messages = st.one_of(
    telemetry(),
    st.builds(HelloMessage, names, st.integers(1, 20), software=names, id=names, epoch=st.none() | epochs),
    st.builds(EpochMessage, names, epochs),
    st.builds(
        CommandMessage,
        names,
        names,
        st.integers(0, 999),
        names,
        st.none() | st.integers(0, 9),
        st.none() | six,
        numbers,
        epoch=epochs,
    ),
    st.builds(AckMessage, names, st.sampled_from(ACK_STATES), st.text(max_size=200), numbers),
    st.builds(StopMessage, names, epochs),
    st.builds(QueryMessage, names),
    st.builds(StopAckMessage, names, numbers),
    st.builds(ClearStopMessage, names, epochs),
    st.builds(ImageRequestMessage, names, st.none() | st.lists(names, min_size=1, max_size=9).map(tuple)),
    st.builds(ErrorMessage, st.text(max_size=64), st.text(max_size=200)),
)


@given(message=messages)
def test_decoding_undoes_encoding(message):
    again = decode(encode(message))
    assert type(again) is type(message)
    # digests compare every number bit for bit
    assert again.digest == message.digest


def frame(standing) -> dict:
    return message_object(TelemetryFrame(3, standing, standing.posture))


def changed(body: dict, **changes) -> str:
    return json.dumps(body | changes)


def test_broken_telemetry_is_named(standing):
    good = frame(standing)
    assert decode(json.dumps(good), legs=6).digest == TelemetryFrame(3, standing, standing.posture).digest
    posture = list(good["posture"])
    tilted = np.array(good["T_site_base"])
    tilted[0, 0] = 1.1
    cases = [
        ("[]", "one JSON object"),
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"type": "stop", "id": "a", "id": "b"}', "twice"),
        (changed(good, type="telemetri"), "type must be one of"),
        (json.dumps({name: one for name, one in good.items() if name != "type"}), "type is missing"),
        (json.dumps({name: one for name, one in good.items() if name != "mode"}), "mode is missing"),
        (changed(good, extra=1), "unknown fields extra"),
        (changed(good, posture=posture[:30]), "posture needs 36 numbers, not 30"),
        (changed(good, posture=[*posture[:35], float("nan")]), "NaN"),
        (changed(good, posture=[*posture[:35], True]), "posture must be a number, not True"),
        (changed(good, posture=[*posture[:35], "0"]), "posture must be a number"),
        (changed(good, posture=[*posture[:35], None]), "posture must be a number"),
        (json.dumps(good).replace('"time": 1000.0', '"time": 1e999'), "time must be a finite number"),
        (json.dumps(good).replace('"time": 1000.0', '"time": 1' + "0" * 400), "time must be a finite number"),
        (changed(good, wheel_forces=good["wheel_forces"][:5]), "wheel_forces needs 6 rows, not 5"),
        (changed(good, commanded=posture[:30]), "commanded needs 36"),
        (changed(good, T_site_base=tilted.tolist()), "T_site_base is no rigid transform"),
        (changed(good, mode="walking"), "mode must be one of idle"),
        (changed(good, number=-1), "number must be a whole number"),
        (changed(good, number=1.0), "number must be a whole number"),
        (changed(good, robot=""), "robot must be a text"),
    ]
    for text, says in cases:
        with pytest.raises(InvalidTelemetry, match=says):
            decode(text, legs=6)
    with pytest.raises(InvalidTelemetry, match="at most"):
        decode(" " * (1 << 20) + "{}")
    with pytest.raises(InvalidTelemetry, match="six numbers for each leg"):
        decode(changed(good, posture=posture[:35]))


def test_another_version_or_another_rover_is_refused():
    hello = {"type": "hello", "protocol": 2, "robot": "athlete", "legs": 6, "software": "1", "id": "h", "epoch": None}
    assert isinstance(decode(json.dumps(hello), legs=6), HelloMessage)
    older = {name: one for name, one in hello.items() if name not in ("id", "epoch")}
    with pytest.raises(InvalidTelemetry, match="protocol 1, this end speaks 2"):
        decode(changed(older, protocol=1))
    with pytest.raises(InvalidTelemetry, match="8 legs, 6 are expected"):
        decode(changed(hello, legs=8), legs=6)


def test_broken_commands_are_named():
    good = message_object(CommandMessage("a", "b", 0, "LEG_MOVE", 1, np.zeros(6), 1.0))
    cases = [
        (changed(good, joints=[0.0] * 5), "joints needs 6 numbers, not 5"),
        (changed(good, leg=True), "leg must be a whole number"),
        (changed(good, leg=-1), "leg must be a whole number"),
        (changed(good, duration=False), "duration must be a number"),
        (changed(good, id=""), "id must be a text"),
        (changed(good, id="x" * 65), "id must be a text"),
        (json.dumps({name: one for name, one in good.items() if name != "joints"}), "joints is missing"),
        (json.dumps({name: one for name, one in good.items() if name != "epoch"}), "epoch is missing"),
        (changed(good, epoch=-1), "epoch must be a whole number"),
        (changed(good, epoch=None), "epoch must be a whole number"),
    ]
    for text, says in cases:
        with pytest.raises(InvalidTelemetry, match=says):
            decode(text)
    with pytest.raises(InvalidTelemetry, match="one of received"):
        AckMessage("a", "lost", "", 0.0)
