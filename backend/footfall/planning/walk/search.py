"""The search of stances: best first, each foot move tried only when its turn comes.

After Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006), §4: a stance is worth
more the nearer its feet are to where they stand at the goal and the more they are as the rover stands at ease; what
was tried and not found gets dearer, and is tried again later. Unlike there, a foot move is planned whole, with its
motion, as soon as its turn comes: that takes milliseconds.
"""

import heapq
import math
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.planning.scene.rover_kernel import wheel_cuts
from footfall.planning.walk.body_kernel import Checks
from footfall.planning.walk.body_search import searched_way
from footfall.planning.walk.body_way import At, BodyWay, Fails, body_way, feet_of
from footfall.planning.walk.chains import moves_left
from footfall.planning.walk.foot_move import Moved, foot_move, nobody
from footfall.planning.walk.footfalls import Footfalls, barred_to
from footfall.planning.walk.guide import Guide
from footfall.planning.walk.legs_kernel import pose_of
from footfall.planning.walk.pins import Pins
from footfall.planning.walk.problem import Stance, WalkGoal
from footfall.planning.walk.reach import reach_of, reaches, steps_onto
from footfall.planning.walk.transition_kernel import find_pose, vector_of
from footfall.planning.walk.world import World
from footfall.planning.watch import Watch

STRIDE = 0.4
"""How far a foot's span gets in one foot move, for the estimate of what is left [m]."""
DONE, LEFT = 0.4, 1.0
"""Weights of what was done and of what is left: the first walk counts, better ones come of smoothing."""
BEHIND = 3.0
"""The foot that is farthest behind counts for so many more."""
LACKING = 6.0
"""Cost of each metre by which the spans of a stance miss each other."""
EASE, ENOUGH = 8.0, 0.2
"""Cost of each metre or radian that a leg has less than ENOUGH to spare, at its best."""
PLACES = 8
"""Places that wait for each leg."""
LEAST_MOVE = 0.12
"""A foot that goes less far stays [m]."""
FEET_APART = 0.5
"""Contacts are at least so far apart [m]: wheels of two legs would touch."""
DEARER, TRIES = 1.0, 3
"""What a foot move that was not found costs more when it is tried again; how often it is tried."""
FIRST_TRIED, TRIED_A_METRE = 50, 12
"""Foot moves that the first attempt may try, at least and for each metre; each later one may try twice as many."""
NOISE = 0.5
"""Mean of what is added to the costs of later attempts."""
STUCK = 0.1
"""What it costs that a leg could not be moved from where it stands, each time."""
FORWARD = 0.7
"""Where in the part of the guide that suits a foot move the chassis is to be, as a share of it."""
CLOSE = 0.1
"""How far the spans of a stance may be from the goal, and the chassis is still tried to get there [m]."""
CLOSING_LOOKS = 160


@dataclass(frozen=True, eq=False)
class Reached:
    """A stance that was reached, and how: ``moved`` from ``before``; pins: which pinned places have had a foot.

    places: (legs,) the number of the footfall under each foot, −1 where it has not moved yet; low, high: (legs,) the
    span of each foot [m]; left: what is estimated to be left.
    """

    at: At
    cost: float
    places: NDArray[np.int64]
    low: Array
    high: Array
    left: float
    before: "Reached | None" = None
    moved: Moved | None = None
    pins: frozenset[int] = frozenset()

    def way(self) -> list[Moved]:
        """The foot moves from the start to here."""
        moves, one = [], self
        while one.before is not None and one.moved is not None:
            moves.append(one.moved)
            one = one.before
        return moves[::-1]


@dataclass(order=True)
class _Open:
    """A foot move that waits for its turn; begin, end: the part of the guide that suits it [m]."""

    priority: float
    number: int
    before: Reached = field(compare=False)
    leg: int = field(compare=False)
    place: int = field(compare=False)
    begin: float = field(compare=False)
    end: float = field(compare=False)
    tries: int = field(compare=False, default=0)


@dataclass
class Search:
    """One search for a walk. attempt: its number; a later one ranks foot moves otherwise, at random, and may try more.

    nearest: the best stance so far; failures: check, leg, x, y and how often; tried: how many foot moves.
    """

    world: World
    places: Footfalls
    guide: Guide
    goal: WalkGoal
    start: At
    watch: Watch
    attempt: int = 0
    nearest: Reached = field(init=False)
    failures: Counter[tuple[str, int, float, float]] = field(default_factory=Counter)
    tried: int = 0

    def __post_init__(self) -> None:
        settings = self.world.settings
        self._rng = np.random.Generator(np.random.PCG64([settings.seed, self.attempt]))
        self._noise = NOISE if self.attempt else 0.0
        self._open: list[_Open] = []
        self._seen: set[tuple[bytes, frozenset[int]]] = set()
        self._sit: set[tuple[int, int]] = set()
        self._stuck: Counter[tuple[int, int]] = Counter()
        self._number = 0
        self._reaches = reaches(self.world, self.guide, self.places)
        self._barred = [barred_to(leg, self.places, settings) for leg in self.world.robot.legs]
        low, high = reach_of(self.world, self.guide, self.start.stance)
        unheld = np.full(len(low), -1, np.int64)
        self._detours = [self._detours_of(leg, low[leg], high[leg]) for leg in self.world.robot.legs]
        reach_to = np.array(
            [np.where(own, -np.inf, one.high) for own, one in zip(self._barred, self._reaches, strict=True)]
        )
        self._pins = Pins(len(settings.pinned), self.places.pinned, reach_to, self.guide.length, STRIDE)
        left = self._left_of(low, high, unheld, frozenset())
        self.nearest = Reached(self.start, 0.0, unheld, low, high, left)

    def way_of(self, checks: Checks, at: At, T_site_base: Array) -> BodyWay | Fails:
        """The chassis' way; the first attempt, which mostly is enough, does not search for one."""
        if not self.attempt:
            return body_way(checks, at, T_site_base)
        return searched_way(checks, at, T_site_base, self.world.settings.seed)

    def run(self) -> tuple[Reached, BodyWay] | None:
        """Search until the chassis is at the goal; None where there is nothing more to try in this attempt."""
        first = self.nearest
        found = self._closed(first)
        if found is not None:
            return first, found
        self._expand(first)
        most = (FIRST_TRIED + TRIED_A_METRE * self.guide.length) * 2**self.attempt
        while self._open and self.tried < most:
            self.watch.tick()
            reached = self._tried(heapq.heappop(self._open))
            if reached is None:
                continue
            if reached.left < self.nearest.left:
                self.nearest = reached
                share = 1.0 - reached.left / max(first.left, 1e-9)
                self.watch.phase(min(0.05 + 0.9 * share, 0.95), f"foot moves planned: {len(reached.way())}")
            found = self._closed(reached)
            if found is not None:
                return reached, found
            self._expand(reached)
        return None

    @cached_property
    def _come_to(self) -> list[NDArray[np.int64]]:
        """Of each leg the footfalls that it may ever stand on."""
        settings, feet = self.world.settings, self.start.stance.contacts
        return [steps_onto(leg, reach, self.places, feet[leg, :2], settings) for leg, reach in enumerate(self._reaches)]

    def out_of_reach(self) -> tuple[int, float] | None:
        """A leg that comes to no footfall on which it stands with the chassis at the goal.

        And how much of the way is left where it has its last [m]; None where every leg comes to one. Without it no
        stance ends the search, whatever is tried.
        """
        end, worst = self.guide.length, None
        for leg, (reach, free) in enumerate(zip(self._reaches, self._come_to, strict=True)):
            low = np.append(reach.low[free], self.nearest.low[leg])
            high = np.append(reach.high[free], self.nearest.high[leg])
            left = end - float(high.max())
            if not _ends(low, high, end).any() and (worst is None or left > worst[1]):
                worst = leg, left
        return worst

    def unreached_pin(self) -> tuple[int, float] | None:
        """A pinned place that no leg which may comes to, and how far it is from what they come to [m].

        Nor is it found whatever is tried; None where every pinned place is come to.
        """
        places = self.places
        for pin, place in enumerate(self.world.settings.pinned):
            rows = np.concatenate([own for leg, own in enumerate(self._come_to) if place.leg in (None, leg)])
            if not (places.pinned[rows] == pin).any():
                away = np.hypot(*(places.contacts[rows, :2] - (place.x, place.y)).T)
                return pin, float(away.min(initial=np.inf))
        return None

    def _tried(self, chosen: _Open) -> Reached | None:
        before, leg, place = chosen.before, chosen.leg, chosen.place
        under = before.places.copy()
        under[leg] = place
        pins = before.pins | self._pins.of(place)
        key = under.tobytes(), pins
        if key in self._seen:
            return None
        self.tried += 1
        to = self._stance(before.at.stance, leg, place)
        if not self._sits(before.at, leg, place):
            return None
        share = FORWARD if chosen.tries == 0 else float(self._rng.uniform())
        aim = self.guide.at(chosen.begin + share * (chosen.end - chosen.begin))
        moved = foot_move(self.world, before.at, leg, to, aim, self._rng, self.way_of)
        if isinstance(moved, Fails):
            x, y = np.round(to.contacts[leg, :2], 1)
            self.failures[moved.check, moved.leg, float(x), float(y)] += 1
            self._stuck[leg, int(before.places[leg])] += 1
            if chosen.tries + 1 < TRIES:
                chosen.tries += 1
                chosen.priority += DEARER * chosen.tries
                heapq.heappush(self._open, chosen)
            return None
        self._seen.add(key)
        low, high = before.low.copy(), before.high.copy()
        low[leg], high[leg] = self._reaches[leg].low[place], self._reaches[leg].high[place]
        left = self._left_of(low, high, under, pins)
        cost = before.cost + 1.0 + _way_cost(moved) + float(self.places.costs[place])
        return Reached(moved.to, cost, under, low, high, left, before, moved, pins)

    def _stance(self, stance: Stance, leg: int, place: int) -> Stance:
        """The stance with a foot on a place."""
        contacts, normals = np.array(stance.contacts), np.array(stance.normals)
        contacts[leg], normals[leg] = self.places.contacts[place], self.places.normals[place]
        Ts_site_wheel, branches = np.array(stance.Ts_site_wheel), np.array(stance.branches)
        Ts_site_wheel[leg], branches[leg] = self._reaches[leg].Ts_site_wheel[place], 0
        return Stance(contacts, normals, Ts_site_wheel, branches)

    def _sits(self, at: At, leg: int, place: int) -> bool:
        """Whether the wheel may stand there as far as the ground goes; where not, it is not asked about again."""
        if (leg, place) not in self._sit:
            rover = self.world.around(at.T_site_base).checks.rover
            wheel = np.ascontiguousarray(self._reaches[leg].Ts_site_wheel[place, :3])
            self._sit.add((leg, place))
            self._barred[leg][place] |= wheel_cuts(wheel, rover) < 0.0
            if self._barred[leg][place]:
                x, y = np.round(self.places.contacts[place, :2], 1)
                self.failures["a wheel cuts into the ground", leg, float(x), float(y)] += 1
        return not self._barred[leg][place]

    def _detours_of(self, leg: int, low: float, high: float) -> Array:
        """What a leg has left of the way by the foot moves that lead to the end at least, (n + 1,) [m].

        That is from each footfall, and last from where it stands, with that span. A foot may have to go aside, or back,
        before it gets on: by spans alone a search comes to where there is no way on, and tries all that the other feet
        can do. The first attempt goes by spans alone.
        """
        reach = self._reaches[leg]
        out = np.zeros(len(reach.low) + 1)
        if not self.attempt:
            return out
        xy = np.vstack([self.places.contacts[:, :2], self.start.stance.contacts[leg, :2]])
        lows, highs = np.append(reach.low, low), np.append(reach.high, high)
        rows = np.flatnonzero(np.isfinite(lows) & ~np.append(self._barred[leg], False))
        xy, lows, highs = xy[rows], lows[rows], highs[rows]
        moves = moves_left(_ends(lows, highs, self.guide.length), xy, lows, highs, self.world.settings.longest)
        if np.isfinite(moves).any():
            out[rows] = STRIDE * np.where(np.isfinite(moves), moves, moves[np.isfinite(moves)].max() + 1.0)
        return out

    def _detours_at(self, places: NDArray[np.int64]) -> Array:
        """The same of the feet of a stance, by the places under them, (legs,) [m]."""
        return np.array([detours[place] for detours, place in zip(self._detours, places, strict=True)])

    def _left(self, low: Array, high: Array, detours: Array, unmet: NDArray[np.bool_]) -> Array:
        """What is left to do over stances with spans and detours (n, legs), (n,); unmet: pinned places (n, pins)."""
        end = self.guide.length
        short = np.maximum(end - np.maximum(high, 0.0), 0.0) + np.maximum(np.minimum(low, 2.0 * end + 1.0) - end, 0.0)
        short = np.maximum(short, detours)
        left = (short.sum(axis=1) + BEHIND * short.max(axis=1)) / STRIDE
        return left + self._pins.left(low, high, unmet)

    def _left_of(self, low: Array, high: Array, under: NDArray[np.int64], pins: frozenset[int]) -> float:
        """The same of one stance with feet on places (legs,)."""
        detours = self._detours_at(under)
        return float(self._left(low[None], high[None], detours[None], self._pins.unmet(pins)[None])[0])

    def _expand(self, reached: Reached) -> None:
        """Let the foot moves from a stance that are worth most wait for their turn."""
        contacts = np.array(reached.at.stance.contacts)
        for leg in range(len(contacts)):
            others = np.arange(len(contacts)) != leg
            reach, own = self._reaches[leg], self.places.contacts
            away = np.hypot(own[:, 0] - contacts[leg, 0], own[:, 1] - contacts[leg, 1])
            good = (away >= LEAST_MOVE) & (away <= self.world.settings.longest)
            good &= np.isfinite(reach.low) & ~self._barred[leg]
            rows = np.flatnonzero(good)
            apart = np.linalg.norm(own[rows, None, :2] - contacts[None, others, :2], axis=2).min(axis=1)
            rows = rows[apart >= FEET_APART]
            begin = np.maximum(max(reached.low.max(), 0.0), reach.low[rows])
            end = np.minimum(min(reached.high.min(), self.guide.length), reach.high[rows])
            low, high = np.tile(reached.low, (len(rows), 1)), np.tile(reached.high, (len(rows), 1))
            low[:, leg], high[:, leg] = reach.low[rows], reach.high[rows]
            unmet = self._pins.unmet_on(rows, reached.pins)
            detours = np.tile(self._detours_at(reached.places), (len(rows), 1))
            detours[:, leg] = self._detours[leg][rows]
            priority = DONE * (reached.cost + 1.0) + LEFT * self._left(low, high, detours, unmet)
            priority += LACKING * np.clip(begin - end, 0.0, 1.0) + EASE * np.maximum(ENOUGH - reach.best[rows], 0.0)
            priority += self.places.costs[rows]
            priority += self._noise * self._rng.exponential(size=len(rows))
            priority += STUCK * self._stuck[leg, int(reached.places[leg])]
            for i in np.argsort(priority, kind="stable")[:PLACES]:
                self._number += 1
                waits = (reached, leg, int(rows[i]), float(begin[i]), float(end[i]))
                heapq.heappush(self._open, _Open(float(priority[i]), self._number, *waits))

    def _closed(self, reached: Reached) -> BodyWay | None:
        """The chassis' way to the goal over a stance, where there is one."""
        end = self.guide.length
        if not _ends(reached.low, reached.high, end).all():
            return None
        if len(reached.pins) < self._pins.count:
            return None
        aim = self.guide.vectors[-1]
        checks = self.world.around(reached.at.T_site_base).checks
        now = vector_of(np.ascontiguousarray(reached.at.T_site_base[:3]))
        if reached.before is None and self._is_there(now):
            stays = body_way(checks, reached.at, np.array(reached.at.T_site_base))
            if not isinstance(stays, Fails):
                return stays
        best = np.empty(6)
        lacks = find_pose(
            np.array([aim, now]),
            aim,
            feet_of(reached.at.stance),
            nobody(reached.at.stance),
            self.world.legs,
            checks.rover,
            checks.balance,
            self._rng,
            CLOSING_LOOKS,
            best,
        )
        if lacks > 0.0 or not self._is_there(best):
            return None
        T = np.eye(4)
        pose_of(best, T[:3])
        found = self.way_of(checks, reached.at, T)
        if isinstance(found, Fails):
            self.failures[found.check, found.leg, round(self.goal.x, 1), round(self.goal.y, 1)] += 1
            return None
        return found

    def _is_there(self, vector: Array) -> bool:
        """Whether a chassis there, (6,), is at the goal."""
        if self.world.hung is not None:
            return self.world.hung.is_at_goal(vector)
        if math.hypot(vector[0] - self.goal.x, vector[1] - self.goal.y) > self.goal.within:
            return False
        return self.goal.yaw is None or abs(_angle(vector[5] - self.goal.yaw)) <= self.goal.turned


def _ends(low: Array, high: Array, end: float) -> NDArray[np.bool_]:
    """Which spans are so near the end of the guide that the chassis is tried to get there."""
    return (low <= end + CLOSE) & (high >= end - CLOSE)


def _angle(angle: float) -> float:
    """The same angle in [−π, π)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def _way_cost(moved: Moved) -> float:
    """What a foot move costs besides being one: the chassis' way, and torque near its limit."""
    at = moved.body.Ts_site_base[:, :3, 3]
    way = float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
    return 0.3 * way + 0.2 * float(moved.torques.max()) ** 2
