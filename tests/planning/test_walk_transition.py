"""The search of a chassis pose for one foot move: what it leaves out of its costs does not change what it finds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.body_way import At, feet_of
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.start import start_of
from footfall.planning.walk.transition_kernel import (
    GROWS,
    LEAST_SPREAD,
    SHRINKS,
    SIZES,
    SPREAD,
    Balance,
    Move,
    find_pose,
    transition_cost,
    vector_of,
)
from footfall.planning.walk.world import World
from tests.support.chassis_ground import wavy
from tests.support.kept_arrays import read_only

LOOKS = 40


@pytest.fixture(scope="module")
def asked(athlete):
    """The arguments of a foot move of leg 0 by some metres, after the poses and before the bound; where it begins."""
    dem = wavy(rocks=((1.9, 0.8, 0.5, 0.4),))
    at = start_of(athlete, dem, footfall.stand(athlete, dem))
    assert isinstance(at, At), at
    world = World(athlete, Nearby(dem, np.isnan(dem.heights)), WalkSettings(), at.T_site_base)
    checks = world.first.checks

    def arguments(along: float, support: int = 1):
        to = np.array(at.stance.Ts_site_wheel[0, :3])
        to[0, 3] += along
        move = Move(0, read_only(to), int(at.stance.branches[0]), 0.2, at.stance.contacts)
        return feet_of(at.stance), move, world.legs, checks.rover, Balance(support, 0.05)

    return arguments, vector_of(np.ascontiguousarray(at.T_site_base[:3]))


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0), st.floats(0.0, 0.6), st.integers(0, 2))
@settings(max_examples=60)
def test_a_bounded_cost_is_the_whole_one_or_reaches_the_bound_as_it_does(asked, seed, far, along, support):
    arguments, now = asked
    rng = np.random.default_rng(seed)
    vector = now + far * SIZES * rng.standard_normal(6)
    given_ones = arguments(along, support)
    whole = transition_cost(vector, now, *given_ones, most=math.inf)
    around = whole[1] + np.array([-5.0, -0.1, -1e-9, 0.0, 1e-9, 0.1, 5.0])
    for most in (*around, 0.0, -0.3):
        told = transition_cost(vector, now, *given_ones, most=most)
        if whole[1] < most:
            assert told == whole
        else:
            assert most <= told[1] <= whole[1]


@pytest.mark.parametrize(("along", "seed"), [(0.1, 1), (0.5, 2), (0.9, 3), (1.4, 4)])
def test_the_pose_is_that_of_a_search_by_whole_costs(asked, along, seed):
    """Second method: the strategy of the docstring in Python, every cost asked for whole."""
    arguments, now = asked
    given_ones = arguments(along)
    aim = now + np.array([0.3, 0.1, 0.0, 0.0, 0.0, 0.2])
    found = np.empty(6)
    guesses = np.array([aim, now])
    lacks = find_pose(guesses, aim, *given_ones, rng=np.random.default_rng(seed), looks=LOOKS, best=found)

    rng, spread = np.random.default_rng(seed), SPREAD
    costs = [transition_cost(guess, aim, *given_ones, most=math.inf) for guess in guesses]
    begin = 0 if costs[0][1] <= costs[1][1] else 1
    best, (least, cost) = guesses[begin], costs[begin]
    for look in range(LOOKS):
        if spread < LEAST_SPREAD or (look > LOOKS // 2 and least > 0.3):
            break
        tried = best + spread * SIZES * rng.standard_normal(6)
        other = transition_cost(tried, aim, *given_ones, most=math.inf)
        if other[1] < cost:
            best, (least, cost), spread = tried, other, min(spread * GROWS, 1.0)
        else:
            spread *= SHRINKS
    assert lacks == pytest.approx(least, abs=1e-12)
    assert found == pytest.approx(best, abs=1e-12)
