"""What an imported file asks for is kept, or refused by name; and texts of CSV files are no formulas."""

import csv
import json
import re
from io import BytesIO, StringIO

import numpy as np
import pytest
from mcap.writer import Writer

from footfall.core.errors import InvalidSequence
from footfall.io.exports import export
from footfall.io.exports.as_ros2 import messages
from footfall.io.imports import from_csv, from_fprime, from_json, from_ros2, from_seqjson, from_yamcs
from footfall.sequence.commands import Command
from tests.support.sequences import four_kinds, require_same_commands, unchecked

READ = {
    "json": from_json.decode,
    "seqjson": from_seqjson.decode,
    "yamcs": from_yamcs.decode,
}


def changed(format: str, change) -> bytes:
    """An exported file with a change of its JSON."""
    document = json.loads(export(four_kinds(), format))
    change(document)
    return json.dumps(document).encode()


def of_step(position: int, **members):
    """A change of one step."""
    return lambda document: document["steps"][position].update(members)


WAITS = {"acknowledgment": "CommandComplete", "wait": 3e4}
GATE = 2  # where the first is
NOT_KEPT = {
    "yamcs": [
        (
            lambda d: d.update(advancement=WAITS),
            "advancement waits 30000 ms",
        ),
        (lambda d: d.update(advancement={"acknowledgment": "Acknowledge_Queued"}), "goes on at 'Acknowledge_Queued'"),
        (lambda d: d.pop("advancement"), "lacks 'advancement'"),
        (lambda d: d.update(commands=[]), "the file has 'commands', which FootFall doesn't know and won't drop"),
        (
            of_step(3, advancement={"acknowledgment": "CommandComplete", "wait": 5}),
            r"steps\[3\], advancement waits 5 ms",
        ),
        (of_step(3, advancement={"acknowledgment": "Acknowledge_Sent", "wait": 0}), r"steps\[3\].*'Acknowledge_Sent'"),
        (of_step(3, extraOptions=[{"id": "x", "value": "y"}]), r"steps\[3\] has 'extraOptions'"),
        (of_step(3, stream="tc_sim"), r"steps\[3\] has 'stream'"),
        (of_step(3, type="wait"), r"steps\[3\] is of type 'wait'"),
        (of_step(2, delay=2000), r"steps\[2\] is another gate.*delay.*2000"),
        (of_step(2, timeout=20_000), r"steps\[2\] is another gate.*20000"),
        (of_step(2, condition=[{"parameter": "/A/b", "operator": "eq", "value": "GO"}]), r"steps\[2\] is another gate"),
        (of_step(1, parameters=[{"parameter": "/A/b"}]), r"steps\[1\] is another check"),
        (
            lambda d: d["steps"].insert(4, dict(d["steps"][2])),
            r"steps\[4\] is a gate before a command that moves nothing",
        ),
        (lambda d: d["steps"].append(d["steps"][GATE]), r"steps\[9\] is a gate with no command behind it"),
        (
            lambda d: d["steps"].insert(2, dict(d["steps"][2])),
            r"steps\[2\] is a gate, and steps\[3\] behind it no command",
        ),
        (
            lambda d: d["steps"].insert(4, {"type": "text", "text": "wait for GO"}),
            "a text that FootFall can't keep.*GO",
        ),
        (lambda d: d["steps"][0].update(text=d["steps"][0]["text"].replace(" rad", " deg")), "says .*in deg"),
        (lambda d: d["steps"][3]["arguments"][0].update(unit="deg"), r"steps\[3\], leg has 'unit'"),
    ],
    "seqjson": [
        (lambda d: d.update(variables=[]), "the file has 'variables'"),
        (lambda d: d["metadata"].update(timeSorted=True), "metadata has 'timeSorted'"),
        (lambda d: d["metadata"]["units"].update(angle="deg"), "units are .*deg"),
        (of_step(0, models=[]), r"steps\[0\] has 'models'"),
        (of_step(0, description="only after GO"), r"steps\[0\] has 'description'"),
        (lambda d: d["steps"][0]["args"][1].update(units="deg"), r"steps\[0\], args\[1\] has 'units'"),
        (lambda d: d["steps"][1]["metadata"].update(row=3), r"steps\[1\] says that it is row 3"),
        (lambda d: d["steps"][1]["metadata"].update(hold=3), r"steps\[1\], metadata has 'hold'"),
    ],
    "json": [
        (lambda d: d.update(unit="deg"), "the file has 'unit'"),
        (lambda d: d["commands"][1].update(delay=3), r"commands\[1\] has 'delay'"),
    ],
}


@pytest.mark.parametrize(
    ("format", "change", "says"), [(format, *one) for format, several in NOT_KEPT.items() for one in several]
)
def test_what_would_be_dropped_is_refused_by_name(format, change, says):
    READ[format](changed(format, lambda document: None))
    with pytest.raises(InvalidSequence, match=says):
        READ[format](changed(format, change))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"row": 2', '"row": 3', "line 5 says that it is row 3"),
        ('"row": 2', '"row": 2, "hold": 3', "line 5, its comment has 'hold'"),
        ('{"version": 1', '{"version": 1, "unit": "deg"', "; footfall-sequence has 'unit'"),
    ],
)
def test_comments_that_tell_something_of_fprime_are_read(old, new, says):
    text = export(four_kinds(), "fprime").decode()
    assert old in text
    with pytest.raises(InvalidSequence, match=says):
        from_fprime.decode(text.replace(old, new, 1).encode())


def test_two_sequences_of_fprime_in_one_file_are_refused():
    """Without numbers of rows all commands were taken to start from what the last header says."""
    text = export(four_kinds(), "fprime").decode()
    plain = re.sub(r" *; \{.*", "", text)
    assert len(from_fprime.decode(plain.encode()).commands) == len(four_kinds().commands)
    with pytest.raises(InvalidSequence, match="is a second comment '; footfall-sequence'"):
        from_fprime.decode((plain + plain).encode())


def test_messages_that_are_not_those_of_the_attachment_are_refused():
    """An MCAP file for ROS 2 with other messages than its sequence asks for."""
    data = export(four_kinds(), "ros2")
    expected = from_ros2.decode(data)
    require_same_commands(expected.commands, four_kinds().commands)
    other = Command("LEG_MOVE", 2, np.zeros(6), 4.25, "swing")
    changed = unchecked((other, *four_kinds().commands[1:]))
    out = BytesIO()
    writer = Writer(out)
    writer.start(profile="ros2", library="test")
    for topic in sorted({one.topic for one in messages(changed.commands, None, len(changed.start))}):
        writer.register_channel(topic, "cdr", 0)
    for one in messages(changed.commands, None, len(changed.start)):
        writer.add_message(writer.register_channel(one.topic, "cdr", 0), one.time, one.data, one.time)
    writer.add_attachment(0, 0, "sequence.json", "application/json", export(four_kinds(), "json"))
    writer.finish()
    with pytest.raises(InvalidSequence, match=r"messages are not the \d+ of its attachment"):
        from_ros2.decode(out.getvalue())


FORMULAS = (
    "=cmd|'/C calc'!A0",
    "+1+1",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    "\uff1d1",
    "'=1",
    "''@a",
    "'plain",
    "'",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_no_text_of_a_csv_is_a_formula_and_all_come_back(text):
    sequence = four_kinds(robot=text, phase=text)
    data = export(sequence, "csv")
    for row in list(csv.reader(StringIO(data.decode(), newline="")))[1:]:
        for cell in (row[1], row[5]):
            assert cell[0] not in "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"
            assert cell in (text, f"'{text}")
    told = from_csv.decode(data)
    assert told.robot == text
    require_same_commands(told.commands, sequence.commands)
