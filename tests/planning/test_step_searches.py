"""The searches on spaces made of simple shapes, against slow second methods."""

import heapq
import itertools
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Cancelled
from footfall.planning.joint_path import largest_change, length, samples
from footfall.planning.step.search import with_ompl
from footfall.planning.step.search.astar import astar
from footfall.planning.step.search.edges import Space, bisection_order, levels_for
from footfall.planning.step.search.line import line
from footfall.planning.step.search.roadmap import Roadmap
from footfall.planning.step.search.smooth import bisected, shortest, smooth
from footfall.planning.watch import OutOfTime, Watch

EPSILON = 0.01


def space_with(free, dimension=2, tick=lambda: None, epsilon=EPSILON):
    return Space(-np.ones(dimension), np.ones(dimension), free, epsilon, tick)


def wall(gap, thickness=0.05):
    """A wall across x = 0 that is open where every other coordinate is within ``gap``."""
    return lambda q: not (abs(q[0]) < thickness and (np.abs(q[1:]) > gap).any())


def assert_good(path, free, start, goal, step=EPSILON / 5):
    assert np.array_equal(path[0], start)
    assert np.array_equal(path[-1], goal)
    for a, b in itertools.pairwise(path):
        assert all(free(q) for _, q in samples(a, b, step))


SEARCHES = {
    "sbl": lambda space, a, b, seed=1, s=5000: with_ompl.sbl(space, a, b, radius=0.2, milestones=s, seed=seed),
    "rrtconnect": lambda space, a, b, seed=1, s=5000: with_ompl.rrtconnect(
        space, a, b, radius=0.2, milestones=s, seed=seed
    ),
}


def found(name, *args):
    path = SEARCHES[name](*args)
    assert path is not None
    return path


@given(length=st.floats(1e-6, 7.0), epsilon=st.floats(1e-3, 0.5))
def test_bisection_leaves_no_piece_longer_than_epsilon(length, epsilon):
    at = sorted({0.0, 1.0, *bisection_order(levels_for(length, epsilon))})
    assert max(np.diff(at)) * length <= epsilon * (1 + 1e-9)


def test_an_edge_check_looks_at_every_epsilon_and_no_finer_than_half():
    seen = []
    space = space_with(lambda q: seen.append(q[0]) is None)
    assert space.edge_is_free(np.array([-0.5, 0.0]), np.array([0.5, 0.3]))
    gaps = np.diff(sorted([-0.5, *seen, 0.5]))
    assert gaps.max() <= EPSILON + 1e-12
    assert gaps.min() > EPSILON / 2
    assert seen[0] == 0.0


def test_a_configuration_outside_the_limits_is_not_free():
    space = space_with(lambda q: True)
    assert not space.is_free(np.array([0.0, 1.01]))
    assert space.first_blocked(np.array([0.0, 0.9]), np.array([0.0, 1.1])) == pytest.approx(0.5, abs=0.06)


def test_line_says_no_to_a_thin_wall():
    space = space_with(wall(0.2, thickness=0.006))
    assert line(space, np.array([-0.5, 0.0]), np.array([0.5, 0.1])) is not None
    assert line(space, np.array([-0.5, 0.6]), np.array([0.5, 0.7])) is None


@pytest.mark.parametrize("name", SEARCHES)
@pytest.mark.parametrize(("dimension", "gap"), [(2, 0.04), (6, 0.65)])
def test_searches_pass_a_narrow_gap(name, dimension, gap):
    free = wall(gap)
    # edges are looked at every ε, so a corner may be cut by less than that
    thinner = wall(gap + EPSILON, 0.05 - EPSILON)
    start, goal = np.full(dimension, -0.6), np.full(dimension, 0.6)
    goal[1] = -0.6
    for seed in range(3):
        path = SEARCHES[name](space_with(free, dimension), start, goal, seed)
        assert path is not None
        assert_good(path, thinner, start, goal)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_closed_wall_is_no_path_and_the_milestones_bound_the_work(name):
    space = space_with(wall(-1.0))
    assert SEARCHES[name](space, np.array([-0.5, 0.0]), np.array([0.5, 0.0]), s=200) is None
    assert space.checked < 20_000


@pytest.mark.parametrize("name", SEARCHES)
def test_same_seed_same_path_and_another_seed_another(name):
    start, goal = np.array([-0.6, -0.6]), np.array([0.6, -0.6])
    paths = [found(name, space_with(wall(0.1)), start, goal, seed) for seed in (0, 3, 0)]
    assert np.array_equal(paths[0], paths[2])
    assert not np.array_equal(paths[0], paths[1])


@pytest.mark.parametrize("name", SEARCHES)
def test_the_wish_to_stop_passes_through_ompl(name):
    left = iter(range(300))

    def tick():
        if next(left, None) is None:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        SEARCHES[name](space_with(wall(-1.0), tick=tick), np.array([-0.5, 0.0]), np.array([0.5, 0.0]))


def test_same_seed_same_path_in_another_process():
    code = (
        "import numpy as np;from footfall.planning.step.search import with_ompl\n"
        "from footfall.planning.step.search.edges import Space\n"
        "f=lambda q: not (abs(q[0])<0.05 and abs(q[1])>0.1)\n"
        "s=Space(-np.ones(2),np.ones(2),f);a,b=np.array([-.6,-.6]),np.array([.6,-.6])\n"
        "print([getattr(with_ompl,n)(s,a,b,radius=.2,milestones=5000,seed=4).tolist() for n in ('sbl','rrtconnect')])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    start, goal = np.array([-0.6, -0.6]), np.array([0.6, -0.6])
    here = [found(name, space_with(wall(0.1)), start, goal, 4).tolist() for name in ("sbl", "rrtconnect")]
    assert out.strip() == str(here)


def test_sbl_is_lazy():
    """It checks far fewer configurations than all its segments hold."""
    space = space_with(wall(0.1))
    path = SEARCHES["sbl"](space, np.array([-0.6, -0.6]), np.array([0.6, -0.6]))
    assert path is not None
    assert space.checked < 2500


def test_removing_a_segment_moves_what_hangs_behind_it(rng):
    roadmap = Roadmap(-np.ones(2), np.ones(2), np.array([-0.5, 0.0]), np.array([0.5, 0.0]), rng)
    a = roadmap.add(np.array([-0.3, 0.0]), 0)
    b = roadmap.add(np.array([-0.1, 0.0]), a)
    leaf = roadmap.add(np.array([-0.1, 0.2]), b)
    c = roadmap.add(np.array([0.3, 0.0]), 1)
    roadmap.join(b, c)
    assert roadmap.route(b, c) == [0, a, b, c, 1] == roadmap.route(c, b)
    roadmap.remove(a, b)
    assert roadmap.side[[0, a]].tolist() == [0, 0]
    assert roadmap.side[[b, leaf, c, 1]].tolist() == [1, 1, 1, 1]
    assert roadmap.parent[b] == c
    assert roadmap.parent[leaf] == b
    assert {roadmap.pick(0) for _ in range(50)} == {0, a}


def test_milestones_in_thin_regions_are_picked_more_often(rng):
    roadmap = Roadmap(-np.ones(2), np.ones(2), np.array([-0.5, 0.0]), np.array([0.9, 0.9]), rng)
    for _ in range(40):
        roadmap.add(np.array([-0.5, 0.0]) + rng.uniform(0, 0.01, 2), 0)
    lonely = roadmap.add(np.array([0.5, 0.5]), 0)
    picked = [roadmap.pick(0) for _ in range(400)]
    assert picked.count(lonely) > 100


def identity(points):
    return points[:, None, :]


def brute_force(free, start, goal, cell):
    """Dijkstra over the whole grid, all edges tested beforehand."""
    reach = range(-12, 13)
    places = [np.array(start) + cell * np.array(o) for o in itertools.product(reach, reach, (0,))]
    places = [p for p in places if (np.abs(p) <= 1).all() and free(p)] + [np.array(goal)]
    best, queue = {}, [(0.0, i) for i, p in enumerate(places) if np.allclose(p, start)]
    while queue:
        cost, i = heapq.heappop(queue)
        if i in best:
            continue
        best[i] = cost
        for j, p in enumerate(places):
            near = 0 < largest_change(places[i], p) <= cell * (1 + 1e-9)
            if j not in best and near and all(free(q) for _, q in samples(places[i], p, EPSILON / 2)):
                heapq.heappush(queue, (cost + float(np.linalg.norm(p - places[i])), j))
    return best.get(len(places) - 1)


@pytest.mark.parametrize("seed", range(4))
def test_astar_finds_the_shortest_grid_path(seed):
    rng = np.random.default_rng(seed)
    discs = np.column_stack([rng.uniform(-0.5, 0.5, (5, 2)), rng.uniform(0.1, 0.3, 5)])
    start, goal = np.array([-0.9, -0.85, 0.0]), np.array([0.83, 0.87, 0.0])

    def free(q):
        return abs(q[2]) < 0.1 and bool((np.hypot(*(discs[:, :2] - q[:2]).T) > discs[:, 2]).all())

    def nearly_free(q):
        return bool((np.hypot(*(discs[:, :2] - q[:2]).T) > discs[:, 2] - EPSILON).all())

    path = astar(space_with(free, 3), identity, (start, start), (goal, goal), 0.2)
    expected = brute_force(free, start, goal, 0.2)
    assert (path is None) == (expected is None)
    if path is not None:
        assert length(path) == pytest.approx(expected, abs=1e-9)
        assert_good(path, nearly_free, start, goal)


def test_astar_follows_continuity_over_branches():
    """Two branches, far apart except where x > 0.6: the goal on the other one is reached through there."""

    def postures(points):
        gap = np.where(points[:, 0] > 0.6, 0.0, 3.0)
        return np.stack([np.column_stack([points, 0 * gap]), np.column_stack([points, gap])], axis=1)

    start, goal = np.array([0.0, 0.0, 0.0, 0.0]), np.array([0.4, 0.4, 0.0, 3.0])
    bounded = Space(np.array([-1, -1, -0.1, -4]), np.array([1, 1, 0.1, 4]), lambda q: True)

    def inside(points):
        out = postures(points)
        out[(np.abs(points) > (1.01, 1.01, 0.05)).any(axis=1)] = np.nan
        return out

    assert astar(bounded, inside, (start[:3], start), (goal[:3], goal), 0.2) is None
    path = astar(bounded, inside, (start[:3], start), (goal[:3], goal), 0.2, largest_jump=3.1)
    assert path is not None


def test_astar_says_none_when_the_grid_is_exhausted():
    def ring(points):
        return np.where((np.linalg.norm(points, axis=1) < 0.5)[:, None], points, np.nan)[:, None]

    far = np.array([0.9, 0.0, 0.0])
    assert astar(space_with(lambda q: True, 3), ring, (np.zeros(3), np.zeros(3)), (far, far), 0.2) is None


@given(seed=st.integers(0, 10_000))
def test_smoothing_keeps_the_ends_never_lengthens_and_stays_free(seed):
    rng = np.random.default_rng(seed)
    free = wall(0.3)
    start, gate, goal = np.array([-0.8, 0.8]), np.zeros(2), np.array([0.8, 0.8])
    detour = rng.uniform((-0.9, -0.9), (-0.1, 0.9), (4, 2))
    other = rng.uniform((0.1, -0.9), (0.9, 0.9), (4, 2))
    path = np.array([start, *detour, [-0.1, 0.0], gate, [0.1, 0.0], *other, goal])
    out = smooth(space_with(free), path)
    assert length(out) <= length(path) + 1e-12
    assert_good(out, wall(0.3 + EPSILON, 0.05 - EPSILON), start, goal)


def test_smoothing_gets_near_the_taut_string():
    free = wall(0.3)
    start, goal = np.array([-0.8, 0.8]), np.array([0.8, 0.8])
    path = found("sbl", space_with(free), start, goal)
    taut = 2 * np.hypot(0.75, 0.5) + 0.1
    assert taut - 1e-9 <= length(smooth(space_with(free), path)) < 1.25 * taut
    assert length(smooth(space_with(free), path)) < 0.8 * length(path)


def test_shortest_over_waypoints_equals_all_pairs(rng):
    free = wall(0.3)
    path = np.array([[-0.8, 0.8], *rng.uniform((-0.9, -0.3), (-0.1, 0.3), (6, 2)), [0.0, 0.0], [0.8, 0.8]])
    out = shortest(space_with(free), path, {})
    n = len(path)
    cost = np.full((n, n), np.inf)
    for i, j in itertools.combinations(range(n), 2):
        if all(free(q) for _, q in samples(path[i], path[j], EPSILON / 4)):
            cost[i, j] = cost[j, i] = np.linalg.norm(path[i] - path[j])
    for k in range(n):
        cost = np.minimum(cost, cost[:, k, None] + cost[k])
    assert length(out) == pytest.approx(cost[0, -1], abs=1e-9)


def test_long_paths_are_shortened_too():
    t = np.linspace(0, 1, 400)
    path = np.column_stack([-0.8 + 1.6 * t, 0.2 * np.sin(40 * t)])
    assert len(smooth(space_with(lambda q: True), path)) == 2
    assert len(bisected(path)) == 799


def test_watch_reports_and_stops():
    heard = []
    watch = Watch(lambda fraction, text: heard.append((fraction, text)), time_limit=0.15)
    watch.phase(0.5, "searching")

    def busy():
        while True:
            watch.tick()

    with pytest.raises(OutOfTime):
        busy()
    assert len(heard) >= 2
    assert set(heard) == {(0.5, "searching")}


def test_uncounted_time_is_given_back():
    watch = Watch(time_limit=0.2)
    with watch.uncounted():
        time.sleep(0.3)
    watch.tick()
    time.sleep(0.25)
    with pytest.raises(OutOfTime):
        watch.tick()
