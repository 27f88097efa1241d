"""How each piece of a walk in a closed loop is gone: chosen, planned, and planned otherwise where a gait is refused."""

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from footfall.io.policies import shipped_policy
from footfall.planning.choice.actions import WALK as PLANNED
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.onward import PLANNER, TABLE, require_chooser, way_of
from footfall.planning.choice.state import Features
from footfall.planning.gait.problem import WAVE
from footfall.planning.walk.problem import WalkGoal, WalkResult, WalkSettings
from footfall.session.core import present
from footfall.session.jobs.job import Job
from footfall.session.loop_settings import LoopSettings
from footfall.telemetry.state import RobotState

if TYPE_CHECKING:
    from footfall.planning.choice.ground_layers import GroundLayers
    from footfall.session.parts import SessionParts

AGAIN = "the plan before could not be gone on with from here"


@dataclass(frozen=True)
class GaitRefused:
    """The check that ended a gait. step: number of its foot move, counted from 1; leg: whose check it is; lacks: by how
    much it fails, in ``unit``. None where the gait was refused as a whole, or has no such; reason: for a person.
    """

    gait: str
    reason: str
    step: int | None = None
    leg: int | None = None
    check: str = ""
    lacks: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class WayChosen:
    """How a piece is gone. action: one of COMMANDED; by: one of CHOOSERS; why: what it chose first, and why. refused:
    that, where it was a gait that does not hold. planners: that were asked, in order. walk: digest of what came of it;
    found: whether there is one; foot_moves: its own; motion: how long it takes as planned [s], None where there is
    none. table: digest of the table.
    """

    action: str
    by: str
    why: str
    refused: GaitRefused | None
    planners: tuple[str, ...]
    walk: str
    found: bool
    foot_moves: int
    motion: float | None
    table: str | None

    @property
    def as_dict(self) -> dict[str, Any]:
        """Plain JSON, as the log has it."""
        return {**asdict(self), "planners": list(self.planners)}


class WaysOn:
    """latest: what was chosen last, None before the first; planners: how often each was asked.

    Raises InvalidInput where there is no such chooser, or no table for it that fits the robot.
    """

    def __init__(
        self,
        live: "SessionParts",
        settings: LoopSettings,
        finish: Callable[[Job, str], str],
        at_rest: Callable[[], RobotState],
    ) -> None:
        policy = (settings.policy or shipped_policy(live.robot_digest)) if settings.choose_by == TABLE else None
        require_chooser(settings.choose_by, policy, live.robot_digest)
        self._live, self._settings, self._finish, self._at_rest = live, settings, finish, at_rest
        self._policy = policy
        self._choice = ChoiceSettings() if self._policy is None else self._policy.settings
        self._current = PLANNED
        self._ground: tuple[str, GroundLayers] | None = None
        self.latest: WayChosen | None = None
        self.planners: Counter[str] = Counter()

    @property
    def farthest(self) -> float:
        """How far ahead is planned at once [m]: a table was learned of pieces of its own length."""
        farthest = self._settings.farthest
        return farthest if self._policy is None else min(farthest, self._choice.ahead)

    def plan(self, goal: WalkGoal, asked: WalkSettings, again: bool) -> tuple[str, WalkResult]:
        """The walk to the end of a piece, by its digest and as it is. again: nothing was gone of the plan before, which
        no gait is tried after."""
        by, refused = self._settings.choose_by, None
        action, why = PLANNED, AGAIN
        if by == PLANNER or not again:
            action, why = way_of(by, self._policy, lambda: self._seen(goal))
        walk, found = self._planned(action, goal, asked)
        planners = (action,)
        if action == WAVE and found.plan is None:
            refused, action = _refused(found), PLANNED
            walk, found = self._planned(action, goal, asked)
            planners = (WAVE, action)
        self.latest = WayChosen(action, by, why, refused, planners, walk, *self._cost(found), self._table)
        self._live.record_way(self.latest.as_dict)
        if found.plan is not None:
            self._current = action
        return walk, found

    @property
    def latest_answer(self) -> dict[str, Any] | None:
        """As :attr:`latest`, plain JSON."""
        return None if self.latest is None else self.latest.as_dict

    def _planned(self, action: str, goal: WalkGoal, asked: WalkSettings) -> tuple[str, WalkResult]:
        self.planners[action] += 1
        gait = replace(self._choice.gaits, gait=WAVE) if action == WAVE else None
        walk = self._finish(self._live.walks.plan(goal, asked, gait=gait), "the walk that is planned")
        return walk, self._live.typed(WalkResult, walk)

    def _seen(self, goal: WalkGoal) -> Features:
        """What the table chooses by: the ground to the end of the piece."""
        from footfall.planning.choice.ground_layers import features_at, ground_of
        from footfall.terrain.dem import Dem

        dem = self._live.typed(Dem, present(self._live.state.dem, "there is no terrain any more"))
        if self._ground is None or self._ground[0] != dem.digest:
            self._ground = dem.digest, ground_of(self._live.robot, dem)
        return features_at(self._ground[1], self._at_rest().T_site_base, np.array([goal.x, goal.y]), self._current)

    def _cost(self, found: WalkResult) -> tuple[bool, int, float | None]:
        from footfall.planning.choice.seconds import seconds_of

        if found.plan is None:
            return False, 0, None
        return True, found.plan.foot_moves, seconds_of(self._live.robot, found.plan, self._choice)

    @property
    def _table(self) -> str | None:
        """Digest of the table, kept with the session."""
        return None if self._policy is None else self._live.put(self._policy)


def _refused(found: WalkResult) -> GaitRefused:
    if not found.blocked:
        return GaitRefused(WAVE, found.reason)
    one = found.blocked[0]
    step = None if one.move is None else one.move + 1
    lacks = one.lacks if one.lacks is not None and isfinite(one.lacks) else None
    return GaitRefused(WAVE, found.reason, step, one.leg, one.check_name, lacks, one.unit)
