"""The queue of steps and moves of the chassis: entries are taken from its end. They join it: see footfall.api.kinds."""

from footfall.api.access import OneSession
from footfall.api.bodies.queue_schemas import QueueShortening
from footfall.api.routing import Routes
from footfall.session.answers.queues import QueueAnswer

router = Routes(tags=["plans"])


@router.put("/sessions/{session}/queues/current")
def shorten_queue(live: OneSession, order: QueueShortening) -> QueueAnswer | None:
    """Take entries from the end of the queue; what is left of it, null where nothing is. Can be undone.

    Where it was planned from its end, it is planned from the end of what is left then.
    """
    live.queues.shorten(order.to)
    return live.queues.answer()
