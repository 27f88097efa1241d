"""The distances that a robot's description asks for, along a walk: of its links from each other, and from the ground.

Standing wheels, and the links that hold them, don't move: they are looked at where their stance has them.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, transform
from footfall.core.grid import GridGeometry
from footfall.planning.answers import Check
from footfall.planning.walk.problem import LIFT, LOWER, SWING, CheckedMotion
from footfall.planning.walk.recheck.apart import MovingBody, nearest
from footfall.planning.walk.recheck.feet import DRIFT
from footfall.planning.walk.recheck.stretches import MotionStretch
from footfall.robot.description import PARTS, link_name
from footfall.robot.meshes import shapes
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.ground.unseen import without_holes

LOCKED = ("ankle_roll", "wheel")
"""Parts of a leg that stay where they are while its wheel stands."""
PIECE = 0.5
"""Pieces of ground are around places on a lattice of this spacing [m]."""
_NO_GROUND = "no ground is known there"


@dataclass
class Least:
    """The least spare distance so far, up to what is watched, and of what, where."""

    spare: float
    text: str = "nothing comes nearer"

    def check(self, name: str) -> Check:
        """As a check of that name, which holds where distance is left."""
        return Check(name, self.spare > 0, self.spare, "m", self.text)


@dataclass(frozen=True)
class RecheckedGround:
    """A piece of the ground without holes: its heights and its surface."""

    dem: Dem
    surface: MovingBody

    def highest(self, low: Array, high: Array) -> float:
        """Highest cell in a box (2,), (2,), or beside it [m]."""
        grid: GridGeometry = self.dem.geometry
        first = np.floor((low - (grid.x0, grid.y0)) / grid.resolution).astype(int)
        last = np.ceil((high - (grid.x0, grid.y0)) / grid.resolution).astype(int) + 1
        heights = self.dem.heights[max(first[1], 0) : max(last[1], 0), max(first[0], 0) : max(last[0], 0)]
        return float(heights.max()) if heights.size else -np.inf


class ClearanceCheck:
    """Gathers the least distances over all stretches; what is negative is −1 × the distance that is asked for."""

    def __init__(self, robot: Robot, dem: Dem, plan: CheckedMotion, watched: float) -> None:
        self.robot, self.dem, self.plan, self.watched = robot, dem, plan, watched
        self.own, self.ground = Least(watched), Least(watched)
        description = robot.description
        meshes = robot_meshes(description)
        self._bodies = {part: MovingBody(mesh) for part, mesh in meshes.items()}
        # a wheel that touches may sink in, and drift by a little
        sink = description.clearances.wheel_sink + DRIFT
        self._touching = MovingBody(
            shapes.cylinder_y(
                description.wheel_radius - sink, description.wheel_width - 2 * sink, description.wheel_sides
            )
        )
        self._chassis = ("base", PAYLOAD) if PAYLOAD in meshes else ("base",)
        self._pairs = self._own_pairs()
        self._pieces: dict[tuple[int, int], RecheckedGround | None] = {}
        self._reach = float(
            max(
                np.linalg.norm(leg.T_base_hip[:3, 3]) + leg.reaches[-1] + self._bodies["wheel"].radius
                for leg in description.legs
            )
        )

    def look(self, stretch: MotionStretch, pulse: Callable[[], None]) -> None:
        """Take a stretch into account."""
        self._look_at_own(stretch, pulse)
        self._look_at_ground(stretch, pulse)

    def grounded(self, number: int) -> None:
        """Take into account how a stance's new wheels, and the links that hold them, meet the ground."""
        stance = self.plan.stances[number]
        legs = self.robot.legs if number == 0 else self.plan.groups[number - 1]
        ground = self._around(stance.Ts_site_wheel[:, :2, 3].mean(axis=0))
        for leg in legs:
            T_wheel = stance.Ts_site_wheel[leg]
            T_ankle = T_wheel @ transform(translation=(-self.robot.description.legs[leg].foot, 0.0, 0.0))
            for part, T in (("ankle_roll", T_ankle), ("wheel", T_wheel)):
                self._to_ground(ground, link_name(leg, part), T[None], part == "wheel", lambda _: f"stance {number}")

    def checks(self) -> tuple[Check, ...]:
        """Of the rover to itself, and to the ground."""
        return self.own.check("self collision"), self.ground.check("terrain collision")

    def _look_at_own(self, stretch: MotionStretch, pulse: Callable[[], None]) -> None:
        count = len(stretch.qs)
        still = np.broadcast_to(np.eye(4), (count, 4, 4))
        Ts = {**stretch.Ts_base_link, **dict.fromkeys(self._chassis, still)}
        middles = {link: apply_each(Ts[link], self._body(link).middle) for link in Ts}
        moving = None if _all_move(stretch) else {link_name(leg, part) for leg in stretch.moving for part in PARTS}
        for a, b, asked in self._pairs:
            if moving is not None and a not in moving and b not in moving:
                continue
            body_a, body_b = self._body(a), self._body(b)
            away = np.sqrt(np.square(middles[a] - middles[b]).sum(axis=1))
            bounds = away - body_a.radius - body_b.radius - asked
            if bounds.min() >= self.own.spare or self.own.spare <= 0:
                continue
            pulse()
            found = nearest(body_a.shape, Ts[a], body_b, Ts[b], asked, bounds, self.own.spare)
            if found is not None:
                self.own = Least(found.spare, f"{a} and {b}, {stretch.where(found.at)}")

    def _look_at_ground(self, stretch: MotionStretch, pulse: Callable[[], None]) -> None:
        middle = stretch.Ts_site_base[len(stretch.qs) // 2, :2, 3]
        ground = self._around(middle)
        if _all_move(stretch):
            for link in self._chassis:
                pulse()
                self._to_ground(ground, link, stretch.Ts_site_base, False, stretch.where)
        for leg in self.robot.legs if _all_move(stretch) else stretch.moving:
            for part in PARTS:
                link = link_name(leg, part)
                if leg not in stretch.moving and part in LOCKED:
                    continue
                pulse()
                Ts = stretch.Ts_site(link)
                if part != "wheel":
                    self._to_ground(ground, link, Ts, False, stretch.where)
                    continue
                for phase in (LIFT, SWING, LOWER):
                    own = np.flatnonzero([one == phase for one in stretch.phases])
                    # a phase begins where the one before it ends
                    span = range(max(int(own[0]) - 1, 0), int(own[-1]) + 1)
                    self._to_ground(
                        ground,
                        link,
                        Ts[span.start : span.stop],
                        phase != SWING,
                        lambda at, first=span.start: stretch.where(first + at),
                    )

    def _to_ground(
        self, ground: RecheckedGround | None, link: str, Ts: Array, touching: bool, where: Callable[[int], str]
    ) -> None:
        """Take a link's way over the ground into account; one that touches may sink in."""
        least = self.ground
        if ground is None or least.spare <= 0:
            self.ground = least if ground is not None else Least(-np.inf, f"{link}: {_NO_GROUND}")
            return
        body, asked = self._body(link), self._asked(link)
        if touching:
            body, asked = self._touching, 0.0
        text = f"{link} and the ground"
        depth = self._depth(ground.dem, body, Ts[0])
        if depth > 0:
            self.ground = Least(-depth, f"{text}, {where(0)}")
            return
        places = body.places(Ts)
        beside = asked + self.watched
        low, high = places[..., :2].min(axis=(0, 1)) - beside, places[..., :2].max(axis=(0, 1)) + beside
        # 1 mm: heights are stored as float32
        above = places[..., 2].min(axis=1) - ground.highest(low, high) - 0.001
        bounds = np.minimum(above, beside) - asked
        still = np.broadcast_to(np.eye(4), Ts.shape)
        found = nearest(ground.surface.shape, still, body, Ts, asked, bounds, least.spare)
        if found is not None:
            self.ground = Least(found.spare, f"{text}, {where(found.at)}")

    def _depth(self, dem: Dem, body: MovingBody, T: Array) -> float:
        """How far the middle of a body is under the ground [m]; a surface does not meet what is wholly below it."""
        x, y, z = apply(T, body.middle)
        return float(np.nan_to_num(height_at(dem, x, y), nan=-np.inf)) - float(z)

    def _around(self, xy: Array) -> RecheckedGround | None:
        """The ground that the rover reaches when its chassis is at a place."""
        key = round(float(xy[0]) / PIECE), round(float(xy[1]) / PIECE)
        if key not in self._pieces:
            contacts = np.concatenate([stance.contacts for stance in self.plan.stances])
            radius = self._reach + PIECE + self.watched + max(self.robot.description.clearances.terrain.values())
            whole = without_holes(self.dem, PIECE * np.array(key, float), radius, contacts)
            self._pieces[key] = (
                None if whole is None else RecheckedGround(whole.dem, MovingBody(triangulate(whole.dem)))
            )
        return self._pieces[key]

    def _body(self, link: str) -> MovingBody:
        return self._bodies[link if link in self._bodies else link.split("_", 1)[1]]

    def _asked(self, link: str) -> float:
        deltas = self.robot.description.clearances
        return deltas.chassis_terrain if link in self._chassis else deltas.terrain[link.split("_", 1)[1]]

    def _own_pairs(self) -> Sequence[tuple[str, str, float]]:
        """Pairs of links and the distance that they must keep [m]."""
        deltas, legs = self.robot.description.clearances, self.robot.legs
        pairs = []
        for leg in legs:
            pairs += [("base", link_name(leg, part), asked) for part, asked in deltas.chassis.items()]
            pairs += [(link_name(leg, p.part_a), link_name(leg, p.part_b), p.distance) for p in deltas.own_leg]
            if PAYLOAD in self._chassis:
                pairs += [(PAYLOAD, link_name(leg, part), deltas.payload) for part in PARTS]
        for one, other in itertools.combinations(legs, 2):
            pairs += [(link_name(one, a), link_name(other, b), deltas.other_leg) for a in PARTS for b in PARTS]
        return pairs


def _all_move(stretch: MotionStretch) -> bool:
    """Whether no part was looked at where it is; after the first stretches, what keeps still has been."""
    return not stretch.moving or stretch.move == 0


def apply_each(Ts: Array, point: Array) -> Array:
    """A point (3,) fixed to a thing at poses (n, 4, 4), (n, 3)."""
    return Ts[:, :3, :3] @ point + Ts[:, :3, 3]
