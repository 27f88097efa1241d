"""The link of a robot that others described: its joints by name in hello, and as many numbers as it has."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidTelemetry
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link import CommandMessage, HelloMessage, decode, encode
from footfall.telemetry.state import RobotState, TelemetryFrame

LAYOUT = JointLayout(("LF", "RF", "H"), (("LF_a", "LF_b", "LF_c"), ("RF_a", "RF_b", "RF_c"), ("H_a", "H_s")), ("H_s",))
JOINTS = len(LAYOUT.joint_names)


def frame_of(layout: JointLayout, number: float) -> TelemetryFrame:
    count, legs = len(layout.joint_names), len(layout.legs)
    posture = number * np.arange(1, count + 1) / 7
    forces = np.arange(3.0 * legs).reshape(legs, 3) / 3
    state = RobotState("hexa", 12.25, posture, np.eye(4), forces, -posture, "moving", described=layout)
    return TelemetryFrame(3, state, posture + 0.1)


def moved(layout: JointLayout, name: str, leg: int | None, joints: list[float] | None) -> CommandMessage:
    return CommandMessage("a", "b", 0, name, leg, None if joints is None else np.array(joints), 1.0)


def test_a_hello_names_legs_and_joints():
    hello = HelloMessage("hexa", 3, described=LAYOUT)
    again = decode(encode(hello))
    assert isinstance(again, HelloMessage)
    assert again.digest == hello.digest
    assert again.described is not None
    assert again.described.digest == LAYOUT.digest


def test_the_hello_of_athlete_has_the_fields_that_it_had():
    assert set(json.loads(encode(HelloMessage("athlete", 6)))) == {
        *("type", "protocol", "robot", "legs", "software", "id", "epoch")
    }


@given(st.floats(-1e3, 1e3))
def test_telemetry_keeps_its_bits(number: float):
    frame = frame_of(LAYOUT, number)
    again = decode(encode(frame), legs=3, described=LAYOUT)
    assert isinstance(again, TelemetryFrame)
    assert again.digest == frame.digest
    assert again.state.leg_count == 3
    np.testing.assert_array_equal(again.state.leg(2), frame.state.posture[6:8])


@pytest.mark.parametrize(
    ("name", "leg", "count"),
    [("LEG_MOVE", 0, 3), ("LEG_MOVE", 2, 2), ("POSTURE_MOVE", None, JOINTS), ("WAIT", None, 0)],
)
def test_a_command_has_as_many_joints_as_it_moves(name: str, leg: int | None, count: int):
    message = moved(LAYOUT, name, leg, [0.5] * count if count else None)
    again = decode(encode(message), described=LAYOUT)
    assert isinstance(again, CommandMessage)
    assert again.digest == message.digest
    with pytest.raises(InvalidTelemetry, match=f"joints needs {count} numbers, not {count + 1}"):
        decode(encode(moved(LAYOUT, name, leg, [0.5] * (count + 1))), described=LAYOUT)


def test_a_frame_of_another_number_of_joints_is_refused():
    text = encode(frame_of(LAYOUT, 1.0))
    fewer = JointLayout(LAYOUT.legs[:2], LAYOUT.joints[:2])
    with pytest.raises(InvalidTelemetry, match="posture needs 6 numbers, not 8"):
        decode(text, described=fewer)
    with pytest.raises(InvalidTelemetry, match="six numbers for each leg"):
        decode(text)


def test_a_hello_that_contradicts_itself_is_refused():
    body = json.loads(encode(HelloMessage("hexa", 3, described=LAYOUT)))
    with pytest.raises(InvalidTelemetry, match="legs is 4, and joints names 3"):
        decode(json.dumps({**body, "legs": 4}))
    joints = body["joints"]
    twice = {**joints, "of_leg": {**joints["of_leg"], "RF": joints["of_leg"]["LF"]}}
    with pytest.raises(InvalidTelemetry, match="no two joints have one name"):
        decode(json.dumps({**body, "joints": twice}))
    lacking = {**joints, "of_leg": {"LF": joints["of_leg"]["LF"]}}
    with pytest.raises(InvalidTelemetry, match="RF is missing"):
        decode(json.dumps({**body, "joints": lacking}))


def test_a_state_has_one_number_for_each_joint():
    with pytest.raises(InvalidTelemetry, match="posture needs 8 finite numbers"):
        RobotState("x", 0.0, np.zeros(9), np.eye(4), np.zeros((3, 3)), np.zeros(9), "idle", described=LAYOUT)
    with pytest.raises(InvalidTelemetry, match="wheel_forces needs 3 × 3"):
        RobotState("x", 0.0, np.zeros(8), np.eye(4), np.zeros((2, 3)), np.zeros(8), "idle", described=LAYOUT)
