"""Ways around walls, unknown and forbidden ground: cheapest by other means too, walked, or refused with where."""

import heapq
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.core.grid import GridGeometry
from footfall.planning.answers import Status
from footfall.planning.walk.around import (
    CELL,
    ChassisCosts,
    NoWay,
    cost_grid,
    is_easy,
    lengths_to,
    resampled,
    rounded,
    straightened,
    way_around,
)
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.guide import STEP, guide
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.travel_cost import plane_of, travel_cost
from footfall.terrain.from_arrays import from_heights

GRID = GridGeometry(-9.0, -9.0, 0.1, 181, 181)
X, Y = np.meshgrid(GRID.xs, GRID.ys)
BEGIN, END = np.array([-5.0, 0.0, 0.0]), np.array([5.0, 0.0, 0.0])
SETTINGS = WalkSettings(seed=1, time_limit=600.0)
COARSE = RecheckSettings(way=0.02, turn=0.02, hold=0.2)
LOW, HIGH = np.array([-8.0, -8.0]), np.array([8.0, 8.0])


def ground(unknown=None, wall=None):
    """Gentle; unknown: (rows, cols) cells. wall: the range of y in which one 2 m high across has its gap."""
    z = 0.03 * np.sin(X) + 0.03 * np.cos(1.3 * Y)
    if wall is not None:
        z = np.where((np.abs(X) < 0.25) & ~((wall[0] < Y) & (wall[1] > Y)), z + 2.0, z)
    if unknown is not None:
        z[unknown] = np.nan
    return from_heights(z.astype(np.float32), GRID.resolution, GRID.x0, GRID.y0, "around")


GROUNDS = {
    "wall": (ground(wall=(0.3, 5.8)), SETTINGS),
    "unknown": (ground(unknown=np.hypot(X, Y) < 1.5), SETTINGS),
    "forbidden": (ground(), WalkSettings(seed=1, time_limit=600.0, forbidden=(Place(0.0, 0.0, 1.5),))),
}


def cost_of(robot, dem, every=SETTINGS, begin=BEGIN, end=END):
    places = footfalls(robot, dem, LOW - 4.5, HIGH + 4.5, every)
    return travel_cost(robot, dem, places, every.spacing, np.zeros((0, 3)), footprint(robot), begin, end)


@pytest.fixture(scope="module")
def costs(athlete):
    """Of all that is not easy."""
    return {what: cost_of(athlete, dem, every) for what, (dem, every) in GROUNDS.items()}


def cheapest(grid, begin, end):
    """Cost of the cheapest path between two cells, by a heap alone."""
    best, waits = {begin: 0.0}, [(0.0, begin)]
    while waits:
        cost, (row, col) = heapq.heappop(waits)
        if (row, col) == end:
            return cost
        if cost > best[row, col]:
            continue
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                to = row + down, col + right
                if to == (row, col) or not (0 <= to[0] < len(grid.may) and 0 <= to[1] < grid.may.shape[1]):
                    continue
                if not grid.may[to]:
                    continue
                far = cost + CELL * math.hypot(down, right) * 0.5 * (grid.costs[row, col] + grid.costs[to])
                if far < best.get(to, math.inf):
                    best[to] = far
                    heapq.heappush(waits, (far, to))
    return math.inf


def random_grid(seed, share):
    rng = np.random.default_rng(seed)
    costs = 1.0 + 9.0 * rng.uniform(size=(14, 19)) ** 4
    may = rng.uniform(size=costs.shape) > share
    may[3, 2] = may[11, 16] = True
    return ChassisCosts(np.array([-2.0, 1.0]), costs, may)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.6))
def test_the_path_costs_what_another_search_finds(seed, share):
    grid = random_grid(seed, share)
    begin, end = grid.low + CELL * np.array([2, 3]), grid.low + CELL * np.array([16, 11])
    least, found = cheapest(grid, (3, 2), (11, 16)), grid.shortest(begin, end, 0.0)
    if math.isinf(least):
        # one of the goal's neighbours may still be as near as the goal's own cell allows
        assert isinstance(found, NoWay) or not np.allclose(found[0][-1], end)
        return
    assert not isinstance(found, NoWay)
    path, cost = found
    assert cost == pytest.approx(least, rel=1e-12)
    cells = [grid.cell(point) for point in path]
    assert cells[0] == (3, 2)
    assert cells[-1] == (11, 16)
    assert all(grid.may[cell] for cell in cells)
    assert np.hypot(*np.diff(path, axis=0).T).max() <= math.sqrt(2.0) * CELL + 1e-12


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_a_way_costs_no_more_than_the_straight_one_and_chords_no_more_than_the_path(seed):
    grid = random_grid(seed, 0.1)
    begin, end = grid.low + CELL * np.array([2.2, 2.9]), grid.low + CELL * np.array([15.8, 11.3])
    found = way_around(grid, begin, end, 0.15)
    if isinstance(found, NoWay):
        return
    assert grid.along(found) <= grid.along(np.array([begin, end])) + 1e-9
    assert np.array_equal(found[[0, -1]], [begin, end])
    path = grid.shortest(begin, end, 0.15)
    assert not isinstance(path, NoWay)
    pieces = sum(grid.along(path[0][i : i + 2]) for i in range(len(path[0]) - 1))
    chords = straightened(grid, path[0])
    assert sum(grid.along(chords[i : i + 2]) for i in range(len(chords) - 1)) <= pieces * 1.05


def test_rounding_keeps_the_ends_and_takes_the_corner_off():
    corner = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]])
    smooth = rounded(corner)
    assert np.array_equal(smooth[[0, -1]], corner[[0, -1]])
    steps = np.diff(smooth, axis=0)
    turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    assert turns.max() < math.radians(15.0)
    assert 5.5 < lengths_to(smooth)[-1] < 6.0
    straight = np.array([[0.0, 0.0], [3.0, 1.0]])
    assert lengths_to(rounded(straight))[-1] == pytest.approx(math.hypot(3.0, 1.0))


def test_planes_are_those_of_least_squares():
    rng = np.random.default_rng(0)
    angle = np.arange(6) * math.pi / 3 + rng.uniform(0.0, 1.0, (20, 1))
    dx, dy, z = 2.0 * np.cos(angle), 2.0 * np.sin(angle), rng.normal(size=(20, 6))
    for i in range(20):
        fitted = np.linalg.lstsq(np.column_stack([np.ones(6), dx[i], dy[i]]), z[i], rcond=None)[0]
        assert [one[i] for one in plane_of(dx, dy, z)] == pytest.approx(fitted, abs=1e-12)


def test_gentle_ground_is_easy_and_a_wall_unknown_and_forbidden_ground_is_not(athlete, costs):
    assert is_easy(cost_of(athlete, ground()))
    assert [what for what in costs if is_easy(costs[what])] == []


@pytest.mark.parametrize("what", list(GROUNDS))
def test_the_way_leads_around(athlete, costs, what):
    grid = cost_grid(costs[what], LOW, HIGH)
    way = way_around(grid, BEGIN[:2], END[:2], 0.15)
    assert not isinstance(way, NoWay)
    straight = np.array([BEGIN[:2], END[:2]])
    assert grid.along(way) < 0.7 * grid.along(straight)
    middle = way[np.argmin(np.abs(way[:, 0]))]
    assert 2.4 <= abs(middle[1]) <= 5.0
    if what == "wall":
        assert 2.4 <= middle[1] <= 3.7
    leads = guide(ground(), BEGIN, END, footprint(athlete), way)
    assert np.allclose(leads.vectors[[0, -1], :2], straight)
    assert np.hypot(*np.diff(leads.vectors[:, :2], axis=0).T).max() <= STEP + 1e-9
    assert leads.length == pytest.approx(lengths_to(resampled(way, 0.01))[-1], rel=1e-3)


@pytest.mark.parametrize("what", ["wall", "unknown"])
def test_a_walk_around_is_found_and_good_by_other_means_too(athlete, what):
    dem, every = GROUNDS[what]
    state = footfall.stand(athlete, dem, -5.0, 0.0)
    found = plan_walk(athlete, dem, state, WalkGoal(5.0, 0.0, 0.0), settings=every)
    assert found.status is Status.FOUND, found.reason
    assert found.plan is not None
    assert [
        one for one in recheck_walk(athlete, dem, found.plan, every, every=COARSE, state=state) if not one.holds
    ] == []
    assert found.plan.chassis_way > 11.0


def test_a_goal_that_is_enclosed_is_refused_with_where(athlete):
    """The strip of unknown ground is wider than the rover with all legs stretched; no search is begun."""
    x, y = np.meshgrid(np.arange(-9.0, 22.01, 0.25), np.arange(-14.0, 14.01, 0.25))
    away = np.hypot(x - 10.0, y)
    heights = np.where((away > 0.8) & (away < 11.5), np.nan, 0.0).astype(np.float32)
    dem = from_heights(heights, 0.25, -9.0, -14.0, "moat")
    state = footfall.stand(athlete, dem, -5.0, -1.0)
    told = []
    found = plan_walk(athlete, dem, state, (10.0, 0.0), settings=SETTINGS, progress=lambda _, text: told.append(text))
    assert found.status is Status.NO_PATH
    match = re.search(r"no nearer than ([\d.]+) m, at \((-?[\d.]+), (-?[\d.]+)\)", found.reason)
    assert match is not None, found.reason
    short, at_x, at_y = (float(number) for number in match.groups())
    assert math.hypot(at_x - 10.0, at_y) == pytest.approx(short, abs=0.11)
    assert "searching for foot moves" not in told


def test_where_the_chassis_surely_cant_be_is_where_some_leg_finds_no_place(athlete):
    """Held against every heading and place, one by one; where the rover stands at ease it may be."""
    dem = ground(unknown=np.abs(Y) > 3.0)
    cost = cost_of(athlete, dem)
    xs = np.arange(-8.0, 8.01, 1.0)
    grid = np.stack(np.meshgrid(xs, xs), axis=-1)
    may = cost.may_stand(grid, CELL)
    xy = np.stack(np.meshgrid(np.arange(-8.0, 8.01, CELL), np.arange(-8.0, 8.01, CELL)), axis=-1)
    may = cost.may_stand(xy, CELL)
    hips = np.array([leg.T_base_hip[:2, 3] for leg in athlete.description.legs])
    refused = 0
    for row in range(0, len(xy), 8):
        for col in range(0, len(xy), 8):
            good = False
            for yaw in np.linspace(0.0, 2 * math.pi, 60, endpoint=False):
                c, s = math.cos(yaw), math.sin(yaw)
                away = cost.tree.query(xy[row, col] + hips @ np.array([[c, s], [-s, c]]))[0]
                good = good or bool((away <= athlete.leg_length(0)).all())
            assert may[row, col] or not good
            refused += not may[row, col]
    assert refused > 0
