"""Files that were exported are read again, the same commands bit for bit; and where the formats are offered."""

import csv
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings

from footfall.api.routes.sequences import ExportFormat
from footfall.cli.program import export as command
from footfall.core.errors import InvalidSequence
from footfall.io.exports import COUNTING, FORMATS, MEDIA, MOST_TOLD, SUFFIXES, export
from footfall.io.imports import from_csv, from_fprime, from_json, from_seqjson, from_yamcs
from footfall.sequence.commands import RuleResult
from tests.support.sequences import HOSTILE, any_commands, bits, four_kinds, require_same_commands, unchecked

READ = {
    "json": from_json.decode,
    "csv": from_csv.decode,
    "seqjson": from_seqjson.decode,
    "fprime": from_fprime.decode,
    "yamcs": from_yamcs.decode,
}
SILENT = ("csv", "yamcs")
"""Formats that don't say from where the commands start."""


@settings(max_examples=30)
@given(commands=any_commands())
@pytest.mark.parametrize("format", READ)
def test_any_numbers_and_names_come_back(format, commands):
    sequence = unchecked(commands, start=np.linspace(-1, 1, 36))
    told = READ[format](export(sequence, format))
    assert told.robot == "athlete"
    require_same_commands(told.commands, commands)
    if format not in SILENT:
        assert told.start is not None
        assert told.T_site_base is not None
        assert bits(told.start) == bits(sequence.start)
        assert bits(told.T_site_base.ravel()) == bits(sequence.T_site_base.ravel())


ROWS: dict[str, Callable[[str], list[int]]] = {
    "json": lambda text: [one["row"] for one in json.loads(text)["commands"]],
    "csv": lambda text: [int(line["row"]) for line in csv.DictReader(io.StringIO(text, newline=""))],
    "seqjson": lambda text: [step["metadata"]["row"] for step in json.loads(text)["steps"]],
    "fprime": lambda text: [json.loads(line.split(" ; ", 1)[1])["row"] for line in text.splitlines() if line[0] == "R"],
    "yamcs": lambda text: [int(s["comment"].split()[1]) for s in json.loads(text)["steps"] if s["type"] == "command"],
}
"""How a file numbers its rows, read without FootFall."""


@settings(max_examples=30)
@given(commands=any_commands())
@pytest.mark.parametrize("format", READ)
def test_every_file_counts_its_rows_from_1_and_is_read_from_0_as_well(format, commands):
    sequence = unchecked(commands, start=np.linspace(-1, 1, 36))
    for first in (1, 0):
        data = export(sequence, format, first_row=first)
        assert sorted({*ROWS[format](data.decode())}) == list(range(first, first + len(commands)))
        require_same_commands(READ[format](data).commands, commands)
    assert export(sequence, format) == export(sequence, format, first_row=1)


def test_the_formats_that_count_are_those_whose_files_change_with_the_number_of_the_first_row():
    sequence = four_kinds()
    for format in FORMATS:
        changes = export(sequence, format) != export(sequence, format, first_row=0)
        assert changes == (format in COUNTING), format


def replaced(format: str, old: str, new: str) -> bytes:
    text = export(four_kinds(), format).decode()
    assert old in text
    return text.replace(old, new, 1).encode()


BAD = {
    "seqjson": {
        ('"COMMAND_COMPLETE"', '"COMMAND_RELATIVE", "tag": "00:00:01"'): r"steps\[0\] has the time",
        ('"stem": "WAIT"', '"stem": "FIRE"'): r"steps\[1\] is a 'FIRE'; FootFall knows LEG_MOVE",
        ('"name": "hip_yaw"', '"name": "hip_pitch"'): r"steps\[0\]: the arguments of LEG_MOVE are leg, hip_yaw",
        ('"type": "number"', '"type": "symbol"'): r"steps\[0\], args\[0\] is a 'symbol', not a number",
        ('"type": "command"', '"type": "activate"'): "FootFall carries out commands only",
        ('"steps": [', '"requests": [{}], "steps": ['): "it has requests, which FootFall can't carry out",
    },
    "csv": {
        ("hip_yaw_rad", "hip_yaw_deg"): "its columns must be sequence, robot, row",
        ("4.25", "soon"): "row 1, duration_s must be a number, not 'soon'",
        ("4.25", "inf"): "row 1, duration_s is too large",
        (",4,LEG_LOWER", ",5,LEG_LOWER"): "row 4 says '5'",
        (",3,POSTURE_MOVE,1", ",3,POSTURE_MOVE,7"): "a POSTURE_MOVE has a line for each leg",
        (",swing,4.25", ""): "fields, the header 14",
        (",1,LEG_MOVE,2,", ",1,LEG_MOVE,,"): "row 1 has joints but no leg",
    },
    "fprime": {
        ("R00:00:00 FootFall.WAIT", "R00:00:07 FootFall.WAIT"): "line 5 waits until R00:00:07",
        ("R00:00:00 FootFall.WAIT", "A2026-001T00:00:00 FootFall.WAIT"): "line 5 waits until A2026",
        ("FootFall.LEG_MOVE 2, ", "FootFall.LEG_MOVE "): "line 4 has 2 arguments; LEG_MOVE takes leg, joints, duration",
        ("FootFall.LEG_MOVE", "Other.LEG_MOVE"): r"line 4 must be a time, FootFall\.<command>",
        ("; footfall-sequence {", "; nothing {"): "it lacks the comment",
        ("4.25", "4.25.1"): "it is no JSON",
    },
    "yamcs": {
        ("/FootFall/WAIT", "/Other/WAIT"): r"steps\[4\] is '/Other/WAIT'; FootFall's commands begin with /FootFall/",
        ("/FootFall/WAIT", "/FootFall/FIRE"): r"steps\[4\] is a 'FIRE'; FootFall knows LEG_MOVE",
        ('"leg"', '"duration"'): r"steps\[3\] gives 'duration' twice",
        (
            '"leg"',
            '"foot"',
        ): r"steps\[3\] has the arguments foot, joints, duration; LEG_MOVE takes leg, ",
        ('"row 2', '"row 3'): r"steps\[4\] says that it is row 3",
        ('"row 2', '"line 2'): r"steps\[4\] must have the comment 'row'",
        ("FootFall sequence", "A sequence"): "it lacks the text",
        ('"type": "check"', '"type": "fire"'): r"steps\[1\] is of type 'fire'; FootFall knows command, text",
        ("4.25", "true"): r"steps\[3\], duration must be a number, not a truth value",
        ("swing", "&#55296;"): r"steps\[3\] has an entity that is no character",
        ('"steps": [', '"advancement": {}, "steps": ['): "is given twice",
    },
}


@pytest.mark.parametrize(("format", "change"), [(format, one) for format, ones in BAD.items() for one in ones])
def test_other_bad_files_are_told(format, change):
    with pytest.raises(InvalidSequence, match=BAD[format][change]):
        READ[format](replaced(format, *change))


def test_every_format_has_a_suffix_and_a_media_type():
    assert list(FORMATS) == list(SUFFIXES) == list(MEDIA)
    assert len(set(SUFFIXES.values())) == len(SUFFIXES)


def test_hostile_names_come_back_as_they_were():
    hostile = "".join(HOSTILE)
    sequence = four_kinds(robot=hostile, phase=hostile)
    for format, decode in READ.items():
        told = decode(export(sequence, format))
        assert told.robot == hostile
        assert {one.phase for one in told.commands} == {hostile}


def test_the_command_line_and_the_api_offer_every_format():
    assert get_args(ExportFormat) == tuple(FORMATS)
    (option,) = get_type_hints(command, include_extras=True)["format"].__metadata__
    assert re.findall(r"[\w-]+", option.help.replace(" or ", " ")) == list(FORMATS)


def test_a_refusal_names_the_first_broken_rules_and_counts_the_rest():
    broken = tuple(RuleResult("speed", row, False, -0.1, "rad/s", f"too fast by {row}") for row in range(543))
    with pytest.raises(InvalidSequence) as refused:
        export(replace(four_kinds(), rules=broken), "json")
    told = refused.value.message
    assert told.startswith(
        "only a sequence that keeps every rule can be exported: row 1 breaks speed (too fast by 0); row 2"
    )
    assert told.endswith(f"; and {543 - MOST_TOLD} more")
    assert told.count("breaks") == MOST_TOLD
    assert len(refused.value.details["failures"]) == 543
