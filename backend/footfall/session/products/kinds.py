"""The one table of product kinds: what a session can make, of what, how, and what becomes of it.

Submitting, recording, folding, comparing, storing and serving read this table; nothing else compares names of kinds.
A new kind is one entry here, its request in :mod:`footfall.session.jobs.requests`, its recipe, and, where it has an
address, one entry in :mod:`footfall.api.kinds`. The table loads no library: whoever opens a session reads it.
"""

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

    executed_by: kind that makes set points of it for a rover that sags, "" where none does. searches: it may end by its
    time limit, and need not come out the same again. says_status: status and reason of its answer are in its event.
    offered: what commands of it are called where they are offered, "" where they are not.
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
    executed_by: str = ""
    searches: bool = False
    says_status: bool = False
    offered: str = ""

    @property
    def is_commands(self) -> bool:
        """Whether it becomes the session's commands."""
        return self.given_as == "sequence"

    @property
    def is_answer(self) -> bool:
        """Whether the session names the latest beside what it is about, and tells whether it still fits."""
        return self.becomes is Becomes.LATEST and self.watched


KINDS: dict[str, Kind] = {}
"""Name → kind. Answers list kinds in this order."""


def entered(kind: Kind) -> Kind:
    """Enter a kind into the table; returns it."""
    KINDS[kind.name] = kind
    return kind


_RECIPES = "footfall.session.jobs.product_recipes"

TERRAIN = entered(
    Kind(
        name="terrain",
        makes="Dem",
        request="TerrainSettings",
        needs=("robot", "snapshot"),
        recipe=f"{_RECIPES}:terrain",
        loads="footfall.terrain.photographs",
        becomes=Becomes.TERRAIN,
        given_as="dem",
    )
)
PHOTOGRAPHS = entered(
    Kind(
        name="photographs",
        makes="Dem",
        request="TerrainSettings",
        needs=("photographs",),
        recipe=f"{_RECIPES}:photographs",
        loads="footfall.terrain.photographs",
        becomes=Becomes.TERRAIN,
        given_as="dem",
    )
)
BLEND = entered(
    Kind(
        name="blend",
        makes="Dem",
        request="BlendSettings",
        needs=("dem", "external"),
        recipe=f"{_RECIPES}:blend",
        loads="footfall.terrain.fusion.blend",
        becomes=Becomes.TERRAIN,
        given_as="dem",
    )
)
CLEAR = entered(
    Kind(
        name="clear",
        makes="Dem",
        request="Area",
        needs=("dem",),
        recipe=f"{_RECIPES}:clear",
        loads="footfall.terrain.fusion.clear",
        becomes=Becomes.TERRAIN,
        given_as="dem",
    )
)
MAPS = entered(
    Kind(
        name="maps",
        makes="MapStack",
        request="MapRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:maps",
        loads="footfall.planning.step.leg_maps",
        becomes=Becomes.MAPS,
        for_cells=True,
        per_leg=True,
        looks_at=LooksAt.LEG,
    )
)
PLAN = entered(
    Kind(
        name="plan",
        makes="PlanResult",
        request="StepRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:plan",
        loads="footfall.planning.step.plan",
        becomes=Becomes.PLAN,
        given_as="plan",
        watched=True,
        executed_by="execution",
        searches=True,
        says_status=True,
        offered="the step",
        looks_at=LooksAt.LEG,
    )
)
AFTER = entered(
    Kind(
        name="after",
        makes="PredictedState",
        request=None,
        needs=GROUND,
        recipe=f"{_RECIPES}:after",
        loads="footfall.planning.body.after",
        becomes=Becomes.AS_IF_AFTER,
        given_as="state",
    )
)
WHAT_IF = entered(
    Kind(
        name="what_if",
        makes="PredictedState",
        request="BodyShift",
        needs=GROUND,
        recipe=f"{_RECIPES}:what_if",
        loads="footfall.planning.body.shift",
        becomes=Becomes.AS_IF,
        given_as="state",
        from_the_rover=True,
        for_cells=True,
        of_this_state=True,
    )
)
EXECUTION = entered(
    Kind(
        name="execution",
        makes="ExecutionResult",
        request="ExecutionRequest",
        needs=(*GROUND, "plan"),
        recipe=f"{_RECIPES}:execution",
        loads="footfall.planning.execution.plan",
        becomes=Becomes.EXECUTION,
        given_as="execution",
        watched=True,
        says_status=True,
        offered="the step",
        looks_at=LooksAt.WAY,
    )
)
SHIFT = entered(
    Kind(
        name="shift",
        makes="ShiftResult",
        request="ShiftRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:shift",
        loads="footfall.planning.body.find_shift",
        given_as="plan",
        from_the_rover=True,
        watched=True,
        executed_by="held_move",
        searches=True,
        looks_at=LooksAt.WAY,
    )
)
BODY_MOVE = entered(
    Kind(
        name="body_move",
        makes="BodyMoveResult",
        request="BodyMoveRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:body_move",
        loads="footfall.planning.body.body_move",
        given_as="plan",
        from_the_rover=True,
        watched=True,
        executed_by="held_move",
        searches=True,
        offered="chassis move",
        looks_at=LooksAt.WAY,
    )
)
HELD_MOVE = entered(
    Kind(
        name="held_move",
        makes="BodyExecutionResult",
        request="ExecutionRequest",
        needs=(*GROUND, "plan"),
        recipe=f"{_RECIPES}:held_move",
        loads="footfall.planning.execution.body_plan",
        given_as="execution",
        from_the_rover=True,
        watched=True,
        offered="chassis move",
        looks_at=LooksAt.WAY,
    )
)
WALK = entered(
    Kind(
        name="walk",
        makes="WalkResult",
        request="WalkRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:walk",
        loads="footfall.planning.walk.plan",
        given_as="plan",
        watched=True,
        searches=True,
        says_status=True,
        looks_at=LooksAt.WAY,
    )
)
GAIT = entered(
    Kind(
        name="gait",
        makes="GaitResult",
        request="GaitRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:gait",
        loads="footfall.planning.gait.plan",
        watched=True,
        says_status=True,
        looks_at=LooksAt.WAY,
    )
)
ROUTE = entered(
    Kind(
        name="route",
        makes="RouteResult",
        request="RouteRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:route",
        loads="footfall.planning.route.plan",
        watched=True,
        says_status=True,
        looks_at=LooksAt.WAY,
        of_chassis=True,
    )
)
SEQUENCE = entered(
    Kind(
        name="sequence",
        makes="Sequence",
        request=None,
        needs=("robot", "dem"),
        recipe=f"{_RECIPES}:sequence",
        loads="footfall.sequence.make",
        becomes=Becomes.COMMANDS,
        given_as="sequence",
        from_the_rover=True,
        watched=True,
    )
)
FOOT_MOVES = entered(
    Kind(
        name="foot_moves",
        makes="Sequence",
        request="FootMovesRequest",
        needs=(*GROUND, "plan"),
        recipe=f"{_RECIPES}:foot_moves",
        loads="footfall.sequence.make",
        becomes=Becomes.COMMANDS,
        given_as="sequence",
        from_the_rover=True,
    )
)
OUTCOME = entered(
    Kind(
        name="outcome",
        makes="Outcome",
        request="OutcomeRequest",
        needs=(*GROUND, "sequence"),
        recipe=f"{_RECIPES}:outcome",
        loads="footfall.sequence.foretold",
    )
)
EDIT = entered(
    Kind(
        name="edit",
        makes="Sequence",
        request="Edit",
        needs=("robot", "dem", "sequence"),
        recipe=f"{_RECIPES}:edit",
        loads="footfall.sequence.edit",
        becomes=Becomes.EDITED,
        given_as="sequence",
        from_the_rover=True,
    )
)
IMPORT = entered(
    Kind(
        name="import",
        makes="Sequence",
        request="ImportRequest",
        needs=GROUND,
        recipe=f"{_RECIPES}:from_file",
        becomes=Becomes.READ_IN,
        given_as="sequence",
        from_the_rover=True,
    )
)
EXPORT = entered(
    Kind(
        name="export",
        makes=FILE,
        request="ExportRequest",
        needs=("sequence",),
        recipe=f"{_RECIPES}:export",
        loads="footfall.io.exports",
        becomes=Becomes.EXPORT,
    )
)
