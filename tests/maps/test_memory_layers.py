"""Age and certainty of heights as map layers."""

from dataclasses import replace

import numpy as np

from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.colors import UNKNOWN_RGB, layer_legend, layer_rgb
from footfall.maps.layers import MapStack
from footfall.maps.stack import memory_layers
from footfall.terrain.dem import Dem

HEIGHTS = np.array([[0.0, 1.0, np.nan], [2.0, 3.0, 4.0]], np.float32)
TIMES = np.array([[10.0, 20.0, np.nan], [610.0, 20.0, 20.0]])


def plain() -> Dem:
    return Dem(HEIGHTS, GridGeometry(0.0, 0.0, 0.1, 2, 3), "ground", Provenance({}))


def stack_of(dem: Dem) -> MapStack:
    return MapStack(dem.geometry, 0, "plain", memory_layers(dem), Provenance({}))


def test_age_counts_from_the_newest_measurement():
    dem = replace(plain(), time=TIMES, variance=np.where(np.isfinite(HEIGHTS), 0.0004, np.nan).astype(np.float32))
    layers = memory_layers(dem)
    assert np.array_equal(layers["age"], np.array([[600, 590, np.nan], [0, 590, 590]], np.float32), equal_nan=True)
    assert np.allclose(layers["height_sd"], np.where(np.isfinite(HEIGHTS), 0.02, np.nan), equal_nan=True)
    stack = stack_of(dem)
    assert layer_legend(stack, "age")[-2][0] == "600 s and more"
    assert tuple(layer_rgb(stack, "age")[0, 2]) == UNKNOWN_RGB
    assert len(np.unique(layer_rgb(stack, "age")[np.isfinite(HEIGHTS)], axis=0)) == 3


def test_terrain_without_memory_has_unknown_age():
    stack = stack_of(plain())
    for layer in ("age", "height_sd"):
        assert np.isnan(stack.layers[layer]).all()
        assert (layer_rgb(stack, layer) == UNKNOWN_RGB).all()
        assert layer_legend(stack, layer)
