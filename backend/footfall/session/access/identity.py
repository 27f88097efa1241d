"""Who asks: the identity that every request carries, and the roles that it may have."""

from enum import Enum
from functools import total_ordering

from footfall.core.value import Value, value, value_enum
from footfall.session.answers.commands import HolderAnswer


@value_enum
@total_ordering
class Role(Enum):
    """What somebody may do; ordered: each role may do all that the lesser ones may."""

    VIEWER = "viewer"
    PLANNER = "planner"
    COMMANDER = "commander"
    ADMIN = "admin"

    def __lt__(self, other: "Role") -> bool:
        order = list(Role)
        return order.index(self) < order.index(other)


@value
class Identity(Value):
    """Who asks for something. name: of the account; client: where from, an address as text, "" in this process.

    page: which of somebody's pages or programs asks, as it calls itself; "" for one that does not say.
    """

    name: str
    role: Role
    client: str = ""
    page: str = ""

    def is_same(self, other: "Identity") -> bool:
        """Whether that is the same page or program of the same account, whatever its address is by now."""
        if self.name != other.name or self.page != other.page:
            return False
        return bool(self.page) or self.client == other.client

    @property
    def seat(self) -> str:
        """Which page of whom it is; "" for who names no page. No page's name has a space."""
        return f"{self.name} {self.page}" if self.page else ""

    def as_dict(self) -> HolderAnswer:
        """Plain JSON: who, in which role, from where."""
        return {"name": self.name, "role": self.role.value, "client": self.client, "page": self.page}


LOCAL = Identity("local", Role.ADMIN)
"""Everybody on a server without accounts, which listens on loopback only; also a script that holds the session."""
