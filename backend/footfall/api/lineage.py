"""Which sequence an address means. A sequence keeps its id over edits; every version has its digest."""

from dataclasses import dataclass

from footfall.api.access import current_session
from footfall.core.errors import NotFound
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions

_ROOT_LENGTH = 12


@dataclass(frozen=True)
class Lineage:
    """A session's sequence: root is the digest it was made with, head the newest version."""

    live: LiveSession
    root: str
    head: str

    @property
    def id(self) -> str:
        return f"{self.live.id}.{self.root[:_ROOT_LENGTH]}"


def lineage_of(live: LiveSession) -> Lineage | None:
    """The session's sequence, or None."""
    state = live.state
    if state.sequence is None:
        return None
    return Lineage(live, (*state.sequence_history, state.sequence)[0], state.sequence)


def find(sessions: Sessions, address: str, look: bool = False) -> tuple[Lineage, str]:
    """The sequence that ``current``, an id or a digest means, and the digest of the version.

    look: to read it only; no session is opened for it.

    A digest is looked for in the current session first, then in the other open ones.
    """
    if address == "current":
        lineage = head_of(current_session(sessions))
        return lineage, lineage.head
    session, dot, root = address.rpartition(".")
    if dot:
        lineage = head_of(sessions.look(session) if look else sessions.get(session))
        if lineage.root[:_ROOT_LENGTH] != root:
            raise NotFound(f"session {session} has another sequence by now: {lineage.id}", current=lineage.id)
        return lineage, lineage.head
    for live in sessions.opened():
        lineage = lineage_of(live)
        if lineage is not None and live.has(address):
            return lineage, address
    raise NotFound(f"no open session has the sequence {address}")


def made_in(live: LiveSession, digest: str) -> Lineage:
    """The sequence that a version is of which was made just now, whether or not the session has another by now."""
    state = live.state
    versions = (*state.sequence_history, state.sequence or digest)
    return Lineage(live, versions[0] if digest in versions else digest, versions[-1])


def head_of(live: LiveSession) -> Lineage:
    """The session's sequence. Raises NotFound where it has none."""
    lineage = lineage_of(live)
    if lineage is None:
        raise NotFound("the session has no sequence yet; make one from a plan")
    return lineage
