"""What a kind of product is; the table of them is :mod:`footfall.session.products.kinds`."""

from dataclasses import dataclass
from enum import Enum

FILE = "file"
"""What a kind makes whose product is the bytes of a file, no value."""

GROUND = ("robot", "dem", "state")
"""Parents of what is computed for a rover on a terrain."""

COMMANDED = ("plan", "execution")
"""Parents that commands are made of: one of them."""


class Becomes(Enum):
    """What a new product becomes in the session (:mod:`footfall.session.log.fold` does it)."""

    LATEST = "the latest of its kind"
    TERRAIN = "the terrain; undo goes back to the one before"
    MAPS = "the maps of its leg"
    PLAN = "the plan, or an alternative to it"
    EXECUTION = "the execution of the plan"
    AS_IF = "the state that is planned from, in a what-if"
    AS_IF_AFTER = "the state that is planned from, after what is planned"
    QUEUE = "the queue, where its answer is one"
    COMMANDS = "the commands, not edited yet"
    EDITED = "the commands; undo goes back to those before"
    READ_IN = "as EDITED; where there were no commands, nothing is there to go back to"
    EXPORT = "one more export"


class LooksAt(Enum):
    """Of which ground a product is; where that is as it was, newer maps leave the product as it is."""

    MAP = "the map itself: of another it is none, as the command gate has it"
    LEG = "where its leg could touch the ground, and under the wheels"
    WAY = "where the legs could touch the ground on the chassis' way"


@dataclass(frozen=True, eq=False)
class Kind:
    """One kind of product.

    name: in events, jobs and answers. makes: class of its value, or FILE; request: class of its settings, None: it has
    none; both as files call them. needs: parents that none is without. recipe: ``module:function`` that makes it.
    loads: module that the recipe needs, loaded before the first job waits for it. becomes: what of the session.

    given_as: name under which other products have it as a parent, "" where none has. from_the_rover: it counts from how
    the rover stands, also in a what-if. for_cells: it is judged cell by cell: it holds while nothing moved by more than
    a measurement may be off. looks_at: which ground may not change. of_chassis: how the joints are turned, and what the
    wheels bear, is nothing to it. watched: the session tells whether the latest is still of how things are now.
    per_leg: newer ones cancel those of the same leg on their way, the same again is taken as it is. of_this_state:
    nothing becomes of it where another state is planned from by then.

    for_described: it is made for robots that others described, too; else their sessions refuse it.

    executed_by: kind that makes set points of it for a rover that sags, "" where none does. says_status: status and
    reason of its answer are in its event. offered: what commands of it are called where they are offered, "" where they
    are not. plays: what a ghost plays it as, step or walk; "" where it plays none.
    """

    name: str
    makes: str
    request: str | None
    needs: tuple[str, ...]
    recipe: str
    loads: str = ""
    becomes: Becomes = Becomes.LATEST
    given_as: str = ""
    from_the_rover: bool = False
    for_cells: bool = False
    looks_at: LooksAt = LooksAt.MAP
    of_chassis: bool = False
    watched: bool = False
    per_leg: bool = False
    of_this_state: bool = False
    for_described: bool = False
    executed_by: str = ""
    says_status: bool = False
    offered: str = ""
    plays: str = ""

    @property
    def is_commands(self) -> bool:
        """Whether it becomes the session's commands."""
        return self.given_as == "sequence"

    @property
    def is_answer(self) -> bool:
        """Whether the session names the latest beside what it is about, and tells whether it still fits."""
        return self.becomes is Becomes.LATEST and self.watched
