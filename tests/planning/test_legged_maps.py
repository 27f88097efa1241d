"""Maps of robots that others described: what is green is stepped on, what is not says what refused it."""

from functools import cache

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point

import footfall
from footfall.core.errors import InvalidInput
from footfall.maps import refusals
from footfall.maps.layers import NOT_LIFTED, REACHABLE_STABLE, MapStack
from footfall.planning.legged.leg_maps import ROUGHEST, compute_maps
from footfall.planning.legged.problem import LeggedSettings, LeggedState
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.robot.legged.posture import placed
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane
from tests.support.described import robot_of
from tests.support.legged_recheck import Recheck, faults

UNHURRIED = LeggedSettings(time_limit=1e6)
LEG, CELL = 1, 0.12
PLANNED_TOO = (refusals.NOT_REACHED, refusals.LIMITS, refusals.SUPPORT, refusals.GROUND, refusals.SELF, refusals.STEEP)
ROBOTS = [4, "A1"]


@cache
def mapped(name: str | int) -> tuple[Dem, LeggedState, MapStack]:
    """Coarse maps of one leg on rough ground."""
    _, robot = robot_of(name)
    dem = fractal(round(5 * robot.length, 1), CELL, roughness=0.08 * robot.length, seed=2)
    state = stand(robot, dem)
    return dem, state, compute_maps(robot, dem, state, LEG, UNHURRIED)


def cells(stack: MapStack, *codes: int) -> list[tuple[int, int]]:
    """Cells of the given classes, in an order that is always the same and none of the map's."""
    found = np.argwhere(np.isin(stack.layers["refused_by"], codes))
    return [(int(row), int(col)) for row, col in np.random.default_rng(5).permutation(found)]


def middle(stack: MapStack, cell: tuple[int, int]) -> tuple[float, float]:
    return float(stack.geometry.xs[cell[1]]), float(stack.geometry.ys[cell[0]])


@pytest.mark.parametrize("name", ROBOTS)
def test_no_green_cell_is_refused_by_the_planner(name):
    path, robot = robot_of(name)
    dem, state, stack = mapped(name)
    greens = cells(stack, refusals.NOTHING)
    assert len(greens) >= 5
    for number, cell in enumerate(greens[:3]):
        result = plan_step(robot, dem, state, LEG, middle(stack, cell), UNHURRIED)
        assert result.plan is not None, (cell, result.reason)
        np.testing.assert_allclose(result.plan.end.soles[LEG, :2], middle(stack, cell), atol=1e-6)
        if number == 0:
            assert faults(Recheck(path, robot, list(path.parents[2:5])).walk(dem, result.plan, 30)) == []


@pytest.mark.parametrize("name", ROBOTS)
def test_the_planner_refuses_what_its_checks_refused_in_the_map(name):
    _, robot = robot_of(name)
    dem, state, stack = mapped(name)
    found = cells(stack, *PLANNED_TOO)
    assert len(found) >= 5
    for cell in found[:2]:
        assert plan_step(robot, dem, state, LEG, middle(stack, cell), UNHURRIED).plan is None, cell


@pytest.mark.parametrize("name", ROBOTS)
def test_a_foot_move_to_a_green_cell_has_the_margins_of_the_map(name):
    _, robot = robot_of(name)
    dem, state, stack = mapped(name)
    cell = cells(stack, refusals.NOTHING)[0]
    result = plan_step(robot, dem, state, LEG, middle(stack, cell), UNHURRIED)
    assert result.plan is not None
    least = {check.name: check.margin for check in result.checks}
    assert stack.layers["torque_ratio"][cell] == pytest.approx(0.9 - least["effort"], abs=1e-5)
    assert stack.layers["limit_margin"][cell] == pytest.approx(least["limits"] + 1e-3, abs=1e-6)
    end = result.plan.end
    polygon = MultiPoint(end.contacts[:, :2]).convex_hull
    com = Point((end.T_site_base[:3, :3] @ placed(robot, end.q).com + end.T_site_base[:3, 3])[:2])
    assert polygon.contains(com)
    assert stack.layers["margin"][cell] == pytest.approx(polygon.boundary.distance(com), abs=1e-6)
    assert 0 < stack.layers["margin_lifted"][cell] <= stack.layers["margin"][cell] + 1e-6


def test_footing_follows_from_what_refused_and_numbers_stand_at_green_cells():
    _, _, stack = mapped("A1")
    code, footing = stack.layers["refused_by"], stack.layers["footing"]
    assert [one for one, about in refusals.REFUSALS.items() if about.footing == REACHABLE_STABLE] == [refusals.NOTHING]
    for one, about in refusals.REFUSALS.items():
        assert (footing[code == one] == about.footing).all()
    green = footing == REACHABLE_STABLE
    assert (green == (code == refusals.NOTHING)).all()
    for name in ("margin", "margin_lifted", "limit_margin", "torque_ratio"):
        assert (np.isfinite(stack.layers[name]) == green).all(), name


def test_the_same_request_gives_the_same_maps():
    _, robot = robot_of(4)
    dem, state, stack = mapped(4)
    assert footfall.compute_maps(robot, dem, state, LEG, UNHURRIED).digest == stack.digest


def test_ground_that_no_foot_is_put_on_says_why():
    _, robot = robot_of("A1")
    dem = plane(4.0, 0.05)
    state = stand(robot, dem)
    heights, (x, y) = np.array(dem.heights), np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    east, north = state.soles[LEG, :2]

    def at(dx: float, dy: float) -> tuple[int, int]:
        row, col = dem.geometry.cell(east + dx, north + dy)
        return int(row), int(col)

    out = np.sign(north)
    beyond = out * (y - north) - 0.1
    heights[beyond > 0] = 0.8 * beyond[beyond > 0]
    heights[(beyond > 0) & (x > east)] = np.nan
    pebble = at(-0.1, 0.0)
    heights[pebble] = 0.06
    changed = from_heights(heights, 0.05, dem.geometry.x0, dem.geometry.y0)
    code = compute_maps(robot, changed, state, LEG, UNHURRIED).layers["refused_by"]
    assert code[at(0.05, 0.15 * out)] == refusals.UNKNOWN
    assert code[at(-0.1, 0.2 * out)] == refusals.STEEP
    assert code[pebble] in (refusals.ROUGH, refusals.EDGE)
    assert code[pebble[0], pebble[1] + 1] == refusals.EDGE
    assert code[at(0.0, 0.0)] == refusals.NOTHING
    assert code[0, 0] == refusals.OUT_OF_RANGE


def test_rough_ground_is_refused_by_its_own_amount():
    _, robot = robot_of("A1")
    level = plane(4.0, 0.05)
    state = stand(robot, level)
    x, y = np.indices(level.geometry.shape)
    # level from cell to cell two apart, so that no plane through it is steep
    heights = 0.8 * ROUGHEST * robot.length * np.where((x + y) % 2, 1.0, -1.0)
    near = np.hypot(*(level.geometry.centers() - state.soles[LEG, :2]).transpose(2, 0, 1)) < 0.12
    for share, refused in ((1.0, False), (2.5, True)):
        dem = from_heights(np.where(near, share * heights, 0.0), 0.05, level.geometry.x0, level.geometry.y0)
        stack = compute_maps(robot, dem, stand(robot, dem), LEG, UNHURRIED)
        code, rough = stack.layers["refused_by"], np.asarray(stack.layers["roughness"], float)
        assert (rough[code == refusals.NOTHING] <= ROUGHEST * robot.length).all()
        assert (rough[code == refusals.ROUGH] > ROUGHEST * robot.length).all()
        assert ((code == refusals.ROUGH).any()) == refused


def test_a_leg_that_cannot_be_lifted_has_no_green_cell_and_says_why():
    _, robot = robot_of(3)
    dem = plane(4.0, CELL)
    stack = compute_maps(robot, dem, stand(robot, dem), 0, UNHURRIED)
    assert "no pose of the chassis keeps the weight over the other feet" in stack.not_lifted
    assert set(np.unique(stack.layers["footing"])) <= {NOT_LIFTED, 4}
    assert (stack.layers["refused_by"] == refusals.NOT_LIFTED).sum() > 10


def test_what_time_leaves_over_is_not_proven():
    _, robot = robot_of("A1")
    dem, state, whole = mapped("A1")
    stack = compute_maps(robot, dem, state, LEG, LeggedSettings(time_limit=1e-9))
    code = stack.layers["refused_by"]
    open_cells = code == refusals.NOT_PROVEN
    assert open_cells.sum() >= (whole.layers["refused_by"] == refusals.NOTHING).sum() - 1
    assert (code == refusals.NOTHING).sum() <= 1
    assert (code[~open_cells] == whole.layers["refused_by"][~open_cells]).all()


def test_maps_of_another_robot_or_leg_are_refused_and_cancelled_ones_end():
    _, robot = robot_of("A1")
    dem, state, _ = mapped("A1")
    with pytest.raises(InvalidInput, match="legs 0 to 3"):
        compute_maps(robot, dem, state, 4)
    with pytest.raises(InvalidInput, match="not of ring"):
        compute_maps(robot_of(4)[1], dem, state, 0)

    def stop(_fraction: float, _text: str) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        compute_maps(robot, dem, state, LEG, UNHURRIED, stop)
