"""Formats that are not read are refused with what would be right, and what GDAL makes of them is read right."""

import numpy as np
import pytest
import rasterio
from rasterio.shutil import copy
from rasterio.transform import Affine
from scipy.io import netcdf_file

from footfall.core.errors import InvalidTerrain
from footfall.io.other_formats import refuse_other_format
from footfall.io.scan_files import read_scan
from footfall.io.terrain_files import READABLE, WRITABLE, decode_terrain, read_terrain

COUNTS = (10 * np.arange(6)[:, None] + np.arange(8)[None]).astype(np.int16)
HEIGHTS = 0.5 * COUNTS + 100.0
NO_VALUE = -32768
LABEL = """PDS_VERSION_ID = PDS3
RECORD_TYPE = FIXED_LENGTH
RECORD_BYTES = 16
FILE_RECORDS = 6
^IMAGE = "a.img"
OBJECT = IMAGE
 LINES = 6
 LINE_SAMPLES = 8
 SAMPLE_TYPE = MSB_INTEGER
 SAMPLE_BITS = 16
 UNIT = METER
 SCALING_FACTOR = 0.5
 OFFSET = {offset}
 MISSING_CONSTANT = -32768
END_OBJECT = IMAGE
OBJECT = IMAGE_MAP_PROJECTION
 MAP_PROJECTION_TYPE = "POLAR STEREOGRAPHIC"
 A_AXIS_RADIUS = 1737.4 <KM>
 B_AXIS_RADIUS = 1737.4 <KM>
 C_AXIS_RADIUS = 1737.4 <KM>
 CENTER_LATITUDE = -90 <DEG>
 CENTER_LONGITUDE = 0 <DEG>
 MAP_SCALE = 0.002 <KM/PIXEL>
 MAP_PROJECTION_ROTATION = 0.0 <DEG>
 LINE_PROJECTION_OFFSET = 3.5
 SAMPLE_PROJECTION_OFFSET = 4.5
END_OBJECT = IMAGE_MAP_PROJECTION
END
"""


def stored():
    """Counts as files have them, the first cell without one."""
    counts = COUNTS.copy()
    counts[0, 0] = NO_VALUE
    return counts


def pds3(folder, offset=100.0):
    (folder / "a.lbl").write_text(LABEL.format(offset=offset), newline="\r\n")
    (folder / "a.img").write_bytes(stored().astype(">i2").tobytes())
    return folder / "a.lbl"


def netcdf(folder):
    """Rows from the south, as NetCDF mostly has them, and in kilometres, of which GDAL makes metres."""
    with netcdf_file(folder / "a.nc", "w") as made:
        made.Conventions = b"CF-1.7"
        for name, count in (("y", 6), ("x", 8)):
            made.createDimension(name, count)
            axis = made.createVariable(name, "d", (name,))
            axis[:], axis.units = 500.0 + 0.002 * np.arange(count), "km"
            axis.standard_name = f"projection_{name}_coordinate"
        system = made.createVariable("crs", "i", ())
        system.grid_mapping_name = "transverse_mercator"
        system.scale_factor_at_central_meridian, system.longitude_of_central_meridian = 0.9996, 15.0
        system.latitude_of_projection_origin = system.false_northing = 0.0
        system.false_easting = 500_000.0
        heights = made.createVariable("z", "h", ("y", "x"))
        heights[:] = stored()[::-1]
        heights.scale_factor, heights.add_offset, heights._FillValue = 0.5, 100.0, np.int16(NO_VALUE)
        heights.units, heights.grid_mapping = "m", "crs"
    return folder / "a.nc"


def of_driver(path, driver):
    profile = {"driver": driver, "width": 8, "height": 6, "count": 1, "dtype": "int16", "nodata": NO_VALUE}
    at = Affine(2, 0, 500_000.0, 0, -2, 5_180_000.0)
    with rasterio.open(path, "w", **profile, crs="EPSG:32633", transform=at) as target:
        target.write(stored(), 1)
        target.scales, target.offsets = (0.5,), (100.0,)
    return path


@pytest.mark.parametrize(
    "made",
    [
        pds3,
        netcdf,
        lambda folder: of_driver(folder / "a.dat", "ENVI"),
        lambda folder: of_driver(folder / "a.xml", "PDS4"),
    ],
    ids=["PDS3", "NetCDF", "ENVI", "PDS4"],
)
def test_what_gdal_makes_of_other_rasters_is_read_right(made, tmp_path):
    path = made(tmp_path)
    with pytest.raises(InvalidTerrain, match=rf"not read as terrain; .*gdal_translate {path.name} ground\.tif"):
        read_terrain(path)
    copy(path, tmp_path / "ground.tif", driver="GTiff")
    dem = read_terrain(tmp_path / "ground.tif")
    assert dem.geometry.resolution == pytest.approx(2.0)
    found = dem.heights[::-1]
    assert np.isnan(found[0, 0])
    np.testing.assert_allclose(found.ravel()[1:], HEIGHTS.ravel()[1:])


def test_radii_are_told_to_be_some(tmp_path):
    copy(pds3(tmp_path, offset=1_737_400.0), tmp_path / "a.tif", driver="GTiff")
    with pytest.raises(InvalidTerrain, match=r"1.73740e\+06 to 1.73743e\+06.*radii.*gdal_edit\.py -offset"):
        read_terrain(tmp_path / "a.tif")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.GLB", "is glTF, which has y up, .* PLY or OBJ with z up, in metres, all its parts where their transforms"),
        ("a.dae", "is Collada, which has a unit and a direction up of its own"),
        ("a.img", "UNIT of a PDS3 label, which has to be METER"),
        ("a.nc", r"NETCDF:a\.nc:z"),
        ("a.gpx", "places and lines, which hold no ground"),
        ("a.tif.gz", "is packed, .* unpack it first"),
        ("a {0}.zip", r"a \{0\}\.zip is packed"),
        ("a.jpg", "a picture, which holds no heights"),
        ("a.what", "its name must end in one of .tif"),
    ],
)
def test_each_is_refused_by_its_name(name, words):
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(b"content", name)


@pytest.mark.parametrize(
    ("content", "words"), [(b"glTF\2\0\0\0", "glTF"), (b"\x89HDF\r\n", "HDF5 or NetCDF"), (b"CDF\1\0", "NetCDF")]
)
def test_their_content_is_known_under_other_names(content, words):
    for name in ("a.obj", "a.asc"):
        with pytest.raises(InvalidTerrain, match=f"its content is {words}"):
            decode_terrain(content, name)


def test_a_scan_is_refused_by_name_too():
    with pytest.raises(InvalidTerrain, match=r"pdal translate a\.e57"):
        read_scan(b"content", "a.e57")


@pytest.mark.parametrize("ending", sorted({*READABLE, *WRITABLE}))
def test_what_is_read_or_written_is_no_other_format(ending):
    refuse_other_format(f"a{ending}")
