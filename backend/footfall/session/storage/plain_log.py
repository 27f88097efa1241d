"""A log as ``events.jsonl`` in a session's folder: as earlier versions kept it, and where one is kept for later.

What is found there is moved into the database once; the file stays beside, under another name.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from footfall.core.errors import InvalidBundle
from footfall.io.bundles import EVENTS, SESSION, log_bytes, read_bundle, session_bytes
from footfall.io.event_log import Record
from footfall.session.storage.artifact_folder import sync_folder, write_whole
from footfall.session.storage.head import compare, new_head, read_head
from footfall.session.storage.interface import EventLog
from footfall.session.storage.writer_lock import WriterLock

MOVED = ".moved"


def has_plain_log(folder: Path) -> bool:
    """Whether a session's folder holds a log that is not in the database yet."""
    return (folder / EVENTS).is_file()


def move_into(log: EventLog, folder: Path) -> int:
    """Move a folder's plain log into the database; returns the bytes of a torn last line that were left out.

    A move that was cut short is completed. Raises InvalidBundle where file and database tell different stories,
    Conflict where an earlier version of FootFall holds the session open.
    """
    lock = WriterLock(folder, EVENTS)  # what earlier versions lock
    try:
        bundle = read_bundle(folder)
        if log.about(folder.name) is None:
            log.create(folder.name, {**bundle.session, "id": folder.name}, bundle.records)
        else:
            known = log.read(folder.name)
            if bundle.records[: len(known)] == known:
                log.append(folder.name, bundle.records[len(known) :])
            elif known[: len(bundle.records)] != bundle.records:
                text = f"{folder.name}/{EVENTS} and {log.name} tell different stories of the session"
                raise InvalidBundle(f"{text}; move one of them away", session=folder.name)
        records = log.read(folder.name)
        if not compare(read_head(folder), records).lost:
            new_head(folder, records).close()
        for name in (EVENTS, SESSION):
            (folder / name).rename(_unused(folder, name + MOVED))
        sync_folder(folder)
    finally:
        lock.release()
    return bundle.torn


def keep(folder: Path, about: Mapping[str, Any], records: Sequence[Record]) -> None:
    """Write a whole log beside the database that can't take it; the next opening moves it there."""
    write_whole(folder / SESSION, session_bytes({**about, "head": _head(records)}))
    write_whole(folder / EVENTS, log_bytes(records))


def _head(records: Sequence[Record]) -> dict[str, Any] | None:
    return {"seq": records[-1]["seq"], "hash": records[-1]["hash"]} if records else None


def _unused(folder: Path, name: str) -> Path:
    found = [folder / name, *(folder / f"{name}.{i}" for i in range(1, 1000))]
    return next(path for path in found if not path.exists())
