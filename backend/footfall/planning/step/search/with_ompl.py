"""Our space handed to OMPL, and a path brought back: for SBL and for planners of OMPL's own, for comparison.

Traps of the bindings that this file takes care of: a planner status is true for approximate
solutions too, so it is compared with EXACT_SOLUTION; start and goal states belong to the problem and must not
be fetched from it (see sbl.py). Exceptions raised in our checks pass through OMPL.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from footfall.core.arrays import Array
from footfall.planning.step.search.edges import Space
from footfall.planning.step.search.sbl import SBL

ou.setLogLevel(ou.LOG_NONE)


class _Edges(ob.MotionValidator):
    """Edge checks of our space as OMPL asks for them."""

    def __init__(self, si: Any, space: Space) -> None:
        super().__init__(si)
        self._space = space

    def checkMotion(self, a: Any, b: Any, *last_valid: Any) -> bool:
        start, end = _array(a, len(self._space.lower)), _array(b, len(self._space.lower))
        return self._space.is_free(end) and self._space.edge_is_free(start, end)


def sbl(space: Space, start: Array, goal: Array, *, radius: float, milestones: int, seed: int) -> Array | None:
    """Waypoints found by :class:`~footfall.planning.step.search.sbl.SBL`.

    Args:
        space: what is free.
        start: (d,) [rad], free.
        goal: (d,) [rad], free.
        radius: of a step of the trees, at most [rad].
        milestones: how many, at most.
        seed: of what is drawn.

    Returns:
        (n, d) [rad], or None.
    """
    return _solve(space, start, goal, lambda si: SBL(si, radius, milestones, space.epsilon, seed))


def rrtconnect(space: Space, start: Array, goal: Array, *, radius: float, milestones: int, seed: int) -> Array | None:
    """Waypoints found by OMPL's RRTConnect.

    Args:
        space: what is free.
        start: (d,) [rad], free.
        goal: (d,) [rad], free.
        radius: its range [rad].
        milestones: bounds its iterations.
        seed: of what is drawn.

    Returns:
        (n, d) [rad], or None.
    """
    return _solve(space, start, goal, lambda si: _ranged(og.RRTConnect(si), radius), milestones, seed)


def kpiece(space: Space, start: Array, goal: Array, *, radius: float, milestones: int, seed: int) -> Array | None:
    """Waypoints found by KPIECE1, which grows one tree.

    Args:
        space: what is free.
        start: (d,) [rad], free.
        goal: (d,) [rad], free.
        radius: its range [rad].
        milestones: twenty of its iterations count as one.
        seed: of what is drawn.

    Returns:
        (n, d) [rad], or None.
    """
    return _solve(space, start, goal, lambda si: _ranged(og.KPIECE1(si), radius), 20 * milestones, seed)


def bitstar(space: Space, start: Array, goal: Array, *, radius: float, milestones: int, seed: int) -> Array | None:
    """Waypoints found by BIT*, which stops at its first path.

    Args:
        space: what is free.
        start: (d,) [rad], free.
        goal: (d,) [rad], free.
        radius: not used: it connects over any distance.
        milestones: bounds its iterations.
        seed: of what is drawn.

    Returns:
        (n, d) [rad], or None.
    """

    def make(si: Any) -> Any:
        planner = og.BITstar(si)
        planner.setStopOnSolnImprovement(True)
        return planner

    return _solve(space, start, goal, make, 20 * milestones, seed)


def _ranged(planner: Any, radius: float) -> Any:
    planner.setRange(radius)
    return planner


def _solve(
    space: Space, start: Array, goal: Array, make: Callable[[Any], Any], most: int | None = None, seed: int = 0
) -> Array | None:
    """most: how often a planner may ask whether to stop, about once an iteration.

    OMPL draws the seeds of new generators from one global generator, which is set before every query so that the query
    alone decides the path.
    """
    dimension = len(space.lower)
    states = ob.RealVectorStateSpace(dimension)
    bounds = ob.RealVectorBounds(dimension)
    for i in range(dimension):
        bounds.setLow(i, float(space.lower[i]))
        bounds.setHigh(i, float(space.upper[i]))
    states.setBounds(bounds)
    si = ob.SpaceInformation(states)
    si.setStateValidityChecker(lambda state: space.is_free(_array(state, dimension)))
    edges = _Edges(si, space)
    si.setMotionValidator(edges)
    si.setup()
    problem = ob.ProblemDefinition(si)
    first, last = states.allocState(), states.allocState()
    for i in range(dimension):
        first[i], last[i] = float(start[i]), float(goal[i])
    problem.setStartAndGoalStates(first, last)
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        space.tick()
        return most is not None and asked > most

    ou.RNG.setSeed(seed + 1)  # OMPL takes 0 for "from the clock"
    planner = make(si)
    planner.setProblemDefinition(problem)
    planner.setup()
    status = planner.solve(ob.PlannerTerminationCondition(stop))
    path = None
    if status == ob.PlannerStatus.EXACT_SOLUTION:
        path = np.array([_array(state, dimension) for state in problem.getSolutionPath().getStates()])
        path[0], path[-1] = start, goal
    return path


def _array(state: Any, dimension: int) -> Array:
    return np.array([state[i] for i in range(dimension)])
