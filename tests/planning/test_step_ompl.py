"""OMPL's planners that are there for comparison: they pass a gap, repeat themselves, and stop when asked."""

import itertools

import numpy as np
import pytest

from footfall.core.errors import Cancelled
from footfall.planning.joint_path import samples
from footfall.planning.step.planners import REGISTRY
from footfall.planning.step.problem import PLANNERS
from footfall.planning.step.search import with_ompl
from footfall.planning.step.search.edges import Space
from footfall.planning.step.turns import AUTO, QUICK, RACE

SEARCHES = {"kpiece": with_ompl.kpiece, "bitstar": with_ompl.bitstar}
START, GOAL = np.array([-0.6, -0.6]), np.array([0.6, -0.6])
EPSILON = 0.01


def wall(gap, thickness=0.05):
    return lambda q: not (abs(q[0]) < thickness and abs(q[1]) > gap)


def found(name, free, seed=1, milestones=5000, tick=lambda: None):
    space = Space(-np.ones(2), np.ones(2), free, EPSILON, tick)
    return SEARCHES[name](space, START, GOAL, radius=0.2, milestones=milestones, seed=seed)


def test_every_planner_that_can_be_named_is_there():
    assert set(PLANNERS) == {"auto", "race", *REGISTRY}
    assert set(QUICK) < set(AUTO) < set(RACE) == set(REGISTRY)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_gap_is_passed_and_every_edge_is_free(name):
    path = found(name, wall(0.1))
    assert path is not None
    assert np.array_equal(path[0], START)
    assert np.array_equal(path[-1], GOAL)
    # edges are looked at every ε, so a corner may be cut by less than that
    thinner = wall(0.1 + EPSILON, 0.05 - EPSILON)
    assert all(thinner(q) for a, b in itertools.pairwise(path) for _, q in samples(a, b, EPSILON / 5))


@pytest.mark.parametrize("name", SEARCHES)
def test_same_seed_same_path(name):
    first, again, other = (found(name, wall(0.1), seed=seed) for seed in (3, 3, 4))
    assert first is not None
    assert again is not None
    assert other is not None
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_closed_wall_is_no_path_and_the_wish_to_stop_passes_through(name):
    assert found(name, wall(-1.0), milestones=20) is None
    left = iter(range(300))

    def tick():
        if next(left, None) is None:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        found(name, wall(-1.0), tick=tick)
