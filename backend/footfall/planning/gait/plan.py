"""Plan a gait from where the rover stands to a goal, and check all of it as a walk is checked, or say what fails."""

import math
from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.gait.failing import posture_over
from footfall.planning.gait.gait_rows import GaitRows
from footfall.planning.gait.layout import Layout, laid_out, placed
from footfall.planning.gait.problem import GaitFailure, GaitPlan, GaitResult, GaitSettings
from footfall.planning.gait.rhythm import Rhythm, groups_of, rhythm
from footfall.planning.gait.settle import settled
from footfall.planning.gait.step import Lack, gone_to, stepped
from footfall.planning.gait.way import corners_of, way_to
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.assemble import checks_of
from footfall.planning.walk.body_way import At
from footfall.planning.walk.footprint import Footprint, footprint
from footfall.planning.walk.goal_ground import goal_ground_refused
from footfall.planning.walk.guide import Guide
from footfall.planning.walk.plan import BESIDE, FARTHEST, NOTHING_KNOWN
from footfall.planning.walk.problem import Stance, WalkGoal, goal_of
from footfall.planning.walk.start import start_of
from footfall.planning.walk.transition_kernel import vector_of
from footfall.planning.walk.world import World
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between

SHORTER = (1.0, 0.75, 0.5)
"""Strides that are tried, as shares of the one asked for."""
TRY = "try another gait, a shorter stride or more tolerance; a walk chooses its footfalls and poses instead"


def plan_gait(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: WalkGoal | tuple[float, float] | tuple[float, float, float],
    gait: str | None = None,
    settings: GaitSettings | None = None,
    progress: Progress = no_progress,
) -> GaitResult:
    """Plan a gait to ``goal``; it may be to turn in place.

    The same arguments give the same answer.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands at first.
        goal: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site.
        gait: replaces that of ``settings``; None: theirs.
        settings: with what is planned and checked; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; a gait that a check refuses is an answer with a reason.

    Raises:
        InvalidInput: goal or settings make no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or GaitSettings()
    settings = settings if gait is None else replace(settings, gait=gait)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    asked = goal_of(goal)
    return _Attempt(robot, dem, state, asked, settings, progress).run()


@dataclass(frozen=True, eq=False)
class _Ended:
    """What ended a gait: the legs that were to move, and the stance and the chassis' pose that were to be taken."""

    group: tuple[int, ...]
    lack: Lack
    walked: float
    stance: Stance
    T_site_base: Array


class _Attempt:
    def __init__(
        self, robot: Robot, dem: Dem, state: RobotState, goal: WalkGoal, settings: GaitSettings, progress: Progress
    ) -> None:
        self.robot, self.dem, self.state = robot, dem, state
        self.goal, self.settings, self.progress = goal, settings, progress
        self.parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
        self.provenance = Provenance(self.parents, settings)

    def run(self) -> GaitResult:
        start = start_of(self.robot, self.dem, self.state)
        if isinstance(start, str):
            return self._no(Status.START_INVALID, start)
        here, there = start.T_site_base[:2, 3], np.array([self.goal.x, self.goal.y])
        away = float(np.linalg.norm(there - here))
        if away > FARTHEST:
            reason = f"the goal is {away:z.1f} m away, a gait goes at most {FARTHEST:g} m; choose a nearer one"
            return self._no(Status.GOAL_INVALID, reason)
        # one that stays may turn over ground that it hides itself
        refusal = goal_ground_refused(self.dem, self.goal) if away > self.goal.within else None
        if refusal is not None:
            return self._no(refusal.status, refusal.reason)
        begin = vector_of(np.ascontiguousarray(start.T_site_base[:3]))[[0, 1, 5]]
        low, high = corners_of(begin, there, self.goal.yaw, self.settings.arc)
        feet = np.array(start.stance.contacts)
        whole = without_holes_between(self.dem, low - 2.0 * BESIDE, high + 2.0 * BESIDE, feet)
        if whole is None:
            return self._no(Status.UNKNOWN_GROUND, NOTHING_KNOWN)
        world = World(self.robot, Nearby(whole.dem, whole.filled), self.settings.as_walk(), start.T_site_base)
        ease = footprint(self.robot, self.settings.height)
        way = way_to(whole.dem, begin, there, self.goal.yaw, ease, self.settings.arc)
        groups = groups_of(self.robot, self.settings.gait, math.atan2(*(there - here)[::-1]) - begin[2])
        best: GaitResult | None = None
        cycles = set[int]()
        for share in SHORTER:
            beat = rhythm(groups, way.length, share * self.settings.stride)
            if beat.cycles in cycles:
                # the same strides again
                continue
            cycles.add(beat.cycles)
            found = self._with(world, start, way, ease, beat)
            if best is None or found.walked > best.walked:
                best = found
            if found.status is Status.FOUND:
                return found
        return best or self._no(Status.NO_PATH, "no stride was tried")

    def _with(self, world: World, start: At, way: Guide, ease: Footprint, beat: Rhythm) -> GaitResult:
        """The gait with one stride."""
        layout = laid_out(world, self.dem, beat, way, ease, self.settings.tolerance)
        rows = GaitRows(start)
        begun = settled(world, start, beat, layout, self.settings.tolerance)
        for moved in begun.moves:
            rows.moved(moved)
        if begun.lack is not None:
            ended = _Ended(begun.leg, begun.lack, 0.0, rows.at.stance, _pose(layout, 0))
            return self._failed(world, rows, ended, beat, layout, len(begun.moves))
        for move in range(beat.moves):
            self.progress(move / beat.moves, f"foot move {move + 1} of {beat.moves}")
            group = beat.group(move)
            to = placed(rows.at.stance, beat, layout, beat.rows(move), self.settings.tolerance)
            result = to if isinstance(to, Lack) else stepped(world, rows.at, group, to, _pose(layout, move))
            if isinstance(result, Lack):
                walked = float(beat.ways[max(move - 1, 0)])
                stance = rows.at.stance if isinstance(to, Lack) else to
                ended = _Ended(group, result, walked, stance, _pose(layout, move))
                return self._failed(world, rows, ended, beat, layout, len(begun.moves))
            rows.stepped(result)
        closing = gone_to(world, rows.at, _pose(layout, beat.moves))
        if isinstance(closing, Lack):
            ended = _Ended((), closing, float(beat.ways[-2]), rows.at.stance, _pose(layout, beat.moves))
            return self._failed(world, rows, ended, beat, layout, len(begun.moves))
        rows.closed(closing)
        plan = self._plan(rows, beat, layout, len(begun.moves))
        checks = checks_of(plan, world.settings)
        return GaitResult(Status.FOUND, plan, None, "", None, way.length, checks, self.goal, self.provenance)

    def _plan(self, rows: GaitRows, beat: Rhythm, layout: Layout, settling: int) -> GaitPlan:
        return GaitPlan(
            goal=self.goal,
            groups=tuple(rows.groups),
            settling=settling,
            stances=tuple(rows.stances),
            stride=beat.stride,
            duty=1.0 - 1.0 / len(beat.groups),
            height=layout.height,
            tread=layout.tread,
            adapted=int((layout.away > 0.0).sum()),
            **rows.rows.waypoints,
            provenance=Provenance(self.parents, self.settings.as_walk()),
        )

    def _failed(
        self, world: World, rows: GaitRows, ended: _Ended, beat: Rhythm, layout: Layout, settling: int
    ) -> GaitResult:
        x, y = (float(one) for one in rows.at.T_site_base[:2, 3])
        lack, T_site_base = ended.lack, ended.T_site_base
        leg = None if lack.leg < 0 else lack.leg
        posture = posture_over(world, rows.at, ended.stance, T_site_base)
        about = lack.check, lack.lacks, lack.unit
        failure = GaitFailure(len(rows.groups), ended.group, leg, *about, x, y, posture, T_site_base)
        partial = self._plan(rows, beat, layout, settling) if rows.groups else None
        checks = checks_of(partial, self.settings.as_walk()) if partial else ()
        reason = f"{failure.text}; {TRY}"
        return GaitResult(
            Status.NO_PATH, None, partial, reason, failure, ended.walked, checks, self.goal, self.provenance
        )

    def _no(self, status: Status, reason: str) -> GaitResult:
        return GaitResult(status, None, None, reason, None, 0.0, (), self.goal, self.provenance)


def _pose(layout: Layout, move: int) -> Array:
    return np.vstack([layout.Ts[move], (0.0, 0.0, 0.0, 1.0)])
