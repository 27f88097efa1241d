"""The one table of product kinds: what a session can make, of what, how, and what becomes of it.

Submitting, recording, folding, comparing, storing and serving read this table; nothing else compares names of kinds.
A new kind is one entry here, its request in :mod:`footfall.session.jobs.requests`, its recipe, and, where it has an
address, one entry in :mod:`footfall.api.kinds`. The table loads no library: whoever opens a session reads it.
"""

from footfall.session.products.product_kind import COMMANDED as COMMANDED
from footfall.session.products.product_kind import FILE as FILE
from footfall.session.products.product_kind import GROUND as GROUND
from footfall.session.products.product_kind import Becomes as Becomes
from footfall.session.products.product_kind import Kind as Kind
from footfall.session.products.product_kind import LooksAt as LooksAt

KINDS: dict[str, Kind] = {}
"""Name → kind. Answers list kinds in this order."""


def entered(kind: Kind) -> Kind:
    """Enter a kind into the table; returns it."""
    KINDS[kind.name] = kind
    return kind


_RECIPES = "footfall.session.jobs.product_recipes"
_DESCRIBED = "footfall.session.jobs.described_recipes"
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
        for_described=True,
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
        for_described=True,
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
        says_status=True,
        offered="the step",
        looks_at=LooksAt.LEG,
        plays="step",
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
QUEUE = entered(
    Kind(
        name="queue",
        makes="QueueResult",
        request=None,
        needs=(*GROUND, "plan"),
        recipe=f"{_RECIPES}:queue",
        loads="footfall.planning.queue.join",
        becomes=Becomes.QUEUE,
        given_as="plan",
        from_the_rover=True,
        watched=True,
        executed_by="held_queue",
        says_status=True,
        offered="the queue",
    )
)
HELD_QUEUE = entered(
    Kind(
        name="held_queue",
        makes="WalkExecutionResult",
        request="ExecutionRequest",
        needs=(*GROUND, "plan"),
        recipe=f"{_RECIPES}:held_queue",
        loads="footfall.planning.walk_execution.queue_plan",
        given_as="execution",
        from_the_rover=True,
        watched=True,
        says_status=True,
        offered="the queue",
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
        says_status=True,
        looks_at=LooksAt.WAY,
        plays="walk",
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
        for_described=True,
    )
)
DESCRIBED_MAPS = entered(
    Kind(
        name="described_maps",
        makes="MapStack",
        request="DescribedMapRequest",
        needs=GROUND,
        recipe=f"{_DESCRIBED}:maps",
        loads="footfall.planning.legged.leg_maps",
        becomes=Becomes.MAPS,
        for_cells=True,
        per_leg=True,
        for_described=True,
    )
)
DESCRIBED_STEP = entered(
    Kind(
        name="described_step",
        makes="LeggedResult",
        request="DescribedStepRequest",
        needs=GROUND,
        recipe=f"{_DESCRIBED}:step",
        loads="footfall.planning.legged.step",
        given_as="plan",
        watched=True,
        says_status=True,
        for_described=True,
        offered="the step",
        plays="step",
    )
)
DESCRIBED_WALK = entered(
    Kind(
        name="described_walk",
        makes="LeggedResult",
        request="DescribedWalkRequest",
        needs=GROUND,
        recipe=f"{_DESCRIBED}:walk",
        loads="footfall.planning.legged.walk",
        given_as="plan",
        watched=True,
        says_status=True,
        for_described=True,
        offered="the walk",
        plays="walk",
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
        for_described=True,
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
        for_described=True,
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
        for_described=True,
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
        for_described=True,
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
