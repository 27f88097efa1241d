"""A session on disk, laid out as a bundle: every event is on the disk before anyone hears of it."""

import contextlib
import fcntl
import hashlib
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput, NotFound
from footfall.core.value import Value
from footfall.io.artifacts import decode, encode
from footfall.io.bundles import ARTIFACTS, EVENTS, SESSION, read_bundle, session_bytes
from footfall.io.event_log import line
from footfall.session.event import Event, event_of


class SessionStore:
    """The folder of one session, held open for appending. Not thread-safe: its session serialises calls.

    .session: content of session.json. .events: the log as found at opening. .torn: bytes of a torn last
    line that were cut off then.
    """

    def __init__(self, folder: Path) -> None:
        """Open a session folder. Raises InvalidBundle where it is damaged beyond a torn last line."""
        self.folder = folder
        self._log = _open_log(folder / EVENTS)
        try:
            self._load()
        except BaseException:
            os.close(self._log)
            raise

    def _load(self) -> None:
        folder = self.folder
        read = read_bundle(folder)
        self.session: dict[str, Any] = dict(read.session)
        self.events = [event_of(record) for record in read.records]
        self.torn = read.torn
        if read.version != self.session["version"]:
            self._upgrade(read.version)
        self._length = os.fstat(self._log).st_size
        if self.torn:
            self._length -= self.torn
            os.ftruncate(self._log, self._length)
            os.fsync(self._log)
        self._last = self.events[-1] if self.events else None

    @classmethod
    def create(cls, folder: Path, session: Mapping[str, Any]) -> "SessionStore":
        """Make a new session folder. Raises InvalidInput where one is there."""
        try:
            (folder / ARTIFACTS).mkdir(parents=True)
        except FileExistsError as err:
            raise InvalidInput(f"there is a session in {folder.name} already") from err
        (folder / EVENTS).touch()
        _write(folder / SESSION, session_bytes(session))
        return cls(folder)

    def append(self, event: Event) -> None:
        """Write one event and wait until the disk has it. OSError: it is not in the log, not even in part."""
        data = line(event.as_dict())
        try:
            written = os.write(self._log, data)
            if written != len(data):
                raise OSError(f"only {written} of {len(data)} bytes of an event were written")
            os.fsync(self._log)
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._log, self._length)
            raise
        self._length += len(data)
        self._last = event

    def seal(self) -> None:
        """Note the last event in session.json, so that a log that is cut later shows."""
        if self._last is not None:
            self.session["head"] = {"seq": self._last.seq, "hash": self._last.hash}
            _write(self.folder / SESSION, session_bytes(self.session))

    def put(self, value: Value) -> str:
        """Store a value; returns its digest. One that is there stays as it is."""
        path = self._path(f"{value.digest}.npz")
        if not path.exists():
            _write(path, encode(value))
        return value.digest

    def put_bytes(self, data: bytes, extension: str) -> str:
        """Store a file's content; returns its digest."""
        digest = bytes_digest(data)
        path = self._path(f"{digest}.{extension}")
        if not path.exists():
            _write(path, data)
        return digest

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle naming the file where it is damaged."""
        path = self._path(f"{digest}.npz")
        if not _is_digest(digest) or not path.is_file():
            raise NotFound(f"the session holds no value {digest}", digest=digest)
        return decode(path.read_bytes(), expect=digest, name=f"{ARTIFACTS}/{path.name}")

    def get_bytes(self, digest: str) -> bytes:
        """Content of a stored file that is no value. Raises as :meth:`get`."""
        found = [p for p in self._path(".").glob(f"{digest}.*") if p.suffix != ".npz"] if _is_digest(digest) else []
        if not found:
            raise NotFound(f"the session holds no file {digest}", digest=digest)
        data = found[0].read_bytes()
        verify_artifact(found[0].name, data)
        return data

    def has(self, digest: str) -> bool:
        """Whether a value of this name is stored; its content is not looked at."""
        return _is_digest(digest) and self._path(f"{digest}.npz").is_file()

    def close(self) -> None:
        """Seal and close; harmless when done twice."""
        if self._log >= 0:
            log, self._log = self._log, -1
            try:
                self.seal()
            finally:
                os.close(log)

    def _path(self, name: str) -> Path:
        return self.folder / ARTIFACTS / name

    def _upgrade(self, version: int) -> None:
        # The log as it was written stays beside the new one.
        old = self.folder / f"events.v{version}.jsonl"
        if not old.exists():
            _write(old, (self.folder / EVENTS).read_bytes())
        _write(self.folder / EVENTS, b"".join(line(event.as_dict()) for event in self.events))
        self.torn = 0
        os.close(self._log)
        self._log = _open_log(self.folder / EVENTS)
        _write(self.folder / SESSION, session_bytes(self.session))


def _open_log(path: Path) -> int:
    try:
        log = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CLOEXEC)
    except FileNotFoundError as err:
        raise InvalidBundle(f"{path.parent.name} is no session: it has no {EVENTS}", file=EVENTS) from err
    try:
        # Two writers would tear each other's chain.
        fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as err:
        os.close(log)
        raise Conflict(f"session {path.parent.name} is open in another process") from err
    return log


def bytes_digest(data: bytes) -> str:
    """Name of a file by its content: 32 hexadecimal characters of SHA-256."""
    return hashlib.sha256(data).hexdigest()[:32]


def verify_artifact(name: str, data: bytes) -> None:
    """Raises InvalidBundle unless the content of artifact file ``name`` is what its name says."""
    digest, _, extension = name.partition(".")
    if extension == "npz":
        decode(data, expect=digest, name=f"{ARTIFACTS}/{name}")
    elif bytes_digest(data) != digest:
        raise InvalidBundle(f"{ARTIFACTS}/{name} is damaged", file=f"{ARTIFACTS}/{name}")


def _is_digest(text: str) -> bool:
    return len(text) == 32 and set(text) <= set("0123456789abcdef")


def _write(path: Path, data: bytes) -> None:
    # The name appears with the whole content or not at all, also after a power cut.
    partial = path.with_name(f".{path.name}.{threading.get_ident()}.partial")
    with partial.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(partial, path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
