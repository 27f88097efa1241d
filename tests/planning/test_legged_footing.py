"""Where a ball let down on the ground comes to rest, held against geometry and a search of its own."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.planning.legged.footing import LATTICE, rest, rest_heights
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, slope
from footfall.terrain.ground.surface import height_at

radii = st.floats(0.01, 0.2)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(radii, st.floats(-0.5, 0.5), st.floats(-3.1, 3.1), st.floats(-1.0, 1.0))
def test_on_a_plane_the_centre_is_a_radius_off_along_the_normal(radius, angle, uphill, x):
    dem = slope(6.0, 0.1, angle, uphill)
    found = rest(dem, x, 0.3, radius)
    normal = np.array([-np.tan(angle) * np.cos(uphill), -np.tan(angle) * np.sin(uphill), 1.0])
    normal /= np.linalg.norm(normal)
    off = normal @ (found.center - (0.0, 0.0, 0.0))
    assert off == pytest.approx(radius, abs=radius / (2 * LATTICE**2) + 1e-6)
    np.testing.assert_allclose(found.normal, normal, atol=1e-3)
    assert np.linalg.norm(found.center - found.contact) == pytest.approx(radius)


@pytest.mark.parametrize("seed", range(5))
def test_on_rough_ground_it_touches_and_does_not_sink_in(seed):
    dem = fractal(4.0, 0.05, roughness=0.05, seed=seed)
    rng = np.random.default_rng(seed)
    for x, y, radius in rng.uniform((-1, -1, 0.01), (1, 1, 0.1), (20, 3)):
        center = rest(dem, x, y, radius).center
        points = center[:2] + rng.uniform(-radius, radius, (40_000, 2))
        ground = np.column_stack([points, height_at(dem, *points.T)])
        least = np.linalg.norm(ground - center, axis=1).min()
        assert radius - 2e-2 * radius <= least <= radius * 1.005 + 1e-4


def test_a_point_rests_on_the_surface_itself():
    dem = fractal(4.0, 0.1, roughness=0.1, seed=3)
    found = rest(dem, 0.33, -0.21, 0.0)
    assert found.center[2] == pytest.approx(float(height_at(dem, 0.33, -0.21)))
    np.testing.assert_array_equal(found.center, found.contact)


def test_heights_of_many_places_are_those_of_each():
    dem = fractal(4.0, 0.1, roughness=0.1, seed=4)
    xy = np.random.default_rng(0).uniform(-1.5, 1.5, (30, 2))
    each = [rest(dem, x, y, 0.07).center[2] for x, y in xy]
    np.testing.assert_allclose(rest_heights(dem, xy, 0.07), each)


def test_unknown_ground_bears_nobody():
    level = plane(2.0, 0.1)
    heights = np.array(level.heights)
    heights[:, 12:] = np.nan
    dem = from_heights(heights, 0.1, level.geometry.x0, level.geometry.y0)
    assert np.isfinite(rest(dem, -0.5, 0.0, 0.05).center).all()
    assert np.isnan(rest(dem, 0.08, 0.0, 0.05).center).all(), "its rim is over unknown ground"
    assert np.isnan(rest(dem, 9.0, 0.0, 0.05).center).all(), "off the map"
