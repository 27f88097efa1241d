"""Colours over images and relief stay the legend's, and the ground grid is where it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.colors import FOOTING, REACH
from footfall.maps.over_imagery import GRAIN, darkened, grain, grid_lines, grid_spacing
from footfall.terrain.dem import Dem
from footfall.terrain.ground.shading import DARKEST, relief


def hue(rgb):
    """Shares of red, green and blue: what is left of a colour where its brightness doesn't count."""
    return np.asarray(rgb, float) / np.sum(rgb, axis=-1, keepdims=True)


def pictured(seed, contrast=200):
    rng = np.random.default_rng(seed)
    seen = rng.integers(20, 20 + contrast, (40, 50)).astype(np.uint8)
    heights = np.cumsum(rng.normal(0, 0.03, (40, 50)), axis=1).astype(np.float32)
    return Dem(heights, GridGeometry(0.0, 0.0, 0.05, 40, 50), "pictured", Provenance({}), texture=seen)


@pytest.mark.parametrize("legend", [FOOTING, REACH], ids=["footing", "reach"])
@pytest.mark.parametrize("seed", range(3))
def test_every_class_stays_nearest_to_its_own_colour_of_the_legend(legend, seed):
    """At every brightness that images and relief make, from full light to the deepest hollow."""
    colors = np.array([rgb for _, rgb in legend.values()])
    different, own = np.unique(colors, axis=0, return_inverse=True)
    dem = pictured(seed)
    brightness = np.maximum(relief(dem) * grain(dem), DARKEST)
    assert brightness.min() < 0.5
    assert brightness.max() > 0.9
    for color, which in zip(colors, own.ravel(), strict=True):
        shown = darkened(np.broadcast_to(color.astype(np.uint8), (*brightness.shape, 3)), brightness)
        apart = np.linalg.norm(hue(shown)[..., None, :] - hue(different), axis=-1)
        assert (apart.argmin(axis=-1) == which).all()


def test_images_are_seen_through_the_colours():
    dem = pictured(4)
    seen = grain(dem)
    assert seen.min() == pytest.approx(1 - GRAIN)
    assert seen.max() == 1.0
    assert dem.texture is not None
    order = np.argsort(dem.texture, axis=None)
    assert (np.diff(seen.ravel()[order]) >= 0).all()
    without = Dem(dem.heights, dem.geometry, "blind", Provenance({}))
    assert (grain(without) == 1.0).all()


@given(x0=st.floats(-500, 500), y0=st.floats(-500, 500), resolution=st.sampled_from([0.01, 0.02, 0.05, 0.08, 0.3, 1.0]))
def test_grid_lines_are_one_cell_wide_on_every_multiple_of_the_spacing(x0, y0, resolution):
    spacing = grid_spacing(resolution)
    assert spacing >= 20 * resolution - 1e-9
    cells = GridGeometry(x0, y0, resolution, 70, 65)
    lines = grid_lines(cells)
    for along, places in ((np.logical_and.reduce(lines, 0), cells.xs), (np.logical_and.reduce(lines, 1), cells.ys)):
        offset = np.abs(places / spacing - np.rint(places / spacing)) * spacing
        assert (along[offset < 0.499 * resolution]).all()
        assert not (along[offset > 0.501 * resolution]).any()
