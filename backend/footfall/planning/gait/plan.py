"""Plan a gait from where the rover stands to a goal, and check all of it: where it fails is told, not repaired."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.gait.checks import lacks
from footfall.planning.gait.problem import TRIPOD, GaitFailure, GaitPlan, GaitResult, GaitSettings
from footfall.planning.scene.rover_kernel import LIFTED, STANDING, TOUCHING
from footfall.planning.step.ground import Nearby
from footfall.planning.step.problem import Status
from footfall.planning.walk.footprint import Footprint, footprint
from footfall.planning.walk.guide import Guide, guide
from footfall.planning.walk.legs_kernel import pose_of
from footfall.planning.walk.problem import LIFT, LOWER, SWING, Stance, WalkGoal, WalkSettings
from footfall.planning.walk.start import start_of
from footfall.planning.walk.transition_kernel import vector_of
from footfall.planning.walk.world import World
from footfall.robot.ik import leg_azimuth, wheel_pose_for_contact
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at
from footfall.terrain.ground.unseen import without_holes_between

Array = NDArray[np.float64]

BESIDE = 9.0
"""Ground that is looked at beyond start and goal [m]."""
RISES = 0.25
"""Share of a step in which the wheels go straight up, and as much in which they go straight down."""


def groups_of(robot: Robot, gait: str, heading: float) -> tuple[tuple[int, ...], ...]:
    """Which legs move together, in their order, in one cycle; heading: in base [rad]."""
    if gait == TRIPOD:
        return tuple(tuple(leg for leg in robot.legs if leg % 2 == half) for half in (0, 1))
    way = (math.cos(heading), math.sin(heading))
    ahead = [round(float(leg.T_base_hip[:2, 3] @ way), 6) for leg in robot.description.legs]
    return tuple((leg,) for leg in sorted(robot.legs, key=lambda leg: (ahead[leg], leg)))


def plan_gait(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: WalkGoal | tuple[float, float] | tuple[float, float, float],
    gait: str | None = None,
    settings: GaitSettings | None = None,
    progress: Progress = no_progress,
) -> GaitResult:
    """The gait straight to ``goal``: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site.

    gait: replaces that of ``settings`` unless None. Before the first stride one cycle in place brings the feet from how
    the rover stands to how it walks. Raises InvalidInput where arguments make no sense. The same arguments give the
    same answer.
    """
    settings = settings or GaitSettings()
    settings = settings if gait is None else replace(settings, gait=gait)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    asked = goal if isinstance(goal, WalkGoal) else WalkGoal(*(float(one) for one in goal))
    provenance = Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest}, settings)
    start = start_of(robot, dem, state)
    if isinstance(start, str):
        return GaitResult(Status.START_INVALID, None, None, start, (), 0.0, asked, provenance)
    here, there = start.T_site_base[:2, 3], np.array([asked.x, asked.y])
    low, high = np.minimum(here, there) - BESIDE, np.maximum(here, there) + BESIDE
    whole = without_holes_between(dem, low, high, np.array(start.stance.contacts))
    if whole is None:
        reason = "no ground at all is known between start and goal; build a terrain"
        return GaitResult(Status.UNKNOWN_GROUND, None, None, reason, (), 0.0, asked, provenance)
    world = World(robot, Nearby(whole.dem, whole.filled), _as_walk(settings), start.T_site_base)
    begin = vector_of(np.ascontiguousarray(start.T_site_base[:3]))
    ease = footprint(robot, settings.height)
    end = np.array([asked.x, asked.y, begin[5] if asked.yaw is None else asked.yaw])
    way = guide(whole.dem, begin[[0, 1, 5]], end, ease)
    heading = math.atan2(*(there - here)[::-1]) - begin[5]
    walk = _Gait(world, dem, settings, way, ease, begin, groups_of(robot, settings.gait, heading))
    walk.run(start.stance, np.array(start.posture), progress)
    failures = tuple(walk.failures.values())
    plan = walk.plan() if walk.qs else None
    if not failures:
        return GaitResult(Status.FOUND, plan, None, "", (), way.length, asked, provenance)
    reason = f"{failures[0].told}; {len(failures)} failures in all; a walk chooses its footfalls instead"
    return GaitResult(Status.NO_PATH, None, plan, reason, failures, walk.walked, asked, provenance)


def _as_walk(settings: GaitSettings) -> WalkSettings:
    return WalkSettings(
        support="ignored",
        least_margin=settings.least_margin,
        friction=settings.friction,
        most_torque=settings.most_torque,
        clearance=settings.clearance,
        reach_reserve=0.0,
        joint_reserve=0.0,
    )


class _Gait:
    def __init__(
        self,
        world: World,
        dem: Dem,
        settings: GaitSettings,
        way: Guide,
        ease: Footprint,
        begin: Array,
        groups: tuple[tuple[int, ...], ...],
    ) -> None:
        self.world, self.dem, self.settings, self.way = world, dem, settings, way
        self.ease, self.groups, self.offset = ease, groups, begin - way.at(0.0)
        self.cycles = max(1, math.ceil(way.length / settings.stride))
        self.stride = way.length / self.cycles
        self.failures: dict[tuple[int, str, int], GaitFailure] = {}
        self.walked = way.length
        self.made: list[tuple[int, ...]] = []
        self.stances: list[Stance] = []
        self.qs, self.Ts, self.steps, self.phases = [], [], [], []
        self.standing, self.margins, self.torques, self.failing = [], [], [], []

    def run(self, stance: Stance, q: Array, progress: Progress) -> None:
        self.stances.append(stance)
        count = len(self.groups)
        steps = count * (self.cycles + 1)
        for step in range(steps):
            progress(step / steps, f"step {step} of {steps}")
            first = (step - count) * self.stride / count
            last = max(first + self.stride / count, 0.0)
            following = self._placed(step, stance, max(first, 0.0), last)
            if following is None:
                return
            self._step(step, stance, following, max(first, 0.0), last, q)
            self.made.append(self.groups[step % count])
            self.stances.append(following)
            stance = following

    def pose(self, way: float, settled: float) -> Array:
        """T_site_base (4, 4) so far along [m], with a share of the way from how the rover stood to how it walks."""
        vector, T = self.way.at(way) + (1.0 - settled) * self.offset, np.eye(4)
        pose_of(vector, T[:3])
        return T

    def _placed(self, step: int, stance: Stance, first: float, last: float) -> Stance | None:
        """The stance after a step; None where the ground is unknown."""
        count, robot = len(self.groups), self.world.robot
        # a foot stands for count − 1 steps: it is put half of that ahead of where it would be at ease
        ahead = 0.5 * self.stride * (count - 1) / count
        # in the cycle in place it is put where a cycle before would have left it
        landed = (step - count + 1) * self.stride / count
        at = self.way.at(min(max(landed + ahead, 0.0), self.way.length))
        T = np.eye(4)
        pose_of(at, T[:3])
        feet = self.ease.at(at[0], at[1], at[5])
        contacts, normals = stance.contacts.copy(), stance.normals.copy()
        wheels = stance.Ts_site_wheel.copy()
        for leg in self.groups[step % count]:
            x, y = feet[leg]
            contact = np.array([x, y, float(height_at(self.dem, x, y))])
            normal = normal_at(self.dem, np.array([x]), np.array([y]), robot.wheel_radius)[0]
            if not (np.isfinite(contact).all() and np.isfinite(normal).all()):
                self._fail(step, LOWER, leg, "unknown ground", np.inf, "", (float(x), float(y)), first)
                return None
            contacts[leg], normals[leg] = contact, normal
            wheels[leg] = wheel_pose_for_contact(robot, contact, normal, leg_azimuth(robot, leg, T), np.eye(4))
        return Stance(contacts, normals, wheels, stance.branches)

    def _step(self, step: int, a: Stance, b: Stance, first: float, last: float, q: Array) -> None:
        """Sample and check one step."""
        moving, count = self.groups[step % len(self.groups)], len(self.groups)
        settings = self.settings
        rise = 2.0 * settings.lift + float(np.linalg.norm(b.contacts - a.contacts, axis=1).max())
        samples = max(8, math.ceil(rise / settings.apart))
        turns = {
            leg: Slerp([0.0, 1.0], Rotation.from_matrix([a.Ts_site_wheel[leg, :3, :3], b.Ts_site_wheel[leg, :3, :3]]))
            for leg in moving
        }
        for i in range(samples + 1):
            u = i / samples
            phase = LIFT if u <= RISES else (SWING if u < 1.0 - RISES else LOWER)
            T = self.pose(first + u * (last - first), min((step + u) / count, 1.0))
            wheels, feet = a.Ts_site_wheel.copy(), np.full(len(a.contacts), STANDING)
            for leg in moving:
                wheels[leg] = self._wheel(a.Ts_site_wheel[leg], b.Ts_site_wheel[leg], u, turns[leg])
                feet[leg] = LIFTED if phase == SWING else TOUCHING
            found, margin, torque = lacks(
                self.world, T, wheels, a.branches, feet, a.contacts, a.normals, settings.raise_terrain, q
            )
            way = first + u * (last - first)
            for lack in found:
                at = (float(T[0, 3]), float(T[1, 3]))
                self._fail(step, phase, lack.leg, lack.name, lack.amount, lack.unit, at, way)
            self.qs.append(q.copy())
            self.Ts.append(T)
            self.steps.append(step)
            self.phases.append(phase)
            self.standing.append(feet == STANDING)
            self.margins.append(margin)
            self.torques.append(torque)
            self.failing.append(bool(found))

    def _wheel(self, a: Array, b: Array, u: float, turn: Slerp) -> Array:
        """T_site_wheel of a moving wheel: straight up, across, straight down."""
        top = max(a[2, 3], b[2, 3]) + self.settings.lift
        over = min(max((u - RISES) / (1.0 - 2.0 * RISES), 0.0), 1.0)
        T = np.eye(4)
        T[:3, :3] = turn(over).as_matrix()
        T[:2, 3] = (1.0 - over) * a[:2, 3] + over * b[:2, 3]
        up = min(u, 1.0 - u) / RISES
        T[2, 3] = top if up >= 1.0 else (a if u < 0.5 else b)[2, 3] * (1.0 - up) + up * top
        return T

    def _fail(
        self, step: int, phase: str, leg: int, name: str, amount: float, unit: str, at: tuple[float, float], way: float
    ) -> None:
        if not self.failures:
            self.walked = way
        key = step, name, leg
        before = self.failures.get(key)
        if before is None:
            one = None if leg < 0 else leg
            self.failures[key] = GaitFailure(step, phase, one, name, float(amount), unit, len(self.qs), *at)
        elif amount > before.amount:
            self.failures[key] = replace(before, amount=float(amount))

    def plan(self) -> GaitPlan:
        count = len(self.groups)
        return GaitPlan(
            groups=tuple(self.made),
            stances=tuple(self.stances),
            stride=self.stride,
            duty=1.0 - 1.0 / count,
            waypoints=np.array(self.qs),
            Ts_site_base=np.array(self.Ts),
            steps=np.array(self.steps, np.int64),
            phases=tuple(self.phases),
            standing=np.array(self.standing),
            margins=np.array(self.margins),
            torques=np.array(self.torques),
            failing=np.array(self.failing),
        )
