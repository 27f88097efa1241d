"""The chassis' way over all its feet where the straight one is blocked: SBL on the manifold of a stance.

While all feet stand, each on a branch of its inverse kinematics, the pose of the chassis gives every joint. So the
configurations of a stance (its manifold, in Hauser, Bretl, Latombe & Wilcox, 2006) are poses of the chassis, and what
is drawn or lies between two of them needs no pulling back onto the contacts. The search is that of Sánchez & Latombe,
"A single-query bi-directional probabilistic roadmap planner with lazy collision checking", 2001: a tree of milestones
from each end, each milestone near another, and edges that are checked only where they join the trees.
"""

from itertools import pairwise

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.walk.body_kernel import HOLDS, Checks, configuration_fails
from footfall.planning.walk.body_way import At, BodyWay, Fails, body_way, feet_of, joined, straight_way
from footfall.planning.walk.legs_kernel import legs_at, pose_of
from footfall.planning.walk.transition_kernel import SIZES, vector_of

DRAWS = 60
"""Milestones that are drawn before there is no way."""
RADIUS = 1.0
"""How far a milestone is from the one that it is drawn near, at most, in SIZES."""
NEARER = 3
"""So often another is drawn, each time nearer, where one does not hold."""
_START, _GOAL = 0, 1


def searched_way(checks: Checks, at: At, T_site_base: Array, seed: int) -> BodyWay | Fails:
    """The chassis' way over all its feet to a pose as ``body_way`` finds it, and else by a search.

    Args:
        checks: of the chassis here.
        at: where the rover is.
        T_site_base: where the way ends, (4, 4).
        seed: of what is drawn.

    Returns:
        The way, every check of it holding; or what the straight one fails.
    """
    straight = body_way(checks, at, T_site_base)
    if not isinstance(straight, Fails):
        return straight
    return _Trees(checks, at, T_site_base, seed).way() or straight


class _Trees:
    """Milestones 0 and 1 are start and goal, the roots. parents: of each milestone; −1 of a root."""

    def __init__(self, checks: Checks, at: At, T_site_base: Array, seed: int) -> None:
        self._checks, self._at, self._T_goal = checks, at, T_site_base
        self._feet, self._rng = feet_of(at.stance), np.random.default_rng(seed)
        start, goal = (vector_of(np.ascontiguousarray(T[:3])) for T in (at.T_site_base, T_site_base))
        goal[5] = start[5] + (goal[5] - start[5] + np.pi) % (2.0 * np.pi) - np.pi
        self._vectors, self._parents, self._postures = [start, goal], [-1, -1], {_START: at.posture}
        # None: blocked, as the straight way from start to goal is
        self._ways: dict[tuple[int, int], BodyWay | None] = {(_START, _GOAL): None}

    def way(self) -> BodyWay | None:
        """From start to goal, as straight as it gets; None where no draw led there."""
        for draw in range(DRAWS):
            new = self._grown(draw % 2)
            if new is None:
                continue
            nearest = self._nearest(new, 1 - draw % 2)
            ends = (new, nearest) if draw % 2 == _START else (nearest, new)
            from_start, to_goal = self._chain(ends[0])[::-1], self._chain(ends[1])
            if self._holds(from_start, to_goal):
                return self._shortened([*from_start, *to_goal])
        return None

    def _grown(self, tree: int) -> int | None:
        """A new milestone of a tree, where one that holds is drawn."""
        members = self._members(tree)
        near = members[self._rng.integers(len(members))]
        for times in range(1, NEARER + 1):
            way = self._rng.standard_normal(6)
            far = RADIUS * self._rng.uniform() / (times * np.linalg.norm(way))
            vector = self._vectors[near] + far * SIZES * way
            posture = self._posture(vector)
            if posture is not None:
                new = len(self._vectors)
                self._vectors.append(vector)
                self._parents.append(near)
                self._postures[new] = posture
                return new
        return None

    def _posture(self, vector: Array) -> Array | None:
        """(legs × 6,) of the rover with its chassis there, where every check holds."""
        T, stance = np.empty((3, 4)), self._at.stance
        q, spares = np.empty_like(self._at.posture), np.empty(len(stance.branches))
        pose_of(vector, T)
        if not legs_at(T, self._feet, self._checks.legs, q, spares) >= 0.0:
            return None
        poses = np.empty((7 * len(spares), 3, 4))
        failed, _, _ = configuration_fails(q, T, stance.contacts, stance.normals, -1, self._checks, poses)
        return q if failed == HOLDS else None

    def _chain(self, milestone: int) -> list[int]:
        """From a milestone to its root."""
        chain = [milestone]
        while self._parents[chain[-1]] >= 0:
            chain.append(self._parents[chain[-1]])
        return chain

    def _members(self, tree: int) -> list[int]:
        return [one for one in range(len(self._vectors)) if self._chain(one)[-1] == tree]

    def _nearest(self, milestone: int, tree: int) -> int:
        here = self._vectors[milestone]
        return min(self._members(tree), key=lambda one: float(np.linalg.norm((self._vectors[one] - here) / SIZES)))

    def _holds(self, from_start: list[int], to_goal: list[int]) -> bool:
        """Whether every edge does; else the milestones cut off by the first that does not join the other tree."""
        milestones, bridge = [*from_start, *to_goal], len(from_start) - 1
        for i, (before, after) in enumerate(pairwise(milestones)):
            if self._edge(before, after) is not None:
                continue
            for k in range(i + 1, bridge + 1):
                self._parents[milestones[k]] = milestones[k + 1]
            for k in range(bridge + 1, i + 1):
                self._parents[milestones[k]] = milestones[k - 1]
            return False
        return True

    def _edge(self, before: int, after: int) -> BodyWay | None:
        """The straight way between two milestones, where it holds."""
        if (before, after) not in self._ways:
            T_before, T_after = self._pose(before), self._pose(after)
            found = straight_way(self._checks, At(self._at.stance, T_before, self._postures[before]), T_after)
            self._ways[before, after] = None if isinstance(found, Fails) else found
        return self._ways[before, after]

    def _pose(self, milestone: int) -> Array:
        if milestone in (_START, _GOAL):
            return (self._at.T_site_base, self._T_goal)[milestone]
        T = np.eye(4)
        pose_of(self._vectors[milestone], T[:3])
        return T

    def _shortened(self, milestones: list[int]) -> BodyWay:
        """The way along milestones, each left out that the straight way past it does without."""
        ways, i = [], 0
        while i < len(milestones) - 1:
            for k in range(len(milestones) - 1, i, -1):
                way = self._edge(milestones[i], milestones[k])
                if way is not None:
                    ways.append(way)
                    i = k
                    break
        return joined(ways)
