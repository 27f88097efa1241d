"""What corners cost at first, and what lines cost: against plain second methods."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from footfall.core.errors import Cancelled
from footfall.core.grid import GridGeometry
from footfall.planning.route import field as field_module
from footfall.planning.route.corners_kernel import LEAST_RISE, NONE, edge_cost, steps_of
from footfall.planning.route.field import CostField
from footfall.planning.route.line_kernel import line_costs
from footfall.planning.route.spread_kernel import LISTS, RISE, WIDTH, begin, spread

SIZE = 9
GRID = GridGeometry(0.0, 0.0, 1.0, SIZE, SIZE)
NEAR_COSTS = st.sampled_from([1.0, 1.7, 4.0, math.inf])
FAR_COSTS = st.sampled_from([1.0, 30.0, 5e3, 2e5, math.inf])
ROUND = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]


def relaxed(costs, goal):
    """What corners cost, (SIZE + 1, SIZE + 1): all of them asked over all pairs of neighbours until none changes."""

    def cell(row, col):
        return costs[row, col] if 0 <= row < SIZE and 0 <= col < SIZE else math.inf

    known = np.full((SIZE + 1, SIZE + 1), math.inf)
    row, col = (int(at + 0.5) for at in goal[::-1])
    for r in (row, row + 1):
        for c in (col, col + 1):
            known[r, c] = costs[row, col] * math.hypot(goal[1] + 0.5 - r, goal[0] + 0.5 - c)
    while True:
        before = known.copy()
        for r, c in np.ndindex(known.shape):
            for k in range(8):
                (dr, dc), (er, ec) = ROUND[k], ROUND[(k + 1) % 8]
                if k % 2:
                    (dr, dc), (er, ec) = (er, ec), (dr, dc)
                if not (0 <= r + er <= SIZE and 0 <= c + ec <= SIZE):
                    continue
                inside = cell(r + min(er, 0), c + min(ec, 0))
                # across the edge to the neighbour straight ahead
                off = (-er, dc) if dr == 0 else (dr, -ec)
                across = cell(r + min(off[0], 0), c + min(off[1], 0))
                straight, diagonal = float(known[r + dr, c + dc]), float(known[r + er, c + ec])
                known[r, c] = min(known[r, c], edge_cost(inside, across, straight, diagonal))
        if np.array_equal(before, known):
            return known


def spread_out(costs, goal, width):
    """What the kernel finds for all corners: it looks on until nothing waits, as no corner of the border gets known."""
    cost_field = CostField(GRID, costs, goal)
    corners, size = cost_field._corners, SIZE + 3
    lists, numbers = np.full(LISTS + 1, NONE, np.int32), np.zeros(5)
    numbers[RISE], numbers[WIDTH] = LEAST_RISE, width
    begin(corners, cost_field._ends, lists, numbers)
    border = np.zeros(1, np.int32)
    while not spread(corners, steps_of(size), border, 0.0, lists, numbers, 7):
        pass
    assert (lists == NONE).all()
    return corners["g"].reshape(size, size)[1:-1, 1:-1]


@settings(max_examples=16, deadline=None)
@given(
    st.sampled_from([NEAR_COSTS, FAR_COSTS]).flatmap(lambda one: arrays(np.float64, GRID.shape, elements=one)),
    st.tuples(st.floats(2.6, 5.4), st.floats(2.6, 5.4)),
    st.sampled_from([1e-3, LEAST_RISE, 10.0, 1e4]),
)
def test_the_first_look_finds_what_asking_all_pairs_again_and_again_finds(costs, goal, width):
    """However wide lists are: what costs more than all narrow ones waits apart, in a wide one corners come again."""
    costs[round(goal[1]), round(goal[0])] = 1.0
    np.testing.assert_allclose(spread_out(costs, goal, width), relaxed(costs, goal), rtol=1e-9)


def test_looking_goes_on_where_it_was_cancelled(monkeypatch):
    costs = np.random.default_rng(11).uniform(1.0, 6.0, (40, 40))
    geometry = GridGeometry(0.0, 0.0, 1.0, 40, 40)
    begin, goal = (3.0, 4.0), (35.0, 30.0)
    way, cost = CostField(geometry, costs, goal).plan(begin)
    monkeypatch.setattr(field_module, "AT_ONCE", 50)

    def stop(fraction, text):
        raise Cancelled("enough")

    interrupted = CostField(geometry, costs, goal)
    with pytest.raises(Cancelled):
        interrupted.plan(begin, stop)
    assert interrupted.looked_at < 41 * 41 / 2
    again, after = interrupted.plan(begin)
    assert after == pytest.approx(cost, rel=1e-12)
    np.testing.assert_allclose(again, way)


def crossed(costs, a, b):
    """Cost of a line by the middles of its pieces between all grid lines; on an edge the cheaper of both cells."""
    shares = [0.0, 1.0]
    for axis in (0, 1):
        if a[axis] != b[axis]:
            lines = np.arange(costs.shape[axis] + 1)
            shares += [s for s in (lines - a[axis]) / (b[axis] - a[axis]) if 0.0 < s < 1.0]
    total = 0.0
    shares = np.unique(np.round(shares, 12))
    for first, last in pairwise(shares):
        r, c = a + 0.5 * (first + last) * (b - a)
        rows = {int(r), int(r) - (a[0] == b[0] == int(r))}
        cols = {int(c), int(c) - (a[1] == b[1] == int(c))}
        total += (last - first) * min(costs[i, j] for i in rows for j in cols)
    return total * math.dist(a, b)


AT = st.tuples(*[st.one_of(st.integers(1, 8).map(float), st.floats(1.0, 8.0)) for _ in range(2)])


@given(arrays(np.float64, (9, 9), elements=st.sampled_from([1.0, 1.3, 2.0, 50.0])), AT, AT)
def test_a_line_costs_what_the_cells_do_that_it_crosses(costs, a, b):
    a, b = np.array(a), np.array(b)
    # a line that all but goes along an edge lies in either cell
    if any(0.0 < abs(a[axis] - b[axis]) < 1e-6 for axis in (0, 1)):
        return
    assert line_costs(costs, np.array([a, b])).sum() == pytest.approx(crossed(costs, a, b), rel=1e-6, abs=1e-6)


def test_a_line_through_the_corner_of_a_blocked_cell_is_free():
    costs = np.ones((4, 4))
    costs[1, 2] = costs[2, 1] = math.inf
    assert line_costs(costs, np.array([[1.0, 1.0], [3.0, 3.0]])).sum() == pytest.approx(math.sqrt(8.0))
    assert math.isinf(line_costs(costs, np.array([[1.0, 1.0], [3.0, 2.9]])).sum())
