"""Where feet may be put, where the rover would stand at ease, and the guide: laws over ground and windows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from footfall.core.frames import apply
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import FOLLOWS_SLOPE, footprint
from footfall.planning.walk.guide import METRES_A_RADIAN, STEP, guide
from footfall.planning.walk.problem import Place, WalkSettings
from footfall.terrain.from_arrays import from_heights
from tests.support.chassis_ground import wavy

SEED = st.integers(0, 2**32 - 1)
SPACING = 0.25
SETTINGS = WalkSettings(spacing=SPACING, seed=5)
LOW, HIGH = np.array([-3.0, -2.0]), np.array([2.0, 3.0])


def ramp(slope=0.0, steep=0.0, half=6.0, resolution=0.1):
    """Ground that rises eastward by ``slope`` [m/m], and from x = 0 on by ``steep``."""
    x = np.arange(-half, half + resolution / 2, resolution)
    heights = np.tile(slope * x + (steep - slope) * np.maximum(x, 0.0), (len(x), 1))
    return from_heights(heights.astype(np.float32), resolution, -half, -half, "ramp")


def rows_of(places):
    """Places as a set of rows, bit for bit."""
    return {tuple(row) for row in np.column_stack([places.contacts, places.normals]).tolist()}


def inside(places, low, high):
    """Those between two corners."""
    return {row for row in rows_of(places) if low[0] < row[0] < high[0] and low[1] < row[1] < high[1]}


@pytest.fixture(scope="module")
def ground():
    return wavy([(1.0, 1.2, 0.3, 0.2)], hole=(-1.0, 1.0, 0.4))


@pytest.fixture(scope="module")
def places(athlete, ground):
    return footfalls(athlete, ground, LOW, HIGH, SETTINGS)


@given(st.tuples(*[st.floats(-1.5, 1.5)] * 4))
def test_places_do_not_depend_on_how_much_ground_is_looked_at(athlete, ground, places, by):
    low, high = LOW + by[:2], HIGH + by[2:]
    other = footfalls(athlete, ground, low, high, SETTINGS)
    shared = np.maximum(low, LOW), np.minimum(high, HIGH)
    assert inside(other, *shared) == inside(places, *shared)
    assert len(inside(places, *shared)) > 20


def test_another_seed_gives_other_places(athlete, ground, places):
    other = footfalls(athlete, ground, LOW, HIGH, WalkSettings(spacing=SPACING, seed=6))
    assert not rows_of(other) & rows_of(places)


@given(st.sampled_from([0.1, 0.2, 0.3, 0.45]), st.integers(0, 2**31))
def test_each_cell_has_one_place_and_they_are_spread(athlete, spacing, seed):
    """Two places of neighbouring cells are a fifth of a cell apart at least, and no ground is far from all."""
    found = footfalls(athlete, ramp(), LOW, HIGH, WalkSettings(spacing=spacing, seed=seed))
    cells = np.floor(found.contacts[:, :2] / spacing).astype(int)
    assert len(np.unique(cells, axis=0)) == len(cells)
    wanted = np.prod(np.ceil(HIGH / spacing) - np.floor(LOW / spacing))
    assert len(cells) == wanted
    away, _ = found.tree.query(found.contacts[:, :2], k=2)
    assert away[:, 1].min() >= 0.2 * spacing - 1e-9
    # spread evenly within what a cell allows, and one way no matter where they are the other
    shares = found.contacts[:, :2] / spacing - cells
    np.testing.assert_allclose(shares.mean(axis=0), 0.5, atol=5 * 0.24 / math.sqrt(len(cells)))
    assert abs(np.corrcoef(shares.T)[0, 1]) < 5 / math.sqrt(len(cells))
    assert shares.min() >= 0.1 - 1e-9
    assert shares.max() <= 0.9 + 1e-9


def test_no_place_is_on_or_beside_unknown_ground(athlete, ground, places):
    grid = ground.geometry
    x, y = np.meshgrid(grid.xs, grid.ys)
    unknown = ~np.isfinite(ground.heights)
    holes = np.column_stack([x[unknown], y[unknown]])
    away = np.linalg.norm(places.contacts[:, None, :2] - holes, axis=2).min(axis=1)
    assert away.min() > athlete.wheel_radius
    # ground that is farther from it than that and its cells has places
    assert away.min() < athlete.wheel_radius + SPACING


def test_no_place_is_off_the_map(athlete, ground):
    found = footfalls(athlete, ground, np.array([3.0, -9.0]), np.array([9.0, 9.0]), SETTINGS)
    edge = 4.5 - athlete.wheel_radius
    assert np.abs(found.contacts[:, :2]).max() < edge
    assert found.contacts[:, 0].max() > edge - 2 * SPACING


def test_no_place_is_on_ground_steeper_than_allowed(athlete):
    dem = ramp(0.1, 0.5)
    steepest = math.atan(0.3)
    found = footfalls(athlete, dem, LOW, HIGH, WalkSettings(spacing=SPACING, steepest=steepest))
    assert found.contacts[:, 0].max() < athlete.wheel_radius
    assert (np.arccos(found.normals[:, 2]) <= steepest + 1e-12).all()
    anywhere = footfalls(athlete, dem, LOW, HIGH, WalkSettings(spacing=SPACING, steepest=math.atan(0.6)))
    assert anywhere.contacts[:, 0].max() > HIGH[0] - SPACING
    assert rows_of(found) < rows_of(anywhere)


def test_places_are_left_out_for_their_slope_alone(athlete, ground, places):
    tilts = np.arccos(places.normals[:, 2])
    steepest = float(np.median(tilts))
    found = footfalls(athlete, ground, LOW, HIGH, WalkSettings(spacing=SPACING, seed=5, steepest=steepest))
    np.testing.assert_array_equal(found.contacts, places.contacts[tilts <= steepest])


def test_contacts_lie_on_the_ground_and_normals_are_its_own(athlete):
    found = footfalls(athlete, ramp(0.2, 0.2), LOW, HIGH, SETTINGS)
    np.testing.assert_allclose(found.contacts[:, 2], 0.2 * found.contacts[:, 0], atol=1e-6)
    np.testing.assert_allclose(
        found.normals, np.tile([-0.2, 0.0, 1.0], (len(found.normals), 1)) / math.hypot(1, 0.2), atol=1e-5
    )


def test_forbidden_ground_has_no_places_but_that_of_one_leg_has(athlete, ground, places):
    settings = WalkSettings(spacing=SPACING, seed=5, forbidden=(Place(0.0, 0.0, 0.8), Place(0.5, -1.0, 0.6, 2)))
    found = footfalls(athlete, ground, LOW, HIGH, settings)
    gone = rows_of(places) - rows_of(found)
    assert rows_of(found) < rows_of(places)
    assert gone == {row for row in rows_of(places) if math.hypot(row[0], row[1]) <= 0.8}
    assert len(gone) > 10


def test_pinned_places_are_places_and_known_by_their_number(athlete, ground, places):
    pins = (Place(0.31, -0.47), Place(-1.0, 1.0), Place(1.62, -1.13))
    found = footfalls(athlete, ground, LOW, HIGH, WalkSettings(spacing=SPACING, seed=5, pinned=pins))
    # the second is in a hole
    assert found.pinned[found.pinned >= 0].tolist() == [0, 2]
    at = found.contacts[found.pinned >= 0, :2]
    np.testing.assert_array_equal(at, [(pins[0].x, pins[0].y), (pins[2].x, pins[2].y)])
    assert len(found.contacts) == len(places.contacts) + 2
    assert (places.pinned == -1).all()


@given(SEED, st.floats(-math.pi, math.pi), st.floats(0.0, 0.3), st.floats(0.0, 2 * math.pi))
def test_the_pose_that_suits_the_feet_at_ease_is_the_one_they_were_put_for(athlete, seed, yaw, slope, way):
    ease = footprint(athlete)
    x, y, z = np.random.default_rng(seed).uniform(-5, 5, 3)
    xy = ease.at(x, y, yaw)
    heights = z + slope * ((xy[:, 0] - x) * math.cos(way) + (xy[:, 1] - y) * math.sin(way))
    poses, off = ease.fits(np.column_stack([xy, heights])[None])
    np.testing.assert_allclose(off, 0.0, atol=1e-9)
    np.testing.assert_allclose(poses[0, :3], (x, y, z + ease.height), atol=1e-9)
    assert math.remainder(poses[0, 5] - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    # it leans as far as it follows the slope, towards where the slope falls
    R = Rotation.from_euler("ZYX", poses[0, 5:2:-1]).as_matrix()
    tan_ahead, tan_left = slope * math.cos(way - yaw), slope * math.sin(way - yaw)
    assert math.tan(math.asin(R[2, 0])) == pytest.approx(FOLLOWS_SLOPE * tan_ahead, abs=1e-9)
    assert math.tan(poses[0, 3]) == pytest.approx(FOLLOWS_SLOPE * tan_left, abs=1e-9)


@given(SEED)
def test_no_pose_near_the_one_that_suits_feet_best_suits_them_better(athlete, seed):
    rng = np.random.default_rng(seed)
    ease = footprint(athlete)
    contacts = np.column_stack([ease.at(1.0, 2.0, 0.7), np.zeros(6)]) + rng.normal(0.0, 0.15, (6, 3))
    poses, off = ease.fits(contacts[None])

    def squares(x, y, yaw):
        return ((contacts[:, :2] - ease.at(x, y, yaw)) ** 2).sum()

    # the base of ATHLETE is in the middle of its feet at ease
    np.testing.assert_allclose(ease.feet.mean(axis=0), 0.0, atol=1e-9)
    best = squares(*poses[0, [0, 1, 5]])
    assert (off[0] ** 2).sum() == pytest.approx(best, rel=1e-9)
    for by in rng.normal(0.0, 0.02, (20, 3)):
        assert squares(*(poses[0, [0, 1, 5]] + by)) >= best


@given(SEED)
def test_the_pose_that_suits_feet_leans_with_the_plane_through_them(athlete, seed):
    rng = np.random.default_rng(seed)
    ease = footprint(athlete)
    contacts = np.column_stack([ease.at(1.0, 2.0, 0.7), np.zeros(6)]) + rng.normal(0.0, 0.4, (6, 3))
    pose = ease.fits(contacts[None])[0][0]
    east, north, middle = np.linalg.lstsq(
        np.column_stack([contacts[:, :2] - contacts[:, :2].mean(axis=0), np.ones(6)]), contacts[:, 2], rcond=None
    )[0]
    ahead, left = np.array([math.cos(pose[5]), math.sin(pose[5])]), np.array([-math.sin(pose[5]), math.cos(pose[5])])
    assert math.tan(pose[3]) == pytest.approx(FOLLOWS_SLOPE * (left @ (east, north)), abs=1e-9)
    assert math.tan(pose[4]) == pytest.approx(-FOLLOWS_SLOPE * (ahead @ (east, north)), abs=1e-9)
    assert pose[2] == pytest.approx(middle + ease.height, abs=1e-9)


def test_the_height_of_a_rover_at_ease_is_the_one_asked_for(athlete):
    asked, usual = footprint(athlete, 1.3), footprint(athlete)
    assert asked.height == 1.3
    np.testing.assert_array_equal(asked.feet, usual.feet)
    assert 1.0 < usual.height < 2.5
    np.testing.assert_allclose(usual.at(0.0, 0.0, 0.0), usual.feet)
    turned = apply(
        np.array([[0, -1, 0, 3], [1, 0, 0, 4], [0, 0, 1, 0], [0, 0, 0, 1.0]]), np.pad(usual.feet, ((0, 0), (0, 1)))
    )
    np.testing.assert_allclose(usual.at(3.0, 4.0, math.pi / 2), turned[:, :2], atol=1e-12)


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 6))
def test_a_guide_leads_evenly_from_where_it_begins_to_where_it_ends(athlete, numbers):
    begin, end = np.array(numbers[:3]), np.array(numbers[3:])
    way = guide(ramp(), begin, end, footprint(athlete))
    xyyaw = way.vectors[:, [0, 1, 5]]
    np.testing.assert_allclose(xyyaw[0], begin, atol=1e-12)
    np.testing.assert_allclose(xyyaw[-1, :2], end[:2], atol=1e-12)
    turn = math.remainder(end[2] - begin[2], 2 * math.pi)
    # half a turn may go either way
    assert abs(math.remainder(xyyaw[-1, 2] - end[2], 2 * math.pi)) < 1e-9
    assert abs(xyyaw[-1, 2] - begin[2]) == pytest.approx(abs(turn), abs=1e-9)
    assert way.length == pytest.approx(math.hypot(*(end - begin)[:2], METRES_A_RADIAN * turn), abs=1e-9)
    assert way.ways[0] == 0.0
    assert np.diff(way.ways).max() <= STEP + 1e-9
    np.testing.assert_allclose(np.diff(xyyaw, n=2, axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(way.at(0.5 * way.length)[[0, 1, 5]], 0.5 * (xyyaw[0] + xyyaw[-1]), atol=1e-9)


@given(st.floats(0.0, 0.4), st.floats(-3.0, 3.0))
def test_a_guide_keeps_its_height_and_leans_with_the_slope(athlete, slope, yaw):
    ease = footprint(athlete)
    way = guide(ramp(slope, slope), np.array([-1.0, 0.3, yaw]), np.array([1.0, -0.2, yaw]), ease)
    np.testing.assert_allclose(way.vectors[:, 2], slope * way.vectors[:, 0] + ease.height, atol=1e-3 + 0.05 * slope)
    rise, bank = FOLLOWS_SLOPE * slope * math.cos(yaw), -FOLLOWS_SLOPE * slope * math.sin(yaw)
    np.testing.assert_allclose(np.tan(way.vectors[:, 4]), -rise, atol=0.02 * slope + 1e-6)
    np.testing.assert_allclose(np.tan(way.vectors[:, 3]), bank, atol=0.02 * slope + 1e-6)
