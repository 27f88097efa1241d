"""A sample as a session that lies in a data folder already, to be opened.

Where a server opens a sample, every artifact is unpacked and its digest made, which takes a quarter of a second of a
core; most tests of a server with a sample look at something else.
"""

import shutil
import tempfile
from functools import cache
from pathlib import Path

from footfall.io.bundles import read_bundle
from footfall.resources import sample_sessions_folder
from footfall.session.storage.store import SessionStore


def lay_sample(name: str, folder: Path) -> str:
    """Put a sample into a data folder that nobody has open yet; the id of the session."""
    laid, session = _taken_in(name)
    shutil.copytree(laid.name, folder, dirs_exist_ok=True)
    return session


@cache
def _taken_in(name: str) -> tuple[tempfile.TemporaryDirectory[str], str]:
    """A data folder with the sample, kept as long as this process of tests, and the id of the session."""
    folder = tempfile.TemporaryDirectory(prefix="footfall-sample-")
    read = read_bundle(sample_sessions_folder() / name)
    session = str(read.session["id"])
    SessionStore.take_in(Path(folder.name) / session, read).close()
    return folder, session
