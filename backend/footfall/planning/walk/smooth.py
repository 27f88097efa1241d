"""Smoothing of a whole walk: fewer foot moves, and better poses of the chassis for those that stay.

Every change goes through the checked motions that the search plans with, and is taken only where the walk then costs
less: so a walk is as good as found at any time, and what can't be checked is left alone.
"""

from dataclasses import replace

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.walk.body_way import At, BodyWay, Fails, body_way, feet_of
from footfall.planning.walk.foot_move import Moved, foot_move, foot_move_at, move_of, nobody
from footfall.planning.walk.legs_kernel import leg_at, pose_of
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.search import FEET_APART
from footfall.planning.walk.smooth_cost import Cost, Way
from footfall.planning.walk.smooth_kernel import Measures, MoveInWalk, better_pose
from footfall.planning.walk.smoothing import Smoothed, WalkFigures
from footfall.planning.walk.transition_kernel import SIZES
from footfall.planning.walk.world import World
from footfall.planning.watch import OutOfTime, Watch

LOOKS = 40
"""Poses that are looked at for one foot move in a round."""
LEAST_GAIN = 0.1
"""What a pose must promise to cost less; below, its motions are not planned again."""
MOST_LACKED = 0.2
"""A foot move is not left out where its leg would lack more at the poses that there are [m, rad]."""
IN_PLACE = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])
"""What changes of the last pose, where the goal says the rest: height and lean."""


def smoothed(
    world: World, start: At, moves: list[Moved], closing: BodyWay, height: float, watch: Watch
) -> tuple[list[Moved], BodyWay, Smoothed | None]:
    """The foot moves and the chassis' last way, smoothed as the settings say.

    Where the time limit passes the walk is as far smoothed as it is. A rover that is at its goal stays.

    Args:
        world: rover, ground and settings of the walk.
        start: where the rover is at first.
        moves: the foot moves.
        closing: the chassis' way after the last of them.
        height: of the chassis above its feet that is wanted where no posture was asked for [m].
        watch: progress and time limit.

    Returns:
        Moves and last way after smoothing, and what came of it; None: nothing was smoothed.
    """
    rounds = world.settings.smoothing.rounds
    if not rounds or not moves:
        return moves, closing, None
    smoothing = _Smoothing(world, Way(start, tuple(moves), closing), Cost(world, height), watch)
    before = smoothing.figures()
    cut_short = not smoothing.run(rounds)
    return list(smoothing.way.moves), smoothing.way.closing, Smoothed(before, smoothing.figures(), cut_short)


class _Smoothing:
    """A walk on its way to a better one: ``way`` is good and checked at any time."""

    def __init__(self, world: World, way: Way, cost: Cost, watch: Watch) -> None:
        self._world, self.way, self._cost, self._watch = world, way, cost, watch
        self._rng = np.random.Generator(np.random.PCG64([world.settings.seed, len(way.moves)]))

    def figures(self) -> WalkFigures:
        return self._cost.figures(self.way)

    def run(self, rounds: int) -> bool:
        """Whether it came to its end within the time limit."""
        try:
            self._watch.phase(0.96, "leaving out foot moves")
            self._shorten()
            for number in range(rounds):
                self._watch.phase(0.97, f"smoothing, round {number + 1} of {rounds}")
                for at in range(len(self.way.moves) + 1):
                    self._watch.tick()
                    self._better(at)
        except OutOfTime:
            return False
        return True

    def _take(self, other: Way, first: int, last: int, left_out: int = 0) -> bool:
        """Take another way if it costs less in foot moves ``first`` to ``last``, of which it may have fewer."""
        now = sum(self._cost.of(self.way, number) for number in range(first, last + 1))
        then = sum(self._cost.of(other, number) for number in range(first, last + 1 - left_out))
        if then < now:
            self.way = other
        return then < now

    # poses

    def _better(self, number: int) -> None:
        """A better pose of the chassis for a foot move, or at the end."""
        way, at = self.way, self.way.at(number)
        closing = number == len(way.moves)
        checks = self._world.around(at.T_site_base).checks
        moved = None if closing else way.moves[number]
        move = nobody(at.stance) if moved is None else move_of(self._world, at.stance, moved.leg, moved.to.stance)
        now, before = way.vector(number), way.vector(number - 1)
        after = before if closing else way.vector(number + 1)
        best = np.empty(6)
        gain = better_pose(
            now,
            _guesses(now, before, after, self._cost.height_above(at.stance), closing),
            SIZES * IN_PLACE if closing else SIZES,
            MoveInWalk(before, after, feet_of(at.stance), at.stance.normals, move),
            Measures(self._world.legs, checks, self._cost.weights(checks)),
            self._rng,
            LOOKS,
            best,
        )
        if gain < LEAST_GAIN:
            return
        other = self._ended(way, best) if moved is None else self._posed(way, number, best)
        if other is not None:
            self._take(other, number, min(number + 1, len(way.moves)))

    def _posed(self, way: Way, number: int, vector: Array) -> Way | None:
        """The way with the chassis elsewhere in a foot move, or None where a check fails."""
        old = way.moves[number]
        moved = foot_move_at(self._world, way.at(number), old.leg, old.to.stance, vector, self._rng)
        if isinstance(moved, Fails):
            return None
        then = self._body(moved.to, way.pose(number + 1))
        return None if then is None else way.with_move(number, moved, then)

    def _ended(self, way: Way, vector: Array) -> Way | None:
        if self._world.hung is not None and not self._world.hung.is_at_goal(vector):
            return None
        T = np.eye(4)
        pose_of(vector, T[:3])
        closing = self._body(way.at(len(way.moves)), T)
        return None if closing is None else replace(way, closing=closing)

    def _body(self, at: At, T_site_base: Array) -> BodyWay | None:
        found = body_way(self._world.around(at.T_site_base).checks, at, T_site_base)
        return None if isinstance(found, Fails) else found

    # foot moves

    def _shorten(self) -> None:
        """Leave out foot moves where the foot may stay until it is moved next, or for good."""
        number = 0
        while number < len(self.way.moves):
            self._watch.tick()
            if not self._left_out(number):
                number += 1

    def _left_out(self, number: int) -> bool:
        """Leave out a foot move: the foot stays until it is moved next, or goes at once to where it is put then."""
        way, leg = self.way, self.way.moves[number].leg
        if self._is_pinned(number):
            return False
        own = (k for k in range(number + 1, len(way.moves)) if way.moves[k].leg == leg)
        until = next(own, len(way.moves))
        here = way.at(number).stance
        if until == len(way.moves):
            return self._instead(number, until, range(number + 1, until), here)
        there = way.moves[until].to.stance
        if np.hypot(*(there.contacts[leg] - here.contacts[leg])[:2]) > self._world.settings.longest:
            return False
        late, early = range(number + 1, until + 1), range(number, until)
        return self._instead(number, until, late, here) or self._instead(number, until, early, there)

    def _instead(self, number: int, until: int, kept: range, foot: Stance) -> bool:
        """Make only the foot moves ``kept`` of ``number`` to ``until``, with the foot of ``number`` as in a stance."""
        way, leg = self.way, self.way.moves[number].leg
        if not self._may_stand(foot, leg, kept, min(until, len(way.moves))):
            return False
        moves = list(way.moves[:number])
        for k in kept:
            old, at = way.moves[k], moves[-1].to if moves else way.start
            to = old.to.stance if k == until else _with_foot_of(old.to.stance, foot, leg)
            moved = foot_move(self._world, at, old.leg, to, way.vector(k), self._rng)
            if isinstance(moved, Fails):
                return False
            moves.append(moved)
        then = self._body(moves[-1].to if moves else way.start, way.pose(min(until + 1, len(way.moves))))
        if then is None:
            return False
        rest, closing = list(way.moves[until + 1 :]), way.closing
        if rest:
            rest[0] = replace(rest[0], body=then)
        else:
            closing = then
        other = Way(way.start, (*moves, *rest), closing)
        return self._take(other, number, min(until + 1, len(way.moves)), left_out=1)

    def _is_pinned(self, number: int) -> bool:
        """Whether a foot move puts its foot on a pinned place."""
        moved = self.way.moves[number]
        x, y = moved.to.stance.contacts[moved.leg, :2]
        return any(
            place.leg in (None, moved.leg) and np.hypot(x - place.x, y - place.y) <= place.radius
            for place in self._world.settings.pinned
        )

    def _may_stand(self, foot: Stance, leg: int, kept: range, until: int) -> bool:
        """Whether a leg's foot is likely to be good where it is in a stance, in all of some foot moves."""
        contact, q = foot.contacts[leg], np.empty(6)
        wheel, branch = np.ascontiguousarray(foot.Ts_site_wheel[leg, :3]), int(foot.branches[leg])
        for k in {*kept, until}:
            others = np.delete(self.way.at(k).stance.contacts, leg, axis=0)
            if np.hypot(*(others - contact)[:, :2].T).min() < FEET_APART:
                return False
        for k in kept:
            T = np.ascontiguousarray(self.way.pose(k)[:3])
            if leg_at(T, wheel, branch, leg, self._world.legs, q) < -MOST_LACKED:
                return False
        return True


def _guesses(now: Array, before: Array, after: Array, height: float, closing: bool) -> Array:
    """Poses (n, 6) to look at first: at the height wanted, and between those before and after."""
    level = now.copy()
    level[2] = height
    half = now.copy()
    half[2] = 0.5 * (now[2] + height)
    if closing:
        return np.array([level, half])
    return np.array([level, half, 0.5 * (before + after), 0.5 * now + 0.25 * (before + after)])


def _with_foot_of(stance: Stance, other: Stance, leg: int) -> Stance:
    """A stance with one foot where it is in another."""
    parts = []
    for name in ("contacts", "normals", "Ts_site_wheel", "branches"):
        part = np.array(getattr(stance, name))
        part[leg] = getattr(other, name)[leg]
        parts.append(part)
    return Stance(*parts)
