"""Files that are written: whole or not at all, and never in the place of what is no file."""

import os
import shutil
from pathlib import Path

from footfall.core.errors import InvalidInput, NotFound


def require_writable(path: str | os.PathLike[str]) -> None:
    """Check, before the work, that a file can come to be there.

    Args:
        path: where it is to be written.

    Raises:
        NotFound: there is no such folder.
        InvalidInput: there is a folder, a device, a pipe or a socket of that name.
    """
    path = Path(path)
    target = path.resolve()
    if not target.parent.is_dir():
        raise NotFound(f"there is no folder {path.parent} to write {path.name} into", path=str(path))
    if target.is_dir():
        raise InvalidInput(f"{path} is a folder; give the name of a file", path=str(path))
    if target.exists() and not target.is_file():
        raise InvalidInput(
            f"{path} is a device, a pipe or a socket, and results are written to files; give the name of a file",
            path=str(path),
        )


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file, or write over it; whoever reads it meanwhile sees all of the old or all of the new content.

    Args:
        path: where.
        content: its bytes.

    Raises:
        NotFound: there is no such folder.
        InvalidInput: there is a folder, a device, a pipe or a socket of that name.
        OSError: it can't be written, as the disk is full; nothing is left of it, and what was there stays.
    """
    require_writable(path)
    target = Path(path).resolve()
    partial = target.with_name(f".{target.name}.partial")
    try:
        partial.write_bytes(content)
        if target.exists():
            shutil.copymode(target, partial)
        partial.replace(target)
    except OSError as err:
        partial.unlink(missing_ok=True)
        raise OSError(err.errno, err.strerror, str(path)) from err
