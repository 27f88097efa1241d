"""A bundle from elsewhere, looked at before anything of it is stored."""

import os

from footfall.core.errors import InvalidBundle
from footfall.io.bundles import EVENTS, read_bundle
from footfall.session.storage.artifact_folder import verify_artifact
from footfall.session.storage.value_kinds import require_kinds


def check_bundle(bundle: str | os.PathLike[str] | bytes) -> None:
    """Read all of it. Raises InvalidBundle, naming the file, where anything is wrong."""
    read = read_bundle(bundle)
    if not read.records or read.records[0]["type"] != "session_created":
        raise InvalidBundle(f"{EVENTS} does not begin with the making of the session", file=EVENTS)
    kinds = {name.partition(".")[0]: verify_artifact(name, content()) for name, content in read.files.items()}
    require_kinds(read.records, kinds)
