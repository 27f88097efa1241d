"""A stance to begin in where a level chassis can't stand: it may lean, shift and turn, feet go anywhere near.

Feet are drawn around a chassis pose, then an evolution strategy moves the chassis over them until nothing is lacking
(``transition_kernel.find_pose``). Of the stances found the one is taken from which most legs can be lifted.
"""

import math
from dataclasses import replace

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.rover_kernel import wheel_cuts
from footfall.planning.walk.body_kernel import HOLDS, configuration_fails
from footfall.planning.walk.body_way import feet_of
from footfall.planning.walk.footfalls import Footfalls, footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.guide import guide
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.legs_kernel import leg_at, legs_at, pose_of
from footfall.planning.walk.problem import Stance, WalkSettings
from footfall.planning.walk.transition_kernel import Move, find_pose
from footfall.planning.walk.world import World
from footfall.robot.ik import wheel_pose_for_contact
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between

WITHIN, TURNED, LEANS = 0.15, 0.15, 0.6
"""The chassis is at most so far from the place seen from above [m], turned [rad], and leaning to each side [rad]."""
AROUND = 4.5
"""Ground that is looked at on each side [m]."""
ROUNDS, LOOKS = 60, 160
"""Sets of feet that are drawn, and chassis poses looked at over each and for each foot that is to be lifted."""
SPREAD = np.array([0.05, 0.05, 0.2, 0.08, 0.08, 0.05])
"""Deviation of the chassis poses that feet are drawn around: x, y, z [m], roll, pitch, yaw [rad]."""
FEET_APART = 0.5
"""Contacts are at least so far apart [m]: wheels of two legs would touch."""
ENOUGH, CHANCE = 0.2, 0.1
"""Spare of a leg that is worth more, and mean of what is added to what a footfall costs [m, rad]."""
OFF = 0.2
"""What each metre costs that a foot is from where it would be at ease."""


def search_stance(
    robot: Robot, dem: Dem, x: float, y: float, yaw: float, hung: Hung | None = None
) -> tuple[Array, Array] | None:
    """Search for a stance near a place.

    All that a walk with default settings asks of a chassis over its feet holds there: reserves of reach and joints,
    support, friction, torque, clearances. Equal arguments give equal stances.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, in site [m].
        y: north, in site [m].
        yaw: heading in site [rad].
        hung: of a rover on a tether; all but the place that is asked for is in the slope's frame then. None: there is
            no tether.

    Returns:
        Posture (legs × 6,) [rad] and T_site_base (4, 4), or None where none is found.
    """
    if hung is None:
        return _Search(robot, dem, x, y, yaw).run()
    frame = hung.frame
    at = frame.on_slope(x, y, footprint(robot).height)
    if not np.isfinite(at).all():
        return None
    found = _Search(robot, frame.ground, at[0], at[1], hung.heading(yaw), hung).run()
    return None if found is None else (found[0], frame.poses_to_site(found[1]))


class _Search:
    def __init__(self, robot: Robot, dem: Dem, x: float, y: float, yaw: float, hung: Hung | None = None) -> None:
        self.robot, self.dem, self.at, self.hung = robot, dem, np.array([x, y, yaw]), hung
        self._rng = np.random.Generator(np.random.PCG64(0))

    def run(self) -> tuple[Array, Array] | None:
        settings, at, hung = WalkSettings(), self.at[:2], self.hung
        if hung is not None:
            settings = replace(settings, clearance=settings.clearance + hung.frame.off)
        low, high = at - AROUND, at + AROUND
        whole = without_holes_between(self.dem, low, high, np.empty((0, 3)))
        if whole is None:
            return None
        self.ease = footprint(self.robot)
        self.aim = guide(whole.dem, self.at, self.at, self.ease).vectors[0]
        T = np.eye(4)
        pose_of(self.aim, T[:3])
        places = footfalls(self.robot, self.dem, low, high, settings)
        self.places: Footfalls = places if hung is None else hung.places(places, self.robot.wheel_radius)
        self.world = World(self.robot, Nearby(whole.dem, whole.filled), settings, T, hung)
        best, liftable = None, -1
        for _ in range(ROUNDS):
            stance = self._drawn()
            found = None if stance is None else self._over(stance)
            if stance is None or found is None:
                continue
            count = self._liftable(stance, found[2])
            if count > liftable:
                best, liftable = found[:2], count
            if liftable == self.robot.leg_count:
                break
        return best

    def _drawn(self) -> Stance | None:
        """Feet around a chassis pose, each where its leg has room; None where a leg finds no place."""
        vector = self.aim + SPREAD * self._rng.standard_normal(6)
        T = np.empty((3, 4))
        pose_of(vector, T)
        eases = self.ease.at(vector[0], vector[1], vector[5])
        checks, q = self.world.first.checks, np.empty(6)
        contacts, normals, wheels = [], [], []
        for leg, spec in enumerate(self.robot.description.legs):
            rows = np.array(self.places.tree.query_ball_point(eases[leg], 0.9), np.int64)
            own = self.places.contacts[rows]
            for contact in contacts:
                good = np.hypot(own[:, 0] - contact[0], own[:, 1] - contact[1]) >= FEET_APART
                rows, own = rows[good], own[good]
            heading = np.full(len(rows), vector[5] + math.atan2(spec.T_base_hip[1, 0], spec.T_base_hip[0, 0]))
            if not len(rows):
                return None
            Ts = wheel_pose_for_contact(self.robot, own, self.places.normals[rows], heading, np.eye(4))
            spare = np.array([leg_at(T, np.ascontiguousarray(one[:3]), 0, leg, self.world.legs, q) for one in Ts])
            cost = np.maximum(ENOUGH - spare, 0.0) + OFF * np.hypot(*(own[:, :2] - eases[leg]).T)
            cost += self._rng.exponential(CHANCE, len(rows))
            for i in np.argsort(cost, kind="stable"):
                if spare[i] > -ENOUGH and wheel_cuts(np.ascontiguousarray(Ts[i, :3]), checks.rover) >= 0.0:
                    contacts.append(own[i])
                    normals.append(self.places.normals[rows[i]])
                    wheels.append(Ts[i])
                    break
            else:
                return None
        branches = np.zeros(len(contacts), np.int64)
        return Stance(np.array(contacts), np.array(normals), np.array(wheels), branches)

    def _pose(self, stance: Stance, guess: Array, leg: int) -> tuple[float, Array]:
        """What the best chassis pose (6,) to lift a leg from (−1: none) lacks, and the pose."""
        checks, best = self.world.first.checks, np.empty(6)
        wheel = np.ascontiguousarray(stance.Ts_site_wheel[leg, :3])
        move = Move(leg, wheel, int(stance.branches[leg]), self.world.settings.lift, stance.contacts)
        lacks = find_pose(
            np.array([guess]),
            self.aim,
            feet_of(stance),
            move,
            self.world.legs,
            checks.rover,
            checks.balance,
            self._rng,
            LOOKS,
            best,
        )
        return lacks, best

    def _over(self, stance: Stance) -> tuple[Array, Array, Array] | None:
        """Posture, T_site_base and its vector (6,) of a chassis near the place; None: there is none."""
        lacks, vector = self._pose(stance, self.aim, -1)
        away = float(np.hypot(*(vector[:2] - self.at[:2])))
        if lacks > 0.0 or away > WITHIN or abs(vector[5] - self.at[2]) > TURNED or np.abs(vector[3:5]).max() > LEANS:
            return None
        T, q, legs = np.eye(4), np.empty(6 * self.robot.leg_count), self.robot.leg_count
        T_site_base = np.empty((3, 4))
        pose_of(vector, T_site_base)
        T[:3] = T_site_base
        legs_at(T_site_base, feet_of(stance), self.world.legs, q, np.empty(legs))
        poses, checks = np.empty((7 * legs, 3, 4)), self.world.first.checks
        failed, _, _ = configuration_fails(q, T_site_base, stance.contacts, stance.normals, -1, checks, poses)
        return (q, T, vector) if failed == HOLDS else None

    def _liftable(self, stance: Stance, vector: Array) -> int:
        """How many legs can be lifted after the chassis moved over its feet."""
        return sum(self._pose(stance, vector, leg)[0] <= 0.0 for leg in self.robot.legs)
