"""CSV (RFC 4180), one line a command, units in the column names; WAIT leaves leg and joints empty."""

import csv
import io

from footfall.sequence.commands import LEG_JOINTS, Sequence

COLUMNS = ("sequence", "robot", "row", "name", "leg", "phase", "duration_s", *(f"{j}_rad" for j in LEG_JOINTS))


def encode(sequence: Sequence) -> bytes:
    """UTF-8 CSV with a header line; ``sequence`` is the digest of what was checked."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for row, command in enumerate(sequence.commands):
        joints = [""] * 6 if command.joints is None else [repr(angle) for angle in command.joints.tolist()]
        leg = "" if command.leg is None else command.leg
        writer.writerow(
            [sequence.digest, sequence.robot, row, command.name, leg, command.phase, repr(command.duration), *joints]
        )
    return text.getvalue().encode()
