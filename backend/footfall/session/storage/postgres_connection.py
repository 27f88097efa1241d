"""How FootFall connects to a PostgreSQL server, whatever for: nothing waits for a network or a server that fell silent.

A lost packet is told by nobody. TCP alone goes on sending for a quarter of an hour, and without something to send
for ever.
"""

from typing import Any

import psycopg
from psycopg import errors
from psycopg.abc import RV, PQGen
from psycopg.conninfo import conninfo_to_dict, make_conninfo

LONGEST = 20.0
"""A server that has not answered a statement after this long is given up [s]."""
BOUNDS: dict[str, str | int] = {
    "connect_timeout": 3,  # until it answers at all [s]
    "tcp_user_timeout": 10_000,  # until what was sent is received [ms]
    "keepalives": 1,
    "keepalives_idle": 5,  # nothing came for so long: is it there [s]?
    "keepalives_interval": 2,
    "keepalives_count": 3,
    "fallback_application_name": "footfall",
}
"""Parameters of libpq. What an address says itself comes before them."""


def conninfo(url: str) -> str:
    """The address with BOUNDS. Raises psycopg.ProgrammingError where it is none."""
    return make_conninfo("", **{**BOUNDS, **conninfo_to_dict(url)})


class BoundedConnection(psycopg.Connection[Any]):
    """A connection that is given up where a statement takes longer than may be waited for."""

    def wait(self, gen: PQGen[RV], interval: float = 0.1, timeout: float | None = None) -> RV:
        try:
            return super().wait(gen, interval, LONGEST if timeout is None else timeout)
        except errors._WaitTimeout as err:
            self.pgconn.finish()  # what it was to say would be taken for the answer to the next question
            raise psycopg.OperationalError(f"no answer within {LONGEST:g} s") from err
