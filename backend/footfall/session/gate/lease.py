"""The conn: the lease of the one who may move the rover.

Whoever holds it holds it under a number that counts up with every holder and never comes again (a fencing number: what
was armed under an older one sends nothing). The holder renews it; it runs out by itself. Pure: every act gives the next
conn and what was done, ``now`` is a clock that never jumps [s].
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

from footfall.core.errors import CommandRefused
from footfall.session.access.identity import Identity, Role
from footfall.session.answers.commands import ConnAnswer

CONN_FOR = 90.0
"""A conn that is not renewed runs out after this [s]: a browser wakes a page that nobody looks at once a minute."""
ANSWER_WITHIN = 20.0
"""A request for the conn that its holder has not answered after this is granted [s]."""


@dataclass(frozen=True)
class Request:
    """Somebody asks the holder for the conn. at: since when."""

    by: Identity
    at: float


@dataclass(frozen=True)
class Conn:
    """number: of the latest holder, 0 before the first. renewed: when the holder was last heard."""

    number: int = 0
    holder: Identity | None = None
    renewed: float = 0.0
    request: Request | None = None

    def left(self, now: float) -> float | None:
        """Seconds until it runs out; None where it does not: who holds it in this process ends with the gate."""
        if self.holder is None or not self.holder.client:
            return None
        return self.renewed + CONN_FOR - now

    def held_by(self, who: Identity) -> bool:
        """Whether ``who`` holds it; ask after :func:`passed`."""
        return self.holder is not None and self.holder.is_same(who)

    def as_dict(self, now: float) -> ConnAnswer:
        """Plain JSON for the interface."""
        conn, _ = passed(self, now)
        request = conn.request
        return {
            "number": conn.number,
            "holder": None if conn.holder is None else conn.holder.as_dict(),
            "expires_in": conn.left(now),
            "request": None
            if request is None
            else {"by": request.by.as_dict(), "granted_in": request.at + ANSWER_WITHIN - now},
        }


class Done(NamedTuple):
    """What became of the conn. act: what was done; by: by whom, None: time; number, holder: after it."""

    act: str
    by: Identity | None
    number: int
    holder: Identity | None


Step = tuple[Conn, tuple[Done, ...]]


def passed(conn: Conn, now: float) -> Step:
    """What time alone does: a request that waited long enough is granted, a lease that was not renewed runs out."""
    request, left = conn.request, conn.left(now)
    ran_out = left is not None and left <= 0
    if request is not None and (ran_out or now - request.at >= ANSWER_WITHIN):
        return _hand(conn, request.by, now, "expired" if ran_out else "unanswered", None)
    if ran_out:
        gone = Conn(conn.number)
        return gone, (Done("expired", None, gone.number, None),)
    return conn, ()


def take(conn: Conn, who: Identity, now: float) -> Step:
    """Take the conn that nobody holds, or renew one's own. Raises CommandRefused where another holds it."""
    require_commander(who)
    conn, done = passed(conn, now)
    if conn.holder is None:
        conn, taken = _hand(conn, who, now, "taken", who)
        return conn, done + taken
    if not conn.held_by(who):
        raise refusal(conn)
    return replace(conn, holder=who, renewed=now), done


def renew(conn: Conn, who: Identity, now: float) -> Step:
    """The heartbeat of the holder. Raises CommandRefused for anybody else."""
    conn, done = passed(conn, now)
    return replace(require_holder(conn, who), renewed=now), done


def release(conn: Conn, who: Identity, now: float) -> Step:
    """Give the conn back: to whoever asked for it, else to nobody. Raises CommandRefused unless ``who`` holds it."""
    conn, done = passed(conn, now)
    require_holder(conn, who)
    if conn.request is not None:
        conn, handed = _hand(conn, conn.request.by, now, "released", who)
        return conn, done + handed
    conn = Conn(conn.number)
    return conn, (*done, Done("released", who, conn.number, None))


def ask(conn: Conn, who: Identity, now: float) -> Step:
    """Ask the holder for the conn; where nobody holds it, take it.

    Raises CommandRefused where ``who`` may not hold it, or another asks already.
    """
    require_commander(who)
    conn, done = passed(conn, now)
    if conn.holder is None or conn.held_by(who):
        conn, taken = take(conn, who, now)
        return conn, done + taken
    if conn.request is not None:
        if conn.request.by.is_same(who):
            return conn, done
        raise CommandRefused(
            f"{conn.request.by.name} asks for the conn already; ask again once that is answered",
            check="conn",
            asking=conn.request.by.name,
        )
    asked = replace(conn, request=Request(who, now))
    return asked, (*done, Done("requested", who, conn.number, conn.holder))


def grant(conn: Conn, who: Identity, now: float) -> Step:
    """The holder hands the conn to whoever asks for it. Raises CommandRefused."""
    conn, done = passed(conn, now)
    conn, granted = _hand(conn, _asked(conn, who).by, now, "granted", who)
    return conn, done + granted


def deny(conn: Conn, who: Identity, now: float) -> Step:
    """The holder keeps it. Raises CommandRefused."""
    conn, done = passed(conn, now)
    _asked(conn, who)
    kept = replace(conn, request=None, renewed=now)
    return kept, (*done, Done("denied", who, kept.number, kept.holder))


def require_commander(who: Identity) -> None:
    """Raises CommandRefused unless somebody in this role may hold the conn."""
    if who.role < Role.COMMANDER:
        raise CommandRefused(
            f"{who.name} is a {who.role.value}; moving the rover takes a commander",
            check="role",
            role=who.role.value,
            needed=Role.COMMANDER.value,
        )


def require_holder(conn: Conn, who: Identity) -> Conn:
    """The conn itself. Raises CommandRefused unless ``who`` holds it; ask after :func:`passed`."""
    if not conn.held_by(who):
        raise refusal(conn)
    return conn


def refusal(conn: Conn) -> CommandRefused:
    """The error that says who holds the conn."""
    holder = conn.holder
    if holder is None:
        return CommandRefused("nobody holds the conn; take it first", check="conn", holder=None)
    where = f" at {holder.client}" if holder.client else ""
    return CommandRefused(
        f"{holder.name}{where} holds the conn; request it, or wait until it is released",
        check="conn",
        holder=holder.name,
        number=conn.number,
    )


def _asked(conn: Conn, who: Identity) -> Request:
    request = require_holder(conn, who).request
    if request is None:
        raise CommandRefused("nobody asks for the conn", check="conn", asking=None)
    return request


def _hand(conn: Conn, to: Identity, now: float, act: str, by: Identity | None) -> Step:
    handed = Conn(conn.number + 1, to, now)
    return handed, (Done(act, by, handed.number, to),)
