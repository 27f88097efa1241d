"""Routes: how long costs and Field D* take at first and after changes, and how near ways are to the cheapest.

The peer is Dijkstra's algorithm over eight directions (scipy) on the same cells in the same run.
"""

import math
import time
from collections.abc import Iterator

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from benchmarks import feasible
from benchmarks.timing import SEED, Figure
from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.planning.route.coarse import cheapest_way
from footfall.planning.route.field import CostField
from footfall.planning.route.headings import Faced, faced, pieces
from footfall.planning.route.turns import way_with_turns

SMALL_CHANGE = 20
"""Cells that change near the rover."""


def rough(size: int, seed: int) -> tuple[GridGeometry, Array]:
    """Smooth random costs, 1…5, on size × size cells of 1 m, a twentieth of them blocked in patches."""
    rng = np.random.default_rng(seed)
    costs = gaussian_filter(rng.normal(size=(size, size)), 8.0)
    costs = 1.0 + 4.0 * (costs - costs.min()) / (costs.max() - costs.min())
    patches = gaussian_filter(rng.normal(size=(size, size)), 5.0)
    blocked = patches > np.quantile(patches, 0.95)
    blocked[:20, :20] = blocked[-20:, -20:] = False
    return GridGeometry(0.0, 0.0, 1.0, size, size), np.where(blocked, math.inf, costs)


def figures(quick: bool) -> Iterator[Figure]:
    """Processor times, of one core; repairs as ratios to planning the same map anew."""
    begin = (5.0, 5.0)
    CostField(*rough(32, SEED), (30.0, 30.0)).plan(begin)
    for size, floor in ((512, 0.1), (1024, 0.5)):
        yield Figure(f"route/first_{size}", _first(size, 2 if quick else 5), "s", floor)
    for name, floor in (("one_percent", 20.0), ("20_cells", 100.0)):
        yield Figure(f"route/repair_{name}_speedup", _repairs(name, 2 if quick else 5), "x", floor, at_most=False)
    yield Figure("route/two_grounds_over_exact", _refracted(), "", 1.005)
    cost, seconds = _against_eight(512, 2 if quick else 5)
    yield Figure("route/cost_over_8_directions", cost, "", 1.0)
    yield Figure("route/time_over_dijkstra", seconds, "")
    seconds, share = _together(512, 2 if quick else 5)
    yield Figure("route/together_512", seconds, "s")
    yield Figure("route/together_over_way_alone", share, "")
    yield from feasible.figures(quick)
    if not quick:
        geometry, costs = rough(4000, SEED)
        began = time.process_time()
        way, _ = cheapest_way(geometry, costs, begin, (3990.0, 3990.0))
        yield Figure("route/coarse_4000", (time.process_time() - began,) if len(way) else (math.inf,), "s", 5.0)


def _first(size: int, count: int) -> tuple[float, ...]:
    samples = []
    for seed in range(count):
        geometry, costs = rough(size, SEED + seed)
        field = CostField(geometry, costs, (size - 6.0, size - 6.0))
        began = time.process_time()
        field.plan((5.0, 5.0))
        samples.append(time.process_time() - began)
    return tuple(samples)


def _repairs(name: str, count: int, size: int = 1024) -> tuple[float, ...]:
    """How many times faster a change around the rover is repaired than the map is planned anew, at the same cost."""
    samples = []
    for seed in range(count):
        geometry, costs = rough(size, SEED + seed)
        begin, goal = (60.0, 60.0), (size - 6.0, size - 6.0)
        costs[57:64, 57:64] = 2.0
        field = CostField(geometry, costs, goal)
        field.plan(begin)
        rng = np.random.default_rng(seed)
        away = np.hypot(*(np.indices(costs.shape) - 60.0))
        away[60, 60] = math.inf
        cells = np.argwhere(away < size * math.sqrt(0.01 / math.pi))
        if name == "20_cells":
            cells = rng.choice(np.argwhere((away < 12.0) & (away > 2.0)), SMALL_CHANGE, replace=False)
        values = rng.uniform(1.0, 8.0, len(cells))
        began = time.process_time()
        field.change(cells, values)
        repaired = field.plan(begin)[1]
        repair = time.process_time() - began
        costs[cells[:, 0], cells[:, 1]] = values
        anew = CostField(geometry, costs, goal)
        began = time.process_time()
        cost = anew.plan(begin)[1]
        samples.append((time.process_time() - began) / repair)
        if not math.isclose(cost, repaired, rel_tol=1e-6):
            raise AssertionError(f"repaired to {repaired}, anew {cost}")
    return tuple(samples)


def _refracted() -> tuple[float, ...]:
    """Cost over the exact optimum (Snell) between ground of cost 1 and dearer ground."""
    size, samples = 256, []
    geometry = GridGeometry(0.0, 0.0, 1.0, size, size)
    for dear in (1.2, 2.0, 5.0):
        for begin, goal in (
            ((10.0, 10.0), (240.0, 230.0)),
            ((90.0, 200.0), (250.0, 30.0)),
            ((3.0, 128.0), (250.0, 140.0)),
        ):
            costs = np.ones(geometry.shape)
            costs[:, size // 2 :] = dear
            y, edge = np.linspace(0.0, size, 1_000_001), size / 2 - 0.5
            exact = np.hypot(edge - begin[0], y - begin[1]) + dear * np.hypot(goal[0] - edge, y - goal[1])
            samples.append(CostField(geometry, costs, goal).plan(begin)[1] / float(exact.min()))
    return tuple(samples)


def _against_eight(size: int, count: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Cost and time over those of Dijkstra over eight directions between the middles of cells."""
    costs_over, time_over = [], []
    for seed in range(count):
        geometry, costs = rough(size, SEED + seed)
        begin, goal = (5.0, 5.0), (size - 6.0, size - 6.0)
        field = CostField(geometry, costs, goal)
        began = time.process_time()
        own = field.plan(begin)[1]
        took = time.process_time() - began
        graph = _eight(costs)
        began = time.process_time()
        from_goal = dijkstra(graph, indices=(size - 6) * size + size - 6)
        time_over.append(took / (time.process_time() - began))
        costs_over.append(own / float(from_goal[5 * size + 5]))
    return tuple(costs_over), tuple(time_over)


def _together(size: int, count: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Time of a search of way and headings together, 8 headings that differ; its cost over that of the way alone."""
    times, shares = [], []
    turning, begin, goal = 5.0, (5.0, 5.0), (size - 6.0, size - 6.0)
    for seed in range(count):
        geometry = rough(size, SEED)[0]
        metre = np.array([rough(size, SEED + 10 * seed + heading)[1] for heading in range(4)])
        alone, _ = CostField(geometry, metre.min(axis=0), goal).plan(begin)
        began = time.process_time()
        way, _ = way_with_turns(geometry, metre, begin, goal, 0.0, turning)
        times.append(time.process_time() - began)
        costs = []
        for points in (alone, way):
            cut = pieces(geometry, points)
            along = np.tile(metre[:, cut.cells[..., 0], cut.cells[..., 1]].min(axis=2), (2, 1))
            found = faced(cut, along, 0.0, turning)
            costs.append(found.cost if isinstance(found, Faced) else math.inf)
        # of both the cheaper one is taken
        shares.append(min(costs) / costs[0])
    return tuple(times), tuple(shares)


def _eight(costs: Array) -> csr_array:
    rows, cols = costs.shape
    number = np.arange(rows * cols).reshape(rows, cols)
    begins, ends, lengths = [], [], []
    for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = np.s_[: rows - dr, (1 if dc < 0 else 0) : cols - max(dc, 0)]
        b = np.s_[dr:, (0 if dc < 0 else dc) : cols + min(dc, 0)]
        length = math.hypot(dr, dc) * 0.5 * (costs[a] + costs[b])
        free = np.isfinite(length)
        begins.append(number[a][free])
        ends.append(number[b][free])
        lengths.append(length[free])
    i, j, length = (np.concatenate(part) for part in (begins, ends, lengths))
    both = (np.concatenate([i, j]), np.concatenate([j, i]))
    return coo_array((np.concatenate([length, length]), both), shape=(rows * cols,) * 2).tocsr()
