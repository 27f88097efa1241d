"""Artifacts of one session: files named by the digest of their content, written whole or not at all."""

import contextlib
import hashlib
import os
import threading
from pathlib import Path

import footfall.session.jobs.requests  # noqa: F401 (registers values that are found in files)
from footfall.core.errors import InvalidBundle, NotFound
from footfall.core.value import Value, stored_name
from footfall.io.artifacts import decode, encode
from footfall.io.bundles import ARTIFACTS
from footfall.session.products.kinds import FILE
from footfall.session.storage.interface import StoreRefused


class ArtifactFolder:
    """``artifacts/`` in a session's folder. What is there already stays as it is. Thread-safe."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / ARTIFACTS

    def put(self, value: Value) -> str:
        """Store a value; returns its digest."""
        path = self._folder / f"{value.digest}.npz"
        if not path.exists():
            write_whole(path, encode(value))
        return value.digest

    def put_bytes(self, data: bytes, extension: str) -> str:
        """Store a file's content; returns its digest."""
        digest = bytes_digest(data)
        path = self._folder / f"{digest}.{extension}"
        if not path.exists():
            write_whole(path, data)
        return digest

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle naming the file where it is damaged."""
        path = self._folder / f"{digest}.npz"
        if not _is_digest(digest) or not path.is_file():
            raise NotFound(f"the session holds no value {digest}", digest=digest)
        return decode(path.read_bytes(), expect=digest, name=f"{ARTIFACTS}/{path.name}")

    def get_bytes(self, digest: str) -> bytes:
        """Content of a stored file that is no value. Raises as :meth:`get`."""
        found = [p for p in self._folder.glob(f"{digest}.*") if p.suffix != ".npz"] if _is_digest(digest) else []
        if not found:
            raise NotFound(f"the session holds no file {digest}", digest=digest)
        data = found[0].read_bytes()
        verify_artifact(found[0].name, data)
        return data

    def has(self, digest: str) -> bool:
        """Whether a value of this name is stored; its content is not looked at."""
        return _is_digest(digest) and (self._folder / f"{digest}.npz").is_file()


def bytes_digest(data: bytes) -> str:
    """Name of a file by its content: 32 hexadecimal characters of SHA-256."""
    return hashlib.sha256(data).hexdigest()[:32]


def verify_artifact(name: str, data: bytes) -> str:
    """Of which kind artifact file ``name`` is: the class of its value, or FILE.

    Raises InvalidBundle unless its content is what its name says.
    """
    digest, _, extension = name.partition(".")
    if extension == "npz":
        return stored_name(type(decode(data, expect=digest, name=f"{ARTIFACTS}/{name}")))
    if bytes_digest(data) != digest:
        raise InvalidBundle(f"{ARTIFACTS}/{name} is damaged", file=f"{ARTIFACTS}/{name}")
    return FILE


def write_whole(path: Path, data: bytes) -> None:
    """Write a file whose name appears with the whole content or not at all, also after a power cut.

    Raises StoreRefused.
    """
    partial = path.with_name(f".{path.name}.{threading.get_ident()}.partial")
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)
    except OSError as err:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)  # a full disk keeps no half files
        text = f"{path.name} can't be written: {err.strerror or err}; see to its disk"
        raise StoreRefused(err.errno, text, str(path)) from err
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Wait until the disk has the names in a folder."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _is_digest(text: str) -> bool:
    return len(text) == 32 and set(text) <= set("0123456789abcdef")
