"""ROS 2: an MCAP file of ``trajectory_msgs/JointTrajectory`` in CDR, one topic a leg, one message a command.

===============================  =====================================================================================
topic                            what
===============================  =====================================================================================
/footfall/leg2/joint_trajectory  what LEG_MOVE, or POSTURE_MOVE, asks of the leg: one point, so the controller goes
                                 there in a straight joint-space line, in ``time_from_start``
/footfall/leg2/lower             the same of a LEG_LOWER. On a topic of its own, because a controller that knows
                                 nothing of forces would press the wheel into the ground
/footfall/leg2/lower_force       std_msgs/Float64 beside it: the rise of force that ends the LEG_LOWER [N]
===============================  =====================================================================================

A robot that others described has its own joints by name, and topics of its legs' names: /footfall/leg_LF/….

Positions keep all their bits. Times are whole nanoseconds: a message stands at the sum of the durations before it,
counted from 0, with header.stamp 0 ("now"). The sequence itself goes along as the attachment ``sequence.json``.
Nothing is compressed, and the bytes depend on nothing but the sequence.
"""

import io
import re
from collections.abc import Iterable
from typing import NamedTuple

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer

from footfall.core.errors import InvalidSequence
from footfall.io.exports import as_json
from footfall.io.ros2_messages import DEFINITIONS, FLOAT, LONGEST, NS, TRAJECTORY, number, trajectory
from footfall.robot.description import athlete_layout
from footfall.sequence.commands import LEG_JOINTS, Command, Sequence, by_leg
from footfall.telemetry.joint_layout import JointLayout

ATTACHMENT = "sequence.json"

_TOPIC_TOKEN = re.compile("[A-Za-z0-9]+(_[A-Za-z0-9]+)*")
"""What may stand between two slashes of a topic; https://design.ros2.org/articles/topic_and_service_names.html"""


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """The MCAP file. Raises InvalidSequence where a duration is too long for the format."""
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start(profile="ros2", library="footfall")
    schemas = {
        name: writer.register_schema(name, SchemaEncoding.ROS2, DEFINITIONS[name].encode())
        for name in (TRAJECTORY, FLOAT)
    }
    channels: dict[str, int] = {}
    for one in messages(sequence.commands, sequence.described, len(sequence.start)):
        if one.topic not in channels:
            channels[one.topic] = writer.register_channel(one.topic, MessageEncoding.CDR, schemas[one.name])
        writer.add_message(
            channels[one.topic], log_time=one.time, data=one.data, publish_time=one.time, sequence=one.row
        )
    writer.add_attachment(0, 0, ATTACHMENT, "application/json", as_json.encode(sequence, first_row))
    writer.finish()
    return out.getvalue()


class AskedMessage(NamedTuple):
    """One message: of a command's row, at a time [ns] from the beginning."""

    topic: str
    name: str
    time: int
    row: int
    data: bytes


def messages(commands: Iterable[Command], described: JointLayout | None, joint_count: int) -> list[AskedMessage]:
    """All that the commands ask, in order. described: of a robot that others described; None: ATHLETE's build.

    Raises InvalidSequence where a duration is too long for the format, or a leg's name is none for a topic.
    """
    layout = described or athlete_layout(joint_count // len(LEG_JOINTS))
    legs = layout.legs if described is None else tuple(map(_topic_token, described.legs))
    found: list[AskedMessage] = []
    at = 0.0
    for row, command in enumerate(commands):
        if not command.duration <= LONGEST:
            raise InvalidSequence(f"row {row + 1} takes longer than ROS 2 can say, {LONGEST} s", row=row)
        for topic, name, data in _messages(command, layout, legs):
            found.append(AskedMessage(topic, name, round(at * NS), row, data))
        at += command.duration
    return found


def _messages(command: Command, layout: JointLayout, legs: tuple[str, ...]) -> list[tuple[str, str, bytes]]:
    """Topic, message name and CDR of what one command asks of each leg."""
    what = "lower" if command.kind.ends_by_force else "joint_trajectory"
    found = [
        (_topic(legs[leg], what), TRAJECTORY, trajectory(command.duration, layout.joints[leg], own))
        for leg, own in by_leg(command, layout)
    ]
    if command.force is not None and command.leg is not None:
        found.append((_topic(legs[command.leg], "lower_force"), FLOAT, number(command.force)))
    return found


def _topic(leg: str, what: str) -> str:
    return f"/footfall/{leg}/{what}"


def _topic_token(leg: str) -> str:
    token = f"leg_{leg}"
    if not _TOPIC_TOKEN.fullmatch(token):
        raise InvalidSequence(
            f"a topic of ROS 2 can't be called {token!r}: name the leg with letters and digits in the robot.toml"
        )
    return token
