"""What drawings read of a session: its products as values, how the rover stands, what the ghost plays."""

from typing import TypeVar

from footfall.core.value import Value
from footfall.planning.gait.problem import GaitResult
from footfall.planning.legged.problem import LeggedPlan, LeggedResult
from footfall.planning.motion import Motion
from footfall.planning.step.problem import Footfall, PlanResult, StepPlan
from footfall.planning.walk.problem import WalkResult
from footfall.session.answers.choices import FootfallAnswer
from footfall.session.jobs.requests import DescribedStepRequest
from footfall.session.live import LiveSession
from footfall.session.products.kinds import DESCRIBED_STEP, DESCRIBED_WALK, GAIT, WALK
from footfall.telemetry.state import RobotState
from footfall_ui.scene.ghost import motion_of

_V = TypeVar("_V", bound=Value)


def read(live: LiveSession, digest: str, kind: type[_V]) -> _V:
    """The product of that digest. Raises TypeError where it is of another class."""
    found = live.get(digest)
    if not isinstance(found, kind):
        raise TypeError(f"{digest} is a {type(found).__name__}, not a {kind.__name__}")
    return found


def rover_state(live: LiveSession) -> RobotState | None:
    """What the rover says of itself; before it says anything, what is planned from."""
    if live.rover.frame is not None:
        return live.rover.frame.state
    return None if live.state.state is None else read(live, live.state.state, RobotState)


def played(live: LiveSession) -> Motion | None:
    """What the ghost plays."""
    return None if live.review.played is None else motion_of(live.get(live.review.played))


def step_plan(live: LiveSession) -> StepPlan | LeggedPlan | None:
    """The step that was planned last; of a robot that others described as long as it stands so, on that ground."""
    if live.state.plan is not None:
        return read(live, live.state.plan, PlanResult).plan
    described = live.state.newest(DESCRIBED_STEP)
    if described is None or not live.fits.of(described).fits:
        return None
    return read(live, described, LeggedResult).plan


def walk_here(live: LiveSession) -> WalkResult | GaitResult | LeggedResult | None:
    """The walk or gait that was planned last; None where the ground that it looked at is otherwise: its footfalls would
    lie under that, or in the air.
    """
    for event in reversed(live.events()):
        if event.type == "product" and event.payload["kind"] in (WALK.name, GAIT.name, DESCRIBED_WALK.name):
            digest = event.payload["digest"]
            found = live.get(digest)
            if isinstance(found, (WalkResult, GaitResult, LeggedResult)) and live.fits.ground_holds(digest):
                return found
            return None
    return None


def accepted(live: LiveSession, chosen: Footfall, answer: FootfallAnswer) -> bool | None:
    """What the plan for this footfall says; without one, what the maps say."""
    if live.state.plan is not None:
        result = read(live, live.state.plan, PlanResult)
        if result.footfall.digest == chosen.digest and result.provenance.parents["dem"] == live.state.dem:
            return result.plan is not None
    described = live.state.newest(DESCRIBED_STEP)
    if described is not None and live.fits.of(described).fits:
        request = live.state.products[described].settings
        if request is not None and read(live, request, DescribedStepRequest).footfall.digest == chosen.digest:
            return read(live, described, LeggedResult).plan is not None
    return answer["acceptable"]
