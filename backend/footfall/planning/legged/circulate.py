"""The Ambler's own walk: the rearmost leg of a stack passes through the body and comes to stand in front of the others.

Between two such foot moves the chassis glides level over six feet. It goes straight ahead or back, and turns in place
with one stack going backward: there the rearmost foot, as the stack goes, is the one in front. Each stack's feet are a
third of a stride apart, those of the other stack half as much off.

D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int. Conf. on Systems
Engineering, 1990.
"""

import time
from dataclasses import replace
from itertools import islice

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import heading
from footfall.core.progress import Progress, no_progress
from footfall.planning.answers import Status
from footfall.planning.legged.foot_move import FootMove, Sample, chassis_way, move_at, plan_of, raised_line
from footfall.planning.legged.glide import Feet, feet_of, level_poses, places
from footfall.planning.legged.guide import Guide
from footfall.planning.legged.problem import LeggedResult, LeggedSettings, LeggedState
from footfall.planning.legged.rhythm import SETTLED, CirculatingRhythm
from footfall.planning.legged.stacks import Stack, stacks_of
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.step import begun, not_judged, of_measured, provenance, start_refused, tally_in_words
from footfall.planning.legged.through_body import through_body
from footfall.planning.legged.walk import goal_refused
from footfall.planning.legged.whole_check import Refusal, Tally
from footfall.planning.walk.problem import WalkGoal, goal_of
from footfall.planning.watch import time_taken
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem

FOOTFALLS = 4
"""Places that are tried for each foot."""
MARGIN = 0.02
"""Of the centre of mass to the conservative support polygon, a share of the longest leg: that polygon holds without any
one of the feet, so it is kept with less than another."""
STRAIGHT = 0.02
"""Headings that differ by less are one [rad]."""


class _Refused(Exception):
    """Ends a walk where it is: status and reason."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


class _Course:
    """How far a walk has come."""

    def __init__(self, ground: Ground, stacks: tuple[Stack, Stack], state: LeggedState, progress: Progress) -> None:
        self.ground, self.stacks, self.start, self.state = ground, stacks, state, state
        self.samples: list[Sample] = []
        self.moves: list[int] = []
        self.tally, self.tries = Tally(), Tally()
        self.progress, self.began = progress, time.monotonic()

    def take(self, samples: list[Sample], tally: Tally, state: LeggedState) -> None:
        self.samples += samples[1:] if self.samples else samples
        self.tally.merge(tally)
        self.state = state

    def refuse(self, what: str) -> _Refused:
        return _Refused(Status.NO_PATH, f"after {len(self.moves)} foot moves {what}: {tally_in_words(self.tries)}")

    def stack_of(self, leg: int) -> tuple[Stack, Stack]:
        """The leg's own stack, and the other one."""
        left, right = self.stacks
        return (left, right) if leg in left.legs else (right, left)

    def foot_goes(self, leg: int, home: Array, pose: tuple[float, float, float], passing: bool) -> None:
        """The leg's foot goes near a place (2,) with the chassis near a pose; raises _Refused."""
        if time_taken(self.began) > self.ground.settings.time_limit:
            raise _Refused(Status.TIME_LIMIT, f"no walk within {self.ground.settings.time_limit:g} s")
        self.tries = Tally()
        own, other = self.stack_of(leg)
        targets = list(islice(self.ground.footfalls(leg, *home), FOOTFALLS))
        if not targets:
            self.tries.refuse(Refusal("footfall", float("nan"), "no ground is known and not too steep"))
        for target in targets:
            after = [part.copy() for part in feet_of(self.state)]
            after[0][leg], after[1][leg] = target.center, target.contact
            near = places(self.ground, self.stacks, self.state, [feet_of(self.state), Feet(*after)], pose)
            if isinstance(near, Refusal):
                self.tries.refuse(near)
                continue
            for T in level_poses(self.ground, self.state, near, pose[2]):
                over = through_body(own, other, T) if passing else raised_line
                found = move_at(self.ground, self.state, leg, target, T, over)
                if isinstance(found, FootMove):
                    self.moves.append(leg)
                    self.take(found.samples, found.tally, found.end)
                    return
                self.tries.refuse(found)
        raise self.refuse(f"leg {self.ground.robot.leg_names[leg]} can't come to ({home[0]:z.2f}, {home[1]:z.2f}) m")

    def glide(self, pose: tuple[float, float, float], within: float) -> bool:
        """The chassis goes level over all feet to within so much of a pose [m]; False where nothing there holds it."""
        self.tries = Tally()
        near = places(self.ground, self.stacks, self.state, [feet_of(self.state)], pose)
        if isinstance(near, Refusal):
            self.tries.refuse(near)
            return False
        close = [(x, y) for x, y in near if np.hypot(x - pose[0], y - pose[1]) <= within + 1e-9]
        for T in level_poses(self.ground, self.state, close, pose[2]):
            own = Tally()
            way = chassis_way(self.ground, self.state, T, own)
            if not isinstance(way, Refusal):
                self.take(way.samples, own, way.end)
                return True
            self.tries.refuse(way)
        return False


def plan_circulating(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    goal: WalkGoal | tuple[float, ...],
    settings: LeggedSettings | None = None,
    progress: Progress = no_progress,
) -> LeggedResult:
    """Plan a walk of a robot with two stacks: it turns to the goal, goes straight there, and turns to its heading.

    A goal that lies behind is walked to backward. With all feet down the weight is inside the conservative support
    polygon, whatever the settings say.

    Args:
        robot: the robot, with stacks.
        dem: the ground, in site.
        state: how the robot stands at first.
        goal: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site; without yaw the heading is kept.
        settings: with what is planned and checked; None: as delivered, the weight inside by MARGIN.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer, as of ``plan_walk``.

    Raises:
        InvalidInput: the goal makes no sense, the state is of another robot, or the robot has no stacks.
        Cancelled: ``progress`` raised it.
    """
    goal = goal_of(goal)
    stacks = stacks_of(robot)
    ground = Ground(robot, dem, replace(settings or LeggedSettings(least_margin=MARGIN), conservative=True))
    return of_measured(_plan(ground, stacks, begun(ground, state), goal, progress), state)


def _plan(
    ground: Ground, stacks: tuple[Stack, Stack], state: LeggedState, goal: WalkGoal, progress: Progress
) -> LeggedResult:
    course = _Course(ground, stacks, state, progress)
    refused = start_refused(ground, state) or goal_refused(ground, state, goal)
    if refused is not None:
        return refused
    try:
        _walk(course, goal)
    except _Refused as err:
        return _answer(course, err.status, err.reason)
    return _answer(course, Status.FOUND, "")


def _walk(course: _Course, goal: WalkGoal) -> None:
    x, y = (float(one) for one in course.state.T_site_base[:2, 3])
    far = float(np.hypot(goal.x - x, goal.y - y))
    if far > goal.within:
        turn = _wrapped(np.arctan2(goal.y - y, goal.x - x) - heading(course.state.T_site_base))
        # what lies behind is walked to backward
        turn -= np.pi * np.sign(turn) if abs(turn) > np.pi / 2 else 0.0
        _turn(course, turn, within=0.3)
        T = course.state.T_site_base
        change = np.array([goal.x - T[0, 3], goal.y - T[1, 3], 0.0])
        length = float(np.hypot(*change[:2]))
        _follow(course, Guide(np.array([*T[:2, 3], heading(T)]), change, length), goal.within)
    if goal.yaw is not None:
        _turn(course, _wrapped(goal.yaw - heading(course.state.T_site_base)), goal.within)


def _turn(course: _Course, turn: float, within: float) -> None:
    """In place by an angle [rad]."""
    if abs(turn) < STRAIGHT:
        return
    T = course.state.T_site_base
    size = float(np.linalg.norm(course.ground.ease.soles[:, :2], axis=1).max())
    guide = Guide(np.array([*T[:2, 3], heading(T)]), np.array([0.0, 0.0, turn]), abs(turn) * size)
    _follow(course, guide, within)


def _follow(course: _Course, guide: Guide, within: float) -> None:
    """Along a guide that goes straight or turns, never both."""
    rhythm = CirculatingRhythm(course.ground.ease.soles, course.stacks, guide)
    if guide.length < rhythm.stride / 2 and course.glide(guide.at(guide.length), within):
        return
    at = rhythm.begun(course.state.soles)
    for leg in sorted(course.ground.robot.legs, key=lambda leg: -at[leg]):
        home = rhythm.home(leg, at[leg])
        if np.linalg.norm(course.state.soles[leg, :2] - home) > SETTLED:
            course.foot_goes(leg, home, guide.at(0.0), passing=False)
    while True:
        leg = min(course.ground.robot.legs, key=lambda leg: at[leg])
        middle = at[leg] + rhythm.stride / 2
        if middle > guide.length + 1e-9:
            break
        at[leg] += rhythm.stride
        course.foot_goes(leg, rhythm.home(leg, at[leg]), guide.at(middle), passing=True)
        course.progress(middle / guide.length, f"{len(course.moves)} foot moves")
    if not course.glide(guide.at(guide.length), within):
        raise course.refuse("the chassis can't come to the end of its way")


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _answer(course: _Course, status: Status, reason: str) -> LeggedResult:
    found = status is Status.FOUND
    if not course.samples:
        T, state = course.state.T_site_base, course.state
        course.samples = [Sample(state.q, T, "body", -1)]
    plan = plan_of(course.samples, course.moves, course.start, course.state)
    return LeggedResult(
        status,
        plan if found else None,
        reason,
        course.tally.checks(),
        course.tries.most_refused() if not found else (),
        not_judged(course.ground, plan),
        provenance(course.ground, course.start),
        None if found else plan,
    )
