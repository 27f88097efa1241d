"""Sequences as files for others, one file here for each format; docs/exports.md says what each can't say.

Every number keeps its bits: as the shortest decimal form that reads back to them, or as a float64. Only the sheet
for print, and the nanoseconds of ROS 2, are rounded.
"""

import os
from collections.abc import Callable

from footfall.core.errors import InvalidSequence, NotFound
from footfall.io.exports import as_csv, as_fprime, as_html, as_joint_csv, as_json, as_ros2, as_seqjson, as_yamcs
from footfall.io.whole_files import require_writable, write_whole
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence

FORMATS: dict[str, Callable[..., bytes]] = {
    "json": as_json.encode,
    "csv": as_csv.encode,
    "seqjson": as_seqjson.encode,
    "fprime": as_fprime.encode,
    "fprime-dictionary": as_fprime.dictionary,
    "yamcs": as_yamcs.encode,
    "ros2": as_ros2.encode,
    "html": as_html.encode,
}
"""format name → encoder, which takes the sequence"""

NOT_DESCRIBED = {"yamcs": "a stack names no joints", "html": "its pictures are of ATHLETE's legs"}
"""format name → why it can't carry the commands of a robot that others described"""

COUNTING = ("json", "csv", "seqjson", "fprime", "yamcs", "ros2")
"""Formats whose files number the rows, so that their encoders take the number of the first, ``first_row``, too."""

MOST_TOLD = 8
"""Broken rules that a refusal names; a walk on a tether breaks one in each of hundreds of rows."""

SUFFIXES = {
    "json": ".json",
    "csv": ".csv",
    "seqjson": ".seq.json",
    "fprime": ".seq",
    "fprime-dictionary": ".dictionary.json",
    "yamcs": ".ycs",
    "ros2": ".mcap",
    "html": ".html",
}
"""format name → usual end of a file name"""

MEDIA = {
    "json": "application/json",
    "csv": "text/csv",
    "seqjson": "application/json",
    "fprime": "text/plain; charset=us-ascii",
    "fprime-dictionary": "application/json",
    "yamcs": "application/json",
    "ros2": "application/octet-stream",
    "html": "text/html; charset=utf-8",
}
"""format name → media type"""


TITLES = {
    "json": "JSON",
    "csv": "CSV",
    "seqjson": "SeqJSON",
    "html": "Sheet for print",
    "fprime": "F Prime sequence",
    "fprime-dictionary": "F Prime dictionary",
    "yamcs": "Yamcs stack",
    "ros2": "ROS 2 (MCAP)",
}
"""format name → its name for a person, in the order that they are offered"""


def formats_for(sequence: Sequence) -> dict[str, str]:
    """Format name → why it can't carry these commands, "" where it can; in the order that they are offered."""
    return {one: "" if sequence.described is None else NOT_DESCRIBED.get(one, "") for one in TITLES}


def export(
    sequence: Sequence,
    format: str,
    path: str | os.PathLike[str] | None = None,
    robot: Robot | None = None,
    first_row: int = 1,
) -> bytes:
    """Write a sequence in one of FORMATS.

    Args:
        sequence: the commands; every rule must hold.
        format: one of FORMATS.
        path: the file to write as well; None: nothing is written.
        robot: what the pictures of "html" show; None: the one of that name that ships with FootFall.
        first_row: number of the first row; files of 2026-11-25 and before count from 0.

    Returns:
        The content of the file.

    Raises:
        NotFound: there is no such format, or no folder to write to.
        InvalidInput: the path is no file's: a folder, a device, a pipe.
        InvalidSequence: a rule does not hold, named with its row, or the format can't carry these commands.
    """
    if format not in FORMATS:
        raise NotFound(f"there is no export format {format!r}; there are {', '.join(FORMATS)}", format=format)
    if path is not None:
        require_writable(path)
    require_exportable(sequence)
    formats = formats_for(sequence)
    if formats[format]:
        others = ", ".join(TITLES[one] for one, lack in formats.items() if not lack)
        raise InvalidSequence(
            f"{TITLES[format]} can't carry commands of {sequence.robot}: {formats[format]}; export them as {others}"
        )
    if sequence.described is not None and format == "csv":
        data = as_joint_csv.encode(sequence, first_row)
    elif format == "html":
        data = as_html.encode(sequence, robot)
    elif format in COUNTING:
        data = FORMATS[format](sequence, first_row)
    else:
        data = FORMATS[format](sequence)
    if path is not None:
        write_whole(path, data)
    return data


def require_exportable(sequence: Sequence) -> None:
    """Raises InvalidSequence, naming the first failing rows with their rules and counting the rest, unless all rules
    hold; ``failures`` of the error has all.
    """
    failures = sequence.failures
    if failures or not sequence.commands:
        listed = [
            f"{'the sequence' if f.row < 0 else f'row {f.row + 1}'} breaks {f.rule} ({f.text})"
            for f in failures[:MOST_TOLD]
        ] or ["it has no commands"]
        if len(failures) > MOST_TOLD:
            listed.append(f"and {len(failures) - MOST_TOLD} more")
        raise InvalidSequence(
            "only a sequence that keeps every rule can be exported: " + "; ".join(listed),
            failures=[{"row": f.row, "rule": f.rule, "text": f.text} for f in failures],
        )
