"""Headings along a route where turning costs: as cheap as Dijkstra's over places × headings, and as told."""

import heapq
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array, csgraph

import footfall
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.grid import GridGeometry
from footfall.planning.answers import Status
from footfall.planning.route import plan as planning
from footfall.planning.route import turns
from footfall.planning.route.field import CostField
from footfall.planning.route.headings import faced, pieces
from footfall.planning.route.problem import RouteSettings
from footfall.planning.route.turns import way_with_turns
from footfall.terrain.from_arrays import from_heights

GRID = GridGeometry(-1.0, 2.0, 0.25, 12, 15)
LOW, HIGH = np.array(GRID.bounds[:2]), np.array(GRID.bounds[2:])
LIGHT = settings(max_examples=40, derandomize=True, deadline=None)
TURNING = st.sampled_from([0.01, 0.1, 0.5, 3.0])
SEEDS = st.integers(0, 2**32 - 1)


def a_way(rng):
    count = int(rng.integers(2, 5))
    return LOW + rng.uniform(size=(count, 2)) * (HIGH - LOW)


def some_costs(rng, headings, closed):
    costs = rng.uniform(1.0, 4.0, (headings, *GRID.shape))
    costs[rng.uniform(size=costs.shape) < closed] = math.inf
    return costs


def along(costs, cut):
    """(headings, pieces): of a metre, the cheaper of both cells beside an edge."""
    return costs[:, cut.cells[..., 0], cut.cells[..., 1]].min(axis=2)


def dijkstra(lengths, costs, yaw, turning):
    """The least cost over (place on the way, which side of it, heading); infinite where no way leads to its end."""
    headings, count = costs.shape
    step = turning * 2 * math.pi / headings
    queue, done = [], {}
    for k in range(headings):
        away = abs(math.remainder(2 * math.pi * k / headings - yaw, 2 * math.pi))
        if np.isfinite(costs[k, 0]):
            heapq.heappush(queue, (turning * away, 0, 0, k))
    while queue:
        spent, piece, end, k = heapq.heappop(queue)
        if (piece, end, k) in done:
            continue
        done[piece, end, k] = spent
        if end and piece == count - 1:
            return spent
        following = [] if (piece, end) == (0, 0) else [(piece, end, (k + side) % headings, step) for side in (-1, 1)]
        if end:
            following.append((piece + 1, 0, k, 0.0))
        else:
            following.append((piece, 1, k, lengths[piece] * costs[k, piece]))
        for on, at, heading, more in following:
            if np.isfinite(costs[heading, on]):
                heapq.heappush(queue, (spent + more, on, at, heading))
    return math.inf


def told_cost(found, costs, yaw, turning):
    """What a way costs with the headings that it tells, by its parts alone."""
    headings = np.append(yaw, found.headings)
    turns = np.abs([math.remainder(b - a, 2 * math.pi) for a, b in pairwise(headings)])
    total = turning * turns.sum()
    for k, a, b in zip(found.headings, found.points, found.points[1:], strict=False):
        total += CostField(GRID, costs[round(k * len(costs) / (2 * math.pi))], found.points[-1]).cost_from([a, b])
    return total


@LIGHT
@given(SEEDS, st.sampled_from([4, 8, 12]), TURNING, st.sampled_from([0.0, 0.1, 0.4]))
def test_they_cost_what_dijkstra_finds_over_places_and_headings(seed, headings, turning, closed):
    rng = np.random.default_rng(seed)
    yaw, cut = float(rng.uniform(-4.0, 4.0)), pieces(GRID, a_way(rng))
    costs = along(some_costs(rng, headings, closed), cut)
    least = dijkstra(cut.lengths, costs, yaw, turning)
    found = faced(cut, costs, yaw, turning)
    if math.isinf(least):
        assert isinstance(found, tuple)
        assert np.linalg.norm(cut.points - found, axis=1).min() == 0.0
    else:
        assert not isinstance(found, tuple)
        assert found.cost == pytest.approx(least, rel=1e-12)


@LIGHT
@given(SEEDS, TURNING)
def test_a_way_costs_what_its_parts_and_its_turns_cost(seed, turning):
    rng = np.random.default_rng(seed)
    yaw, cut = float(rng.uniform(-4.0, 4.0)), pieces(GRID, a_way(rng))
    costs = some_costs(rng, 8, 0.0)
    found = faced(cut, along(costs, cut), yaw, turning)
    assert not isinstance(found, tuple)
    assert told_cost(found, costs, yaw, turning) == pytest.approx(found.cost, rel=1e-9)


@LIGHT
@given(SEEDS)
def test_pieces_cost_what_the_whole_way_costs(seed):
    rng = np.random.default_rng(seed)
    costs = rng.uniform(1.0, 4.0, GRID.shape)
    field = CostField(GRID, costs, LOW + rng.uniform(size=2) * (HIGH - LOW))
    way, cost = field.plan(LOW + rng.uniform(size=2) * (HIGH - LOW))
    cut = pieces(GRID, way)
    assert cut.lengths @ along(costs[None], cut)[0] == pytest.approx(cost, rel=1e-9)
    assert cut.corners.sum() == len(way)


def test_the_dearer_a_turn_the_less_is_turned():
    rng = np.random.default_rng(3)
    cut = pieces(GRID, np.array([LOW, HIGH]))
    costs = along(some_costs(rng, 8, 0.0), cut)
    turned = []
    for turning in (0.01, 0.1, 1.0, 100.0):
        found = faced(cut, costs, 0.1, turning)
        assert not isinstance(found, tuple)
        headings = np.append(0.1, found.headings)
        turned.append(sum(abs(math.remainder(turn, 2 * math.pi)) for turn in np.diff(headings)))
    assert turned == sorted(turned, reverse=True)
    assert turned[0] > turned[-1]
    # as near as there is a heading
    assert turned[-1] == pytest.approx(0.1)


def test_where_it_stands_already_is_no_way():
    found = faced(pieces(GRID, np.array([LOW, LOW])), np.empty((8, 0)), 0.4, 1.0)
    assert not isinstance(found, tuple)
    assert (found.cost, found.headings.tolist()) == (0.0, [0.4])


def over_places_and_headings(costs, begin, goal, yaw, turning):
    """The least cost over the middles of cells in eight directions, at all headings: Dijkstra (scipy)."""
    headings, rows, cols = costs.shape
    number = np.arange(costs.size).reshape(costs.shape)
    links = []
    for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = np.s_[:, : rows - dr, max(0, -dc) : cols - max(dc, 0)]
        b = np.s_[:, dr:, max(0, dc) : cols + min(dc, 0)]
        links.append((number[a], number[b], 0.5 * GRID.resolution * math.hypot(dr, dc) * (costs[a] + costs[b])))
    step = np.where(np.isinf(costs) | np.isinf(np.roll(costs, -1, 0)), math.inf, turning * 2 * math.pi / headings)
    links.append((number, np.roll(number, -1, 0), step))
    ends, away = [], []
    for place in (begin, goal):
        row, col = (int(at) for at in GRID.cell(*place))
        ends.append((row, col))
        away.append(math.dist(place, (GRID.xs[col], GRID.ys[row])))
    angles = 2 * math.pi * np.arange(headings) / headings
    turned = turning * np.abs([math.remainder(angle - yaw, 2 * math.pi) for angle in angles])
    (r0, c0), (r1, c1) = ends
    # dijkstra takes a cost of 0 for no link at all
    links.append((np.full(headings, costs.size), number[:, r0, c0], 1e-12 + turned + costs[:, r0, c0] * away[0]))
    links.append((number[:, r1, c1], np.full(headings, costs.size + 1), 1e-12 + costs[:, r1, c1] * away[1]))
    i, j, cost = (np.concatenate([np.ravel(one[k]) for one in links]) for k in range(3))
    free = np.isfinite(cost)
    graph = coo_array((cost[free], (i[free], j[free])), shape=(costs.size + 2,) * 2)
    return float(csgraph.dijkstra(graph.tocsr(), directed=False, indices=costs.size)[-1])


@LIGHT
@given(SEEDS, st.sampled_from([4, 8, 12]), TURNING, st.sampled_from([0.0, 0.2, 0.5]))
def test_searched_together_a_way_costs_what_dijkstra_finds_over_places_and_headings(seed, headings, turning, closed):
    rng = np.random.default_rng(seed)
    yaw, (begin, goal) = float(rng.uniform(-4.0, 4.0)), LOW + rng.uniform(size=(2, 2)) * (HIGH - LOW)
    costs = np.tile(some_costs(rng, headings // 2, closed), (2, 1, 1))
    way, cost = way_with_turns(GRID, costs[: headings // 2], begin, goal, yaw, turning)
    least = over_places_and_headings(costs, begin, goal, yaw, turning)
    assert cost == pytest.approx(least, rel=1e-9)
    if math.isinf(least):
        assert not len(way)
        return
    np.testing.assert_allclose([way[0], way[-1]], [begin, goal], atol=1e-9)
    # cut short, and with its own cheapest headings, it costs no more
    cut = pieces(GRID, way)
    found = faced(cut, along(costs, cut), yaw, turning)
    assert not isinstance(found, tuple)
    assert found.cost <= least + 1e-9
    if not closed:
        assert told_cost(found, costs, yaw, turning) == pytest.approx(found.cost, rel=1e-9)


def test_turns_decide_which_way_is_taken():
    """A wall with two gates: through the near one the rover faces otherwise than now, through the far one as now."""
    costs = np.ones((2, *GRID.shape))
    costs[:, :, 7] = math.inf
    costs[1, 5, 7] = costs[0, 0, 7] = 1.0
    begin, goal = (GRID.xs[1], GRID.ys[5]), (GRID.xs[13], GRID.ys[5])
    rows = []
    for turning in (0.01, 10.0):
        way, _ = way_with_turns(GRID, costs, begin, goal, 0.0, turning)
        at_gate = np.interp(GRID.xs[7], way[:, 0], way[:, 1])
        rows.append(int(GRID.cell(GRID.xs[7], at_gate)[0]))
    assert rows == [5, 0]


def test_more_states_than_are_searched_together_are_refused_with_both_numbers(monkeypatch):
    monkeypatch.setattr(turns, "MOST_STATES", 100)
    with pytest.raises(InvalidInput, match=r"at most 100 .* these are 720: take coarser cells"):
        way_with_turns(GRID, np.ones((4, *GRID.shape)), (0.0, 3.0), (1.0, 4.0), 0.0, 1.0)


def test_looking_for_way_and_headings_can_be_cancelled(monkeypatch):
    monkeypatch.setattr(turns, "AT_ONCE", 5)

    def stop(fraction, text):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        way_with_turns(GRID, np.ones((4, *GRID.shape)), (-0.9, 2.1), (2.0, 4.5), 0.0, 1.0, stop)


ASKED = RouteSettings(resolution=0.2, cost="feasible", turning=0.5)
SIDE = GridGeometry(-5.0, -5.0, 0.2, 51, 71)
GOAL = (5.0, 0.5)


@pytest.fixture(scope="module")
def broken():
    """Plates up to 1.2 m above each other: not every leg finds footfalls everywhere."""
    rng = np.random.default_rng(5)
    heights = np.kron(rng.uniform(0.0, 1.2, (9, 12)), np.ones((6, 6)))[:51, :71]
    x, y = np.meshgrid(SIDE.xs, SIDE.ys)
    heights[np.hypot(x, y) < 3.0] = 0.0
    return from_heights(heights.astype(np.float32), 0.2, SIDE.x0, SIDE.y0, "broken")


def test_a_route_has_headings_where_turning_costs_and_only_there(athlete, broken):
    stood = footfall.stand(athlete, broken)
    plain = footfall.plan_route(athlete, broken, stood, GOAL, replace(ASKED, turning=0.0))
    found = footfall.plan_route(athlete, broken, stood, GOAL, ASKED)
    assert plain.plan is not None
    assert found.plan is not None
    assert plain.plan.headings is None
    assert found.plan.headings is not None
    assert len(found.plan.headings) == len(found.plan.points) - 1
    assert found.plan.cost >= plain.plan.cost - 1e-9
    assert found.plan.length == pytest.approx(plain.plan.length)
    assert RouteSettings(cost="feasible").digest == RouteSettings(cost="feasible", turning=0.0).digest != ASKED.digest


def test_where_no_heading_goes_on_it_says_where_and_what_to_try(athlete, broken, monkeypatch):
    def halves(found, cells):
        costs = along_of(found, cells)
        half = costs.shape[1] // 2
        costs[1:, :half] = costs[:-1, half:] = math.inf
        return costs

    along_of = planning.costs_along
    monkeypatch.setattr(planning, "costs_along", halves)
    found = footfall.plan_route(athlete, broken, footfall.stand(athlete, broken), GOAL, ASKED)
    assert found.status is Status.NO_PATH
    assert "without turning" in found.reason
    assert -0.1 < found.cut_off[0] < GOAL[0]


def test_a_route_whose_way_is_searched_with_its_headings_is_no_dearer(athlete, broken):
    stood = footfall.stand(athlete, broken)
    alone = footfall.plan_route(athlete, broken, stood, GOAL, ASKED)
    found = footfall.plan_route(athlete, broken, stood, GOAL, replace(ASKED, together=True))
    assert alone.plan is not None
    assert found.plan is not None
    assert found.plan.cost <= alone.plan.cost
    assert ASKED.digest == replace(ASKED, together=False).digest != replace(ASKED, together=True).digest


def test_turning_that_means_nothing_is_refused():
    with pytest.raises(InvalidInput, match="give turning"):
        RouteSettings(cost="feasible", together=True)
    with pytest.raises(InvalidInput, match="at every heading"):
        RouteSettings(turning=1.0)
    for turning in (-0.1, math.nan, math.inf):
        with pytest.raises(InvalidInput):
            replace(ASKED, turning=turning)
