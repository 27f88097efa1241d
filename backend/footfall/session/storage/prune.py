"""Removing what is not needed any more: files that nothing refers to, old recordings, old sessions."""

import contextlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from footfall.core.errors import Conflict, FootFallError
from footfall.io.bundles import artifact_files, is_artifact
from footfall.session.storage.databases import open_log, sole_writer
from footfall.session.storage.interface import Listed
from footfall.session.storage.listing import chosen_sessions
from footfall.session.storage.plain_log import has_plain_log
from footfall.session.storage.references import digests_in, referenced
from footfall.session.storage.store import LEAVING, read_session, remove_session
from footfall.session.storage.verify import unfinished

RECORDINGS = "recordings"


@dataclass(frozen=True)
class Removal:
    """One thing that goes. path: relative to the working folder."""

    session: str
    path: str
    bytes: int
    why: str


@dataclass(frozen=True)
class Pruned:
    """What went, or would go. spared: session → why nothing of it was looked at."""

    removals: list[Removal] = field(default_factory=list)
    spared: dict[str, str] = field(default_factory=dict)


def prune(
    folder: Path,
    names: Sequence[str] = (),
    recordings_before: float | None = None,
    sessions_before: float | None = None,
    carry_out: bool = False,
) -> Pruned:
    """Remove what nothing refers to from sessions (none named: all) that nobody has open.

    recordings_before: and recordings last written before this time; sessions_before: and whole sessions whose last
    event is older [s since 1970-01-01 UTC]. Without ``carry_out`` nothing is removed, only told.
    Raises NotFound where a named session is not there.
    """
    chosen = chosen_sessions(folder, names)
    pruned = Pruned()
    for name, about in chosen.items():
        try:
            if isinstance(about, str):
                raise Conflict(about)
            if sessions_before is not None and about.latest is not None and about.latest < sessions_before:
                _take_session(folder / name, pruned, carry_out)
            else:
                _take_files(folder / name, recordings_before, pruned, carry_out)
        except FootFallError as err:
            pruned.spared[name] = err.message
    if not names:
        _take_leavings(folder, chosen, pruned, carry_out)
    return pruned


def _take_session(folder: Path, pruned: Pruned, carry_out: bool) -> None:
    with sole_writer(folder):
        pass  # nobody has it open
    removal = Removal(folder.name, folder.name, _size(folder), "the whole session: its last event is that old")
    if carry_out:
        remove_session(folder)
    pruned.removals.append(removal)


def _take_files(folder: Path, recordings_before: float | None, pruned: Pruned, carry_out: bool) -> None:
    with sole_writer(folder):
        for path, why in _unneeded(folder, recordings_before):
            removal = Removal(folder.name, str(path.relative_to(folder.parent)), path.stat().st_size, why)
            if carry_out:
                path.unlink()
            pruned.removals.append(removal)


def _unneeded(folder: Path, recordings_before: float | None) -> Iterator[tuple[Path, str]]:
    if has_plain_log(folder):
        raise Conflict("its log is not in the database yet; open the session once")
    files = {name: read for name, read in artifact_files(folder).items() if is_artifact(name)}
    used = referenced(read_session(folder).records, files, lambda name: digests_in(name, files[name]()))
    for name in files:
        if name.partition(".")[0] not in used:
            yield folder / "artifacts" / name, "nothing refers to it"
    for path in unfinished(folder):
        yield path, "left by a crash"
    if recordings_before is not None:
        for path in sorted((folder / RECORDINGS).glob("*.mcap")):
            if path.stat().st_mtime < recordings_before:
                yield path, "a recording that old"


def _take_leavings(folder: Path, found: dict[str, Listed | str], pruned: Pruned, carry_out: bool) -> None:
    """Finish removals that were cut short."""
    for path in sorted(folder.glob(f"{LEAVING}*")):
        name = path.name.removeprefix(LEAVING)
        pruned.removals.append(Removal(name, path.name, _size(path), "its removal was cut short"))
        if carry_out:
            if name in found and not (folder / name).exists():
                with contextlib.closing(open_log(folder, create=False)) as log:
                    log.forget(name)
            shutil.rmtree(path)


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
