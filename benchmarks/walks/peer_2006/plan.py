"""A walk planned plainly in the two stages of Hauser, Bretl, Latombe & Wilcox (2006), §4, on this project's kernels.

EXPLORE-STANCEGRAPH finds a sequence of stances with a transition for each foot move, best first; then the motions
along that sequence are planned. What is not found gets dearer, nothing is deleted. A foot move is a removal and a
placement with one pose of the chassis; motions are planned as ``plan_walk`` plans them, which is faster than the
paper's SBL in all joints: a ratio against this peer is in the peer's favour.
"""

import heapq
import math
import time
from dataclasses import replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.assemble import walk_of
from footfall.planning.walk.body_kernel import HOLDS, configuration_fails
from footfall.planning.walk.body_way import At, BodyWay, Fails, body_way, feet_of
from footfall.planning.walk.foot_move import Moved, foot_move_at
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.legs_kernel import leg_at, legs_at, pose_of
from footfall.planning.walk.problem import Stance, WalkGoal, WalkPlan, WalkSettings
from footfall.planning.walk.start import start_of
from footfall.planning.walk.transition_kernel import margin_without
from footfall.planning.walk.world import World
from footfall.robot.ik import wheel_pose_for_contact
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between

Feet = tuple[int, ...]
Edge = tuple[Feet, int, int]

COUNT = 200
"""Random footfalls, as in the paper's experiments."""
BESIDE = 3.0
"""They lie so far beyond start and goal [m]."""
SPREAD = np.array([0.1, 0.1, 0.08, 0.05, 0.05, 0.08])
"""Standard deviations of chassis poses about the nominal one [m, rad]."""
SAMPLES = 100
"""Poses that one query of FIND-TRANSITION looks at."""
APART = 0.45
"""Feet are no nearer to each other [m]."""
MOVES_PER_METRE, NOMINAL, EQUILIBRIUM, DEARER = 12.0, 2.0, 2.0, 4.0
"""Weights of g + h, in foot moves: distance to goal, feet from nominal [1/m], margin [1/m], a query that failed."""


def peer_walk(robot: Robot, dem: Dem, state: RobotState, goal: WalkGoal, settings: WalkSettings) -> WalkPlan | None:
    """The walk that the peer finds, not smoothed; None where the time limit passes. Raises InvalidInput for a start
    without a stance, or ground of which nothing is known."""
    begun = time.process_time()
    start = start_of(robot, dem, state)
    if isinstance(start, str):
        raise InvalidInput(start)
    here, there = start.T_site_base[:2, 3], np.array([goal.x, goal.y])
    low, high = np.minimum(here, there) - BESIDE, np.maximum(here, there) + BESIDE
    whole = without_holes_between(dem, low - BESIDE, high + BESIDE, np.array(start.stance.contacts))
    if whole is None:
        raise InvalidInput("nothing is known of the ground")
    world = World(robot, Nearby(whole.dem, whole.filled), settings, start.T_site_base)
    search = _Search(world, dem, start, goal, (low, high), begun + settings.time_limit)
    found = search.run()
    if found is None:
        return None
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    return walk_of(goal, start, found[0], found[1], Provenance(parents, settings, settings.seed))


class _Search:
    """feet: of each leg the place it stands on, −1 where it stands at the start."""

    def __init__(
        self, world: World, dem: Dem, start: At, goal: WalkGoal, corners: tuple[Array, Array], ends: float
    ) -> None:
        self.world, self.start, self.goal, self.ends = world, start, goal, ends
        self.rng = np.random.default_rng(world.settings.seed)
        self.ease = footprint(world.robot, world.settings.height)
        places = footfalls(world.robot, dem, *corners, replace(world.settings, spacing=0.1))
        rows = self.rng.choice(len(places.contacts), min(COUNT, len(places.contacts)), replace=False)
        self.contacts, self.normals = places.contacts[rows], places.normals[rows]
        yaw = math.atan2(start.T_site_base[1, 0], start.T_site_base[0, 0])
        self.wheels = [
            wheel_pose_for_contact(
                world.robot,
                self.contacts,
                self.normals,
                np.full(len(rows), yaw + math.atan2(leg.T_base_hip[1, 0], leg.T_base_hip[0, 0])),
                np.eye(4),
            )
            for leg in world.robot.description.legs
        ]
        self.dearer: dict[Edge, float] = {}
        self.transitions: dict[Edge, Array] = {}

    def run(self) -> tuple[list[Moved], BodyWay] | None:
        while time.process_time() < self.ends:
            edges = self._explore_stances()
            if edges is None:
                continue
            found = self._follow(*edges)
            if found is not None:
                return found
        return None

    def _stance(self, feet: Feet) -> Stance:
        own = self.start.stance
        contacts, normals = np.array(own.contacts), np.array(own.normals)
        wheels, branches = np.array(own.Ts_site_wheel), np.array(own.branches)
        for leg, place in enumerate(feet):
            if place >= 0:
                contacts[leg], normals[leg] = self.contacts[place], self.normals[place]
                wheels[leg], branches[leg] = self.wheels[leg][place], 0
        return Stance(contacts, normals, wheels, branches)

    def _explore_stances(self) -> tuple[list[Edge], Array] | None:
        """EXPLORE-STANCEGRAPH: the edges to a stance that holds the goal, and the chassis pose (6,) there."""
        first = (-1,) * len(self.start.stance.branches)
        came: dict[Feet, Edge | None] = {first: None}
        waiting: list[tuple[float, float, Edge]] = []
        self._expand(first, 0.0, waiting)
        while waiting and time.process_time() < self.ends:
            priority, cost, edge = heapq.heappop(waiting)
            feet, leg, place = edge
            then = (*feet[:leg], place, *feet[leg + 1 :])
            if then in came:
                continue
            if edge not in self.transitions:
                pose = self._find_transition(edge, then)
                if pose is None:
                    self.dearer[edge] = self.dearer.get(edge, 0.0) + DEARER
                    heapq.heappush(waiting, (priority + DEARER, cost + DEARER, edge))
                    continue
                self.transitions[edge] = pose
            came[then] = edge
            last = self._at_goal(then)
            if last is not None:
                return _back(came, then), last
            self._expand(then, cost, waiting)
        return None

    def _expand(self, feet: Feet, cost: float, waiting: list[tuple[float, float, Edge]]) -> None:
        """Queue every foot move from a stance with g + h."""
        contacts = np.array(self._stance(feet).contacts)
        for leg in range(len(feet)):
            others = np.delete(contacts, leg, axis=0)
            away = np.linalg.norm(self.contacts[:, :2] - contacts[leg, :2], axis=1)
            apart = np.linalg.norm(self.contacts[:, None, :2] - others[None, :, :2], axis=2).min(axis=1)
            rows = np.flatnonzero((away <= self.world.settings.longest) & (apart >= APART) & (away > 1e-9))
            if not len(rows):
                continue
            after = np.tile(contacts, (len(rows), 1, 1))
            after[:, leg] = self.contacts[rows]
            poses, off = self.ease.fits(after)
            left = np.hypot(poses[:, 0] - self.goal.x, poses[:, 1] - self.goal.y)
            for row, pose, short, nominal in zip(rows.tolist(), poses, left, off.max(axis=1), strict=True):
                edge = (feet, leg, row)
                margin = min(margin_without(contacts, leg, pose[:3], 0), 0.5)
                g = cost + 1.0 + self.dearer.get(edge, 0.0)
                h = MOVES_PER_METRE * short + NOMINAL * nominal - EQUILIBRIUM * margin
                heapq.heappush(waiting, (g + h, g, edge))

    def _find_transition(self, edge: Edge, then: Feet) -> Array | None:
        """FIND-TRANSITION: a chassis pose (6,), drawn about the nominal one, feasible before and after a foot move."""
        feet, leg, _ = edge
        before, after = self._stance(feet), self._stance(then)
        nominal = self.ease.fits(np.array([before.contacts, after.contacts]))[0].mean(axis=0)
        return self._drawn(nominal, before, after, leg)

    def _drawn(self, nominal: Array, before: Stance, after: Stance, leg: int) -> Array | None:
        legs, T = self.world.legs, np.empty((3, 4))
        spares, q, q_leg = np.empty(len(before.branches)), np.empty(6 * len(before.branches)), np.empty(6)
        poses, feet = np.empty((7 * len(spares), 3, 4)), feet_of(before)
        wheel = np.ascontiguousarray(after.Ts_site_wheel[leg, :3])
        for sample in range(SAMPLES):
            vector = nominal + (SPREAD * self.rng.standard_normal(6) if sample else 0.0)
            pose_of(vector, T)
            least = legs_at(T, feet, legs, q, spares)
            if not min(least, leg_at(T, wheel, int(after.branches[leg]), leg, legs, q_leg)) >= 0.0:
                continue
            checks = self.world.around(np.vstack([T, (0.0, 0.0, 0.0, 1.0)])).checks
            put = q.copy()
            put[6 * leg : 6 * leg + 6] = q_leg
            lifted = leg if before is not after else -1
            if all(
                configuration_fails(posture, T, stance.contacts, stance.normals, lifted, checks, poses)[0] == HOLDS
                for stance, posture in ((before, q), (after, put))
            ):
                return vector
        return None

    def _at_goal(self, feet: Feet) -> Array | None:
        """A chassis pose (6,) at the goal over a stance."""
        stance = self._stance(feet)
        nominal = self.ease.fits(np.array([stance.contacts]))[0][0]
        if math.hypot(nominal[0] - self.goal.x, nominal[1] - self.goal.y) > 0.5:
            return None
        nominal[:2] = self.goal.x, self.goal.y
        if self.goal.yaw is not None:
            nominal[5] = self.goal.yaw
        vector = self._drawn(nominal, stance, stance, 0)
        return vector if vector is not None and self._is_there(vector) else None

    def _is_there(self, vector: Array) -> bool:
        near = math.hypot(vector[0] - self.goal.x, vector[1] - self.goal.y) <= self.goal.within
        yaw = self.goal.yaw
        return near and (yaw is None or abs(math.remainder(vector[5] - yaw, 2 * math.pi)) <= self.goal.turned)

    def _follow(self, edges: list[Edge], last: Array) -> tuple[list[Moved], BodyWay] | None:
        """The motions along a sequence; the first foot move that has none gets dearer and loses its transition."""
        at, moves = self.start, []
        for edge in edges:
            feet, leg, place = edge
            then = self._stance((*feet[:leg], place, *feet[leg + 1 :]))
            moved = foot_move_at(self.world, at, leg, then, self.transitions[edge], self.rng)
            if isinstance(moved, Fails):
                self.dearer[edge] = self.dearer.get(edge, 0.0) + DEARER
                del self.transitions[edge]
                return None
            moves.append(moved)
            at = moved.to
        T = np.eye(4)
        pose_of(last, T[:3])
        closing = body_way(self.world.around(at.T_site_base).checks, at, T)
        return None if isinstance(closing, Fails) else (moves, closing)


def _back(came: dict[Feet, Edge | None], feet: Feet) -> list[Edge]:
    edges: list[Edge] = []
    edge = came[feet]
    while edge is not None:
        edges.append(edge)
        edge = came[edge[0]]
    return edges[::-1]
