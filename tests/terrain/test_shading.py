"""Light on the ground, by laws of light; and the surface under holes, which hides nothing that is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import LinearNDInterpolator

from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, slope
from footfall.terrain.ground.shading import DARKEST, LEVEL, LIGHT, facing, relief, sky_seen
from footfall.terrain.ground.under_holes import SUNK, under_holes


def turned(dem, times):
    """By so many right angles, anticlockwise seen from above: row 0 is south."""
    return from_heights(np.rot90(dem.heights, -times).copy(), dem.geometry.resolution)


def bowl(depth, radius=0.3, resolution=0.02, half=1.0):
    x = np.arange(-half, half + resolution / 2, resolution)
    away = np.hypot(*np.meshgrid(x, x))
    return from_heights((-depth * np.clip(1 - away / radius, 0, 1)).astype(np.float32), resolution, -half, -half)


def test_level_ground_is_even_at_any_height():
    for height in (-3.0, 0.0, 2000.0):
        assert relief(plane(4.0, 0.05, height)) == pytest.approx(LEVEL, abs=1e-6)


@pytest.mark.parametrize("uphill", np.arange(8) * np.pi / 4)
def test_a_slope_is_lit_as_lambert_says(uphill):
    dem = slope(4.0, 0.05, 0.3, uphill)
    normal = np.array([-np.sin(0.3) * np.cos(uphill), -np.sin(0.3) * np.sin(uphill), np.cos(0.3)])
    assert facing(dem) == pytest.approx(normal @ LIGHT / LIGHT[2], abs=1e-4)


def test_the_light_comes_from_the_north_west():
    """Ground that rises to the south-east faces it."""
    assert LIGHT[0] < 0 < LIGHT[1]
    assert np.linalg.norm(LIGHT) == pytest.approx(1.0)
    lit, away = (facing(slope(4.0, 0.1, 0.3, uphill)).mean() for uphill in (-np.pi / 4, 3 * np.pi / 4))
    assert lit > 1.1
    assert away < 0.9


@given(seed=st.integers(0, 99), times=st.integers(1, 3))
def test_ground_and_light_that_turn_together_look_the_same(seed, times):
    dem = fractal(2.0, 0.1, seed=seed)
    angle = times * np.pi / 2
    light = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]) @ LIGHT
    assert facing(turned(dem, times), light) == pytest.approx(np.rot90(facing(dem), -times), abs=1e-4)
    assert sky_seen(turned(dem, times)) == pytest.approx(np.rot90(sky_seen(dem), -times), abs=1e-5)


def test_a_pit_is_darker_the_deeper_it_is_and_a_hill_is_not():
    seen = [sky_seen(bowl(depth)) for depth in (-0.2, 0.0, 0.05, 0.2, 0.6)]
    middles = [one[50, 50] for one in seen]
    assert middles[0] == middles[1] == 1.0
    assert middles[1] > middles[2] > middles[3] > middles[4]
    # the middle of a cone of 0.3 m sees over its rim all around: cos² of the wall's elevation, cells apart at most
    assert middles[3] == pytest.approx(1 / (1 + (0.2 / 0.3) ** 2), rel=0.05)
    assert (relief(bowl(0.6)) >= DARKEST).all()


def test_the_rim_of_a_hole_is_as_bright_as_the_ground_about_it():
    heights = slope(4.0, 0.05, 0.3, 1.0).heights.copy()
    whole = relief(from_heights(heights, 0.05))
    heights[20:40, 30:50] = np.nan
    holed = relief(from_heights(heights, 0.05))
    known = np.isfinite(heights)
    assert holed[known] == pytest.approx(whole[known], abs=0.02)
    assert np.isfinite(holed).all()


@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.05, 0.95), rows=st.integers(4, 60), cols=st.integers(4, 60))
def test_what_lies_under_holes_is_below_all_that_is_known_and_no_lower_than_the_lowest(seed, share, rows, cols):
    rng = np.random.default_rng(seed)
    heights = rng.uniform(-1.0, 1.0, (rows, cols)).astype(np.float32)
    heights[rng.random((rows, cols)) < share] = np.nan
    heights[rng.integers(rows), rng.integers(cols)] = 0.0
    dem = from_heights(heights, 0.03, 5.0, -2.0)
    mesh = under_holes(dem)
    assert (mesh.vertices[:, 2] >= np.nanmin(heights) - SUNK - 1e-6).all()
    row, col = np.nonzero(np.isfinite(heights))
    x, y = dem.geometry.xs[col], dem.geometry.ys[row]
    # with the slanting sides of any triangulation of its corners
    beneath = LinearNDInterpolator(mesh.vertices[:, :2], mesh.vertices[:, 2])(x, y) if len(mesh.triangles) else []
    under = np.isfinite(beneath)
    assert (np.asarray(beneath)[under] < heights[row, col][under]).all()


def test_all_holes_and_nothing_else_have_something_under_them():
    heights = np.zeros((100, 120), np.float32)
    assert len(under_holes(from_heights(heights, 0.02)).triangles) == 0
    heights[30:50, 40:70] = heights[90:, :10] = np.nan
    dem = from_heights(heights, 0.02)
    mesh = under_holes(dem)
    a, b, c = (mesh.vertices[mesh.triangles[:, i], :2] for i in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (doubled > 0).all()
    # covered: the square of every unknown cell; not much more: a square of 10 cm on each side
    squares = [(tri[:, 0].min(), tri[:, 0].max(), tri[:, 1].min(), tri[:, 1].max()) for tri in np.stack([a, b, c], 1)]
    low_x, high_x, low_y, high_y = np.array(squares).T
    row, col = np.nonzero(np.isnan(heights))
    x, y = dem.geometry.xs[col][:, None], dem.geometry.ys[row][:, None]
    assert ((x >= low_x - 1e-9) & (x <= high_x + 1e-9) & (y >= low_y - 1e-9) & (y <= high_y + 1e-9)).any(axis=1).all()
    assert doubled.sum() / 2 < (30 + 16) * 0.02 * (20 + 16) * 0.02 + (10 + 12) * 0.02 * (10 + 12) * 0.02
