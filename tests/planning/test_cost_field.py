"""Field D*: ways are the cheapest there are, whatever order costs come in."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.grid import GridGeometry
from footfall.planning.route import field as field_module
from footfall.planning.route.coarse import cheapest_way
from footfall.planning.route.corners_kernel import edge_cost
from footfall.planning.route.field import CostField

SIZE = 7
SQUARE = GridGeometry(-3.0, 2.0, 0.5, SIZE, SIZE)
COSTS = arrays(np.float64, SQUARE.shape, elements=st.sampled_from([1.0, 1.3, 2.0, 5.0, math.inf]))
PLACES = st.tuples(st.integers(0, SIZE - 1), st.integers(0, SIZE - 1), st.floats(-0.24, 0.24), st.floats(-0.24, 0.24))


def place(chosen):
    row, col, dx, dy = chosen
    return np.array([SQUARE.xs[col] + dx, SQUARE.ys[row] + dy])


def free(costs, *places):
    costs = costs.copy()
    for row, col, *_ in places:
        costs[row, col] = 1.0 if math.isinf(costs[row, col]) else costs[row, col]
    return costs


def grid_cost(costs, begin, goal, parts=3):
    """Cheapest way over points on the edges of cells, ``parts`` to an edge, straight through cells: Dijkstra (scipy).

    An upper bound of what the cheapest way costs, nearer to it the more parts there are.
    """
    rows, cols = costs.shape
    size, corner = SQUARE.resolution, np.array([SQUARE.x0, SQUARE.y0]) - SQUARE.resolution / 2
    index, links = {}, {}

    def number(point):
        return index.setdefault((round(point[0], 6), round(point[1], 6)), len(index))

    ends = [(begin - corner) / size, (goal - corner) / size]
    for r in range(rows):
        for c in range(cols):
            if math.isinf(costs[r, c]):
                continue
            rim = [(c + i / parts, r + j) for i in range(parts + 1) for j in (0, 1)]
            rim += [(c + j, r + i / parts) for i in range(1, parts) for j in (0, 1)]
            rim += [tuple(end) for end in ends if int(end[0]) == c and int(end[1]) == r]
            for a in rim:
                for b in rim:
                    pair = (number(a), number(b))
                    cost = costs[r, c] * size * math.dist(a, b)
                    if pair[0] != pair[1]:
                        links[pair] = min(cost, links.get(pair, math.inf))
    a, b = (number(end) for end in ends)
    if not links:
        return 0.0 if a == b else math.inf
    keys = np.array(list(links))
    graph = coo_array((np.array(list(links.values())), (keys[:, 0], keys[:, 1])), shape=(len(index),) * 2)
    return float(dijkstra(graph.tocsr(), indices=a)[b])


def sampled_cost(costs, way, parts=5000):
    """What a way costs by the cells that points along it lie in; on an edge the cheaper counts."""
    total = 0.0
    for a, b in pairwise(way):
        points = a + (np.arange(parts)[:, None] + 0.5) / parts * (b - a)
        near = [points + shift for shift in ((-1e-7, -1e-7), (-1e-7, 1e-7), (1e-7, -1e-7), (1e-7, 1e-7))]
        cells = [SQUARE.cell(point[:, 0], point[:, 1]) for point in near]
        inside = [(np.clip(r, 0, SIZE - 1), np.clip(c, 0, SIZE - 1)) for r, c in cells]
        total += math.dist(a, b) * np.min([costs[cell] for cell in inside], axis=0).mean()
    return total


@settings(max_examples=40, deadline=None)
@given(COSTS, PLACES, PLACES)
def test_a_way_costs_what_dijkstra_finds_over_points_on_all_edges(costs, begin, goal):
    costs = free(costs, begin, goal)
    a, b = place(begin), place(goal)
    cost_field = CostField(SQUARE, costs, b)
    way, cost = cost_field.plan(a)
    other = grid_cost(costs, a, b)
    if math.isinf(other):
        assert math.isinf(cost)
        assert not len(way)
        return
    np.testing.assert_allclose([way[0], way[-1]], [a, b], atol=1e-9)
    assert cost_field.cost_from(way) == pytest.approx(cost, rel=1e-9)
    # of few cells whose costs jump fivefold the interpolation misses some
    assert cost <= 1.1 * other + 0.05
    assert sampled_cost(costs, way) == pytest.approx(cost, rel=0.01)


@settings(max_examples=40, deadline=None)
@given(COSTS, COSTS, arrays(bool, SQUARE.shape, elements=st.booleans()), PLACES, PLACES, PLACES)
def test_repaired_it_is_what_it_would_be_anew(costs, other, chosen, begin, later, goal):
    costs, other = free(costs, begin, later, goal), free(other, begin, later, goal)
    chosen[goal[0], goal[1]] = False
    repaired = CostField(SQUARE, costs, place(goal))
    repaired.plan(place(begin))
    changed = np.where(chosen, other, costs)
    repaired.change(np.argwhere(chosen), other[chosen])
    for here in (begin, later):
        anew = CostField(SQUARE, changed, place(goal))
        assert repaired.plan(place(here))[1] == pytest.approx(anew.plan(place(here))[1], rel=1e-6)


def test_a_small_change_near_the_rover_is_repaired_with_few_looks():
    rng = np.random.default_rng(3)
    geometry = GridGeometry(0.0, 0.0, 1.0, 200, 200)
    costs = rng.uniform(1.0, 4.0, geometry.shape)
    cost_field = CostField(geometry, costs, (190.0, 180.0))
    cost_field.plan((5.0, 5.0))
    first = cost_field.looked_at
    cost_field.change([[4, 7], [5, 7], [6, 7]], [9.0, math.inf, 9.0])
    cost_field.plan((5.0, 5.0))
    assert 0 < cost_field.looked_at - first < first / 100


def test_a_corner_is_looked_at_once_on_a_grid_without_changes():
    """The estimate keeps to what a corner adds: with a larger one they are looked at again and again."""
    costs = np.random.default_rng(4).uniform(1.0, 6.0, (150, 150))
    cost_field = CostField(GridGeometry(0.0, 0.0, 1.0, 150, 150), costs, (140.0, 20.0))
    cost_field.plan((3.0, 130.0))
    assert cost_field.looked_at <= 151 * 151


@pytest.mark.parametrize("dear", [1.5, 3.0, 8.0])
@pytest.mark.parametrize(("begin", "goal"), [((5.0, 5.0), (55.0, 50.0)), ((3.0, 40.0), (60.0, 8.0))])
def test_between_two_kinds_of_ground_a_way_is_refracted(dear, begin, goal):
    """Snell's law gives the exact optimum: within 0.5 %, and cheaper than over eight directions."""
    geometry = GridGeometry(0.0, 0.0, 1.0, 64, 64)
    costs = np.ones(geometry.shape)
    costs[:, 32:] = dear
    way, cost = CostField(geometry, costs, goal).plan(begin)
    y = np.linspace(-0.5, 63.5, 400_001)
    exact = (np.hypot(31.5 - begin[0], y - begin[1]) + dear * np.hypot(goal[0] - 31.5, y - goal[1])).min()
    assert exact - 1e-9 <= cost <= 1.005 * exact
    assert len(way) < 6
    dx, dy = goal[0] - 31.5, abs(goal[1] - begin[1])
    eight = (31.5 - begin[0]) + dear * dx + (math.sqrt(2.0) - 1.0) * min(dy, 31.5 - begin[0])
    assert cost < eight + max(dy - (31.5 - begin[0]), 0.0)


def test_on_even_ground_a_way_is_straight():
    geometry = GridGeometry(0.0, 0.0, 0.1, 90, 70)
    way, cost = CostField(geometry, np.full(geometry.shape, 2.0), (6.3, 8.1)).plan((0.2, 0.5))
    assert len(way) == 2
    assert cost == pytest.approx(2.0 * math.dist((6.3, 8.1), (0.2, 0.5)), rel=1e-9)


@given(st.floats(1.0, 50.0), st.floats(1.0, 50.0), st.floats(0.0, 100.0), st.floats(-60.0, 60.0))
def test_an_edge_costs_the_least_over_all_its_points(inside, beside, diagonal, more):
    straight = max(diagonal + more, 0.0)
    share = np.linspace(0.0, 1.0, 2001)
    through = inside * np.hypot(1.0, share) + straight + share * (diagonal - straight)
    along = np.array([[beside * x + inside * math.hypot(1.0 - x, 1.0) + diagonal] for x in share])
    exact = min(through.min(), along.min(), min(inside, beside) + straight)
    found = edge_cost(inside, beside, straight, diagonal)
    # the neighbouring pair covers walking along the whole edge (see the paper), so this one may be dearer by that
    assert found >= exact * (1.0 - 1e-6)
    assert found <= min(through.min(), along.min()) + 1e-3 or straight <= diagonal


def test_a_large_grid_is_looked_at_coarsely_first(monkeypatch):
    rng = np.random.default_rng(7)
    geometry = GridGeometry(0.0, 0.0, 1.0, 96, 96)
    costs = np.repeat(np.repeat(rng.uniform(1.0, 5.0, (24, 24)), 4, 0), 4, 1)
    costs[40:44, :90] = math.inf
    whole = cheapest_way(geometry, costs, (4.0, 4.0), (30.0, 90.0))[1]
    monkeypatch.setattr("footfall.planning.route.coarse.MOST_CELLS", 1000)
    way, coarse = cheapest_way(geometry, costs, (4.0, 4.0), (30.0, 90.0))
    assert whole - 1e-6 <= coarse <= 1.05 * whole
    np.testing.assert_allclose([way[0], way[-1]], [(4.0, 4.0), (30.0, 90.0)], atol=1e-9)
    costs[40:44] = math.inf
    assert not len(cheapest_way(geometry, costs, (4.0, 4.0), (30.0, 90.0))[0])


def test_looking_can_be_cancelled(monkeypatch):
    monkeypatch.setattr(field_module, "AT_ONCE", 10)

    def stop(fraction, text):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        CostField(SQUARE, np.ones(SQUARE.shape), place((1, 1, 0.0, 0.0))).plan(place((5, 6, 0.0, 0.0)), stop)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: CostField(SQUARE, np.ones((3, 3)), (0.0, 4.0)), "for a grid of"),
        (lambda: CostField(SQUARE, np.full(SQUARE.shape, 0.5), (0.0, 4.0)), "at least 1 a metre"),
        (lambda: CostField(SQUARE, np.full(SQUARE.shape, math.nan), (0.0, 4.0)), "at least 1 a metre"),
        (lambda: CostField(SQUARE, np.full(SQUARE.shape, math.inf), (0.0, 4.0)), "nothing may go"),
        (lambda: CostField(SQUARE, np.ones(SQUARE.shape), (40.0, 4.0)), "outside the map"),
        (lambda: CostField(SQUARE, np.ones(SQUARE.shape), (0.0, 4.0)).plan((math.nan, 4.0)), "outside the map"),
        (lambda: CostField(SQUARE, np.ones(SQUARE.shape), (0.0, 4.0)).change([[0, SIZE]], [2.0]), "in the grid"),
        (lambda: CostField(SQUARE, np.ones(SQUARE.shape), (-3.0, 2.0)).change([[0, 0]], [2.0]), "under the goal"),
    ],
)
def test_bad_input_is_refused_in_words(ask, said):
    with pytest.raises(InvalidInput, match=said):
        ask()
