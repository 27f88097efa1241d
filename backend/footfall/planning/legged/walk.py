"""A walk of a legged robot to a goal: a wave of foot moves, before each of them the chassis goes where it must.

The wave keeps the feet a part of a stride apart from each other (McGhee & Frank, 1968). A foot move that is refused is
tried shorter, then with another leg. Where all are refused the last foot moves are taken back and made in other ways:
one at the first dead end, one more at each that follows, until the walk gets farther.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.planning.answers import Status
from footfall.planning.legged.chassis_poses import poses
from footfall.planning.legged.foot_move import FootMove, chassis_way, foot_moves, plan_of
from footfall.planning.legged.guide import GuideLine, guide_to, wave
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings, LeggedState
from footfall.planning.legged.stance import ASIDE, Ground
from footfall.planning.legged.step import (
    begun,
    not_judged,
    of_measured,
    place_refused,
    provenance,
    start_refused,
    tally_in_words,
)
from footfall.planning.legged.to_see import to_see
from footfall.planning.legged.way_round import way_round
from footfall.planning.legged.whole_check import Refusal, Tally
from footfall.planning.route.problem import Route
from footfall.planning.walk.problem import WalkGoal, goal_of
from footfall.planning.watch import time_taken
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

SHORTER = (1.0, 0.6, 0.3)
"""Shares of a stride that are tried."""
FOOTFALLS = 4
"""Places that are tried for each stride."""
BACK = 6
"""Dead ends that a walk may come to before it gets farther; at the last of them so many foot moves are taken back."""
STRAY = 0.5
"""A route may begin so far from the chassis, as a share of the longest leg."""
THIN = 0.02
"""The margin that a walk is looked for with once more, where none is found: a share of the longest leg. In physics feet
that stand come off the ground with it."""


class _Step(NamedTuple):
    """leg: that moved. s: where on the guide its foot is at ease [m]. move: how."""

    leg: int
    s: float
    move: FootMove


class _DeadEnd(NamedTuple):
    """share: of the guide that the feet have behind them on average. answer: of a walk that ends here."""

    share: float
    answer: LeggedResult

    def after(self, others: int) -> LeggedResult:
        """The answer, after so many other ways were tried, the last from as many foot moves before."""
        if not others:
            return self.answer
        back = f"{others} other ways, from up to {others} foot moves before, lead no farther"
        return replace(self.answer, reason=f"{self.answer.reason}; {back}")


class _Walk:
    """How far a walk has come: its foot moves, and for each foot the place on the guide at which it is at ease [m].

    ahead: for each foot move, and for the next one, what else may be tried in its place. unfooted: where (2,) the next
    one found no ground to stand on.
    """

    def __init__(self, ground: Ground, state: LeggedState, guide: GuideLine, goal: WalkGoal) -> None:
        self.ground, self.start, self.guide, self.goal = ground, state, guide, goal
        self.stride = 2 * ground.settings.stride * ground.ease.stroke
        self.steps: list[_Step] = []
        self.arrival: FootMove | None = None
        self.tries = Tally()
        self.unfooted: list[Array] = []
        self.ahead = [_moves(self)]

    @property
    def ways(self) -> list[FootMove]:
        return [*(one.move for one in self.steps), *([self.arrival] if self.arrival else [])]

    @property
    def state(self) -> LeggedState:
        return self.ways[-1].end if self.ways else self.start

    @property
    def on_guide(self) -> Array:
        places = np.zeros(len(self.ground.robot.legs))
        for leg, s, _ in self.steps:
            places[leg] = s
        return places

    @property
    def share(self) -> float:
        """Of the guide that the feet have behind them on average, 0…1; 0 where it has no length."""
        return float(self.on_guide.mean()) / (self.guide.length or 1.0)

    @property
    def order(self) -> list[int]:
        """Of the legs where the chassis is now."""
        part, _ = self.guide.part_at(float(self.on_guide.mean()))
        return wave(self.ground, part)

    @property
    def feet_are_there(self) -> bool:
        return bool((self.on_guide >= self.guide.length - 1e-9).all())

    def goes_on(self) -> bool:
        """Whether one more foot move is found, or the chassis' way to the goal where all feet are there."""
        if self.feet_are_there:
            self.arrival = _arrival(self)
            return self.arrival is not None
        self.tries, self.unfooted = Tally(), []
        step = next(self.ahead[-1], None)
        if step is None:
            return False
        self.steps.append(step)
        self.ahead.append(_moves(self))
        return True

    def goes_back(self, count: int) -> None:
        """Takes so many foot moves back, all where there are fewer."""
        left = max(len(self.steps) - count, 0)
        del self.steps[left:], self.ahead[left + 1 :]

    @property
    def plan(self) -> LeggedPlan | None:
        ways = self.ways
        if not ways:
            return None
        samples = [ways[0].samples[0], *(sample for way in ways for sample in way.samples[1:])]
        return plan_of(samples, [one.leg for one in self.steps], self.start, self.state)

    @property
    def tally(self) -> Tally:
        """The least margins of the whole way."""
        least = Tally()
        for way in self.ways:
            least.merge(way.tally)
        return least


def plan_walk(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    goal: WalkGoal | tuple[float, ...],
    settings: LeggedSettings | None = None,
    progress: Progress = no_progress,
    route: Route | None = None,
) -> LeggedResult:
    """Plan a walk from a state, its feet near their places at ease, until the chassis is over the goal.

    Straight, or along a route that begins where the chassis is and ends at the goal.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stands at first.
        goal: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site; without yaw the heading is kept.
        settings: with what is planned and checked; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        route: along which the chassis goes; None: straight.

    Returns:
        The answer. Of "no": its status, its reason with amounts, whether a route leads around or a thinner margin would
        do, and the part of the walk that was found.

    Raises:
        InvalidInput: the goal makes no sense, the state is of another robot, or the route leads elsewhere.
        Cancelled: ``progress`` raised it.
    """
    goal = goal_of(goal)
    settings, began = settings or LeggedSettings(), time.monotonic()
    ground = Ground(robot, dem, settings)
    between = None if route is None else between_ends(route, state, goal, STRAY * robot.length)
    result = _along(of_measured(_plan(ground, begun(ground, state), goal, progress, between), state), route)
    if result.status is Status.NO_PATH and route is None:
        around = way_round(robot, dem, state, goal)
        result = replace(result, reason=f"{result.reason}; {around}") if around else result
    left = settings.time_limit - time_taken(began)
    if result.status is not Status.NO_PATH or settings.least_margin <= THIN or left <= 0:
        return result
    thin = Ground(robot, dem, replace(settings, least_margin=THIN, time_limit=left))
    other = _plan(thin, begun(thin, state), goal, progress, between)
    return _with_thin_margin(result, settings, robot.length, other.status)


def _with_thin_margin(result: LeggedResult, settings: LeggedSettings, length: float, thin: Status) -> LeggedResult:
    """The answer of a walk that was not found, saying what came of the thin margin; nothing where time ran out."""
    kept = f"{THIN * length:z.3f} m ({THIN:.0%} of the longest leg) in place of {settings.least_margin * length:z.3f} m"
    outcomes = {
        Status.FOUND: f"with a margin of {kept} a walk is found, in which feet that stand may come off the ground",
        Status.NO_PATH: f"with a margin of {kept} none is found either",
    }
    return replace(result, reason=f"{result.reason}; {outcomes[thin]}") if thin in outcomes else result


def _along(result: LeggedResult, route: Route | None) -> LeggedResult:
    """The answer, made from a route too where there is one."""
    if route is None:
        return result
    parents = {**result.provenance.parents, "route": route.digest}
    return replace(result, provenance=replace(result.provenance, parents=parents))


def between_ends(route: Route, state: LeggedState, goal: WalkGoal, stray: float) -> Array:
    """The corners of a route.

    Args:
        route: of the chassis.
        state: how the robot stands at first.
        goal: where the chassis is to be.
        stray: how far from there the route may begin [m].

    Returns:
        (n, 2) in site [m], without both ends.

    Raises:
        InvalidInput: it begins or ends elsewhere.
    """
    here, there = state.T_site_base[:2, 3], np.array([goal.x, goal.y])
    begins, ends = (float(np.linalg.norm(one)) for one in (route.points[0] - here, route.points[-1] - there))
    if begins > stray:
        raise InvalidInput(f"the route begins {begins:z.2f} m from the chassis: plan it anew from here", away=begins)
    if ends > goal.within:
        raise InvalidInput(f"the route ends {ends:z.2f} m from the goal: plan one to it", away=ends)
    return np.asarray(route.points[1:-1], float)


def _plan(
    ground: Ground, state: LeggedState, goal: WalkGoal, progress: Progress, between: Array | None = None
) -> LeggedResult:
    refused = start_refused(ground, state) or goal_refused(ground, state, goal)
    if refused is not None:
        return refused
    walk = _Walk(ground, state, guide_to(ground, state.T_site_base, goal, between), goal)
    began, ends = time.monotonic(), 0
    farthest: _DeadEnd | None = None
    while walk.arrival is None:
        if time_taken(began) > ground.settings.time_limit:
            return _cut_short(walk, farthest)
        if walk.goes_on():
            progress(walk.share, f"{len(walk.steps)} foot moves")
            continue
        if farthest is None or walk.share > farthest.share:
            ends, farthest = 0, _dead_end(walk)
        if ends == BACK or not walk.steps:
            return farthest.after(ends)
        ends += 1
        walk.goes_back(ends)
    return _answer(walk, Status.FOUND, "", walk.plan, None)


def _dead_end(walk: _Walk) -> _DeadEnd:
    what = "the chassis can't get over the goal" if walk.feet_are_there else "no foot can go on"
    return _DeadEnd(walk.share, _not_found(walk, Status.NO_PATH, f"{what}: {tally_in_words(walk.tries)}{_seen(walk)}"))


def _seen(walk: _Walk) -> str:
    """What to do where a foot finds no ground because nobody saw it, in words; empty where that is not why."""
    reach = ASIDE * walk.ground.robot.length
    for x, y in walk.unfooted:
        way = to_see(walk.ground, walk.start, (x, y), reach)
        if way:
            return f"; ground within {reach:z.2f} m of ({x:z.2f}, {y:z.2f}) m is not known: {way}"
    return ""


def _cut_short(walk: _Walk, farthest: _DeadEnd | None) -> LeggedResult:
    """The answer where time ran out: as far as the walk came at all."""
    late = f"no walk within {walk.ground.settings.time_limit:g} s"
    if farthest is None or walk.share > farthest.share:
        return _not_found(walk, Status.TIME_LIMIT, late)
    return replace(farthest.answer, status=Status.TIME_LIMIT, reason=f"{late}; {farthest.answer.reason}")


def _moves(walk: _Walk) -> Iterator[_Step]:
    """Foot moves from where a walk is: of the foot that is due, then of others, each planned when asked for."""
    ground, guide, state, on_guide = walk.ground, walk.guide, walk.state, walk.on_guide
    for leg, s in _due(walk, on_guide):
        middle = on_guide.copy()
        middle[leg] = (middle[leg] + s) / 2
        x, y, yaw = guide.at(float(middle.mean()))
        home = ground.home(leg, *guide.at(s))
        targets = list(islice(ground.footfalls(leg, *home), FOOTFALLS))
        if not targets:
            walk.tries.refuse(Refusal("footfall", float("nan"), "no ground is known and not too steep"))
            walk.unfooted.append(home)
        for found in foot_moves(ground, state, leg, targets, x, y, yaw):
            if isinstance(found, FootMove):
                yield _Step(leg, s, found)
            else:
                walk.tries.refuse(found)


def _due(walk: _Walk, on_guide: Array) -> Iterator[tuple[int, float]]:
    """Legs, and how far along the guide each is to go: the one farthest behind first, its longest stride first.

    The first foot moves are shorter, so that the feet come to stand a part of a stride apart.
    """
    turns = {leg: turn for turn, leg in enumerate(walk.order)}
    behind = sorted(walk.ground.robot.legs, key=lambda leg: (round(float(on_guide[leg]), 6), turns[leg]))
    for leg in behind:
        at = float(on_guide[leg])
        share = 1.0 if at > 0 else (turns[leg] + 1) / len(turns)
        for shorter in SHORTER:
            s = min(at + share * shorter * walk.stride, walk.guide.length)
            if s > at:
                yield leg, s


def _arrival(walk: _Walk) -> FootMove | None:
    """The chassis' way over the goal, or as near as its weight and legs let it within what the goal allows."""
    ground, state, goal, tries = walk.ground, walk.state, walk.goal, walk.tries
    x, y, yaw = walk.guide.at(walk.guide.length)
    for T in poses(ground, state.soles, state.contacts, ground.robot.legs, x, y, yaw, state.q):
        own, off = Tally(), float(np.hypot(T[0, 3] - goal.x, T[1, 3] - goal.y))
        if off > goal.within:
            tries.refuse(Refusal("goal", goal.within - off, "the weight would leave the feet"))
            continue
        way = chassis_way(ground, state, T, own)
        if isinstance(way, Refusal):
            tries.refuse(way)
            continue
        return FootMove(way.samples, way.end, own)
    return None


def goal_refused(ground: Ground, state: LeggedState, goal: WalkGoal) -> LeggedResult | None:
    """The answer to a goal that is off the map or on unknown ground; None where it is neither."""
    known = bool(np.isfinite(height_at(ground.dem, goal.x, goal.y)))
    return place_refused(ground, state, "the goal", (goal.x, goal.y), known)


def _not_found(walk: _Walk, status: Status, reason: str) -> LeggedResult:
    T, (x, y, _) = walk.state.T_site_base, walk.guide.at(walk.guide.length)
    away = float(np.hypot(T[0, 3] - x, T[1, 3] - y))
    reason = f"after {len(walk.steps)} foot moves, {away:z.2f} m from the goal, {reason}"
    return _answer(walk, status, reason, None, walk.plan)


def _answer(
    walk: _Walk, status: Status, reason: str, plan: LeggedPlan | None, partial: LeggedPlan | None
) -> LeggedResult:
    ground = walk.ground
    return LeggedResult(
        status,
        plan,
        reason,
        walk.tally.checks(),
        walk.tries.most_refused(),
        not_judged(ground, plan or partial),
        provenance(ground, walk.start),
        partial,
    )
