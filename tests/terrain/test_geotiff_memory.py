"""A terrain that remembers, through GeoTIFF and back."""

import numpy as np
import pytest
import rasterio
from rasterio.io import MemoryFile
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.io.terrain_geotiff import BANDS, read_raster, write_geotiff
from footfall.terrain.dem import Dem


@pytest.fixture
def remembered(rng) -> Dem:
    heights = rng.normal(0, 1, (7, 9)).astype(np.float32)
    heights[rng.random(heights.shape) < 0.3] = np.nan
    known = np.isfinite(heights)
    return Dem(
        heights,
        GridGeometry(-0.4, 2.2, 0.02, *heights.shape),
        "map",
        Provenance({}),
        variance=np.where(known, rng.uniform(1e-6, 1e-2, heights.shape), np.nan).astype(np.float32),
        count=np.where(known, rng.integers(1, 9, heights.shape), 0).astype(np.uint16),
        time=np.where(known, 1.9e9 + rng.uniform(0, 1e4, heights.shape), np.nan),
        source=np.where(known, rng.integers(1, 3, heights.shape), 0).astype(np.uint8),
        sources=("nav0", "haz, 1"),
    )


def test_every_layer_comes_back_to_the_bit(remembered):
    again = read_raster(write_geotiff(remembered), "again")
    for name in ("heights", "variance", "count", "time", "source"):
        assert np.array_equal(getattr(again, name), getattr(remembered, name), equal_nan=name[0] not in "cs"), name
        assert getattr(again, name).dtype == getattr(remembered, name).dtype
    assert again.sources == remembered.sources
    assert again.geometry.x0 == pytest.approx(remembered.geometry.x0)


def test_layers_are_of_their_cells_where_rows_begin_in_the_south(remembered):
    """Heights were turned with the rows, what is remembered of them was not."""
    with MemoryFile(write_geotiff(remembered)) as memory, memory.open() as source:
        bands, tags, profile = source.read(), source.tags(), source.profile
        south = source.bounds.bottom
    at = profile["transform"]
    profile["transform"] = Affine(at.a, 0, at.c, 0, at.a, south)
    with MemoryFile() as memory:
        with memory.open(**profile) as target:
            target.write(bands[:, ::-1])
            target.update_tags(SOURCES=tags["SOURCES"])
            target.descriptions = BANDS
        again = read_raster(bytes(memory.read()), "again")
    for name in ("heights", "variance", "count", "time", "source"):
        np.testing.assert_array_equal(getattr(again, name), getattr(remembered, name), name)
    assert again.geometry.y0 == pytest.approx(remembered.geometry.y0)


def test_bands_are_named_and_mean_what_they_say(remembered):
    with MemoryFile(write_geotiff(remembered)) as memory, memory.open() as source:
        assert source.descriptions == BANDS
        age, certainty = source.read(4)[::-1], source.read(5)[::-1]
    assert np.nanmin(age) == 0
    assert np.allclose(age, np.nanmax(remembered.time) - remembered.time, equal_nan=True)
    # within one standard deviation: 68.27 %
    one = Dem(
        np.zeros((1, 1), np.float32),
        GridGeometry(0.0, 0.0, 0.1, 1, 1),
        "one",
        Provenance({}),
        variance=np.full((1, 1), 0.05**2, np.float32),
        count=np.ones((1, 1), np.uint16),
        time=np.zeros((1, 1)),
        source=np.zeros((1, 1), np.uint8),
    )
    with MemoryFile(write_geotiff(one)) as memory, memory.open() as source:
        assert source.read(5)[0, 0] == pytest.approx(0.682689, abs=1e-5)
    assert np.nanmin(certainty) > 0
    assert np.nanmax(certainty) <= 1


def test_a_terrain_without_memory_stays_one_band(remembered):
    plain = Dem(remembered.heights, remembered.geometry, "plain", Provenance({}))
    with MemoryFile(write_geotiff(plain)) as memory, memory.open() as source:
        assert source.count == 1
        assert source.dtypes == ("float32",)
    assert read_raster(write_geotiff(plain), "plain").variance is None


@pytest.mark.parametrize(("band", "number"), [(2, -1.0), (3, np.inf), (6, 0.5), (6, 1e9), (7, 3.0)])
def test_damaged_layers_are_refused(remembered, tmp_path, band, number):
    path = tmp_path / "map.tif"
    path.write_bytes(write_geotiff(remembered))
    with rasterio.open(path, "r+") as target:
        layer = target.read(band)
        layer[np.isfinite(layer)] = number
        target.write(layer, band)
    with pytest.raises(InvalidTerrain):
        read_raster(path.read_bytes(), "damaged")
