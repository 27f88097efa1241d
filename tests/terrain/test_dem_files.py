"""Terrain files: round trips, conventions, and refusals."""

import io
import struct
import tracemalloc
import warnings
import zipfile
import zlib
from typing import Any

import numpy as np
import pytest
import rasterio
import trimesh
from PIL import Image
from rasterio.crs import CRS
from rasterio.errors import NotGeoreferencedWarning
from rasterio.transform import Affine
from trimesh.exchange.ply import export_ply

from footfall.core.errors import InvalidTerrain, NotFound
from footfall.io.terrain_files import WRITABLE, decode_terrain, encode_terrain, read_terrain, write_terrain
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at


@pytest.fixture
def holed():
    heights = fractal((4.0, 3.0), 0.1, seed=7).heights.copy()
    heights[4:7, 9:12] = np.nan
    return from_heights(heights, 0.1, -2.0, -1.5, "holed")


def geotiff(path, heights, transform=None, **options):
    profile = {
        "driver": "GTiff",
        "count": 1,
        "dtype": heights.dtype,
        "width": heights.shape[1],
        "height": heights.shape[0],
    }
    profile["transform"] = Affine(0.5, 0, 100.0, 0, -0.5, 200.0) if transform is None else transform
    with rasterio.open(path, "w", **{**profile, **options}) as target:
        target.write(heights, 1)
    return path


@pytest.mark.parametrize("ending", WRITABLE)
def test_round_trip(ending, holed, tmp_path):
    path = tmp_path / f"ground{ending}"
    write_terrain(holed, path)
    back = read_terrain(path)
    assert back.geometry.shape == holed.geometry.shape
    np.testing.assert_allclose(back.geometry.bounds, holed.geometry.bounds, atol=1e-6)
    if ending in (".tif", ".tiff", ".asc", ".npz"):
        np.testing.assert_array_equal(back.heights, holed.heights)
    else:
        np.testing.assert_allclose(back.heights, holed.heights, atol=1e-5)
    assert back.name == path.name
    assert encode_terrain(holed, ending) == encode_terrain(holed, ending)


def test_npz_and_asc_keep_the_place_exactly_and_npz_the_texture(holed):
    texture = np.arange(holed.heights.size, dtype=np.uint8).reshape(holed.heights.shape)
    dem = from_heights(holed.heights, 0.1, 1 / 3, -2 / 7, "t.npz", texture=texture)
    assert decode_terrain(encode_terrain(dem, ".npz"), "t.npz").digest == dem.digest
    assert decode_terrain(encode_terrain(dem, ".asc"), "a.asc").geometry.digest == dem.geometry.digest


def test_geotiff_is_north_up_with_centres_half_a_cell_in(tmp_path):
    heights = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, -9999.0]], np.float32)
    dem = read_terrain(geotiff(tmp_path / "a.tif", heights, nodata=-9999.0, crs="EPSG:32633"))
    np.testing.assert_array_equal(dem.heights, [[5.0, np.nan], [3.0, 4.0], [1.0, 2.0]])
    assert dem.geometry.bounds == pytest.approx((100.25, 198.75, 100.75, 199.75))
    south_up = read_terrain(geotiff(tmp_path / "b.tif", heights[:2], Affine(0.5, 0, 0, 0, 0.5, 10)))
    np.testing.assert_array_equal(south_up.heights, heights[:2])
    assert south_up.geometry.y0 == pytest.approx(10.25)


def test_geotiff_scale_and_offset_of_the_band_apply(tmp_path):
    path = geotiff(tmp_path / "a.tif", np.array([[0, 2], [4, 6]], np.int16))
    with rasterio.open(path, "r+") as target:
        target.scales, target.offsets = (0.5,), (10.0,)
    np.testing.assert_array_equal(read_terrain(path).heights, [[12, 13], [10, 11]])


def test_geotiff_without_a_place_needs_a_resolution(tmp_path):
    path = tmp_path / "a.tif"
    Image.fromarray(np.arange(12, dtype=np.float32).reshape(3, 4)).save(path)
    with pytest.raises(InvalidTerrain, match="resolution="):
        read_terrain(path)
    dem = read_terrain(path, resolution=2.0)
    assert dem.geometry.bounds == (0.0, 0.0, 6.0, 4.0)
    np.testing.assert_array_equal(dem.heights[0], [8, 9, 10, 11])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"crs": "EPSG:4326"}, "degrees"),
        ({"crs": "EPSG:2227"}, "foot"),
        ({"crs": "EPSG:32616+6360"}, "heights of a.tif are in US survey foot"),
        ({"crs": "EPSG:3857", "transform": Affine(0.5, 0, -9.39e6, 0, -0.5, 4.39e6)}, "true to scale"),
        ({"crs": "+proj=eqc +R=1737400 +units=m", "transform": Affine(0.5, 0, 0, 0, -0.5, 1.4e6)}, "true to scale"),
        ({"transform": Affine(0.47, 0.17, 0, 0.17, -0.47, 0)}, "rotated"),
        ({"transform": Affine(0.5, 0, 0, 0, -0.7, 0)}, "oblong"),
        ({"transform": Affine(-0.5, 0, 0, 0, -0.5, 0)}, "mirrored"),
        ({"nodata": 1.0}, "no cell"),
    ],
)
def test_geotiffs_that_are_refused(options, words, tmp_path):
    with pytest.raises(InvalidTerrain, match=words):
        read_terrain(geotiff(tmp_path / "a.tif", np.ones((4, 5), np.float32), **options))


def test_an_undeclared_no_data_number_is_refused(tmp_path):
    heights = np.ones((4, 5), np.float32)
    heights[1, 1] = -3.4e38
    with pytest.raises(InvalidTerrain, match="no-data"):
        read_terrain(geotiff(tmp_path / "a.tif", heights))


@pytest.mark.parametrize("number", [-9999, -32768, 32767])
def test_a_number_that_stands_for_no_value_is_refused_wherever_it_is_not_declared(number, tmp_path):
    heights = np.array([[400, 401], [number, 402]], np.int16)
    declared = read_terrain(geotiff(tmp_path / "a.tif", heights, nodata=number))
    np.testing.assert_array_equal(declared.heights, [[np.nan, 402], [400, 401]])
    path = geotiff(tmp_path / "b.tif", heights)
    with pytest.raises(InvalidTerrain, match=f"1 heights of b.tif are {number}"):
        read_terrain(path)
    with rasterio.open(path, "r+") as target:
        target.scales, target.offsets = (0.1,), (1000.0,)
    with pytest.raises(InvalidTerrain, match="no value"):
        read_terrain(path)
    with pytest.raises(InvalidTerrain, match="no value"):
        decode_terrain(npz(heights=heights, resolution=30.0, x0=0.0, y0=0.0), "a.npz")
    with pytest.raises(InvalidTerrain, match="no value"):
        decode_terrain(
            f"ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\nnodata_value 0\n1 {number}".encode(), "a.asc"
        )


@pytest.mark.parametrize("number", [-9999, -32768])
def test_meshes_and_scans_with_such_heights_are_refused_too(number):
    """A grid made into points or triangles keeps its number for no value, as a pit that cells may blur."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0.0, 4.0, 0.5), np.arange(0.0, 4.0, 0.5)))
    z = np.where((x == 2.0) & (y == 2.0), float(number), 0.1 * x)
    rows = "\n".join(f"{a} {b} {c}" for a, b, c in zip(x, y, z, strict=True))
    upright = "\n".join(f"{a} {c} {b}" for a, b, c in zip(x, y, z, strict=True))
    for text, up in ((rows, "z"), (upright, "y"), (upright, "-y")):
        with pytest.raises(InvalidTerrain, match=f"1 heights of a.xyz are {number}.*leave those points out"):
            decode_terrain(text.encode(), "a.xyz", unit="m", up=up, resolution=1.0)
    mesh = "".join(f"v {row}\n" for row in rows.split("\n"))
    mesh += "".join(f"f {i} {i + 1} {i + 9} {i + 8}\n" for i in range(1, 56) if i % 8)
    for resolution in (None, 0.3, 0.5):
        with pytest.raises(InvalidTerrain, match=f"1 heights of a.obj are {number}.*leave those vertices"):
            decode_terrain(mesh.encode(), "a.obj", resolution=resolution, most_error=1e6)
    apart = f"{mesh}v 0 0 {number}\n".replace(str(float(number)), "0.2")  # no face has that vertex
    assert decode_terrain(apart.encode(), "a.obj", resolution=0.5).heights.min() >= 0.0


@pytest.mark.parametrize("unit", ["ft", "cm", "US survey foot"])
def test_heights_in_another_unit_than_metres_are_refused(unit, tmp_path):
    path = geotiff(tmp_path / "a.tif", np.ones((4, 5), np.float32))
    for given in ("m", "metre", unit):
        with rasterio.open(path, "r+") as target:
            target.units = (given,)
        if given != unit:
            assert read_terrain(path).heights.shape == (4, 5)
    with pytest.raises(InvalidTerrain, match="bring them to metres"):
        read_terrain(path)


@pytest.mark.parametrize(
    ("crs", "x", "y"),
    [
        ("EPSG:32633", 5e5, 5e6),
        ("EPSG:3857", -9.4e6, 10.0),
        ("EPSG:2154", 7e5, 6.6e6),
        ("EPSG:32633+5773", 5e5, 5e6),
        ("+proj=stere +lat_0=-90 +R=1737400 +units=m", 0.0, 0.0),
        ("+proj=eqc +lat_ts=18.4 +lon_0=77.5 +R=3396190 +units=m", 0.0, 1.0906e6),
    ],
)
def test_projections_that_are_true_to_scale_there_are_read(crs, x, y, tmp_path):
    heights = np.arange(20, dtype=np.float32).reshape(4, 5)
    path = geotiff(tmp_path / "a.tif", heights, Affine(0.5, 0, x, 0, -0.5, y), crs=CRS.from_user_input(crs))
    np.testing.assert_array_equal(read_terrain(path).heights, heights[::-1])


def test_pictures_and_bands_of_something_else_are_refused(tmp_path):
    grey = np.arange(20, dtype=np.uint8).reshape(4, 5)
    path = geotiff(tmp_path / "ortho.tif", grey)
    with pytest.raises(InvalidTerrain, match="8 bit"):
        read_terrain(path)
    with rasterio.open(path, "r+") as target:
        target.units = ("m",)
    np.testing.assert_array_equal(read_terrain(path).heights, grey[::-1])
    several = geotiff(tmp_path / "b.tif", np.ones((4, 5), np.float32), count=2)
    assert read_terrain(several).heights.max() == 1.0
    for first, refused in (("slope [rad]", True), ("Elevation", False)):
        with rasterio.open(several, "r+") as target:
            target.set_band_description(1, first)
        if refused:
            with pytest.raises(InvalidTerrain, match="first of 2 bands"):
                read_terrain(several)
        else:
            assert read_terrain(several).heights.max() == 1.0


def test_one_band_of_something_else_and_a_scale_that_flattens_are_refused(tmp_path):
    path = geotiff(tmp_path / "b.tif", np.ones((4, 5), np.float32))
    for called, words in (("slope [rad]", "called 'slope"), ("DEM, slope corrected", None), ("layer 7", None)):
        with rasterio.open(path, "r+") as target:
            target.set_band_description(1, called)
        if words:
            with pytest.raises(InvalidTerrain, match=words):
                read_terrain(path)
        else:
            assert read_terrain(path).heights.max() == 1.0
    for scale, offset in ((0.0, 0.0), (np.nan, 0.0), (1.0, np.inf)):
        with rasterio.open(path, "r+") as target:
            target.scales, target.offsets = (scale,), (offset,)
        with pytest.raises(InvalidTerrain, match="leave no heights"):
            read_terrain(path)


@pytest.mark.parametrize("kind", [np.uint16, np.float32])
def test_what_is_transparent_is_unknown(kind, tmp_path):
    """An alpha band, as gdalwarp -dstalpha makes it: of floats GDAL itself reads the 0 of hidden cells as heights."""
    heights = np.arange(20).reshape(4, 5).astype(kind)
    hidden = heights < 7
    path = geotiff(tmp_path / "a.tif", np.where(hidden, kind(0), heights), count=2, ALPHA="YES")
    with rasterio.open(path, "r+") as target:
        target.write(np.where(hidden, kind(0), kind(65535)), 2)
    found = read_terrain(path).heights[::-1]
    np.testing.assert_array_equal(np.isnan(found), hidden)
    np.testing.assert_array_equal(found[~hidden], heights[~hidden])


def test_degrees_show_even_without_a_projection():
    rough = 300 + 50 * np.random.default_rng(1).normal(size=(20, 20))
    asc = "ncols 20\nnrows 20\nxllcorner 13.1\nyllcorner 47.2\ncellsize {}\n" + "\n".join(
        " ".join(f"{h:.2f}" for h in row) for row in rough
    )
    with pytest.raises(InvalidTerrain, match="degrees"):
        decode_terrain(asc.format(0.000277778).encode(), "a.asc")
    with pytest.raises(InvalidTerrain, match="degrees"):
        decode_terrain(asc.format(0.0833).encode(), "a.asc")


def test_a_projection_beside_a_grid_is_heeded(holed, tmp_path):
    write_terrain(holed, tmp_path / "a.asc")
    (tmp_path / "a.prj").write_text(CRS.from_epsg(4326).to_wkt())
    with pytest.raises(InvalidTerrain, match="degrees"):
        read_terrain(tmp_path / "a.asc")


def test_asc_conventions():
    body = "1 2 3\n4 -9999 6\n"
    corner = decode_terrain(
        f"NCOLS 3\r\nNROWS 2\r\nXLLCORNER 10\r\nYLLCORNER 20\r\nCELLSIZE 2\r\nNODATA_VALUE -9999\r\n{body}".encode(),
        "a.asc",
    )
    np.testing.assert_array_equal(corner.heights, [[4, np.nan, 6], [1, 2, 3]])
    assert corner.geometry.bounds == (11.0, 21.0, 15.0, 23.0)
    center = decode_terrain(f"ncols 3\nnrows 2\nxllcenter 10\nyllcenter 20\ncellsize 2\n{body}".encode(), "a.asc")
    assert center.geometry.bounds == (10.0, 20.0, 14.0, 22.0)
    marked = (
        b"\xef\xbb\xbfncols 2\nnrows 1\nxllcenter 0\nyllcenter 0\ncellsize 2\nNODATA_value -3.4028234663852886e+38\n"
    )
    np.testing.assert_array_equal(decode_terrain(marked + b"1 -3.4028235e+38", "a.asc").heights, [[1, np.nan]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n", "ncols"),
        ("ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n", "1 heights"),
        ("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 x\n", "numbers"),
        ("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 0\n1\n", "resolution"),
        ("ncols 1.5\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n", "whole"),
        ("ncols 90000\nnrows 90000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n", "cells"),
        ("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n-9999\n", "no cell"),
        ("hello there\n", "header"),
        ("ncols x\n", "no number"),
        ("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\ncellsize 2\n1\n", "beside cellsize"),
        ("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\nxllcenter 0\ncellsize 1\n1\n", "beside xllcorner"),
        ("ncols nan\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1\n", "whole"),
    ],
)
def test_bad_grids_say_what_is_wrong(text, words):
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(text.encode(), "a.asc")


@pytest.mark.parametrize("ending", [".tif", ".npz", ".ply", ".stl", ".off", ".obj", ".asc"])
@pytest.mark.parametrize("damage", ["cut", "noise"])
def test_damaged_files_are_refused_or_read_whole(ending, damage, holed, rng):
    content = encode_terrain(holed, ending)
    content = content[: len(content) // 3] if damage == "cut" else rng.bytes(len(content))
    if damage == "cut" and ending == ".obj":
        pytest.skip("an OBJ has no length: its first third is a whole file of points, or fewer faces")
    with pytest.raises(InvalidTerrain):
        decode_terrain(content, f"a{ending}")


@pytest.mark.parametrize("name", ["a.jpg", "a.doc", "a", "a.tif.gz"])
def test_unknown_endings_are_refused(name, tmp_path, holed):
    (tmp_path / name).write_bytes(b"1")
    with pytest.raises(InvalidTerrain, match=r"\.tif"):
        read_terrain(tmp_path / name)
    with pytest.raises(InvalidTerrain, match=r"\.tif"):
        write_terrain(holed, tmp_path / name)


@pytest.mark.parametrize(
    ("true", "named"), [(".tif", ".png"), (".npz", ".tif"), (".asc", ".ply"), (".off", ".obj"), (".ply", ".asc")]
)
def test_wrong_endings_are_named(true, named, holed):
    with pytest.raises(InvalidTerrain, match="named"):
        decode_terrain(encode_terrain(holed, true), f"a{named}")


def test_missing_and_empty_files(tmp_path, holed):
    with pytest.raises(NotFound):
        read_terrain(tmp_path / "none.tif")
    (tmp_path / "a.asc").touch()
    with pytest.raises(InvalidTerrain, match="empty"):
        read_terrain(tmp_path / "a.asc")
    with pytest.raises(NotFound):
        write_terrain(holed, tmp_path / "no" / "a.tif")


def npz(**arrays):
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


@pytest.mark.parametrize(
    "arrays",
    [
        {"heights": np.zeros((3, 3))},
        {"heights": np.zeros(9), "resolution": 1.0, "x0": 0.0, "y0": 0.0},
        {"heights": np.zeros((3, 3), complex), "resolution": 1.0, "x0": 0.0, "y0": 0.0},
        {"heights": np.zeros((3, 3)), "resolution": -1.0, "x0": 0.0, "y0": 0.0},
        {"heights": np.zeros((3, 3)), "resolution": 1.0, "x0": np.nan, "y0": 0.0},
        {"heights": np.full((3, 3), np.nan), "resolution": 1.0, "x0": 0.0, "y0": 0.0},
        {"heights": np.full((3, 3), np.inf), "resolution": 1.0, "x0": 0.0, "y0": 0.0},
        {"heights": np.array([[None, 1.0]], object), "resolution": 1.0, "x0": 0.0, "y0": 0.0},
    ],
)
def test_bad_npz_is_refused(arrays):
    with pytest.raises(InvalidTerrain):
        decode_terrain(npz(**arrays), "a.npz")


def test_an_npz_that_promises_too_much_is_refused_unread():
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (10**6, 10**6)})
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("heights.npy", header.getvalue())
    with pytest.raises(InvalidTerrain, match="coarser"):
        decode_terrain(out.getvalue(), "a.npz")


def png(array, clear=None):
    """clear: the grey that is declared transparent, as a chunk ``tRNS`` behind the header."""
    out = io.BytesIO()
    Image.fromarray(array).save(out, format="PNG")
    content = out.getvalue()
    if clear is None:
        return content
    chunk = b"tRNS" + struct.pack(">H", clear)
    return content[:33] + struct.pack(">I", 2) + chunk + struct.pack(">I", zlib.crc32(chunk)) + content[33:]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_height_images(dtype):
    top = np.iinfo(dtype).max
    picture = np.array([[0, top, 0, 0], [0, 0, 0, top // 5]], dtype)
    dem = decode_terrain(png(picture), "a.png", size=(4.0, 2.0), height_range=(-1.0, 1.5))
    expected = np.full((2, 4), -1.0)
    expected[1, 1], expected[0, 3] = 1.5, -0.5
    np.testing.assert_allclose(dem.heights, expected, atol=1e-6)
    assert dem.geometry.bounds == (0.5, 0.5, 3.5, 1.5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("clear", [0, 77])
def test_the_grey_that_a_picture_declares_transparent_is_unknown(dtype, clear, tmp_path):
    picture = np.array([[0, 77, 0, 5], [77, 9, 0, 77]], dtype)
    path = tmp_path / "a.png"
    path.write_bytes(png(picture, clear))
    dem = read_terrain(path, size=(4.0, 2.0), height_range=(0.0, 10.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(path) as judge:
            known = judge.read_masks(1) > 0
    np.testing.assert_array_equal(np.isfinite(dem.heights), known[::-1])
    np.testing.assert_array_equal(known, picture != clear)


def test_oblong_pixels_become_square_cells():
    ramp = np.tile(np.arange(0, 250, 10, dtype=np.uint8), (11, 1))
    dem = decode_terrain(png(ramp), "a.png", size=(5.0, 1.1), height_range=(0.0, 2.55))
    assert dem.geometry.resolution == pytest.approx(0.1)
    np.testing.assert_allclose(
        dem.heights, np.broadcast_to(0.5 * (dem.geometry.xs - 0.1), dem.heights.shape), atol=1e-5
    )


def test_images_need_size_range_and_grey(holed):
    grey = png(np.zeros((4, 4), np.uint8))
    options: dict[str, Any] = {"size": (1.0, 1.0), "height_range": (0.0, 1.0)}
    for missing in options:
        with pytest.raises(InvalidTerrain, match=missing):
            decode_terrain(grey, "a.png", **{k: v for k, v in options.items() if k != missing})
    with pytest.raises(InvalidTerrain, match="grey"):
        decode_terrain(png(np.zeros((4, 4, 3), np.uint8)), "a.png", **options)
    with pytest.raises(InvalidTerrain, match="height_range"):
        decode_terrain(grey, "a.png", size=(1.0, 1.0), height_range=(1.0, 0.0))
    with pytest.raises(InvalidTerrain, match="pictures only"):
        decode_terrain(encode_terrain(holed, ".npz"), "a.npz", **options)
    with pytest.raises(InvalidTerrain, match="corrupt"):
        decode_terrain(grey[:40], "a.png", **options)
    huge = grey[:16] + struct.pack(">II", 10**6, 10**6) + grey[24:]
    with pytest.raises(InvalidTerrain, match="coarser"):
        decode_terrain(huge, "a.png", **options)


def exported(solid: Any, kind: str) -> bytes:
    content = solid.export(file_type=kind)
    return content.encode() if isinstance(content, str) else content


def test_meshes_that_are_no_surface_are_refused():
    for solid in (trimesh.creation.icosphere(), trimesh.creation.box((1, 1, 1))):
        with pytest.raises(InvalidTerrain, match="not a surface"):
            decode_terrain(exported(solid, "stl"), "a.stl", resolution=0.05)
    cloud = exported(trimesh.PointCloud(np.random.default_rng(0).random((30, 3))), "ply")
    with pytest.raises(InvalidTerrain, match="--up z"):
        decode_terrain(cloud, "a.ply")
    with pytest.raises(InvalidTerrain):
        decode_terrain(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "a.off")
    with pytest.raises(InvalidTerrain):
        decode_terrain(b"OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "a.off")


def test_obj_faces_that_count_backwards_mean_the_vertices_so_far():
    rows, cols = np.mgrid[:4, :5]
    corners = np.stack([0.5 * cols, 0.5 * rows, np.sin(rows) + cols], -1).astype(float)
    tops = [(0, 0), (0, 1), (1, 1), (1, 0)]

    def written(face):
        lines = []
        for r in range(3):
            for c in range(4):
                lines += ["v {:.6f} {:.6f} {:.6f}".format(*corners[r + i, c + j]) for i, j in tops]
                lines += [face((r * 4 + c) * 4)]
        return "\n".join(["vt 0 0", "vn 0 0 1", *lines]).encode()

    forwards = decode_terrain(written(lambda n: f"f {n + 1}/1/1 {n + 2}/1/1 {n + 3}/1/1 {n + 4}/1/1"), "a.obj")
    assert forwards.heights.shape == (4, 5)
    np.testing.assert_allclose(forwards.heights, corners[..., 2], atol=1e-5)
    for face in (lambda n: "f -4/-1/-1 -3/-1/-1 -2/-1/-1 -1/-1/-1", lambda n: f"f -4 \\\n {n + 2} -2 -1"):
        np.testing.assert_array_equal(decode_terrain(written(face), "a.obj").heights, forwards.heights)
    with pytest.raises(InvalidTerrain, match="vertex 0"):
        decode_terrain(written(lambda n: f"f {n} {n + 1} {n + 2} {n + 3}"), "a.obj")


@pytest.mark.parametrize("endian", ["<", ">"])
@pytest.mark.parametrize("real", ["f4", "f8"])
def test_plys_of_others(endian, real, holed):
    """Binary of both byte orders with squares and colours: OFF of the same ground is the second witness."""
    corners = np.array([[x, y, 0.3 * x - 0.1 * y] for y in range(4) for x in range(5)], float) * [0.5, 0.5, 1.0]
    squares = [[r * 5 + c, r * 5 + c + 1, r * 5 + c + 6, r * 5 + c + 5] for r in range(3) for c in range(4)]
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[endian]
    name = {"f4": "float", "f8": "double"}[real]

    def ply(at):
        header = f"ply\nformat {kind} 1.0\nelement vertex {len(corners)}\n"
        header += "".join(f"property {name} {axis}\n" for axis in "xyz") + "property uchar red\n"
        header += f"element face {len(squares)}\nproperty list uchar int vertex_indices\nend_header\n"
        vertices = np.zeros(len(corners), [("p", endian + real, 3), ("red", "u1")])
        vertices["p"] = corners + at
        faces = np.zeros(len(squares), [("n", "u1"), ("i", endian + "i4", 4)])
        faces["n"], faces["i"] = 4, squares
        return header.encode() + vertices.tobytes() + faces.tobytes()

    dem = decode_terrain(ply(0.0), "a.ply", resolution=0.5)
    np.testing.assert_allclose(dem.heights, corners[:, 2].reshape(4, 5), atol=1e-6)
    at = [5e5, 4e6, 100.0]
    if real == "f4":
        with pytest.raises(InvalidTerrain, match="seven digits"):
            decode_terrain(ply(at), "a.ply", resolution=0.5)
    else:
        far = decode_terrain(ply(at), "a.ply", resolution=0.5)
        np.testing.assert_allclose(far.heights, dem.heights + 100.0, atol=1e-5)


def test_a_ply_in_text_that_is_cut_is_refused():
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    whole = export_ply(square, encoding="ascii")
    assert decode_terrain(whole, "a.ply", resolution=0.5).heights.shape == (3, 3)
    with pytest.raises(InvalidTerrain, match="cut"):
        decode_terrain(whole[: whole.rstrip().rfind(b"\n") + 1], "a.ply", resolution=0.5)


def test_float32_meshes_far_from_the_origin_are_not_written():
    far = from_heights(np.zeros((5, 5)), 0.1, 5e5, 4e6)
    with pytest.raises(InvalidTerrain, match="digits"):
        encode_terrain(far, ".stl")
    np.testing.assert_allclose(
        decode_terrain(encode_terrain(far, ".off"), "a.off").geometry.bounds, far.geometry.bounds
    )
    with pytest.raises(InvalidTerrain, match="no triangles"):
        encode_terrain(from_heights([[1.0]], 0.1), ".ply")


def test_scale_center_and_resolution(holed):
    content = encode_terrain(holed, ".npz")
    doubled = decode_terrain(content, "a.npz", scale=2.0)
    np.testing.assert_array_equal(doubled.heights, 2 * holed.heights)
    np.testing.assert_allclose(doubled.geometry.bounds, 2 * np.array(holed.geometry.bounds))
    centred = decode_terrain(encode_terrain(from_heights(holed.heights, 0.1, 5e5, 4e6), ".asc"), "a.asc", center=True)
    np.testing.assert_allclose(centred.geometry.bounds, (-2.0, -1.5, 2.0, 1.5), atol=1e-6)
    moved = decode_terrain(content, "a.npz", center=(1.0, -1.0))
    np.testing.assert_allclose(moved.geometry.bounds, (-3.0, -0.5, 1.0, 2.5))
    finer = decode_terrain(content, "a.npz", resolution=0.05, scale=2.0)
    assert finer.geometry.resolution == 0.05
    np.testing.assert_allclose(height_at(finer, 1.0, 1.0), 2 * height_at(holed, 0.5, 0.5), atol=1e-5)
    off = encode_terrain(fractal(4.0, 0.1), ".off")
    assert decode_terrain(off, "a.off", resolution=0.07, scale=2.0).geometry.resolution == pytest.approx(0.07)
    refused: list[dict[str, Any]] = [{"scale": 0.0}, {"scale": np.nan}, {"resolution": -1.0}, {"center": (1.0, np.nan)}]
    for bad in refused:
        with pytest.raises(InvalidTerrain):
            decode_terrain(content, "a.npz", **bad)


def test_real_fractal_terrain(shared_data):
    dem = read_terrain(shared_data / "fractal_terrain_1.off", scale=2.75, center=True)
    assert dem.heights.shape == (129, 129)
    np.testing.assert_allclose(dem.geometry.bounds, (-27.5, -27.5, 27.5, 27.5), atol=1e-4)
    solid = trimesh.load_mesh(shared_data / "fractal_terrain_1.off", process=False)
    # the file rounds its coordinates to six digits, so vertices lie up to 0.14 mm off their cells
    np.testing.assert_allclose(
        np.sort(dem.heights.ravel()), np.sort(np.unique(solid.vertices, axis=0)[:, 2] * 2.75), atol=1e-3
    )


def test_real_lunar_picture(shared_data):
    dem = read_terrain(shared_data / "lunar_gld100_dtm2_2970.png", size=(18, 12), height_range=(0, 0.5), center=True)
    west, south, east, north = dem.geometry.bounds
    cell = dem.geometry.resolution
    assert (east - west + cell, north - south + cell) == pytest.approx((18, 12), abs=2 * cell)
    assert 0.0 <= dem.heights.min() < dem.heights.max() <= 0.5


def test_a_header_without_an_end_needs_little_more_memory_than_itself():
    content = b"ncols 1 " * (1 << 19)
    tracemalloc.start()
    try:
        with pytest.raises(InvalidTerrain, match="header line"):
            decode_terrain(content, "a.asc")
        assert tracemalloc.get_traced_memory()[1] < 0.5 * len(content)
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"units": "mm"}, "its array units would be passed over"),
        ({"nodata": 0.0}, "its array nodata would be passed over"),
        ({"mask": np.zeros((3, 3), bool)}, "its array mask would be passed over"),
        ({"resolution": "0_5"}, "resolution is no number"),
        ({"x0": True}, "x0 is no number"),
    ],
)
def test_an_npz_has_nothing_that_would_be_passed_over(arrays, words):
    def npz(**members: Any) -> bytes:
        held = io.BytesIO()
        np.savez(held, **{"heights": np.zeros((3, 3)), "resolution": 0.5, "x0": 0, "y0": 0, **members})
        return held.getvalue()

    assert decode_terrain(npz(remark=np.array(7)), "a.npz").heights.max() == 0.0
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(npz(**arrays), "a.npz")
