"""CSV of our commands, as ``io.exports.as_csv`` writes it. It doesn't say what the commands start from."""

import csv
import io
from collections.abc import Collection
from itertools import groupby

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_csv import ANGLES, COLUMNS, EVERY_COLUMN, as_written
from footfall.io.imports.parsed import ParsedSequence, command, decimal, text_of
from footfall.sequence.commands import Command
from footfall.telemetry.command_kinds import DURATION, FORCE, kind_named

Line = dict[str, str]


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence, naming row and column, where the file is not such a CSV."""
    lines = lines_of(data, (COLUMNS, EVERY_COLUMN), f"{', '.join(COLUMNS)} and, where needed, {FORCE.column}")
    groups = [list(group) for _, group in groupby(lines, key=lambda line: line["row"])]
    first = 0 if groups[0][0]["row"] == "0" else 1  # older files count from 0
    for row, group in enumerate(groups, first):
        if group[0]["row"] != str(row):
            raise InvalidSequence(f"row {row} says {group[0]['row']!r}: lines are missing or out of order")
    commands = (_command(f"row {row}", group) for row, group in enumerate(groups, first))
    return ParsedSequence(as_written(lines[0]["robot"]), tuple(commands))


def lines_of(data: bytes, headers: Collection[tuple[str, ...]], allowed: str) -> list[Line]:
    """The lines under one of some headers, by column.

    allowed: how the headers are called. Raises InvalidSequence where it is another, lines are shorter or longer, or
    they are not of one sequence and one robot.
    """
    reader = csv.reader(io.StringIO(text_of(data), newline=""), strict=True)
    try:
        header, *rows = [row for row in reader if row]
    except (csv.Error, ValueError) as error:
        where = f", at line {reader.line_num}" if reader.line_num else ": it is empty"
        raise InvalidSequence(f"it is no CSV with a header{where}") from error
    if tuple(header) not in headers:
        raise InvalidSequence(
            f"its columns must be {allowed}, separated by commas; it begins with {', '.join(header)[:80]!r}",
            columns=header,
        )
    for number, row in enumerate(rows):
        if len(row) != len(header):
            raise InvalidSequence(f"line {number + 2} has {len(row)} fields, the header {len(header)}")
    lines = [dict(zip(header, row, strict=True)) for row in rows]
    if len({(line["sequence"], line["robot"]) for line in lines}) != 1:
        raise InvalidSequence("its lines must all be of one sequence and one robot, and be at least one")
    return lines


def _command(where: str, lines: list[Line]) -> Command:
    """One command from its lines; a POSTURE_MOVE has one for each leg."""
    first = lines[0]
    name, force = first["name"], first.get(FORCE.column, "")
    arguments: list[object] = []
    joints = [decimal(line[column], f"{where}, {column}") for line in lines for column in ANGLES if line["leg"]]
    if kind_named(name).moves_all:
        if [line["leg"] for line in lines] != [str(leg) for leg in range(len(lines))]:
            raise InvalidSequence(f"{where}: a {name} has a line for each leg, 0, 1, 2 …")
    elif len(lines) > 1:
        raise InvalidSequence(f"{where}: a {name} has one line, not {len(lines)}")
    elif first["leg"]:
        arguments.append(decimal(first["leg"], f"{where}, leg"))
    if any(
        line[key] != first[key]
        for line in lines
        for key in ("name", "phase", DURATION.column, FORCE.column)
        if key in first
    ):
        raise InvalidSequence(f"{where}: its lines differ in name, phase, duration or force")
    if joints:
        arguments.append(joints)
    elif any(first[column] for column in ANGLES):
        raise InvalidSequence(f"{where} has joints but no leg")
    arguments.append(decimal(first[DURATION.column], f"{where}, {DURATION.column}"))
    if force:
        arguments.append(decimal(force, f"{where}, {FORCE.column}"))
    return command(name, arguments, as_written(first["phase"]), where)
