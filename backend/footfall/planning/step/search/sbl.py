"""SBL: single query, bi-directional, lazy in collision checking, as a planner of OMPL.

G. Sánchez & J.-C. Latombe, "A single-query bi-directional probabilistic roadmap planner with lazy
collision checking", ISRR 2001, and "On delaying collision checking in PRM planning", IJRR 2002. OMPL's own SBL is
not bound in Python. Distances are in the maximum norm.
"""

import heapq
import itertools

import numpy as np
from ompl import base as ob
from ompl import geometric as og

from footfall.core.arrays import Array
from footfall.planning.step.search.roadmap import Roadmap

SHRINKS = 64
"""Radii ρ/1 … ρ/64 tried around one milestone before another is picked."""


class SBL(ob.Planner):
    """Grow a tree of milestones from the start and one from the goal; check a path only once they meet.

    radius: ρ, largest change of a coordinate between neighbouring milestones. milestones: the bound s.
    epsilon: segments are checked by bisection until the pieces change no coordinate by more than this.
    seed: of the planner's own generator (PCG64); the same seed gives the same roadmap in any process.

    Needs a bounded RealVectorStateSpace. ``solve`` returns EXACT_SOLUTION, TIMEOUT (milestones or time
    used up) or INVALID_START / INVALID_GOAL.
    """

    def __init__(self, si: ob.SpaceInformation, radius: float, milestones: int, epsilon: float, seed: int) -> None:
        super().__init__(si, "SBL")
        self._radius, self._milestones, self._epsilon = radius, milestones, epsilon
        self._seed = seed
        self.grown = 0

    def clear(self) -> None:
        """Forget the last query."""
        super().clear()
        self.grown = 0

    def solve(self, ptc: ob.PlannerTerminationCondition) -> ob.PlannerStatus:
        """Search until solved, s milestones are placed, or ``ptc`` says stop."""
        si = self.getSpaceInformation()
        space = si.getStateSpace()
        dimension = space.getDimension()
        bounds = space.getBounds()
        lower = np.array([bounds.low[i] for i in range(dimension)])
        upper = np.array([bounds.high[i] for i in range(dimension)])
        scratch = space.allocState()

        def free(q: Array) -> bool:
            for i in range(dimension):
                scratch[i] = float(q[i])
            return si.isValid(scratch)

        # getStartState() of the problem hands out a state that it still owns; the planner's inputs don't
        inputs = self.getPlannerInputStates()
        inputs.restart()
        inputs.update()
        first, last = inputs.nextStart(), inputs.nextGoal()
        if first is None:
            return ob.PlannerStatus.INVALID_START
        if last is None:
            return ob.PlannerStatus.INVALID_GOAL
        start, goal = (np.array([state[i] for i in range(dimension)]) for state in (first, last))

        rng = np.random.Generator(np.random.PCG64(self._seed))
        roadmap = Roadmap(lower, upper, start, goal, rng)
        newest = 0
        while not ptc():
            route = self._connect(roadmap, newest, free)
            if route is not None:
                path = og.PathGeometric(si)
                for index in route:
                    for i in range(dimension):
                        scratch[i] = float(roadmap.q[index, i])
                    path.append(scratch)
                self.getProblemDefinition().addSolutionPath(path)
                return ob.PlannerStatus.EXACT_SOLUTION
            if self.grown >= self._milestones:
                break
            grown = self._expand(roadmap, rng, lower, upper, free, ptc)
            if grown is None:
                break
            newest = grown
            self.grown += 1
        return ob.PlannerStatus.TIMEOUT

    def _expand(self, roadmap: Roadmap, rng: np.random.Generator, lower: Array, upper: Array, free, ptc) -> int | None:
        """EXPAND-TREE: one new free milestone near a picked one, in boxes that shrink as ρ/1, ρ/2 and so on."""
        side = int(rng.integers(2))
        while not ptc():
            m = roadmap.pick(side)
            around = roadmap.q[m]
            for i in range(1, SHRINKS + 1):
                reach = self._radius / i
                q = rng.uniform(np.maximum(lower, around - reach), np.minimum(upper, around + reach))
                if free(q):
                    return roadmap.add(q, m)
        return None

    def _connect(self, roadmap: Roadmap, newest: int, free) -> list[int] | None:
        """CONNECT-TREES: bridge the newest milestone to the closest of the other tree, if within ρ."""
        other, distance = roadmap.closest_opposite(newest)
        if distance >= self._radius:
            return None
        roadmap.join(newest, other)
        route = roadmap.route(newest, other)
        blocked = self._first_colliding(roadmap, route, free)
        if blocked is None:
            return route
        roadmap.remove(*blocked)
        return None

    def _first_colliding(self, roadmap: Roadmap, route: list[int], free) -> tuple[int, int] | None:
        """TEST-PATH: halve the segments in the order of their check scores until all are fine or one collides."""
        queue: list[tuple[float, int, int]] = []

        def put(i: int, j: int) -> None:
            if roadmap.remaining_levels(i, j, self._epsilon) > 0:
                heapq.heappush(queue, (-roadmap.unchecked_length(i, j), i, j))

        for i, j in itertools.pairwise(route):
            put(i, j)
        while queue:
            _, i, j = heapq.heappop(queue)
            if not all(free(q) for q in roadmap.next_points(i, j)):
                return i, j
            put(i, j)
        return None
