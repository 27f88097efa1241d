"""What a raster says that its band holds: heights in metres are read, anything else is refused by its name."""

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.terrain.generate import plane

HEIGHTS = [
    {"called": "DEM"},
    {"called": "DSM_1m"},
    {"called": "elev"},
    {"called": "Band 1"},
    {"called": "Orange County 2020"},
    {"called": "Passthrough survey"},
    {"called": "Elevation (accuracy 0.1 m)"},
    {"unit": "m"},
    {"unit": "meters above sea level"},
    {"tags": {"units": "m", "long_name": "surface altitude"}},
    {"tags": {"GRIB_UNIT": "[m]", "GRIB_COMMENT": "Geopotential height [gpm]"}},
    {"whole": {"TIFFTAG_IMAGEDESCRIPTION": "survey of May"}},
    {"whole": {"TIFFTAG_IMAGEDESCRIPTION": "North Slope, Alaska"}},
    {"called": "height", "whole": {"TIFFTAG_IMAGEDESCRIPTION": "NDVI and height"}},
]
OTHERS = [
    ({"called": "NDVI"}, "'NDVI'"),
    ({"called": "ndvi_2020"}, "'ndvi_2020'"),
    ({"called": "Surface Temperature"}, "'Surface Temperature'"),
    ({"called": "standard error of height"}, "'standard error of height'"),
    ({"called": "std_dev elevation"}, "'std_dev elevation'"),
    ({"called": "elevation (standard error)"}, "standard error"),
    ({"called": "height difference"}, "'height difference'"),
    ({"called": "TerrainSlope"}, "'TerrainSlope'"),
    ({"called": "slope_deg"}, "'slope_deg'"),
    ({"called": "reflectance"}, "'reflectance'"),
    ({"unit": "degC"}, "in 'degC'"),
    ({"unit": "%"}, "in '%'"),
    ({"tags": {"units": "degC"}}, "in 'degC'"),
    ({"tags": {"GRIB_UNIT": "[C]"}}, "in 'C'"),
    ({"tags": {"units": "1"}}, "in '1'"),
    ({"tags": {"long_name": "surface temperature"}}, "'surface temperature'"),
    ({"tags": {"standard_name": "air_temperature"}}, "'air_temperature'"),
    ({"whole": {"TIFFTAG_IMAGEDESCRIPTION": "NDVI of the site"}}, "'NDVI of the site'"),
]


def raster(path, called="", unit="", tags=(), whole=()):
    profile = {"driver": "GTiff", "width": 3, "height": 3, "count": 1, "dtype": "float32", "crs": "EPSG:32633"}
    with rasterio.open(path, "w", **profile, transform=Affine(1, 0, 500_000, 0, -1, 5_180_000)) as made:
        made.write(np.full((1, 3, 3), 0.5, np.float32))
        made.set_band_description(1, called)
        made.units = (unit,)
        made.update_tags(1, **dict(tags))
        made.update_tags(**dict(whole))
    return path


@pytest.mark.parametrize("said", HEIGHTS)
def test_heights_are_read(said, tmp_path):
    assert read_terrain(raster(tmp_path / "a.tif", **said)).heights.max() == 0.5


@pytest.mark.parametrize(("said", "words"), OTHERS)
def test_what_is_said_to_be_no_heights_is_refused_by_its_name(said, words, tmp_path):
    with pytest.raises(InvalidTerrain, match=words):
        read_terrain(raster(tmp_path / "a.tif", **said))


def test_an_ascii_grid_heeds_what_a_file_beside_calls_it(tmp_path):
    path = tmp_path / "a.asc"
    write_terrain(plane(size=2.0, resolution=0.5), path)
    beside = '<PAMDataset><PAMRasterBand band="1"><Description>{}</Description></PAMRasterBand></PAMDataset>'
    for called in ("NDVI", "Elevation"):
        (tmp_path / "a.asc.aux.xml").write_text(beside.format(called))
        if called == "Elevation":
            assert read_terrain(path).heights.max() == 0.0
            continue
        with pytest.raises(InvalidTerrain, match="'NDVI'"):
            read_terrain(path)
