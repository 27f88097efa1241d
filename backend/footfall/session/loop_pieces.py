"""The pieces that a walk in a closed loop is planned in: where the next one goes, along which route, and its walk."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from footfall.planning.answers import Status
from footfall.planning.route.kept_off import kept_off
from footfall.planning.route.problem import RouteResult, RouteSettings
from footfall.planning.walk.problem import Place, WalkGoal, WalkPlan, WalkResult, WalkSettings
from footfall.planning.walk_execution.decision import SoFar
from footfall.planning.walk_execution.pins_left import pins_left
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import RouteRequest
from footfall.session.loop_settings import LoopSettings
from footfall.session.loop_ways import WaysOn
from footfall.session.products.kinds import ROUTE
from footfall.telemetry.state import RobotState

if TYPE_CHECKING:
    from footfall.planning.execution.execution_settings import ExecutionSettings
    from footfall.planning.walk_execution.stage import Stage
    from footfall.session.parts import SessionParts
    from footfall.terrain.dem import Dem


SWAYS = 0.3
"""The chassis may go so far beside its straight way to the end of a piece, also where it is to keep off [m]."""


class Pieces:
    """Plans one piece after the other. walk: digest of the latest; None before the first.

    ways: how they are gone. finish: waits for a job, told what it makes, and gives its result's digest; at_rest: how
    the rover stands, waited for where it does not rest yet.
    """

    def __init__(
        self,
        live: "SessionParts",
        goal: WalkGoal,
        settings: LoopSettings,
        finish: Callable[[Job, str], str],
        at_rest: Callable[[], RobotState],
    ) -> None:
        self._live, self._goal, self._settings = live, goal, settings
        self._finish, self._at_rest = finish, at_rest
        self.walk: str | None = None
        self.ways = WaysOn(live, settings, finish, at_rest)
        self._route: RouteResult | None = None

    def plan(self, so_far: SoFar) -> tuple[WalkPlan | None, SoFar]:
        """The walk of the next piece, None where there is none, and what was done then."""
        from footfall.planning.walk_execution.firmer import firmer
        from footfall.planning.walk_execution.stage import Stage, came_nearest, next_goal

        so_far = replace(so_far, anew=so_far.anew + 1)
        # a plan that was found was not too far, but not firm enough
        not_found = max(so_far.anew - 1 - so_far.declined, 0)
        dem, live, farthest = newest_dem(self._live), self._live, self.ways.farthest / 2**not_found
        asked = firmer(self._with_no_foot_where_it_keeps_off(), so_far.declined, so_far.too_near)
        asked = replace(asked, seed=asked.seed + so_far.anew - 1, pinned=so_far.unmet)
        stage: Stage | str = "no ground is known yet" if so_far.nearest is None else Stage(so_far.nearest, asked)
        live.stances.freeze()
        if so_far.nearest is None and dem is not None:
            route = self._settings.route
            routed = None if route is None else self._routed
            stage = next_goal(live.robot, dem, self._at_rest(), self._goal, farthest, asked, routed, route)
        if isinstance(stage, str):
            return None, replace(so_far, refused=stage)
        self.walk, found = self.ways.plan(stage.goal, self._settings_of(stage), so_far.anew > 1)
        refused = f"no walk is found: {found.reason}" if found.plan is None else self._trespass(found.plan)
        plan = None if refused else found.plan
        # where it has less clearance now than it is to keep, no walk begins
        near = so_far.too_near if found.plan is not None else 0
        return plan, replace(so_far, refused=refused, too_near=near, nearest=came_nearest(found), short=stage.short)

    @property
    def commanded(self) -> "ExecutionSettings":
        """How its foot moves are commanded: on the ground that was asked for, however firmly a piece is planned."""
        from footfall.planning.compliance.compliance_settings import ComplianceSettings
        from footfall.planning.execution.execution_settings import ExecutionSettings

        compliance = ComplianceSettings(balance=self._settings.walk.balance)
        return self._live.executions.settings_in_force(ExecutionSettings(compliance=compliance))

    def unmet(self, pinned: tuple[Place, ...], done: int) -> tuple[Place, ...]:
        """Those of some pinned places that the first ``done`` foot moves of the piece put no foot on."""
        plan = None if self.walk is None else self._live.typed(WalkResult, self.walk).plan
        return pinned if plan is None else pins_left(plan, pinned, done)

    def _with_no_foot_where_it_keeps_off(self) -> WalkSettings:
        """How walks are planned, with no foot on the no-go areas of the route."""
        walk, route = self._settings.walk, self._settings.route
        said = {(one.x, one.y, one.radius) for one in walk.forbidden if one.leg is None}
        areas = () if route is None else tuple((one.x, one.y, one.radius) for one in route.no_go)
        return replace(walk, forbidden=(*walk.forbidden, *(Place(*one) for one in areas if one not in said)))

    def _trespass(self, plan: WalkPlan) -> str:
        """How far the chassis would go where the route keeps it off, for a person; "" where it keeps off."""
        if self._settings.route is None:
            return ""
        deep = kept_off(plan.Ts_site_base[:, :2, 3], self._settings.route)
        allowed = deep[0] + SWAYS
        if deep.max() <= allowed:
            return ""
        x, y = plan.Ts_site_base[int(deep.argmax()), :2, 3]
        return (
            f"the walk that is found leads through a no-go area or out of the corridors: at ({x:z.2f}, {y:z.2f}) by "
            f"{deep.max():z.2f} m, {allowed:z.2f} m are allowed"
        )

    def _settings_of(self, stage: "Stage") -> WalkSettings:
        """How a piece is planned: one that ends before the goal has only pinned places that it may come to."""
        from footfall.planning.walk.footprint import footprint

        asked = stage.settings
        if stage.goal is self._goal or not asked.pinned:
            return asked
        x, y = (float(at) for at in self._at_rest().T_site_base[:2, 3])
        feet = footprint(self._live.robot, asked.height).feet
        farthest = math.hypot(stage.goal.x - x, stage.goal.y - y) + float(np.hypot(*feet.T).max())
        return replace(asked, pinned=tuple(pin for pin in asked.pinned if math.hypot(pin.x - x, pin.y - y) <= farthest))

    def _routed(self, place: tuple[float, float]) -> RouteResult:
        """The route to a place on the newest map, or the one before where none begins so near to blocked ground."""
        request = RouteRequest(place, self._settings.route or RouteSettings())
        found = self._live.typed(RouteResult, self._finish(self._live.stances.ask(ROUTE, request), "a route"))
        if found.status is Status.START_INVALID and self._route is not None:
            return self._route
        self._route = found if found.plan is not None else self._route
        return found


def newest_dem(live: "SessionParts") -> "Dem | None":
    """The ground as it is known now; None where none is."""
    from footfall.terrain.dem import Dem

    digest = live.state.dem
    found = None if digest is None else live.get(digest)
    return found if isinstance(found, Dem) else None
