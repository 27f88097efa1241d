"""Steps and walks of a session whose robot others described; those of ATHLETE's build have plans and walks."""

from footfall.core.errors import InvalidInput
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.route.problem import RouteResult, RouteSettings, settings_by_leg
from footfall.planning.walk.problem import WalkGoal
from footfall.robot.legged.groups import longest_leg
from footfall.session.choosing.choices import PageChoices
from footfall.session.core import SessionCore
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import DescribedStepRequest, DescribedWalkRequest
from footfall.session.products.kinds import DESCRIBED_STEP, DESCRIBED_WALK
from footfall.session.products.stances import Stances


class DescribedPlans:
    """What is planned for them; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore, choices: PageChoices, stances: Stances) -> None:
        self._core, self._choices, self._stances = core, choices, stances

    def step(self, leg: int, target: tuple[float, float] | None = None, settings: LeggedSettings | None = None) -> Job:
        """Plan a step to ``target`` (x, y) [m]; without one, to the chosen footfall. Raises Conflict, InvalidInput."""
        self._require_described("plans")
        self._core.require_leg(leg)
        chosen = self._choices.footfall_for(leg, target)
        request = DescribedStepRequest(chosen, settings or LeggedSettings())
        return self._stances.ask(DESCRIBED_STEP, request, leg=leg)

    def walk(self, goal: WalkGoal, settings: LeggedSettings | None = None, route: str | None = None) -> Job:
        """Plan a walk to a goal from the state that is planned from.

        route: digest of the one along which it goes; None: straight. Raises Conflict, InvalidInput, NotFound.
        """
        self._require_described("walks")
        request = DescribedWalkRequest(goal, settings or LeggedSettings())
        if route is None:
            return self._stances.ask(DESCRIBED_WALK, request)
        if self._core.typed(RouteResult, route).plan is None:
            raise InvalidInput("that route was not found, so no walk goes along it", route=route)
        return self._stances.ask(DESCRIBED_WALK, request, also={"route": route})

    def route_settings(self) -> RouteSettings:
        """Settings of routes as delivered, for the size of the session's robot."""
        about = self._core.described
        return RouteSettings() if about is None else settings_by_leg(longest_leg(about.model))

    def _require_described(self, instead: str) -> None:
        if self._core.described is None:
            raise InvalidInput(f"the session's robot is of ATHLETE's build: order {instead}, without described")
