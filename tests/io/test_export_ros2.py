"""ROS 2: the MCAP file reads back with mcap-ros2-support, from the definitions that it carries, bit for bit."""

import io
import json
import re

import numpy as np
import pytest
from hypothesis import given, settings
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from footfall.core.errors import InvalidSequence
from footfall.io.exports import export
from footfall.robot.description import JOINTS, joint_name
from footfall.sequence.commands import Command, Sequence
from tests.support.node import run
from tests.support.sequences import (
    HOSTILE,
    LEGS,
    any_commands,
    bits,
    four_kinds,
    recorded,
    unchecked,
)

NS = 1_000_000_000


def messages(data: bytes) -> dict[int, list[tuple]]:
    """Row → (topic, schema name, log time, message), read by the library for ROS 2."""
    found: dict[int, list[tuple]] = {}
    reader = make_reader(io.BytesIO(data), validate_crcs=True, decoder_factories=[DecoderFactory()])
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        assert schema is not None
        assert channel.message_encoding == "cdr"
        found.setdefault(message.sequence, []).append((channel.topic, schema.name, message.log_time, decoded))
    return found


def require_reads_back(sequence: Sequence) -> None:
    rows = messages(export(sequence, "ros2"))
    assert set(rows) == {row for row, one in enumerate(sequence.commands) if one.name != "WAIT"}
    at = 0.0
    for row, command in enumerate(sequence.commands):
        if command.joints is not None:
            legs = [command.leg] if command.leg is not None else list(range(LEGS))
            last = "lower" if command.name == "LEG_LOWER" else "joint_trajectory"
            told = {topic: (name, time, message) for topic, name, time, message in rows[row]}
            expected = {f"/footfall/leg{leg}/{last}" for leg in legs}
            if command.force is not None:
                topic = f"/footfall/leg{command.leg}/lower_force"
                assert bits([told[topic][2].data]) == bits([command.force])
                expected.add(topic)
            assert set(told) == expected
            for number, leg in enumerate(legs):
                name, time, message = told[f"/footfall/leg{leg}/{last}"]
                assert name == "trajectory_msgs/msg/JointTrajectory"
                assert time == round(at * NS)
                require_trajectory(message, leg, command.joints[6 * number : 6 * number + 6], command.duration)
        at += command.duration


def require_trajectory(message, leg: int, joints, duration: float) -> None:
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (0, 0, "")
    assert message.joint_names == [joint_name(leg, part) for part, _ in JOINTS]
    assert len(message.points) == 1
    point = message.points[0]
    assert bits(point.positions) == bits(joints)
    assert list(point.velocities) == list(point.accelerations) == list(point.effort) == []
    took = point.time_from_start.sec * NS + point.time_from_start.nanosec
    assert took == pytest.approx(duration * NS, abs=0.5 + 1e-16 * duration * NS)
    assert 0 <= point.time_from_start.nanosec < NS


@pytest.mark.parametrize("name", ["rock-step", "edited-export"])
def test_a_recorded_step_reads_back(name):
    require_reads_back(recorded(name))


@settings(max_examples=25)
@given(commands=any_commands())
def test_any_numbers_read_back(commands):
    require_reads_back(unchecked(commands))


@pytest.mark.parametrize("leg", [9, 10, 101])
def test_legs_of_any_number_read_back(leg):
    joints = np.linspace(-1.0, 1.0, 6)
    start = np.zeros(6 * (leg + 1))
    require_reads_back(unchecked((Command("LEG_MOVE", leg, joints, 1.5),), start=start))


def test_the_definitions_are_complete():
    """Every type that a definition names is a primitive or defined in the same text: Foxglove asks for no package."""
    reader = make_reader(io.BytesIO(export(four_kinds(), "ros2")))
    summary = reader.get_summary()
    assert summary is not None
    schemas = summary.schemas.values()
    assert {one.encoding for one in schemas} == {"ros2msg"}
    for schema in schemas:
        first, *others = re.split(r"^=+\n", schema.data.decode(), flags=re.MULTILINE)
        defined = {part.splitlines()[0].removeprefix("MSG: ") for part in others}
        fields = [line.split()[0] for part in (first, *others) for line in part.splitlines() if "MSG:" not in line]
        named = {kind.removesuffix("[]") for kind in fields}
        assert named - defined <= {"int32", "uint32", "string", "float64"}
        assert defined <= named


def test_foxgloves_own_libraries_read_the_same(tmp_path):
    sequence = four_kinds()
    path = tmp_path / "step.mcap"
    data = export(sequence, "ros2", path)
    theirs = json.loads(run("foxglove.mjs", str(path)))
    ours = [(row, *one) for row, several in messages(data).items() for one in several]
    assert len(theirs) == len(ours) == 9
    for found, (row, topic, schema, time, message) in zip(theirs, ours, strict=True):
        assert (found["row"], found["topic"], found["schema"], found["time"]) == (row, topic, schema, str(time))
        if schema == "std_msgs/msg/Float64":
            assert found["message"] == {"data": bits([message.data])[0].hex()}
            continue
        point = message.points[0]
        took = {"sec": point.time_from_start.sec, "nanosec": point.time_from_start.nanosec}
        assert found["message"] == {
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
            "joint_names": message.joint_names,
            "points": [
                {
                    "positions": [one.hex() for one in bits(point.positions)],
                    "velocities": [],
                    "accelerations": [],
                    "effort": [],
                    "time_from_start": took,
                }
            ],
        }


def test_a_lowering_is_not_on_the_topic_of_a_controller():
    topics = {one[0] for one in messages(export(four_kinds(), "ros2"))[3]}
    assert topics == {"/footfall/leg2/lower", "/footfall/leg2/lower_force"}


def test_the_whole_sequence_goes_along():
    hostile = "".join(HOSTILE)
    sequence = four_kinds(robot=hostile, phase=hostile)
    reader = make_reader(io.BytesIO(export(sequence, "ros2")))
    attachment = next(iter(reader.iter_attachments()))
    assert (attachment.name, attachment.media_type) == ("sequence.json", "application/json")
    assert attachment.data == export(sequence, "json")
    assert json.loads(attachment.data)["robot"] == hostile
    require_reads_back(sequence)


def test_the_bytes_depend_on_nothing_else():
    assert export(four_kinds(), "ros2") == export(four_kinds(), "ros2")


def test_what_the_format_cannot_hold_is_refused():
    long = unchecked((Command("WAIT", None, None, 1.0), Command("WAIT", None, None, 3e9)))
    with pytest.raises(InvalidSequence, match=r"row 2 takes longer than ROS 2 can say, 2147483647 s"):
        export(long, "ros2")
    with pytest.raises(InvalidSequence, match="no commands"):
        export(unchecked(()), "ros2")
