"""Sequences as files for others: JSON, CSV and SeqJSON. One file here for each format.

Every number is written with its shortest decimal form that reads back to the same bits.
"""

import os
from collections.abc import Callable
from pathlib import Path

from footfall.core.errors import InvalidInput, InvalidSequence, NotFound
from footfall.io.exports import as_csv, as_json, as_seqjson
from footfall.sequence.commands import Sequence

FORMATS: dict[str, Callable[[Sequence], bytes]] = {
    "json": as_json.encode,
    "csv": as_csv.encode,
    "seqjson": as_seqjson.encode,
}
"""format name → encoder"""

SUFFIXES = {"json": ".json", "csv": ".csv", "seqjson": ".seq.json"}
"""format name → usual end of a file name"""


def export(sequence: Sequence, format: str, path: str | os.PathLike[str] | None = None) -> bytes:
    """The sequence in one of FORMATS, also written to ``path`` where one is given.

    Raises InvalidSequence where a rule does not hold (naming row and rule), NotFound for an unknown
    format or a missing folder.
    """
    if format not in FORMATS:
        raise NotFound(f"there is no export format {format!r}; there are {', '.join(FORMATS)}", format=format)
    require_exportable(sequence)
    data = FORMATS[format](sequence)
    if path is not None:
        _write(Path(path), data)
    return data


def require_exportable(sequence: Sequence) -> None:
    """Raises InvalidSequence, naming every failing row and rule, unless all rules hold."""
    failures = sequence.failures
    if failures or not sequence.commands:
        listed = [
            f"{'the sequence' if f.row < 0 else f'row {f.row}'} breaks {f.rule} ({f.text})" for f in failures
        ] or ["it has no commands"]
        raise InvalidSequence(
            "only a sequence that keeps every rule can be exported: " + "; ".join(listed),
            failures=[{"row": f.row, "rule": f.rule, "text": f.text} for f in failures],
        )


def _write(path: Path, data: bytes) -> None:
    if not path.parent.is_dir():
        raise NotFound(f"there is no folder {path.parent} to write {path.name} into", path=str(path))
    if path.is_dir():
        raise InvalidInput(f"{path} is a folder; give the name of a file", path=str(path))
    # A reader never sees half a sequence: the name appears with the whole content.
    partial = path.with_name(f".{path.name}.partial")
    partial.write_bytes(data)
    partial.replace(path)
