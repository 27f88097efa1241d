"""Lines of an event log: one JSON object each, chained by hash.

A line is ``{"seq", "time", "type", "payload", "previous", "hash"}``; ``hash`` covers the other fields in
canonical form and ``previous`` is the hash of the line before. A changed, lost or swapped line shows; a
cut tail shows against a head kept apart from them.
"""

import hashlib
import json
import sys
from collections.abc import Iterable

from footfall.core.errors import InvalidBundle, InvalidInput
from footfall.core.json_object import JsonObject
from footfall.core.surrogates import all_spelled_out, lone_surrogate_in

Record = JsonObject
START = "0" * 32
"""``previous`` of the first line."""

MAX_LINE = 16 << 20
"""Longest line that is read [bytes]."""

_FIELDS = {"seq", "time", "type", "payload", "previous", "hash"}


def make_record(seq: int, time: float, type: str, payload: JsonObject, previous: str) -> Record:
    """One record with its hash. Raises InvalidInput where the payload is not plain JSON."""
    try:
        payload = as_read(payload)
    except (TypeError, ValueError) as err:
        raise InvalidInput(f"the payload of an event must be plain JSON: {err}", type=type) from err
    body = {"seq": seq, "time": time, "type": type, "payload": payload, "previous": previous}
    return {**body, "hash": _hash(body)}


def as_read(payload: JsonObject) -> JsonObject:
    """What a reader will see is what is used from now on: lists for tuples, text keys, text that UTF-8 can hold.

    Raises TypeError, ValueError.
    """
    read = json.loads(json.dumps(payload, allow_nan=False))
    return read if lone_surrogate_in(read) is None else all_spelled_out(read)


def _hash(body: Record) -> str:
    text = json.dumps(body, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def line(record: Record) -> bytes:
    """The record as one line, newline included."""
    return json.dumps(record, separators=(",", ":"), allow_nan=False).encode() + b"\n"


def rechain(records: Iterable[Record]) -> list[Record]:
    """Records with fresh ``seq``, ``previous`` and ``hash``, for logs that a migration changed."""
    chained: list[Record] = []
    previous = START
    for seq, record in enumerate(records):
        chained.append(make_record(seq, record["time"], record["type"], record["payload"], previous))
        previous = chained[-1]["hash"]
    return chained


def read_lines(data: bytes, name: str = "events.jsonl") -> tuple[list[Record], int]:
    """All whole records, and the number of bytes they take; more bytes than that are a torn last line.

    A last line counts as torn where it lacks its newline or is not JSON. Raises InvalidBundle, naming
    the line, for everything else that is not a chain of whole records.
    """
    records: list[Record] = []
    previous, taken = START, 0
    *lines, _ = data.split(b"\n")  # what follows the last newline is nothing, or torn
    for i, text in enumerate(lines):
        if len(text) > MAX_LINE:
            raise InvalidBundle(f"{name} line {i + 1} has more than {MAX_LINE >> 20} MB", file=name, line=i + 1)
        record = _parse(text)
        if record is None:
            if taken + len(text) + 1 == len(data):
                break
            raise InvalidBundle(f"{name} line {i + 1} is no event", file=name, line=i + 1)
        if not _follows(record, i, previous):
            raise InvalidBundle(
                f"{name} line {i + 1} was changed, or a line before it was lost: its hash does not fit",
                file=name,
                line=i + 1,
            )
        records.append(record)
        previous = record["hash"]
        taken += len(text) + 1
    return records, taken


def require_chain(records: Iterable[Record], label: str) -> None:
    """Raises InvalidBundle, naming the first event that is not whole or does not follow the one before."""
    previous = START
    for i, record in enumerate(records):
        if not _is_whole(record) or not _follows(record, i, previous):
            raise InvalidBundle(
                f"{label} event {i} was changed, or an event before it was lost: its hash does not fit", seq=i
            )
        previous = record["hash"]


def _follows(record: Record, seq: int, previous: str) -> bool:
    body = {key: record[key] for key in record if key != "hash"}
    return record["seq"] == seq and record["previous"] == previous and record["hash"] == _hash(body)


def _parse(text: bytes) -> Record | None:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return record if isinstance(record, dict) and set(record) == _FIELDS and _is_whole(record) else None


def _is_whole(record: Record) -> bool:
    return (
        type(record["seq"]) is int
        and type(record["time"]) in (int, float)
        and abs(record["time"]) <= sys.float_info.max
        and isinstance(record["type"], str)
        and isinstance(record["payload"], dict)
    )
