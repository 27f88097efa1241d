"""CSV (RFC 4180), one line a command and leg, units in the column names; WAIT leaves leg and joints empty.

Rows count from 1, as on the page. A POSTURE_MOVE has a line for each leg, all with its row. The column ``force_N``
comes last, where a LEG_LOWER needs it.
Spreadsheets run a text that begins as a formula does: it gets an apostrophe before it, which reading takes away.
"""

import csv
import io
import re

from footfall.sequence.commands import LEG_JOINTS, Command, Sequence, by_leg
from footfall.telemetry.command_kinds import DURATION, FORCE, LEG_ANGLES
from footfall.telemetry.joint_layout import JointLayout

ANGLES = tuple(f"{joint}_{LEG_ANGLES.unit}" for joint in LEG_JOINTS)
COLUMNS = ("sequence", "robot", "row", "name", "leg", "phase", DURATION.column, *ANGLES)
EVERY_COLUMN = (*COLUMNS, FORCE.column)

_FORMULA = re.compile("'*[=+\\-@\t\r\n\uff1d\uff0b\uff0d\uff20]")
"""How a text begins that a spreadsheet takes for a formula, in full width too; also after apostrophes of its own."""


def harmless(text: str) -> str:
    """A text as a cell that no spreadsheet runs."""
    return f"'{text}" if _FORMULA.match(text) else text


def as_written(cell: str) -> str:
    """Inverse of :func:`harmless`."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def encode(sequence: Sequence, first_row: int = 1) -> bytes:
    """UTF-8 CSV with a header line; ``sequence`` is the digest of what was checked."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    layout = sequence.layout
    forces = any(command.force is not None for command in sequence.commands)
    writer.writerow(EVERY_COLUMN if forces else COLUMNS)
    for row, command in enumerate(sequence.commands, first_row):
        last = ["" if command.force is None else repr(command.force)] if forces else []
        for leg, joints in _lines(command, layout):
            about_row = [sequence.digest, harmless(sequence.robot), row, command.name, leg, harmless(command.phase)]
            writer.writerow([*about_row, repr(command.duration), *joints, *last])
    return text.getvalue().encode()


def _lines(command: Command, layout: JointLayout) -> list[tuple[int | str, list[str]]]:
    """A leg and its six joints for each line of a command."""
    lines: list[tuple[int | str, list[str]]] = [
        (leg, [repr(angle) for angle in angles.tolist()]) for leg, angles in by_leg(command, layout)
    ]
    return lines or [("", [""] * len(ANGLES))]
