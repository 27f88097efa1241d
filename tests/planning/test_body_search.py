"""Ways of the chassis over its feet that are searched for where straight ones are blocked, judged by other means."""

import numpy as np
import pytest

import footfall
from benchmarks.walks.terrains import TRAINING, start_of, terrain
from footfall.core.errors import Cancelled
from footfall.core.value import Provenance
from footfall.planning.walk import search as searching
from footfall.planning.walk.assemble import walk_of
from footfall.planning.walk.body_search import searched_way
from footfall.planning.walk.body_way import BodyWay, Fails, body_way
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.walk import recheck_walk

SETTINGS = WalkSettings(time_limit=600.0)
ENOUGH = 20
COARSE = RecheckSettings(way=0.01, turn=0.01, hold=0.1)


@pytest.fixture(scope="module")
def steep():
    return terrain("very steep", TRAINING[2])


@pytest.fixture(scope="module")
def blocked(stopped):
    """What a search asks for on very steep ground that no straight way leads to: checks, where from, where to."""
    return stopped[0]


@pytest.fixture(scope="module")
def search(stopped):
    return stopped[1]


@pytest.fixture(scope="module")
def stopped(athlete, steep):
    """The same, and the search that was stopped."""
    asked, searches = [], []

    def watched(search, checks, at, T_site_base):
        searches.append(search)
        found = body_way(checks, at, T_site_base)
        if isinstance(found, Fails):
            asked.append((checks, at, T_site_base))
        if len(asked) == ENOUGH:
            raise Cancelled("enough")
        return found

    x, y = start_of(2.75)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(searching.Search, "way_of", watched)
        with pytest.raises(Cancelled, match="enough"):
            plan_walk(athlete, steep, footfall.stand(athlete, steep, x, y), (x + 2.75, y, 0.0), settings=SETTINGS)
    return asked, searches[-1]


@pytest.fixture(scope="module")
def found(blocked):
    return [searched_way(*one, seed=1) for one in blocked]


def test_most_ways_that_are_blocked_straight_ahead_are_found(found):
    assert sum(isinstance(one, BodyWay) for one in found) >= 0.8 * ENOUGH


def test_they_begin_where_the_rover_is_and_end_where_it_is_to_be(blocked, found):
    for (_, at, T_site_base), way in zip(blocked, found, strict=True):
        if isinstance(way, Fails):
            continue
        assert np.array_equal(way.postures[0], at.posture)
        assert np.array_equal(way.Ts_site_base[0], at.T_site_base)
        assert np.array_equal(way.Ts_site_base[-1], T_site_base)


def test_they_hold_by_other_means_too(athlete, steep, blocked, found):
    """As a walk of no foot move, of whose way kinematics, meshes and forces are another library's."""
    provenance = Provenance({"dem": steep.digest, "robot": athlete.digest}, SETTINGS, SETTINGS.seed)
    for (_, at, T), way in list(zip(blocked, found, strict=True))[:6]:
        if isinstance(way, Fails):
            continue
        goal = WalkGoal(float(T[0, 3]), float(T[1, 3]))
        plan = walk_of(goal, at, [], way, provenance)
        failed = [one for one in recheck_walk(athlete, steep, plan, every=COARSE) if not one.holds]
        assert failed == []


def test_the_same_seed_finds_the_same_way(blocked, found):
    again = searched_way(*blocked[0], seed=1)
    assert isinstance(found[0], BodyWay)
    assert isinstance(again, BodyWay)
    assert np.array_equal(again.postures, found[0].postures)


def test_a_straight_way_that_holds_is_taken(blocked):
    checks, at, _ = blocked[0]
    T = np.array(at.T_site_base)
    straight, searched = body_way(checks, at, T), searched_way(checks, at, T, seed=1)
    assert isinstance(straight, BodyWay)
    assert isinstance(searched, BodyWay)
    assert np.array_equal(searched.postures, straight.postures)


def test_what_no_way_leads_to_fails_as_the_straight_one_does(blocked):
    checks, at, _ = blocked[0]
    T = np.array(at.T_site_base)
    T[2, 3] += 5.0
    straight, searched = body_way(checks, at, T), searched_way(checks, at, T, seed=1)
    assert isinstance(straight, Fails)
    assert searched == straight


def test_only_later_attempts_search(blocked, search):
    for attempt, kind in ((0, Fails), (1, BodyWay)):
        search.attempt = attempt
        assert isinstance(search.way_of(*blocked[0]), kind)
