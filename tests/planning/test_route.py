"""Routes over ground: around what is bad, refused with what is in the way and where it is cut off."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from shapely.geometry import LineString, Point

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.maps.traversability import traversability
from footfall.planning.answers import Status
from footfall.planning.route.cost import _rise_under, cost_grid, reach
from footfall.planning.route.field import CostField
from footfall.planning.route.problem import Corridor, NoGo, RouteSettings
from footfall.robot.model import Robot
from footfall.terrain.from_arrays import from_heights

GRID = GridGeometry(-5.0, -8.0, 0.1, 161, 201)
GOAL = (10.0, 0.0)


def ground(wall=0.0, hole=None):
    """Flat; wall: height of one across y < 2 at x = 5 [m]; hole: x, y, radius that is unknown."""
    x, y = np.meshgrid(GRID.xs, GRID.ys)
    z = np.where((np.abs(x - 5.0) < 0.3) & (y < 2.0), wall, 0.0)
    if hole is not None:
        z = np.where(np.hypot(x - hole[0], y - hole[1]) < hole[2], np.nan, z)
    return from_heights(z.astype(np.float32), GRID.resolution, GRID.x0, GRID.y0, "made")


def rough():
    heights = np.random.default_rng(1).normal(0.0, 0.05, GRID.shape)
    return from_heights(heights.astype(np.float32), GRID.resolution, GRID.x0, GRID.y0, "rough")


@pytest.fixture(scope="module")
def start(athlete):
    return footfall.stand(athlete, ground())


def test_over_flat_ground_a_route_is_straight(athlete, start):
    found = footfall.plan_route(athlete, ground(), start, GOAL)
    assert found.plan is not None
    np.testing.assert_allclose(found.plan.points, [(0.0, 0.0), GOAL], atol=1e-9)
    assert found.plan.length == pytest.approx(10.0)
    assert found.plan.cost >= found.plan.length - 1e-9


def test_it_goes_around_a_wall(athlete, start):
    dem = ground(wall=1.0)
    found = footfall.plan_route(athlete, dem, start, GOAL)
    assert found.plan is not None
    grid = cost_grid(athlete, dem)
    straight = CostField(grid.geometry, grid.costs, GOAL).cost_from([(0.0, 0.0), GOAL])
    assert found.plan.cost < straight
    crossing = np.interp(5.0, found.plan.points[:, 0], found.plan.points[:, 1])
    assert crossing > 1.0


def test_what_a_cell_costs_is_the_mean_of_what_is_under_the_rover(athlete):
    dem = ground(wall=0.2, hole=(2.0, -3.0, 4.0))
    settings = RouteSettings()
    grid = cost_grid(athlete, dem, settings)
    found = traversability(dem, settings.maps)
    good = np.nan_to_num(found.goodness.astype(float)) * found.certainty
    side = 2 * round((math.sqrt(math.pi) * reach(athlete) / 0.1 - 1) / 2) + 1
    blocked = []
    for row, col in ((80, 50), (80, 95), (60, 70), (3, 3), (40, 100), (150, 190)):
        south, west = max(row - side // 2, 0), max(col - side // 2, 0)
        mean = good[south : row + side // 2 + 1, west : col + side // 2 + 1].sum() / side**2
        cost = grid.costs[row, col]
        blocked.append(math.isinf(cost))
        assert math.isinf(cost) == (mean < settings.worst)
        if not blocked[-1]:
            assert cost == pytest.approx(1.0 / mean, rel=1e-6)
    assert set(blocked) == {True, False}


def test_how_high_the_ground_rises_is_that_over_the_plane_under_the_rover():
    """A second method: the plane of least squares. On a slope without bumps nothing rises."""
    rng, side = np.random.default_rng(5), 9
    rows, cols = np.mgrid[0:30, 0:34].astype(float)
    slope = 0.3 * rows - 0.2 * cols
    bumps = np.where(rng.uniform(size=slope.shape) < 0.02, rng.uniform(0.2, 2.0, slope.shape), 0.0)
    for heights in (slope, slope + bumps):
        found = _rise_under(heights[:, None, :, None], side)
        for row, col in ((10, 10), (15, 20), (20, 8), (12, 27)):
            near = np.s_[row - 4 : row + 5, col - 4 : col + 5]
            axes = np.column_stack([np.ones(side**2), rows[near].ravel(), cols[near].ravel()])
            plane = axes @ np.linalg.lstsq(axes, heights[near].ravel(), rcond=None)[0]
            exact = (heights[near].ravel() - plane).max()
            assert found[row, col] <= exact + 0.35
            if heights is slope:
                assert found[row, col] == pytest.approx(0.0, abs=1e-9)
    assert found[10:20, 10:20].max() > 0.5


@pytest.mark.parametrize(
    ("area", "resolution"),
    [(NoGo(5.0, 0.5, 2.0), 0.1), (NoGo(5.05, 0.02, 0.04), 0.1), (NoGo(4.95, -0.05, 0.3), 1.0)],
    ids=["large", "between middles of cells", "smaller than a cell"],
)
def test_a_route_keeps_off_what_is_no_go_however_large_cells_are(athlete, start, area, resolution):
    asked = RouteSettings(no_go=(area,), resolution=resolution)
    found = footfall.plan_route(athlete, ground(), start, GOAL, asked)
    assert found.plan is not None, found.reason
    assert LineString(found.plan.points).distance(Point(area.x, area.y)) > area.radius - 1e-9
    assert LineString([(0.0, 0.0), GOAL]).distance(Point(area.x, area.y)) < area.radius


def test_a_route_keeps_to_its_corridors(athlete, start):
    settings = RouteSettings(corridors=(Corridor(0.0, 0.0, 5.0, 4.0, 0.5), Corridor(5.0, 4.0, 10.0, 0.0, 0.5)))
    found = footfall.plan_route(athlete, ground(), start, GOAL, settings)
    assert found.plan is not None
    share = np.linspace(0.0, 1.0, 100)[:, None]
    for a, b in pairwise(found.plan.points):
        x, y = ((1 - share) * a + share * b).T
        # both pieces have this slope and meet at (5, 4)
        away = np.abs(4.0 - 0.8 * np.abs(x - 5.0) - y) / math.hypot(1.0, 0.8)
        assert away.max() < 0.5 + 0.08
    refused = footfall.plan_route(athlete, ground(), start, (10.0, 2.0), settings)
    assert refused.status is Status.GOAL_INVALID
    assert "ground beside the corridors" in refused.reason


def test_by_footfalls_a_route_goes_over_what_legs_step_over_and_around_what_is_higher(athlete, start):
    """A wall of 0.9 m is no ground to roll over, but legs reach from above it to the ground; over 2 m they don't."""
    settings = RouteSettings(cost="feasible")
    flat, low, high = (footfall.plan_route(athlete, ground(wall=z), start, GOAL, settings).plan for z in (0, 0.9, 2.0))
    assert flat is not None
    assert low is not None
    assert high is not None
    assert flat.cost == pytest.approx(10.0, abs=0.05)
    assert low.points[:, 1].max() < 0.5
    assert flat.cost < low.cost < 20.0
    assert np.interp(5.0, high.points[:, 0], high.points[:, 1]) > 2.0 + reach(athlete) - 0.5
    blocked = footfall.plan_route(athlete, ground(wall=2.0), start, (5.0, -2.0), settings)
    assert blocked.status is Status.GOAL_INVALID
    assert "fewer than five legs find footfalls" in blocked.reason


def test_a_goal_that_is_cut_off_is_told_where(athlete, start):
    wall = tuple(NoGo(6.0, float(y), 1.0) for y in np.arange(-8.0, 9.0))
    found = footfall.plan_route(athlete, ground(), start, GOAL, RouteSettings(no_go=wall))
    assert found.status is Status.NO_PATH
    assert found.plan is None
    x, y = found.cut_off
    assert 4.6 < x < 5.3
    assert f"({x:.2f}, {y:.2f})" in found.reason
    assert f"{math.dist((x, y), GOAL):.2f} m before" in found.reason


@pytest.mark.parametrize(
    ("goal", "settings", "status", "said"),
    [
        ((40.0, 0.0), RouteSettings(), Status.OFF_MAP, "off the map: the map spans x -5.00…15.00 m"),
        ((9.0, -3.0), RouteSettings(), Status.UNKNOWN_GROUND, "unknown; take images"),
        (GOAL, RouteSettings(no_go=(NoGo(10.0, 0.0, 0.5),)), Status.GOAL_INVALID, "no-go; the nearest that is better"),
        (GOAL, RouteSettings(no_go=(NoGo(10.04, 0.0, 0.03),)), Status.GOAL_INVALID, "marked as no-go; the nearest"),
        (GOAL, RouteSettings(no_go=(NoGo(0.0, 0.0, 0.5),)), Status.START_INVALID, "the rover is on ground that is"),
    ],
)
def test_refusals_say_what_is_in_the_way(athlete, start, goal, settings, status, said):
    found = footfall.plan_route(athlete, ground(hole=(9.0, -3.0, 0.5)), start, goal, settings)
    assert (found.status, found.plan) == (status, None)
    assert said in found.reason


AREA = NoGo(10.0, 0.0, 0.5)
DRAWN = "draw the no-go areas or corridors otherwise"


@pytest.mark.parametrize(
    ("settings", "tries"),
    [
        (RouteSettings(no_go=(AREA,)), f"; {DRAWN}, or choose another goal"),
        (RouteSettings(no_go=(NoGo(0.0, 0.0, 0.5),)), f"; {DRAWN}, or move the rover there"),
        (RouteSettings(corridors=(Corridor(-2.0, 0.0, 2.0, 0.0, 0.5),)), f"; {DRAWN}, or choose another goal"),
        # of which none is on the map
        (RouteSettings(corridors=(Corridor(80.0, 0.0, 90.0, 0.0, 0.5),)), f"leave nothing of the map; {DRAWN}"),
    ],
)
def test_what_the_operator_marked_is_told_to_be_drawn_otherwise(athlete, start, settings, tries):
    for asked in (settings, replace(settings, cost="feasible")):
        found = footfall.plan_route(athlete, ground(), start, GOAL, asked)
        assert found.plan is None
        assert found.reason.endswith(tries)
        assert "worse ground" not in found.reason


def test_ground_that_is_in_the_way_is_told_with_what_the_operator_marked_beside_it(athlete, start):
    dem = rough()
    plain = footfall.plan_route(athlete, dem, start, GOAL)
    assert plain.reason.endswith("take images of what is not known, allow worse ground, or choose another goal")
    marked = footfall.plan_route(athlete, dem, start, GOAL, RouteSettings(no_go=(NoGo(5.0, 5.0, 0.5),)))
    assert marked.reason.endswith(f"allow worse ground, {DRAWN}, or choose another goal")


def test_a_rover_on_unknown_ground_or_off_the_map_is_told_so(athlete, start):
    found = footfall.plan_route(athlete, ground(hole=(0.0, 0.0, 4.0)), start, GOAL)
    assert (found.status, found.plan) == (Status.START_INVALID, None)
    assert "the rover is on unknown ground" in found.reason
    assert "the nearest that is better" in found.reason
    away = start.T_site_base.copy()
    away[0, 3] = -5.5
    found = footfall.plan_route(athlete, ground(), replace(start, T_site_base=away), GOAL)
    assert (found.status, found.plan) == (Status.START_INVALID, None)
    assert "the rover at (-5.5, 0) lies off the map: the map spans x -5.0" in found.reason


def test_ground_that_is_bad_everywhere_has_no_route(athlete, start):
    found = footfall.plan_route(athlete, rough(), start, GOAL)
    assert (found.status, found.plan) == (Status.NO_PATH, None)
    assert "no ground of the map is good enough" in found.reason


def test_bad_input_is_an_error(athlete, start):
    goals: list[Any] = [(math.nan, 0.0), (1.0, 2.0, 3.0)]
    for goal in goals:
        with pytest.raises(InvalidInput, match="finite x and y"):
            footfall.plan_route(athlete, ground(), start, goal)
    for bad, said in (
        ({"resolution": 0.0}, "resolution"),
        ({"worst": 1.5}, "at most 1"),
        ({"highest": -1.0}, "highest"),
    ):
        with pytest.raises(InvalidInput, match=said):
            replace(RouteSettings(), **bad)


@pytest.mark.parametrize("resolution", [5.1, 2000.0, 1e12])
def test_cells_that_would_fill_the_memory_are_refused(resolution):
    """A cell takes in so many of the map's to each side, also where the map has none."""
    with pytest.raises(InvalidInput, match="at most 5 m"):
        RouteSettings(resolution=resolution)
    assert RouteSettings(resolution=5.0).resolution == 5.0


def test_the_same_question_has_the_same_answer(athlete, start):
    dem = ground(wall=1.0)
    first, again = (footfall.plan_route(athlete, dem, start, GOAL) for _ in range(2))
    assert first.digest == again.digest


def test_a_robot_that_has_no_posture_to_stand_in_names_those_it_has(athlete, start):
    postures = {name: q for name, q in athlete.description.postures.items() if name != "stand"}
    other = Robot(replace(athlete.description, postures=postures))
    with pytest.raises(InvalidInput, match=f"has no such posture; it has {', '.join(postures)}: name one"):
        footfall.plan_route(other, ground(), start, GOAL)
