"""A walk that is carried out: commands of its foot moves, how far it is, and the rest planned anew."""

from fastapi import Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.bodies.answers import JobAnswer
from footfall.api.bodies.sequence_answers import SequenceAnswer
from footfall.api.bodies.walk_schemas import FootMovesOrder
from footfall.api.execution_orders import settings_of_order
from footfall.api.routes.jobs import accepted
from footfall.api.routes.sequences import answer_with
from footfall.api.routing import Routes
from footfall.planning.walk.problem import WalkResult
from footfall.session.answers.walks import AlongWalkAnswer, WalkingAnswer
from footfall.session.products.kinds import WALK
from footfall.session.walk_along import along_walk

router = Routes(tags=["plans"])


@router.post("/sessions/{session}/walks/{digest}/sequence", status_code=201)
def command_foot_moves(live: OneSession, digest: Digest, order: FootMovesOrder, response: Response) -> SequenceAnswer:
    """Commands of some foot moves of a walk, from where the rover stands: the session's sequence.

    `way` of the answer says how they are commanded, `foot_moves` where each is predicted to end and with which torques.
    409 where the rover does not stand as the walk has it then: which joint, wheel or the chassis, by how much. 422
    where they can't be commanded so: nothing is made otherwise than was asked for.
    """
    walk, settings = None if digest == "current" else digest, settings_of_order(live, order.settings)
    digest = live.walks.command(walk, order.first, order.count, settings, as_commanded=order.as_commanded)
    return answer_with(live, digest, response)


@router.get("/sessions/{session}/walking")
def read_walking(live: OneSession) -> WalkingAnswer | None:
    """How far the latest walk is, and what is next; null without a walk that was found."""
    return live.walks.walking_answer()


@router.get("/sessions/{session}/walks/{digest}/along")
def read_along(live: OneSession, digest: Digest) -> AlongWalkAnswer:
    """What each phase of a walk leaves to spare beyond clearances, and how old the ground under its footfalls is.

    `current` names the latest walk. Of one that was not found it is told as far as it came; 409 where it came nowhere.
    """
    walk = live.state.newest(WALK) if digest == "current" else digest
    return along_walk(live, walk or digest, product(live, digest, WalkResult, walk))


@router.post("/sessions/{session}/walks/{digest}/again", status_code=202)
def replan(live: OneSession, digest: Digest, response: Response) -> JobAnswer:
    """Plan the rest of a walk from how the rover stands now, as a job: same goal, same settings.

    Pinned places that the walk's foot moves have put a foot on are left out.
    """
    return accepted(live.walks.replan(None if digest == "current" else digest), response)
