"""A copy of sessions in a folder of its own, made while they are in use; it is a working folder like the first one."""

import contextlib
import secrets
import shutil
from collections.abc import Sequence
from pathlib import Path

from footfall.core.errors import InvalidBundle, InvalidInput
from footfall.core.progress import Progress, no_progress, part
from footfall.io.bundles import ARTIFACTS, EVENTS, SESSION
from footfall.session.storage.artifact_folder import sync_folder, write_whole
from footfall.session.storage.databases import has_log, open_log
from footfall.session.storage.head import HEAD, HELD, compare, new_head, read_head
from footfall.session.storage.listing import chosen_sessions
from footfall.session.storage.plain_log import has_plain_log
from footfall.session.storage.prune import RECORDINGS
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog
from footfall.session.storage.verify import StoreFinding, verify


def backup(
    folder: Path, target: Path, names: Sequence[str] = (), recordings: bool = True, progress: Progress = no_progress
) -> list[StoreFinding]:
    """Copy sessions (none named: all) into ``target``, a new or empty folder; returns what verifying the copy found.

    recordings: whether finished recordings go along. What is damaged is copied as it is, and found.
    Raises NotFound where a named session is not there, InvalidInput where the target holds something, OSError.
    """
    chosen = list(chosen_sessions(folder, names))
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise InvalidInput(f"{target} is there already; give a new folder, so that no older backup is overwritten")
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    partial.mkdir(parents=True)
    try:
        _copy(folder, partial, chosen, recordings, part(progress, 0.0, 0.6))
        findings = verify(partial, chosen, part(progress, 0.6, 1.0))
        if target.exists():
            target.rmdir()
        partial.rename(target)
        sync_folder(target.parent)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return findings


def _copy(folder: Path, target: Path, chosen: Sequence[str], recordings: bool, progress: Progress) -> None:
    # Heads first: the log copied later is as long or longer. Artifacts last: events name only what is there.
    for name in chosen:
        (target / name).mkdir()
        for plain in (HEAD, HELD, EVENTS, SESSION):
            if (folder / name / plain).is_file():
                write_whole(target / name / plain, (folder / name / plain).read_bytes())
    if has_log(folder):
        _copy_database(folder, target, chosen)
    for i, name in enumerate(chosen):
        progress(i / len(chosen), name)
        (target / name / ARTIFACTS).mkdir()
        for path in _files(folder / name, recordings):
            copy = target / name / path.relative_to(folder / name)
            copy.parent.mkdir(exist_ok=True)
            with contextlib.suppress(FileNotFoundError):  # removed meanwhile: needed by nothing, or found missing
                write_whole(copy, path.read_bytes())


def _copy_database(folder: Path, target: Path, chosen: Sequence[str]) -> None:
    with contextlib.closing(open_log(folder, create=False)) as log:
        log.copy_to(target / DATABASE, chosen)
    with contextlib.closing(SqliteLog(target / DATABASE, create=False)) as copy:
        for one in copy.sessions():
            if not has_plain_log(target / one.id):
                _bring_up_head(target / one.id, copy)


def _bring_up_head(session: Path, log: SqliteLog) -> None:
    """Events that came between the copy of the head and that of the log are none that were lost."""
    with contextlib.suppress(InvalidBundle):  # found when the copy is verified
        records = log.read(session.name)
        if compare(read_head(session), records).kind == "behind":
            new_head(session, records).close()


def _files(session: Path, recordings: bool) -> list[Path]:
    kept = sorted((session / ARTIFACTS).glob("[!.]*"))
    recorded = sorted((session / RECORDINGS).glob("*.mcap")) if recordings else []
    return [path for path in kept + recorded if path.is_file() and not path.is_symlink()]
