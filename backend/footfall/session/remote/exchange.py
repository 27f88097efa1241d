"""Values on their way between a server and a worker: files by digest in the data folder that both see."""

import contextlib
import json
import shutil
import time
from collections.abc import Collection
from pathlib import Path
from typing import Any

from footfall.core import errors
from footfall.core.errors import FootFallError
from footfall.core.value import Value
from footfall.io.bundles import ARTIFACTS
from footfall.session.storage.artifact_folder import ArtifactFolder

JOBS = "jobs"
"""Folder beside the sessions; one folder in it for each job on its way."""

FRESH = 60.0
"""A folder as young as this may be of a job that is just being asked for [s]."""


class Exchange:
    """What one job takes and makes. What the session has stored already is not copied."""

    def __init__(self, data: Path, job: str, session: str) -> None:
        self._folder = data / JOBS / job
        self._own = ArtifactFolder(self._folder)
        self._session = ArtifactFolder(data / session) if session else None

    def open(self) -> None:
        """Make the job's folder."""
        (self._folder / ARTIFACTS).mkdir(parents=True, exist_ok=True)

    def put(self, value: Value) -> str:
        """Returns the digest. Raises StoreRefused."""
        known = self._session is not None and self._session.has(value.digest)
        return value.digest if known else self._own.put(value)

    def put_product(self, product: Value | bytes) -> str:
        """Returns a name for :meth:`product`. Raises StoreRefused."""
        return (
            f"bin {self._own.put_bytes(product, 'bin')}" if isinstance(product, bytes) else f"npz {self.put(product)}"
        )

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle where it is damaged."""
        if self._session is not None and self._session.has(digest):
            return self._session.get(digest)
        return self._own.get(digest)

    def product(self, name: str) -> Value | bytes:
        """Raises as :meth:`get`."""
        form, _, digest = name.partition(" ")
        return self._own.get_bytes(digest) if form == "bin" else self.get(digest)

    def remove(self) -> None:
        """The job is over."""
        shutil.rmtree(self._folder, ignore_errors=True)


def remove_forgotten(data: Path, known: Collection[str]) -> None:
    """Remove what jobs of servers that were killed have left."""
    folders = (data / JOBS).iterdir() if (data / JOBS).is_dir() else ()
    for folder in folders:
        with contextlib.suppress(OSError):
            if folder.name not in known and time.time() - folder.stat().st_mtime > FRESH:
                shutil.rmtree(folder)


def error_text(error: FootFallError) -> str:
    """An error as text for the other side."""
    return json.dumps({"kind": error.kind, "message": error.message, "details": error.details}, default=str)


def error_of(text: str) -> FootFallError:
    """The error that the other side told of."""
    document: dict[str, Any] = json.loads(text)
    kinds = {cls.kind: cls for cls in vars(errors).values() if isinstance(cls, type) and issubclass(cls, FootFallError)}
    return kinds.get(document["kind"], FootFallError)(document["message"], **document["details"])
