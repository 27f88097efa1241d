"""One writer a session, across processes: two would tear each other's chain."""

import fcntl
import os
from pathlib import Path

from footfall.core.errors import Conflict, InvalidBundle

LOCK = "lock"


class WriterLock:
    """Held from making to :meth:`release`; the system lets go of it when the process dies."""

    def __init__(self, folder: Path, name: str = LOCK) -> None:
        """Raises Conflict where another process holds it, InvalidBundle where there is no such folder."""
        try:
            self._file = os.open(folder / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except (FileNotFoundError, NotADirectoryError) as err:
            raise InvalidBundle(f"there is no session folder {folder.name}", session=folder.name) from err
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as err:
            os.close(self._file)
            text = f"session {folder.name} is open in another process; close it there, or end that process"
            raise Conflict(text, session=folder.name) from err

    def release(self) -> None:
        """Harmless when done twice."""
        if self._file >= 0:
            file, self._file = self._file, -1
            os.close(file)
