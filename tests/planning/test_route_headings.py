"""Headings along a route where turning costs: as cheap as Dijkstra's over places × headings, and as told."""

import heapq
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.planning.route import plan as planning
from footfall.planning.route.field import CostField
from footfall.planning.route.headings import faced, pieces
from footfall.planning.route.problem import RouteSettings
from footfall.planning.step.problem import Status
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


def test_turning_that_means_nothing_is_refused():
    with pytest.raises(InvalidInput, match="at every heading"):
        RouteSettings(turning=1.0)
    for turning in (-0.1, math.nan, math.inf):
        with pytest.raises(InvalidInput):
            replace(ASKED, turning=turning)
