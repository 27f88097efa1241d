"""CSV of the commands of a robot that others described, as ``io.exports.as_joint_csv`` writes it.

It doesn't say what the commands start from, nor which joints are of which leg: that the robot's layout says.
"""

import numpy as np

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_csv import as_written
from footfall.io.exports.as_joint_csv import FIRST, columns
from footfall.io.imports.from_csv import Line, lines_of
from footfall.io.imports.parsed import ParsedSequence, command, decimal
from footfall.sequence.commands import Command
from footfall.telemetry.command_kinds import DURATION, kind_named
from footfall.telemetry.joint_layout import JointLayout


def decode(data: bytes, layout: JointLayout) -> ParsedSequence:
    """Raises InvalidSequence, naming row and column, where the file is no such CSV, or one of another robot."""
    lines = lines_of(data, (tuple(columns(layout)),), f"{', '.join(FIRST)}, and the robot's joints, leg after leg")
    for row, line in enumerate(lines, 1):
        if line["row"] != str(row):
            raise InvalidSequence(f"row {row} says {line['row']!r}: lines are missing or out of order")
    commands = tuple(_command(f"row {row}", line, layout) for row, line in enumerate(lines, 1))
    return ParsedSequence(as_written(lines[0]["robot"]), commands, described=layout)


def _command(where: str, line: Line, layout: JointLayout) -> Command:
    kind, cells = kind_named(line["name"]), list(line.values())[len(FIRST) :]
    filled = [at for at, cell in enumerate(cells) if cell]
    leg = as_written(line["leg"])
    if leg and leg not in layout.legs:
        raise InvalidSequence(f"{where}: there is no leg {leg!r}, only {', '.join(layout.legs)}")
    own = range(len(cells)) if kind.moves_all else range(0)
    arguments: list[object] = []
    if leg:
        number = layout.legs.index(leg)
        own = range(len(cells))[layout.slices[number]]
        arguments.append(number)
    if filled != list(own):
        named = ", ".join(np.array(layout.joint_names)[list(own)]) or "none"
        raise InvalidSequence(f"{where}: the joints of this {line['name']} are {named}, all of them and no others")
    if filled:
        names = layout.joint_names
        arguments.append([decimal(cells[at], f"{where}, {names[at]}") for at in filled])
    arguments.append(decimal(line[DURATION.column], f"{where}, {DURATION.column}"))
    return command(line["name"], arguments, as_written(line["phase"]), where)
