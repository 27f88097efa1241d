"""Where the rover is on the map, how sure that is, and when a correction is not counted on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.frames import apply, rotation, transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import LEAST_SURE, MOVES_NOTHING, Looks, on_map, place_on_map
from footfall.terrain.terrain_settings import TerrainSettings

SETTINGS = TerrainSettings()
DEM = Dem(np.zeros((4, 4), np.float32), GridGeometry(0.0, 0.0, 1.0, 4, 4), "flat", Provenance({}))


def told(x=0.0, time=1000.0, yaw=0.0):
    T = transform(rotation("z", np.array(yaw)), (x, 0.5, 1.0))
    forces = np.tile([10.0, 0.0, 500.0], (6, 1))
    return RobotState("r", time, np.zeros(36), T, forces, np.zeros(36), "idle")


def moved(x=0.0, yaw=0.0):
    return transform(rotation("z", np.array(yaw)), (x, 0.0, 0.0))


def corrected(by):
    return replace(DEM, correction=by)


def looks(count=4, first=None, **about):
    return replace(Looks(told(), first or told(), count, np.eye(4), SETTINGS), **about)


def test_without_a_correction_the_map_has_it_where_odometry_has_it():
    for dem in (None, DEM):
        found = place_on_map(told(), dem, None)
        assert (found.state.digest, len(found.possible)) == (told().digest, 1)
        assert (found.doubt, found.corrected) == ("", 0.0)


@given(st.floats(-0.1, 0.1), st.floats(-0.03, 0.03), st.floats(0.0, 0.5), st.floats(0.0, 600.0))
def test_a_fresh_correction_is_counted_on_and_bounds_how_far_it_moves_any_point(x, yaw, way, age):
    by, now = moved(x, yaw), told(way, 1000.0 + age)
    found = place_on_map(now, corrected(by), looks())
    assert (found.doubt, found.possible) == ("", (found.state,))
    assert (found.way, found.age) == (pytest.approx(way), pytest.approx(age))
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.0, 0.8)])
    # second method: the points themselves, moved
    at = apply(now.T_site_base, points)
    assert np.linalg.norm(apply(by, at) - at, axis=1).max() <= found.corrected + 1e-9
    assert np.allclose(apply(found.state.T_site_base, points), apply(by, at))
    assert np.linalg.norm(found.state.wheel_forces, axis=1) == pytest.approx(np.linalg.norm(now.wheel_forces, axis=1))


def test_the_deviation_is_that_of_a_random_walk():
    """Second method: many rovers, whose odometry goes astray in small steps."""
    generator = np.random.default_rng(1)
    steps, way = 20, 1.5
    per_step = np.hypot(SETTINGS.pose_shift, SETTINGS.pose_turn) * np.sqrt(way / steps)
    strayed = generator.normal(0.0, per_step, (20_000, steps)).sum(axis=1).std()
    found = place_on_map(told(way), corrected(moved(0.1)), looks())
    assert found.deviation == pytest.approx(strayed, rel=0.03)


@given(st.floats(0.0, 6.0), st.floats(0.0, 4.0 * 3600.0))
def test_what_is_too_old_by_way_or_time_is_in_doubt_with_both_sizes(way, age):
    found = place_on_map(told(way, 1000.0 + age), corrected(moved(0.1)), looks())
    assert found.deviation is not None
    assert bool(found.doubt) == (found.deviation > LEAST_SURE)
    if found.doubt:
        assert f"uncertain by {found.deviation:.3f} m since, at most 0.05 m" in found.doubt
        assert f"{way:.2f} m away" in found.doubt
        assert "take images" in found.doubt
        assert found.possible == (found.state, found.by_odometry)


def test_a_rover_whose_clock_began_anew_is_in_doubt():
    found = place_on_map(told(time=900.0), corrected(moved(0.1)), looks())
    assert found.doubt.startswith("the rover's clock is 100 s before the images")


def test_a_correction_from_elsewhere_is_in_doubt_unless_it_moves_nothing():
    found = place_on_map(told(), corrected(moved(0.1)), None)
    assert found.doubt.startswith("the map's correction of 0.10 m is from no images of this rover")
    assert (found.deviation, found.way, found.age) == (None, None, None)
    assert place_on_map(told(), corrected(moved(0.9 * MOVES_NOTHING)), None).doubt == ""
    assert place_on_map(told(9.0), corrected(moved(0.9 * MOVES_NOTHING)), looks()).doubt == ""


@pytest.mark.parametrize("count", [1, 4, 25])
def test_a_correction_is_at_most_three_deviations_of_as_many_looks(count):
    most = 3.0 * np.sqrt(count) * SETTINGS.pose_shift
    for share, doubted in ((0.99, False), (1.01, True)):
        found = place_on_map(told(), corrected(moved(share * most)), looks(count))
        assert bool(found.doubt) == doubted, found.doubt
    assert f"moved the pose by {1.01 * most:.2f} m" in found.doubt
    assert f"in {count} looks" in found.doubt
    turned = 1.01 * 3.0 * np.sqrt(count) * SETTINGS.pose_turn
    # about the chassis: nothing but the turn speaks against it
    T = told().T_site_base
    about = transform(None, T[:3, 3]) @ moved(yaw=turned) @ transform(None, -T[:3, 3])
    assert f"{np.degrees(turned):.1f}° in" in place_on_map(told(), corrected(about), looks(count)).doubt


def test_a_turn_early_on_moves_a_far_rover_by_more_and_a_map_from_elsewhere_counts_from_there():
    far, by = told(10.0), moved(0.0, 0.03)
    assert np.linalg.norm((by @ far.T_site_base - far.T_site_base)[:3, 3]) > 0.29
    assert place_on_map(far, corrected(by), looks(latest=far)).doubt == ""
    assert "look whether map and odometry" in place_on_map(far, corrected(by), looks(latest=far, first=far)).doubt
    there = moved(3.0)
    small = moved(0.05) @ there
    assert place_on_map(told(), corrected(small), looks(below=there)).doubt == ""
    assert "look whether" in place_on_map(told(), corrected(small), looks()).doubt


def test_on_map_is_what_the_map_says():
    by = moved(0.2, 0.1)
    assert np.array_equal(on_map(told(), corrected(by)).T_site_base, by @ told().T_site_base)
