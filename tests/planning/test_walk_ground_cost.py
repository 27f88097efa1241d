"""What footfalls cost by their ground: sizes by other means, and walks that go beside what costs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.value import flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.walk.footfalls import Footfalls, footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.ground_cost import HOUR, costed, roughness_under
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import FootfallCosts, WalkGoal, WalkSettings
from footfall.planning.walk.slope_frame import slope_between
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk.travel_cost import travel_cost
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.surface import height_at
from tests.support.chassis_ground import wavy

LOW, HIGH = np.array([-2.5, -2.5]), np.array([2.5, 2.5])
SETTINGS = WalkSettings(seed=3, time_limit=600.0, smoothing=Smoothing(rounds=0))
GOAL = WalkGoal(1.2, 0.0, 0.0)
NEAR = 0.1
"""How far from a foot ground is made worse [m]."""
BAD = 3.0
"""What a footfall on bad ground costs, in foot moves."""


def ground(height, half=3.0, resolution=0.05):
    """Ground of height(x, y) [m]."""
    x = np.arange(-half, half + resolution / 2, resolution)
    return from_heights(height(*np.meshgrid(x, x)).astype(np.float32), resolution, -half, -half, "ground")


def remembered(dem, age=None, deviation=None):
    """The ground with layers of what is remembered; age [s], deviation [m]: (rows, cols) or one for all."""
    shape = dem.geometry.shape
    ages = np.broadcast_to(0.0 if age is None else age, shape)
    variance = np.broadcast_to(1e-6 if deviation is None else np.square(deviation), shape)
    source = np.ones(shape, np.uint8)
    return replace(
        dem,
        time=1.7e9 - ages,
        variance=variance.astype(np.float32),
        count=source.astype(np.uint16),
        source=source,
        sources=("front",),
    )


def costs_of(robot, dem, places, **weights):
    return costed(dem, places, robot.wheel_radius, FootfallCosts(**weights)).costs


def put(plan):
    """Where feet are put, (m, 2) [m]."""
    return np.array([after.contacts[leg, :2] for leg, after in zip(plan.legs, plan.stances[1:], strict=True)])


def near(dem, places):
    """Which cells are beside places (n, 2)."""
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    away, _ = KDTree(places).query(np.column_stack([x.ravel(), y.ravel()]))
    return away.reshape(x.shape) <= NEAR


@pytest.fixture(scope="module")
def dem():
    return wavy(half=5.0)


@pytest.fixture(scope="module")
def start(athlete, dem):
    return footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def free(athlete, dem, start):
    """A walk for which the ground costs nothing."""
    return walked(athlete, dem, start, FootfallCosts())


def walked(robot, dem, state, costs):
    found = plan_walk(robot, dem, state, GOAL, settings=replace(SETTINGS, footfall_costs=costs))
    assert found.status is Status.FOUND, found.reason
    assert found.plan is not None
    return found.plan


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_plane_is_not_rough_and_its_slope_costs_what_it_is(athlete, east, north):
    dem = ground(lambda x, y: east * x + north * y, half=2.0, resolution=0.1)
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    assert len(places.contacts) > 20
    assert roughness_under(dem, places, athlete.wheel_radius).max() < 1e-6
    slope = math.atan(math.hypot(east, north))
    np.testing.assert_allclose(costs_of(athlete, dem, places, slope=2.0), 2.0 * slope, atol=1e-4)


@pytest.mark.parametrize("height", [0.004, 0.012])
def test_roughness_is_what_a_fit_of_many_points_leaves(athlete, height):
    dem = ground(lambda x, y: 0.2 * x + height * np.sin(17.0 * x) * np.cos(13.0 * y), resolution=0.02)
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    found = roughness_under(dem, places, athlete.wheel_radius)
    rng = np.random.default_rng(5)
    angle, away = rng.uniform(0.0, 2.0 * np.pi, 3000), athlete.wheel_radius * np.sqrt(rng.uniform(size=3000))
    expected = []
    for x, y, _ in places.contacts:
        east, north = x + away * np.cos(angle), y + away * np.sin(angle)
        columns, z = np.column_stack([east, north, np.ones(3000)]), height_at(dem, east, north)
        plane = np.linalg.lstsq(columns, z, rcond=None)[0]
        expected.append(np.std(z - columns @ plane) / math.hypot(1.0, *plane[:2]))
    assert len(expected) > 100
    np.testing.assert_allclose(found, expected, rtol=0.25)
    assert np.mean(found / expected) == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(costs_of(athlete, dem, places, roughness=40.0), 40.0 * found)


def test_age_is_that_of_the_oldest_ground_under_the_wheel(athlete, dem):
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    x, _ = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    found = costs_of(athlete, remembered(dem, np.where(x < 0.0, 2.0 * HOUR, 0.0)), places, age=1.5)
    radius, cell = athlete.wheel_radius, dem.geometry.resolution
    at = places.contacts[:, 0]
    assert (found[at < radius - cell] == 3.0).all()
    assert (found[at > radius + cell] == 0.0).all()
    assert {*found.tolist()} == {0.0, 3.0}


def test_ground_that_is_not_sure_costs_its_deviation(athlete, dem):
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    spoilt = np.hypot(x, y) < 1.0
    found = costs_of(athlete, remembered(dem, deviation=np.where(spoilt, 0.05, 0.01)), places, deviation=20.0)
    away, radius, cell = np.hypot(*places.contacts[:, :2].T), athlete.wheel_radius, dem.geometry.resolution
    np.testing.assert_allclose(found[away < 1.0 + radius - 2.0 * cell], 1.0, rtol=1e-5)
    np.testing.assert_allclose(found[away > 1.0 + radius + cell], 0.2, rtol=1e-5)


def test_ground_that_does_not_say_how_old_or_sure_it_is_costs_nothing_for_that(athlete, dem):
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    assert not costs_of(athlete, dem, places, age=5.0, deviation=5.0).any()


def test_on_a_slope_it_is_the_site_s_ground_that_knows_its_age(athlete):
    """The slope's frame has ground of its own, turned, that remembers nothing."""
    site = ground(lambda x, y: -1.2 * x, half=4.0, resolution=0.1)
    x, _ = np.meshgrid(site.geometry.xs, site.geometry.ys)
    site = remembered(site, np.where(x > 0.0, HOUR, 0.0))
    frame = slope_between(site, np.zeros(2), np.zeros(2), 3.0, np.zeros(2))
    assert frame.ground is not site
    places = footfalls(athlete, frame.ground, LOW, HIGH, SETTINGS)
    found = costed(frame.ground, places, athlete.wheel_radius, FootfallCosts(age=1.0), frame).costs
    at, edge = frame.to_site(places.contacts)[:, 0], athlete.wheel_radius + site.geometry.resolution
    assert (found[at > 0.0] == 1.0).all()
    assert (found[at < -edge] == 0.0).all()
    assert {*found.tolist()} == {0.0, 1.0}


def test_old_ground_is_avoided_where_as_good_lies_beside_it(athlete, dem, start, free):
    """All that the walk steps on is made old: nothing else tells it from the rest."""
    old = remembered(dem, np.where(near(dem, put(free)), 3.0 * HOUR, 0.0))
    same = walked(athlete, old, start, FootfallCosts())
    np.testing.assert_array_equal(same.waypoints, free.waypoints)
    other = walked(athlete, old, start, FootfallCosts(age=BAD / 3.0))
    assert_beside(athlete, old, same, other, age=1.0 / 3.0)


def test_ground_that_is_not_sure_is_avoided_where_surer_lies_beside_it(athlete, dem, start, free):
    unsure = remembered(dem, deviation=np.where(near(dem, put(free)), 0.06, 1e-3))
    other = walked(athlete, unsure, start, FootfallCosts(deviation=BAD / 0.06))
    assert_beside(athlete, unsure, free, other, deviation=1.0 / 0.06)


def test_rough_ground_is_avoided_where_even_ground_lies_beside_it(athlete, dem, start, free):
    """Bumps of 2 cm, which every wheel may stand on, wherever the walk steps."""
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    bumps = np.where(near(dem, put(free)), 0.01 * np.sign(np.sin(31.0 * x) * np.sin(29.0 * y)), 0.0)
    rough = replace(dem, heights=(dem.heights + bumps).astype(np.float32))
    same = walked(athlete, rough, start, FootfallCosts())
    other = walked(athlete, rough, start, FootfallCosts(roughness=BAD / 0.004))
    assert_beside(athlete, rough, same, other, roughness=1.0 / 0.004)


def assert_beside(robot, dem, same, other, **weights):
    """The other walk steps less on ground that costs than the one to which it is no matter, which does step on it."""
    told = []
    for plan in (same, other):
        contacts = np.array([after.contacts[leg] for leg, after in zip(plan.legs, plan.stances[1:], strict=True)])
        normals = np.array([after.normals[leg] for leg, after in zip(plan.legs, plan.stances[1:], strict=True)])
        nothing = np.zeros(len(contacts))
        places = Footfalls(contacts, normals, np.full(len(contacts), -1), nothing, KDTree(contacts[:, :2]))
        told.append(costs_of(robot, dem, places, **weights).mean())
    assert told[0] > 0.5, told
    assert told[1] < 0.3 * told[0], told


def test_the_chassis_way_costs_more_over_dear_footfalls_and_nothing_less(athlete, dem):
    places = footfalls(athlete, dem, LOW, HIGH, SETTINGS)
    rng = np.random.default_rng(8)
    dear = replace(places, costs=np.where(places.contacts[:, 1] > 0.0, 2.0, 0.0))
    begin, end = np.zeros(3), np.array([1.0, 0.0, 0.0])
    free, told = (
        travel_cost(athlete, dem, one, SETTINGS.spacing, np.zeros((0, 3)), footprint(athlete), begin, end)
        for one in (places, dear)
    )
    xy = rng.uniform(-0.8, 0.8, (60, 2))
    more = told.at(xy) - free.at(xy)
    assert (more >= -1e-12).all()
    assert more.max() <= 2.0 + 1e-12
    # half of its feet stand on either side
    np.testing.assert_allclose(told.at(np.zeros((1, 2))) - free.at(np.zeros((1, 2))), 1.0, atol=0.34)


def test_settings_from_before_there_were_such_costs_mean_none():
    structure, arrays = flatten(replace(SETTINGS, footfall_costs=FootfallCosts(0, 0, 0, 0)))
    assert "footfall_costs" not in structure["of"]
    assert unflatten(structure, arrays).footfall_costs.age == 0.0
    told = replace(SETTINGS, footfall_costs=FootfallCosts(age=0.5))
    again = unflatten(*flatten(told))
    assert isinstance(again, WalkSettings)
    assert again.digest == told.digest != SETTINGS.digest


@pytest.mark.parametrize("wrong", [{"age": -1.0}, {"roughness": math.nan}, {"slope": -0.1}, {"deviation": math.inf}])
def test_costs_that_make_no_sense_are_misuse(wrong):
    with pytest.raises(InvalidInput):
        FootfallCosts(**wrong)
