"""MCAP files for ROS 2, as ``io.exports.as_ros2`` writes them: the sequence goes along, as its messages say less."""

import io
import struct

from mcap.exceptions import McapError
from mcap.reader import make_reader

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_ros2 import ATTACHMENT, messages
from footfall.io.imports import from_json
from footfall.io.imports.parsed import ParsedSequence


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence where the file is not such an MCAP file, or its messages are not those of the sequence."""
    try:
        reader = make_reader(io.BytesIO(data), validate_crcs=True)
        attachments = {one.name: one.data for one in reader.iter_attachments()}
        others = sorted({*attachments} - {ATTACHMENT}) + [one.name for one in reader.iter_metadata()]
        there = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    except (McapError, EOFError, ValueError, struct.error) as error:
        raise InvalidSequence("it is no whole MCAP file: it is damaged or cut") from error
    if ATTACHMENT not in attachments:
        raise InvalidSequence(f"it has no attachment {ATTACHMENT}; FootFall writes one with the messages for ROS 2")
    if others:
        raise InvalidSequence(f"it has {', '.join(others)}, which FootFall doesn't know and won't drop")
    parsed = from_json.decode(attachments[ATTACHMENT])
    count = 0 if parsed.start is None else len(parsed.start)
    expected = [(one.topic, one.time, one.data) for one in messages(parsed.commands, parsed.described, count)]
    if sorted(there) != sorted(expected):
        raise InvalidSequence(
            f"its {len(there)} messages are not the {len(expected)} of its attachment {ATTACHMENT}: one of the two was "
            "changed; give the attachment alone, as JSON, or write the file anew"
        )
    return parsed
