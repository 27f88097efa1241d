"""What is no height and not declared so: 0 around maps that were turned, pages beside the ground."""

import io

import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.crs import CRS
from rasterio.transform import Affine
from rasterio.warp import Resampling, reproject

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import decode_terrain, read_terrain
from footfall.terrain.from_arrays import check_fill

UTM = CRS.from_epsg(32633)
PLACE = Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 5_180_040.0)


def heights(low):
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    return (low + 0.1 * x + np.sin(y)).astype(np.float32)


def written(path, array, **more):
    how = {"driver": "GTiff", "height": 40, "width": 40, "count": 1, "crs": UTM, "transform": PLACE}
    with rasterio.open(path, "w", dtype=array.dtype, **how, **more) as made:
        made.write(array, 1)
    return path


def turned(low):
    """As warping makes it of a map without a no-data value, into a system that is turned against its own."""
    out = np.zeros((40, 40), np.float32)
    turn = Affine.translation(500_000, 5_180_040) @ Affine.rotation(-20) @ Affine.scale(1, -1)
    reproject(heights(low), out, src_transform=turn, src_crs=UTM, dst_transform=PLACE, dst_crs=UTM,
              resampling=Resampling.bilinear)  # fmt: skip
    return out


@pytest.mark.parametrize("low", [1500.0, -4500.0])
def test_the_0_that_warping_fills_corners_with_is_no_height(tmp_path, low):
    array = turned(low)
    filled = int((array == 0).sum())
    assert filled > 100
    with pytest.raises(InvalidTerrain, match=f"{filled} cells of a.tif are 0 m, .* from all others.*-a_nodata 0"):
        read_terrain(written(tmp_path / "a.tif", array))
    known = np.isfinite(read_terrain(written(tmp_path / "b.tif", array, nodata=0)).heights)
    assert (~known).sum() == filled


def test_ascii_grids_and_npz_have_it_too():
    grid = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n120.5 121 -999\n119 120 -999\n"
    with pytest.raises(InvalidTerrain, match=r"2 cells of a.asc are -999 m"):
        decode_terrain(grid.encode(), "a.asc")
    held = io.BytesIO()
    np.savez(held, heights=[[1.0, 2.0, 9999.0], [1.5, 9999.0, 1.0]], resolution=1.0, x0=0.0, y0=0.0)
    with pytest.raises(InvalidTerrain, match=r"2 cells of a.npz are 9999 m"):
        decode_terrain(held.getvalue(), "a.npz")


@pytest.mark.parametrize(
    "array",
    [
        [[0.0, 0.0, 30.0], [0.0, 0.0, 30.0]],  # a wall
        [[0.0, 0.0, 70.0], [0.0, 40.0, 90.0]],  # a cliff with heights on its way
        [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[700.0, 700.0, 700.0], [700.0, 700.0, 700.0]],
        [[np.nan, np.nan, np.nan], [np.nan, np.nan, np.nan]],
    ],
)
def test_walls_and_plains_are_heights(array):
    check_fill(array, "a")


def test_a_step_in_millimetres_is_no_fill():
    held = io.BytesIO()
    np.savez(held, heights=[[0.0, 0.0, 80.0], [0.0, 0.0, 81.0]], resolution=100.0, x0=0.0, y0=0.0)
    assert decode_terrain(held.getvalue(), "a.npz", scale=0.001).heights.max() == pytest.approx(0.081)


def test_a_tiff_of_several_pages_is_refused():
    """Its first page was read, whatever the others are."""
    pages = [Image.fromarray(heights(low)) for low in (1.0, 2.0)]
    held = io.BytesIO()
    pages[0].save(held, "TIFF", save_all=True, append_images=pages[1:])
    with pytest.raises(InvalidTerrain, match=r"a.tif has 2 pages, .*GTIFF_DIR:1:a.tif"):
        decode_terrain(held.getvalue(), "a.tif", resolution=1.0)


def test_overviews_and_masks_are_no_pages(tmp_path):
    path = written(tmp_path / "a.tif", heights(1.0))
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(path, "r+") as made:
        made.write_mask(np.full((40, 40), 255, np.uint8))
        made.build_overviews([2, 4], Resampling.average)
    assert read_terrain(path).geometry.shape == (40, 40)
