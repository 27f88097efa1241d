"""Which artifacts a session needs: what its events name, and what those artifacts name in turn."""

import json
import re
from collections.abc import Callable, Iterable, Mapping

from footfall.core.errors import Conflict, InvalidBundle
from footfall.core.value import flatten
from footfall.io.artifacts import decode
from footfall.io.bundles import ARTIFACTS, Bundle, write_zip
from footfall.io.event_log import Record
from footfall.session.storage.artifact_folder import verify_artifact

MOST_NAMED = 20
"""So many missing artifacts are named in a refusal."""

_DIGEST = re.compile(r'"([0-9a-f]{32})"')
_NEEDED: Mapping[str, tuple[str, ...]] = {
    "session_created": ("robot",),
    "state_frozen": ("digest",),
    "snapshot_taken": ("digest", "state"),
    "terrain_loaded": ("digest",),
    "product": ("digest", "settings"),
}


def needed(record: Record) -> list[str]:
    """Digests of the artifacts without which an event means nothing."""
    payload = record["payload"]
    named = [payload.get(key) for key in _NEEDED.get(record["type"], ())]
    parents = payload.get("parents") if record["type"] == "product" else None
    named += parents.values() if isinstance(parents, Mapping) else ()
    # of a bundle of others anything may stand there; nothing is called so
    return [str(digest) for digest in named if digest is not None]


def missing(records: Iterable[Record], files: Iterable[str]) -> list[tuple[str, Record]]:
    """Digests that events need and no artifact has, each with the event. files: names of the artifacts."""
    present = {name.partition(".")[0] for name in files}
    return [(digest, record) for record in records for digest in needed(record) if digest not in present]


def require_whole(bundle: Bundle) -> None:
    """Raise InvalidBundle where artifacts are missing: it would not replay."""
    lacking = list(dict.fromkeys(digest for digest, _ in missing(bundle.records, bundle.files)))
    if lacking:
        named = {digest for record in bundle.records for digest in needed(record)}
        raise InvalidBundle(
            f"{len(lacking)} of the {len(named)} artifacts that the session's events name are missing: "
            f"{', '.join(map(repr, lacking[:MOST_NAMED]))}; export the session again where it is whole",
            missing=lacking[:MOST_NAMED],
            count=len(lacking),
        )


def whole_zip(bundle: Bundle) -> bytes:
    """A session's bundle as a zip. Raises Conflict where artifacts are missing."""
    try:
        require_whole(bundle)
    except InvalidBundle as err:
        text = f"the session can't be handed on: {err.message}, or put them back from a backup"
        raise Conflict(text, **err.details) from err
    return write_zip(bundle)


def referenced(records: Iterable[Record], files: Iterable[str], named_by: Callable[[str], Iterable[str]]) -> set[str]:
    """Digests that a log, or an artifact that it leads to, seems to name: rather too many than too few.

    files: names of the artifacts. named_by: file name → digests that the artifact names.
    """
    by_digest: dict[str, list[str]] = {}
    for name in files:
        by_digest.setdefault(name.partition(".")[0], []).append(name)
    found: set[str] = set()
    waiting = set(_DIGEST.findall(json.dumps([record["payload"] for record in records])))
    while waiting:
        digest = waiting.pop()
        found.add(digest)
        for name in by_digest.get(digest, ()):
            waiting.update(set(named_by(name)) - found)
    return found


def digests_in(name: str, data: bytes) -> set[str]:
    """Digests that artifact file ``name`` names. Raises InvalidBundle unless its content is what its name says."""
    if not name.endswith(".npz"):
        verify_artifact(name, data)
        return set()
    structure, _ = flatten(decode(data, expect=name.partition(".")[0], name=f"{ARTIFACTS}/{name}"))
    return set(_DIGEST.findall(json.dumps(structure)))
