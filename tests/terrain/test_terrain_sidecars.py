"""What lies beside a terrain file, units of every kind of coordinates, places that are no grid: heeded or refused."""

import shutil
import warnings

import numpy as np
import pytest
import rasterio
from numpy.typing import NDArray
from rasterio.control import GroundControlPoint
from rasterio.crs import CRS
from rasterio.errors import NotGeoreferencedWarning
from rasterio.shutil import copy
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.io.terrain_projection import convergence, units
from footfall.terrain.from_arrays import from_heights

ROWS = COLS = 12
HEIGHTS = 2.0 + 0.01 * np.arange(ROWS * COLS, dtype=np.float32).reshape(ROWS, COLS)
AT = Affine(0.5, 0, 500_000.0, 0, -0.5, 5_180_000.0)
UTM = CRS.from_epsg(32633)
MOON = CRS.from_proj4("+proj=stere +lat_0=-90 +lon_0=0 +k=1 +x_0=0 +y_0=0 +R=1737400 +units=m +no_defs")


def geotiff(path, heights: NDArray = HEIGHTS, crs=UTM, transform=AT, **options):
    profile = {"driver": "GTiff", "width": heights.shape[1], "height": heights.shape[0], "count": 1}
    with rasterio.open(path, "w", **profile, dtype=heights.dtype, crs=crs, transform=transform, **options) as target:
        target.write(heights, 1)
    return path


def aux(path, inside):
    path.with_name(f"{path.name}.aux.xml").write_text(
        f'<PAMDataset><PAMRasterBand band="1">{inside}</PAMRasterBand></PAMDataset>'
    )


def asc(path, heights=HEIGHTS):
    head = f"ncols {COLS}\nnrows {ROWS}\nxllcorner 500000\nyllcorner 5180000\ncellsize 0.5\n"
    path.write_text(head + "\n".join(" ".join(f"{z:.2f}" for z in row) for row in heights) + "\n")
    return path


def test_a_mask_beside_hides_cells(tmp_path):
    path = geotiff(tmp_path / "m.tif")
    hidden = HEIGHTS < 2.5
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=False), rasterio.open(path, "r+") as target:
        target.write_mask(~hidden)
    assert (tmp_path / "m.tif.msk").is_file()
    found = read_terrain(path).heights[::-1]
    np.testing.assert_array_equal(np.isnan(found), hidden)
    np.testing.assert_array_equal(found[~hidden], HEIGHTS[~hidden])


def test_the_mask_that_gdal_makes_of_an_isis_cube_is_heeded(tmp_path):
    """It is of one band, not of all, and its flags are 0."""
    hidden = HEIGHTS < 2.5
    special = np.float32(-3.4028234663852886e38)  # of a saturated pixel, and not the no-data value
    cube = np.where(hidden, special, HEIGHTS)
    with rasterio.open(
        tmp_path / "c.lbl",
        "w",
        driver="ISIS3",
        width=COLS,
        height=ROWS,
        count=1,
        dtype="float32",
        crs=UTM,
        transform=AT,
    ) as target:
        target.write(cube, 1)
    copy(tmp_path / "c.lbl", tmp_path / "c.tif", driver="GTiff")
    assert (tmp_path / "c.tif.msk").is_file()
    with rasterio.open(tmp_path / "c.tif") as made:
        assert made.mask_flag_enums == ([],)
    np.testing.assert_array_equal(np.isnan(read_terrain(tmp_path / "c.tif").heights[::-1]), hidden)


@pytest.mark.parametrize("nodata", [None, -1.0])
def test_a_mask_beside_that_gdal_passes_over_is_refused_whatever_else_hides_cells(tmp_path, nodata):
    path = geotiff(tmp_path / "m.tif", nodata=nodata)
    geotiff(tmp_path / "m.tif.msk", (HEIGHTS < 2.5).astype(np.uint8))
    with pytest.raises(InvalidTerrain, match=r"m\.tif\.msk is no mask .*lacks its flags"):
        read_terrain(path)


@pytest.mark.parametrize("made", [geotiff, asc])
def test_a_no_data_value_and_a_scale_beside_are_heeded(tmp_path, made):
    path = made(tmp_path / f"a{'.tif' if made is geotiff else '.asc'}", np.round(HEIGHTS, 2))
    aux(path, "<NoDataValue>2.5</NoDataValue>")
    if made is asc:
        with pytest.raises(InvalidTerrain, match="NODATA_value"):
            read_terrain(path)
    else:
        found = read_terrain(path).heights[::-1]
        assert np.isnan(found).sum() == 1
        assert np.isnan(found[np.isclose(HEIGHTS, 2.5)]).all()
    aux(path, "<Offset>-2</Offset><Scale>10</Scale>")
    np.testing.assert_allclose(read_terrain(path).heights[::-1], 10 * np.round(HEIGHTS, 2) - 2, rtol=1e-6)


@pytest.mark.parametrize("version", ["1.0", "1.1"])
@pytest.mark.parametrize(("heights", "words"), [(5715, "depths"), (6360, "US survey foot"), (8051, "depths")])
def test_heights_that_a_geotiff_of_any_version_names_are_heeded(tmp_path, version, heights, words):
    """GDAL says nothing of them where the file is of version 1.0, so that depths were heights."""
    path = geotiff(tmp_path / "a.tif", crs=CRS.from_user_input(f"EPSG:32633+{heights}"), GEOTIFF_VERSION=version)
    with pytest.raises(InvalidTerrain, match=words):
        read_terrain(path)
    metres = geotiff(tmp_path / "b.tif", crs=CRS.from_user_input("EPSG:32633+5703"), GEOTIFF_VERSION=version)
    found = read_terrain(metres).true_north
    assert found == pytest.approx(read_terrain(geotiff(tmp_path / "c.tif")).true_north)


def test_statistics_beside_change_nothing(tmp_path):
    path = asc(tmp_path / "s.asc")
    alone = read_terrain(path)
    aux(path, '<Metadata><MDI key="STATISTICS_MAXIMUM">3.43</MDI></Metadata>')
    assert read_terrain(path).digest == alone.digest


@pytest.mark.parametrize("name", ["p.prj", "P.PRJ", "p.Prj"])
def test_a_projection_beside_is_heeded_whatever_the_case_of_its_name(tmp_path, name):
    path = asc(tmp_path / "p.asc")
    (tmp_path / name).write_text(CRS.from_epsg(2263).to_wkt())
    with pytest.raises(InvalidTerrain, match="US survey foot"):
        read_terrain(path)
    (tmp_path / name).write_text(CRS.from_epsg(3857).to_wkt())
    with pytest.raises(InvalidTerrain, match="not true to scale"):
        read_terrain(path)
    (tmp_path / name).write_text(UTM.to_wkt())
    assert read_terrain(path).true_north is not None


def cloud(dem, path):
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    np.savetxt(path, np.column_stack([x.ravel(), y.ravel(), dem.heights.ravel()]), fmt="%.3f")


@pytest.mark.parametrize("own", [None, 'LOCAL_CS["site",UNIT["metre",1],AXIS["East",EAST],AXIS["North",NORTH]]'])
def test_a_projection_beside_a_raster_in_local_coordinates_is_heeded(tmp_path, own):
    """Of the scale, and of true north; a local system of its own made it be passed over."""
    crs = None if own is None else CRS.from_wkt(own)
    path = geotiff(tmp_path / "a.tif", crs=crs, transform=AT)
    (tmp_path / "a.prj").write_text(UTM.to_wkt())
    assert read_terrain(path).true_north == read_terrain(geotiff(tmp_path / "b.tif")).true_north
    (tmp_path / "a.prj").write_text(CRS.from_epsg(3857).to_wkt())
    with pytest.raises(InvalidTerrain, match="not true to scale"):
        read_terrain(path)


@pytest.mark.parametrize("ending", ["obj", "off", "npz", "xyz"])
def test_a_projection_beside_is_heeded_beside_every_kind_of_file(tmp_path, ending):
    """As beside a grid: units, whether it is true to scale, and where true north is."""
    dem = from_heights(HEIGHTS, 0.5, 700_000.0, 5_180_000.0)
    path, told = tmp_path / f"p.{ending}", tmp_path / "p.prj"
    arguments = {"unit": "m", "up": "z", "resolution": 0.5} if ending == "xyz" else {}
    if ending == "xyz":
        cloud(dem, path)
    else:
        write_terrain(dem, path)
    for code, why in ((2263, "US survey foot"), (4326, "degrees"), (3857, "not true to scale")):
        told.write_text(CRS.from_epsg(code).to_wkt())
        with pytest.raises(InvalidTerrain, match=why):
            read_terrain(path, **arguments)
    told.write_text(UTM.to_wkt())
    found = read_terrain(path, **arguments)
    assert found.true_north == pytest.approx(convergence(UTM, found.geometry.bounds))
    assert found.true_north is not None
    assert found.true_north[0] < -1.0  # east of the middle meridian true north is to the left
    told.unlink()
    assert read_terrain(path, **arguments).true_north is None


@pytest.mark.parametrize("name", ["h.pgw", "h.wld", "h.png.aux.xml"])
def test_what_is_not_read_beside_a_picture_is_refused_by_name(tmp_path, name):
    from footfall.io.image_files import encode_png

    path = tmp_path / "h.png"
    path.write_bytes(encode_png(np.arange(64, dtype=np.uint8).reshape(8, 8)))
    (tmp_path / name).write_text(
        "<PAMDataset><SRS>EPSG:4326</SRS></PAMDataset>" if "aux" in name else "1\n0\n0\n-1\n0\n0\n"
    )
    with pytest.raises(InvalidTerrain, match=name):
        read_terrain(path, size=(4.0, 4.0), height_range=(0.0, 1.0))
    shutil.move(tmp_path / name, tmp_path / "away")
    assert read_terrain(path, size=(4.0, 4.0), height_range=(0.0, 1.0)).geometry.rows > 0


@pytest.mark.parametrize(
    ("system", "factor", "height"),
    [
        ('LOCAL_CS["site",UNIT["foot",0.3048]]', 0.3048, False),
        ('LOCAL_CS["site",UNIT["km",1000]]', 1000.0, False),
        ("EPSG:2263", 0.304800609601219, False),
        ("EPSG:32633+6360", 0.304800609601219, True),
        ("EPSG:32633+8228", 0.3048, True),
    ],
)
@pytest.mark.parametrize("made", [geotiff, asc])
def test_units_of_every_kind_of_system_are_checked_in_every_kind_of_file(tmp_path, made, system, factor, height):
    crs = CRS.from_string(system)
    assert [(one.factor, one.height) for one in units(crs) if one.factor != 1.0] == [(pytest.approx(factor), height)]
    if made is geotiff:
        path = geotiff(tmp_path / "u.tif", crs=crs)
    else:
        path = asc(tmp_path / "u.asc")
        (tmp_path / "u.prj").write_text(crs.to_wkt())
    with pytest.raises(InvalidTerrain, match="heights of" if height else "coordinates of"):
        read_terrain(path)


@pytest.mark.parametrize("system", ["EPSG:4326", "EPSG:4979", "EPSG:4326+5773", "EPSG:4978"])
def test_degrees_and_the_earths_centre_are_refused(tmp_path, system):
    with pytest.raises(InvalidTerrain, match=r"degrees|geocentric"):
        read_terrain(geotiff(tmp_path / "d.tif", crs=CRS.from_string(system)))


def test_metres_of_every_kind_of_system_are_taken(tmp_path):
    for i, crs in enumerate(
        (UTM, CRS.from_string("EPSG:32633+5703"), CRS.from_string('LOCAL_CS["s",UNIT["metre",1]]'))
    ):
        assert read_terrain(geotiff(tmp_path / f"{i}.tif", crs=crs)).geometry.rows == ROWS


def test_what_a_file_declares_counts_before_any_guess_of_no_value(tmp_path):
    stored = np.full((4, 4), 32767, np.uint16)
    stored[0] = 0
    path = geotiff(tmp_path / "s.tif", stored, nodata=0)
    with rasterio.open(path, "r+") as target:
        target.scales, target.offsets = (0.01,), (-300.0,)
    found = read_terrain(path).heights[::-1]
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1:], 27.67, atol=1e-5)


@pytest.mark.parametrize(
    ("stored", "taken"),
    [
        ([30_000, 32_767, 33_000, 35_000], True),  # a height in their midst
        ([32_766, 32_767, 32_766, 32_766], True),
        ([100, 200, 300, -9999], False),
        ([-100, -200, -300, -32_768], False),
        ([100, -9999, 300, -32_768], False),
        ([-9999, -9999, -9999, -9999], False),
        ([-9900, -9999, -10_000, -11_000], True),
    ],
)
def test_scaled_numbers_are_judged_by_what_is_near_them(tmp_path, stored, taken):
    """Undeclared: a number that stands for no value elsewhere is a height here, unless it lies far from all others."""
    held = np.array(stored, np.int32).reshape(2, 2)
    path = geotiff(tmp_path / "s.tif", held)
    with rasterio.open(path, "r+") as target:
        target.scales, target.offsets = (0.0001,), (20.0,)
    if taken:
        np.testing.assert_allclose(read_terrain(path).heights[::-1], 20.0 + 0.0001 * held, rtol=1e-6)
        return
    with pytest.raises(InvalidTerrain, match="before scaling"):
        read_terrain(path)
    with rasterio.open(path, "r+") as target:  # declaring another number says that these are heights
        target.nodata = 12_345
    np.testing.assert_allclose(read_terrain(path).heights[::-1], 20.0 + 0.0001 * held, rtol=1e-6)


def test_a_height_that_scaling_makes_a_number_for_no_value_is_refused(tmp_path):
    held = np.array([[-19_998, 4], [6, 8]], np.int32)
    path = geotiff(tmp_path / "s.tif", held, nodata=0)
    with rasterio.open(path, "r+") as target:
        target.scales = (0.5,)
    with pytest.raises(InvalidTerrain, match=r"1 heights of s\.tif are -9999"):
        read_terrain(path)


def test_control_points_are_no_grid(tmp_path):
    path = tmp_path / "g.tif"
    points = [GroundControlPoint(r, c, 0.9 * c - 0.4 * r, 0.4 * c + 0.9 * r) for r in (0, ROWS) for c in (0, COLS)]
    profile = {"driver": "GTiff", "width": COLS, "height": ROWS, "count": 1, "dtype": "float32"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(path, "w", **profile) as target:
            target.write(HEIGHTS, 1)
            target.gcps = points, UTM
    with pytest.raises(InvalidTerrain, match="4 control points"):
        read_terrain(path, resolution=0.5)


def test_true_north_is_told(tmp_path):
    # Snyder 1987, polar stereographic from the south pole: meridians are straight lines from the middle
    x, y = 10_000.0, 300.0
    at = Affine(0.5, 0, x - 3.0, 0, -0.5, y + 3.0)
    found = read_terrain(geotiff(tmp_path / "m.tif", crs=MOON, transform=at)).true_north
    assert found is not None
    assert found[0] == pytest.approx(np.degrees(np.arctan2(x, y)), abs=0.02)
    assert found[1] < found[0] < found[2]
    # on other cells too
    assert read_terrain(tmp_path / "m.tif", resolution=0.25).true_north == found
    # in UTM: about Δλ sin φ
    east = convergence(UTM, (699_000.0, 5_180_000.0, 701_000.0, 5_182_000.0))
    assert east is not None
    assert east[0] == pytest.approx(-2.61 * np.sin(np.radians(46.7)), abs=0.06)


def test_a_map_that_is_true_in_its_middle_only_is_refused(tmp_path):
    merc = CRS.from_proj4("+proj=merc +lat_ts=0 +datum=WGS84 +units=m +no_defs")
    wide = Affine(100_000.0, 0, -600_000.0, 0, -100_000.0, 600_000.0 + 600_000.0)
    with pytest.raises(InvalidTerrain, match="at its edge"):
        read_terrain(geotiff(tmp_path / "w.tif", crs=merc, transform=wide))
