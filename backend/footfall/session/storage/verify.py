"""Whether a working folder holds what was written to it: log, head, artifacts, and nothing that belongs to nobody."""

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from footfall.core.errors import FootFallError, InvalidBundle
from footfall.core.progress import Progress, no_progress
from footfall.io.bundles import ARTIFACTS, EVENTS, artifact_files, is_artifact, read_bundle
from footfall.io.event_log import Record
from footfall.session.storage.databases import log_name, looking
from footfall.session.storage.head import HEAD, Comparison, Head, compare, read_head
from footfall.session.storage.interface import EventLog
from footfall.session.storage.listing import chosen_sessions
from footfall.session.storage.plain_log import has_plain_log
from footfall.session.storage.references import digests_in, missing, referenced


@dataclass(frozen=True)
class StoreFinding:
    """One thing that is not as it should be.

    session: its name; "" for the database. kind: "database", "log", "head", "folder", "artifact" (damaged), "missing",
    "orphan", "unfinished" or "unmoved". harmful: something is lost or in danger; else it is only untidy.
    """

    session: str
    kind: str
    text: str
    harmful: bool = True


def verify(folder: Path, names: Sequence[str] = (), progress: Progress = no_progress) -> list[StoreFinding]:
    """Check sessions of a working folder (none named: all, and the database itself). Nothing is changed.

    Sessions may be in use meanwhile. Raises NotFound where a named session is not there.
    """
    chosen = list(chosen_sessions(folder, names))
    findings: list[StoreFinding] = []
    log: EventLog | None = None
    with contextlib.ExitStack() as stack:
        try:
            log = stack.enter_context(looking(folder))
            findings += [StoreFinding("", "database", f"{log.name}: {text}") for text in log.damage()]
        except FileNotFoundError:
            pass  # each session without its events will say so
        except (FootFallError, OSError) as err:
            findings.append(StoreFinding("", "database", _text(err)))
        for i, name in enumerate(chosen):
            progress(i / len(chosen), name)
            findings += _of_session(folder / name, log)
    return findings


def _of_session(folder: Path, log: EventLog | None) -> Iterator[StoreFinding]:
    name = folder.name
    if not folder.is_dir():
        yield StoreFinding(name, "folder", f"the folder {name} is missing, with its artifacts and recordings")
        return
    try:
        if has_plain_log(folder):
            yield StoreFinding(
                name,
                "unmoved",
                f"{EVENTS} is not in {log_name(folder.parent)} yet; opening the session moves it",
                False,
            )
            records = read_bundle(folder).records
        else:
            head = read_head(folder)
            records = _logged(log, folder)
            yield from _about_head(folder, head, records)
    except (FootFallError, OSError) as err:
        yield StoreFinding(name, "log", _text(err))
        return
    yield from _about_artifacts(folder, records)


def _logged(log: EventLog | None, folder: Path) -> list[Record]:
    if log is None or log.about(folder.name) is None:
        raise InvalidBundle(f"its events are not in {log_name(folder.parent)}, which was removed or replaced")
    return log.read(folder.name)


def _about_head(folder: Path, head: Head | None, records: Sequence[Record]) -> Iterator[StoreFinding]:
    found = compare(head, records)
    if found.kind == "behind" and found.by > 1:
        # a session in use goes on between the readings: its head must have come up by now, and may be farther
        later = compare(read_head(folder), records)
        found = Comparison("fits") if later.kind == "ahead" else later
    if found.kind == "behind" and found.by == 1:
        yield StoreFinding(
            folder.name, "head", f"{found.text}, as after a crash; opening the session repairs it", False
        )
    elif found.kind != "fits":
        yield StoreFinding(folder.name, "head", f"{folder.name}/{HEAD}: {found.text}")
    elif head is not None and head.damaged:
        yield StoreFinding(folder.name, "head", f"{folder.name}/{HEAD}: one of its two copies is damaged", False)


def _about_artifacts(folder: Path, records: Sequence[Record]) -> Iterator[StoreFinding]:
    name = folder.name
    try:
        files = artifact_files(folder)
    except InvalidBundle as err:
        yield StoreFinding(name, "artifact", err.message)
        return
    whole: dict[str, set[str]] = {}
    for file, content in files.items():
        if not is_artifact(file):
            yield StoreFinding(name, "orphan", f"{ARTIFACTS}/{file} is no artifact", False)
            continue
        try:
            whole[file] = digests_in(file, content())
        except FileNotFoundError:
            continue  # removed meanwhile; if it was needed, it is missing
        except (FootFallError, OSError) as err:
            yield StoreFinding(name, "artifact", _text(err))
    for digest, record in missing(records, files):
        text = f"{ARTIFACTS}/{digest} is missing; event {record['seq']} ({record['type']}) names it"
        yield StoreFinding(name, "missing", text)
    used = referenced(records, whole, whole.__getitem__)
    for file in whole:
        if file.partition(".")[0] not in used:
            yield StoreFinding(name, "orphan", f"nothing refers to {ARTIFACTS}/{file}; prune removes it", False)
    for path in unfinished(folder):
        yield StoreFinding(name, "unfinished", f"{ARTIFACTS}/{path.name} was left by a crash; prune removes it", False)


def unfinished(folder: Path) -> Iterable[Path]:
    """Files of a session whose writing was cut short, or is going on."""
    return sorted((folder / ARTIFACTS).glob(".*.partial"))


def _text(err: FootFallError | OSError) -> str:
    return err.message if isinstance(err, FootFallError) else f"{err.filename or ''}: {err.strerror or err}"
