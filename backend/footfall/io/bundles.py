"""Session bundles: a folder or a zip with ``session.json``, ``events.jsonl`` and ``artifacts/<digest>.<ext>``.

``session.json`` carries the version of the layout. A bundle of an older version is brought up to date
while it is read, one version at a time; one of a newer version is refused. ``head`` in it is the last event
that was sealed, so that a cut tail shows.
"""

import io
import json
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from footfall.core.errors import InvalidBundle
from footfall.core.json_object import JsonObject
from footfall.core.misread import place_of
from footfall.io.event_log import Record, line, read_lines, rechain

FORMAT = "footfall-session"
VERSION = 1
"""Version of the layout that this software writes."""

MAX_ZIP_BYTES = 4 << 30
"""Largest accepted bundle, unpacked [bytes]."""
MAX_FILES = 20_000
MAX_SESSION_BYTES = 1 << 20
"""Largest accepted session.json, unpacked [bytes]."""
MAX_RATIO, SMALL_FILE = 200, 1 << 20
"""A file of more than SMALL_FILE bytes that its zip holds this many times smaller is no honest part of a session."""

SESSION, EVENTS, ARTIFACTS = "session.json", "events.jsonl", "artifacts"
_ARTIFACT = re.compile(r"[0-9a-f]{32}\.[a-z0-9][a-z0-9-]{0,19}(\.[a-z0-9]{1,10})?")
_EPOCH = (1980, 1, 1, 0, 0, 0)

Migration = Callable[[JsonObject, list[Record]], tuple[JsonObject, list[Record]]]

MIGRATIONS: dict[int, Migration] = {}
"""version n → function (session, records) → the same as version n + 1 would have written it.

A migration touches ``type`` and ``payload`` of the records; the hash chain is made afresh afterwards. Fields
added to values need none: missing fields take their defaults and the stored digest stays the name.
"""


@dataclass(frozen=True)
class Bundle:
    """A bundle as read: nothing recomputed yet.

    session: content of session.json, at the present version.
    records: every event, at the present version.
    torn: bytes of a torn last line that were left out.
    version: the version it was written with.
    files: artifact file name → function that reads its bytes.
    """

    session: Mapping[str, Any]
    records: list[Record]
    torn: int
    version: int
    files: Mapping[str, Callable[[], bytes]] = field(repr=False)


def migrate(
    session: JsonObject,
    records: list[Record],
    migrations: Mapping[int, Migration] = MIGRATIONS,
    version: int = VERSION,
) -> tuple[JsonObject, list[Record]]:
    """Bring a bundle from its own version to ``version``.

    Raises InvalidBundle for a version that is no whole number above 0, is newer, or has no way up.
    """
    found = session.get("version")
    if type(found) is not int or found < 1:
        raise InvalidBundle(f"{SESSION} needs a version number", version=found)
    if found > version:
        raise InvalidBundle(
            f"the session was written by a later version of FootFall (layout {found}, this one reads up to {version}); "
            "update FootFall",
            version=found,
            readable=version,
        )
    old = found
    while found < version:
        if found not in migrations:
            raise InvalidBundle(f"there is no way from layout {found} to {found + 1}", version=found)
        session, records = migrations[found](dict(session), [dict(record) for record in records])
        found += 1
        session["version"] = found
    if old == version:
        return session, records
    session.pop("head", None)  # it named an event of the old chain
    return session, rechain(records)


def read_bundle(bundle: str | os.PathLike[str] | bytes) -> Bundle:
    """Read a folder, a zip file, or the bytes of a zip; artifacts stay unread until asked for.

    Raises InvalidBundle, naming the file, for what is missing, damaged, of a later version, too large
    (MAX_ZIP_BYTES, MAX_FILES, MAX_SESSION_BYTES), or points outside of the bundle.
    """
    if isinstance(bundle, bytes):
        return _from_zip(bundle, "the bundle")
    path = Path(bundle)
    if path.is_dir():
        return _assemble(_folder_files(path), path.name)
    if path.is_file():
        return _from_zip(path.read_bytes(), path.name)
    raise InvalidBundle(f"there is no session bundle at {path}", path=str(path))


def write_zip(bundle: Bundle) -> bytes:
    """The bundle as a zip, the same bytes for the same session."""
    files: dict[str, Callable[[], bytes]] = {f"{ARTIFACTS}/{name}": content for name, content in bundle.files.items()}
    files[SESSION] = lambda: session_bytes(bundle.session)
    files[EVENTS] = lambda: log_bytes(bundle.records)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, _EPOCH)
            # Artifacts are packed already.
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".npz") else zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name]())
    return out.getvalue()


def log_bytes(records: Iterable[Record]) -> bytes:
    """Content of events.jsonl."""
    return b"".join(line(record) for record in records)


def session_bytes(session: Mapping[str, Any]) -> bytes:
    """Content of session.json."""
    return json.dumps(dict(session), indent=1, sort_keys=True).encode() + b"\n"


def is_artifact(name: str) -> bool:
    """Whether a file of this name may lie among the artifacts."""
    return _ARTIFACT.fullmatch(name) is not None


def artifact_files(folder: Path) -> dict[str, Callable[[], bytes]]:
    """Artifact file name → function that reads its bytes, of a session's folder. Raises InvalidBundle at a link."""
    if (folder / ARTIFACTS).is_symlink():
        raise InvalidBundle(f"{ARTIFACTS} is a link; a bundle holds plain files only", file=ARTIFACTS)
    if not (folder / ARTIFACTS).is_dir():
        return {}
    paths = sorted(p for p in (folder / ARTIFACTS).iterdir() if not p.name.startswith("."))
    return {path.name: path.read_bytes for path in paths if _is_plain(path, f"{ARTIFACTS}/{path.name}")}


def _folder_files(folder: Path) -> dict[str, Callable[[], bytes]]:
    files = {name: (folder / name).read_bytes for name in (SESSION, EVENTS) if _is_plain(folder / name, name)}
    return files | {f"{ARTIFACTS}/{name}": content for name, content in artifact_files(folder).items()}


def _is_plain(path: Path, name: str) -> bool:
    if path.is_symlink():
        raise InvalidBundle(f"{name} is a link; a bundle holds plain files only", file=name)
    return path.is_file()


def _from_zip(data: bytes, label: str) -> Bundle:
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except (zipfile.BadZipFile, ValueError) as err:
        raise InvalidBundle(f"{label} is no zip of a session: damaged, cut or another kind", file=label) from err
    entries = archive.infolist()
    total = sum(entry.file_size for entry in entries)
    if len(entries) > MAX_FILES or total > MAX_ZIP_BYTES:
        raise InvalidBundle(
            f"{label} is too large: {len(entries)} files, {total >> 20} MB unpacked; "
            f"at most {MAX_FILES} files and {MAX_ZIP_BYTES >> 20} MB are read",
            files=len(entries),
            bytes=total,
        )
    files: dict[str, Callable[[], bytes]] = {}
    top = _common_folder([entry.filename for entry in entries])
    for entry in entries:
        if entry.is_dir():
            continue
        path = PurePosixPath(entry.filename)
        if path.is_absolute() or ".." in path.parts or "\\" in entry.filename or ":" in entry.filename:
            raise InvalidBundle(f"{entry.filename!r} points outside of the bundle", file=entry.filename)
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise InvalidBundle(f"{entry.filename!r} is a link; a bundle holds plain files only", file=entry.filename)
        if entry.file_size > max(SMALL_FILE, MAX_RATIO * entry.compress_size):
            raise InvalidBundle(f"{entry.filename!r} would unpack to {entry.file_size >> 20} MB", file=entry.filename)
        name = path.as_posix().removeprefix(top)
        if name == SESSION and entry.file_size > MAX_SESSION_BYTES:
            text = f"{SESSION} has {entry.file_size} bytes, more than {MAX_SESSION_BYTES} are refused"
            raise InvalidBundle(text, file=SESSION, limit=MAX_SESSION_BYTES)
        if name in files:
            raise InvalidBundle(f"{entry.filename!r} is in the bundle twice", file=entry.filename)
        files[name] = _entry_reader(archive, entry)
    return _assemble(files, label)


def _common_folder(names: list[str]) -> str:
    """A zip made of a folder holds that folder: "rock-step/"; else ""."""
    if SESSION in names:
        return ""
    tops = {name.split("/", 1)[0] for name in names}
    return f"{next(iter(tops))}/" if len(tops) == 1 and ".." not in tops else ""


def _entry_reader(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Callable[[], bytes]:
    def read() -> bytes:
        try:
            return archive.read(entry)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as err:
            raise InvalidBundle(
                f"{entry.filename} is damaged, or its packing is not read", file=entry.filename
            ) from err

    return read


def _assemble(files: dict[str, Callable[[], bytes]], label: str) -> Bundle:
    for needed in (SESSION, EVENTS):
        if needed not in files:
            raise InvalidBundle(f"{label} is no session: it has no {needed}", file=needed)
    try:
        session = json.loads(files[SESSION]())
    except (ValueError, RecursionError) as err:
        raise InvalidBundle(f"{SESSION} is no JSON{place_of(err)}", file=SESSION) from err
    if not isinstance(session, dict) or session.get("format") != FORMAT:
        raise InvalidBundle(f'{SESSION} does not say "format": "{FORMAT}"', file=SESSION)
    # A later layout may chain its events otherwise, so its version is refused before they are read.
    migrate({**session}, [], {v: lambda s, r: (s, r) for v in range(1, VERSION)})
    data = files[EVENTS]()
    records, taken = read_lines(data)
    _require_head(session, records)
    version = session["version"]
    session, records = migrate(session, records)
    artifacts: dict[str, Callable[[], bytes]] = {}
    for name, content in files.items():
        folder, _, rest = name.partition("/")
        if folder == ARTIFACTS and is_artifact(rest):
            artifacts[rest] = content
        elif name not in (SESSION, EVENTS):
            raise InvalidBundle(f"{name!r} does not belong into a session bundle", file=name)
    return Bundle(session, records, len(data) - taken, version, artifacts)


def _require_head(session: Mapping[str, Any], records: list[Record]) -> None:
    head = session.get("head")
    if head is None:
        return
    if not isinstance(head, dict) or type(seq := head.get("seq")) is not int or "hash" not in head:
        raise InvalidBundle(f"{SESSION} has a damaged head", file=SESSION)
    chained = head["hash"]
    if seq >= len(records):
        raise InvalidBundle(
            f"{EVENTS} was cut: it ends with event {len(records) - 1}, {SESSION} knows of event {seq}",
            file=EVENTS,
            last=len(records) - 1,
            known=seq,
        )
    if seq < 0 or records[seq]["hash"] != chained:
        raise InvalidBundle(f"event {seq} is not the one that {SESSION} knows", file=EVENTS, seq=seq)
