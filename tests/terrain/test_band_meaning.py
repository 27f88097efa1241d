"""What a raster says that its band holds: heights in metres are read, anything else is refused by its name."""

import numpy as np
import pytest
import rasterio
from rasterio.shutil import copy
from rasterio.transform import Affine
from scipy.io import netcdf_file

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
    {"called": "Elevation (slope-corrected)"},
    {"called": "DEM from intensity images"},
    {"called": "height above ellipsoid, vegetation removed"},
    {"called": "orthometric height over the geoid EGM96"},
    {"unit": "m"},
    {"unit": "meters above sea level"},
    {"tags": {"units": "m", "long_name": "surface altitude"}},
    {"tags": {"GRIB_UNIT": "[m]", "GRIB_COMMENT": "Geopotential height [gpm]"}},
    {"whole": {"TIFFTAG_IMAGEDESCRIPTION": "survey of May"}},
    {"whole": {"TIFFTAG_IMAGEDESCRIPTION": "North Slope, Alaska"}},
    {"called": "height", "whole": {"TIFFTAG_IMAGEDESCRIPTION": "NDVI and height"}},
    {"tags": {"positive": "up"}},
    {"whole": {"x#units": "km"}},  # GDAL made metres of them, of which the coordinate system tells
    {"whole": {"x#units": "metres", "y#units": "1", "time#units": "days since 1970-01-01"}, "crs": None},
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
    ({"called": "DEM_slope"}, "'DEM_slope'"),
    ({"called": "dtm aspect"}, "'dtm aspect'"),
    ({"called": "elevation mask"}, "'elevation mask'"),
    ({"called": "count of heights"}, "'count of heights'"),
    ({"called": "Surface temperature at the elevation of the site"}, "'Surface temperature"),
    ({"called": "Canopy Height Model"}, "'Canopy Height Model'"),
    ({"called": "geoid height"}, "'geoid height'"),
    ({"called": "height above ground"}, "'height above ground'"),
    ({"unit": "degC"}, "in 'degC'"),
    ({"unit": "%"}, "in '%'"),
    ({"tags": {"units": "degC"}}, "in 'degC'"),
    ({"tags": {"GRIB_UNIT": "[C]"}}, "in 'C'"),
    ({"tags": {"units": "1"}}, "in '1'"),
    ({"tags": {"long_name": "surface temperature"}}, "'surface temperature'"),
    ({"tags": {"standard_name": "air_temperature"}}, "'air_temperature'"),
    ({"whole": {"TIFFTAG_IMAGEDESCRIPTION": "NDVI of the site"}}, "'NDVI of the site'"),
    ({"tags": {"positive": "Down"}}, "are depths: .*turn their sign"),
    (
        {"whole": {"x#units": "km"}, "crs": None},
        "coordinates of a.tif are in 'km', as it says of x,.*bring them to metres",
    ),
    ({"whole": {"lat#units": "degrees_north"}, "crs": None}, "in 'degrees_north', as it says of lat"),
    ({"whole": {"X1#units": "ft", "X1#axis": "X"}, "crs": None}, "in 'ft', as it says of X1"),
    (
        {"whole": {"i#units": "cm", "i#standard_name": "projection_x_coordinate"}, "crs": None},
        "in 'cm', as it says of i",
    ),
]


def raster(path, called="", unit="", tags=(), whole=(), crs: str | None = "EPSG:32633"):
    profile = {"driver": "GTiff", "width": 3, "height": 3, "count": 1, "dtype": "float32", "crs": crs}
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


def test_what_a_netcdf_file_says_of_its_coordinates_is_heeded_behind_gdal(tmp_path):
    for unit in ("m", "km"):
        with netcdf_file(tmp_path / "a.nc", "w") as made:
            made.Conventions = b"CF-1.7"
            for name in "yx":
                made.createDimension(name, 4)
                axis = made.createVariable(name, "d", (name,))
                axis[:], axis.units, axis.standard_name = np.arange(4.0), unit, f"projection_{name}_coordinate"
            heights = made.createVariable("z", "f", ("y", "x"))
            heights[:], heights.units = np.outer(np.arange(4), np.ones(4)), "m"
        copy(tmp_path / "a.nc", tmp_path / "a.tif", driver="GTiff")
        if unit == "m":
            assert read_terrain(tmp_path / "a.tif").heights[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0]
            continue
        with pytest.raises(InvalidTerrain, match="in 'km'"):
            read_terrain(tmp_path / "a.tif")


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
