"""CSV (RFC 4180) of a robot that others described: one line a command, a column for each of its joints by name.

Columns of joints that a command leaves as they are stay empty. Units are in the column names, the leg stands by its
name, and texts are as harmless to spreadsheets as in ``as_csv``.
"""

import csv
import io

from footfall.io.exports.as_csv import harmless
from footfall.sequence.commands import Sequence, by_leg
from footfall.telemetry.command_kinds import DURATION
from footfall.telemetry.joint_layout import JointLayout

FIRST = ("sequence", "robot", "row", "name", "leg", "phase", DURATION.column)


def columns(layout: JointLayout) -> list[str]:
    """The header: what every command has, then all joints, leg after leg, in rad or m."""
    joints = [f"{name}_{'m' if name in layout.sliding else 'rad'}" for name in layout.joint_names]
    return [*FIRST, *map(harmless, joints)]


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """UTF-8 CSV with a header line; ``sequence`` is the digest of what was checked."""
    layout, text = sequence.layout, io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns(layout))
    for row, command in enumerate(sequence.commands, first_row):
        joints = [""] * len(layout.joint_names)
        for leg, places in by_leg(command, layout):
            joints[layout.slices[leg]] = map(repr, places.tolist())
        leg_name = "" if command.leg is None else harmless(layout.legs[command.leg])
        about_row = [sequence.digest, harmless(sequence.robot), row, command.name, leg_name, harmless(command.phase)]
        writer.writerow([*about_row, repr(command.duration), *joints])
    return text.getvalue().encode()
