"""A walk of a legged robot to a goal: a wave of foot moves, before each of them the chassis goes where it must.

The wave keeps the feet a part of a stride apart from each other (McGhee & Frank, 1968). It is no search over stances: a
foot move that is refused is tried shorter, then with another leg; where all are refused the walk ends there.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from footfall.core.progress import Progress, no_progress
from footfall.planning.answers import Status
from footfall.planning.legged.chassis_poses import poses
from footfall.planning.legged.foot_move import FootMove, Sample, chassis_way, foot_move, plan_of
from footfall.planning.legged.guide import Guide, guide_to, wave
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings, LeggedState
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.step import (
    begun,
    no_plan,
    of_measured,
    provenance,
    start_refused,
    tally_in_words,
    unchecked,
)
from footfall.planning.legged.whole_check import Refusal, Tally
from footfall.planning.walk.problem import WalkGoal, goal_of
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem
from footfall.terrain.extent import outside
from footfall.terrain.ground.surface import height_at

SHORTER = (1.0, 0.6, 0.3)
"""Shares of a stride that are tried."""
FOOTFALLS = 4
"""Places that are tried for each stride."""
THIN = 0.02
"""The margin that a walk is looked for with once more, where none is found: a share of the longest leg. In physics feet
that stand come off the ground with it."""


class _Walk:
    """How far a walk has come: its way so far, and for each foot the place on the guide at which it is at ease [m]."""

    def __init__(self, ground: Ground, state: LeggedState, guide: Guide) -> None:
        self.ground, self.start, self.state, self.guide = ground, state, state, guide
        self.samples: list[Sample] = []
        self.moves: list[int] = []
        self.on_guide = np.zeros(len(ground.robot.legs))
        self.tally = Tally()

    def take(self, leg: int, s: float, move: FootMove) -> None:
        self.samples += move.samples[1:] if self.samples else move.samples
        self.moves.append(leg)
        self.on_guide[leg] = s
        self.state = move.end
        self.tally.merge(move.tally)

    @property
    def plan(self) -> LeggedPlan | None:
        return plan_of(self.samples, self.moves, self.start, self.state) if self.samples else None


def plan_walk(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    goal: WalkGoal | tuple[float, ...],
    settings: LeggedSettings | None = None,
    progress: Progress = no_progress,
) -> LeggedResult:
    """Plan a walk from a state, its feet near their places at ease, until the chassis is over the goal.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stands at first.
        goal: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site; without yaw the heading is kept.
        settings: with what is planned and checked; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer. Of "no": its status, its reason with amounts, whether a thinner margin would do, and the part of the
        walk that was found.

    Raises:
        InvalidInput: the goal makes no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    goal = goal_of(goal)
    settings, began = settings or LeggedSettings(), time.monotonic()
    ground = Ground(robot, dem, settings)
    result = of_measured(_plan(ground, begun(ground, state), goal, progress), state)
    left = settings.time_limit - (time.monotonic() - began)
    if result.status is not Status.NO_PATH or settings.least_margin <= THIN or left <= 0:
        return result
    thin = Ground(robot, dem, replace(settings, least_margin=THIN, time_limit=left))
    return _told_of_less(result, settings, robot.length, _plan(thin, begun(thin, state), goal, progress).status)


def _told_of_less(result: LeggedResult, settings: LeggedSettings, length: float, thin: Status) -> LeggedResult:
    """The answer of a walk that was not found, saying what came of the thin margin; nothing where time ran out."""
    kept = f"{THIN * length:z.3f} m ({THIN:.0%} of the longest leg) in place of {settings.least_margin * length:z.3f} m"
    told = {
        Status.FOUND: f"with a margin of {kept} a walk is found, in which feet that stand may come off the ground",
        Status.NO_PATH: f"with a margin of {kept} none is found either",
    }
    return replace(result, reason=f"{result.reason}; {told[thin]}") if thin in told else result


def _plan(ground: Ground, state: LeggedState, goal: WalkGoal, progress: Progress) -> LeggedResult:
    refused = start_refused(ground, state) or goal_refused(ground, state, goal)
    if refused is not None:
        return refused
    walk = _Walk(ground, state, guide_to(ground, state.T_site_base, goal))
    began, tries = time.monotonic(), Tally()
    order = wave(ground, walk.guide)
    stride = 2 * ground.settings.stride * ground.ease.stroke
    while (walk.on_guide < walk.guide.length - 1e-9).any():
        if time.monotonic() - began > ground.settings.time_limit:
            return _not_found(walk, Status.TIME_LIMIT, f"no walk within {ground.settings.time_limit:g} s", tries)
        tries = Tally()
        if not _one_move(walk, order, stride, tries):
            return _not_found(walk, Status.NO_PATH, f"no foot can go on: {tally_in_words(tries)}", tries)
        progress(float(walk.on_guide.mean()) / walk.guide.length, f"{len(walk.moves)} foot moves")
    if not _arrives(walk, goal, tries):
        return _not_found(walk, Status.NO_PATH, f"the chassis can't get over the goal: {tally_in_words(tries)}", tries)
    return _answer(walk, Status.FOUND, "", tries, walk.plan, None)


def _one_move(walk: _Walk, order: list[int], stride: float, tries: Tally) -> bool:
    """Move the foot that is due, or where that is refused another; False where all are."""
    ground, guide = walk.ground, walk.guide
    for leg, s in _due(walk, order, stride):
        middle = walk.on_guide.copy()
        middle[leg] = (middle[leg] + s) / 2
        x, y, yaw = guide.at(float(middle.mean()))
        targets = list(islice(ground.footfalls(leg, *ground.home(leg, *guide.at(s))), FOOTFALLS))
        if not targets:
            tries.refuse(Refusal("footfall", float("nan"), "no ground is known and not too steep"))
        for target in targets:
            move = foot_move(ground, walk.state, leg, target, x, y, yaw, tries)
            if move is not None:
                walk.take(leg, s, move)
                return True
    return False


def _due(walk: _Walk, order: list[int], stride: float) -> Iterator[tuple[int, float]]:
    """Legs, and how far along the guide each is to go: the one farthest behind first, its longest stride first.

    The first foot moves are shorter, so that the feet come to stand a part of a stride apart.
    """
    turns = {leg: turn for turn, leg in enumerate(order)}
    behind = sorted(walk.ground.robot.legs, key=lambda leg: (round(float(walk.on_guide[leg]), 6), turns[leg]))
    for leg in behind:
        at = float(walk.on_guide[leg])
        share = 1.0 if at > 0 else (turns[leg] + 1) / len(turns)
        for shorter in SHORTER:
            s = min(at + share * shorter * stride, walk.guide.length)
            if s > at:
                yield leg, s


def _arrives(walk: _Walk, goal: WalkGoal, tries: Tally) -> bool:
    """The chassis goes over the goal, or as near as its weight and legs let it within what the goal allows."""
    ground, state = walk.ground, walk.state
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
        walk.samples += way[1:] if walk.samples else way
        walk.state = ground.state(way[-1].q, T, state.soles, state.contacts, state.normals)
        walk.tally.merge(own)
        return True
    return False


def goal_refused(ground: Ground, state: LeggedState, goal: WalkGoal) -> LeggedResult | None:
    """The answer to a goal that is off the map or on unknown ground; None where it is neither."""
    where = f"the goal ({goal.x:z.2f}, {goal.y:z.2f}) m"
    if not outside(ground.dem.geometry, goal.x, goal.y) <= 0:
        return no_plan(ground, state, Status.OFF_MAP, f"{where} is off the map", Tally())
    if not np.isfinite(height_at(ground.dem, goal.x, goal.y)):
        return no_plan(ground, state, Status.UNKNOWN_GROUND, f"the ground at {where} is not known", Tally())
    return None


def _not_found(walk: _Walk, status: Status, reason: str, tries: Tally) -> LeggedResult:
    T, (x, y, _) = walk.state.T_site_base, walk.guide.at(walk.guide.length)
    away = float(np.hypot(T[0, 3] - x, T[1, 3] - y))
    reason = f"after {len(walk.moves)} foot moves, {away:z.2f} m from the goal, {reason}"
    return _answer(walk, status, reason, tries, None, walk.plan)


def _answer(
    walk: _Walk, status: Status, reason: str, tries: Tally, plan: LeggedPlan | None, partial: LeggedPlan | None
) -> LeggedResult:
    ground = walk.ground
    return LeggedResult(
        status,
        plan,
        reason,
        walk.tally.checks(),
        tries.most_refused(),
        unchecked(ground.robot),
        provenance(ground, walk.start),
        partial,
    )
