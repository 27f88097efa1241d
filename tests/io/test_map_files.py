"""Maps as files: what is written comes back, and what can't be written is refused before anything is."""

import io
import json

import numpy as np
import pytest
import rasterio
from PIL import Image

from footfall.core.errors import InvalidInput, InvalidTerrain, NotFound
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.io.map_files import ALL, ONE, layer_npy, maps_geotiff, relief_png, require_map_file, write_maps
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.maps.colors import BARE_RGB, UNKNOWN_RGB, layer_rgb
from footfall.maps.layers import LAYERS, MapStack
from footfall.maps.reach_classes import BEYOND, HINDERED_BY, UNSEEN
from footfall.robot.proof.obstacles import TERRAIN as GROUND
from footfall.terrain.from_arrays import from_heights

GRID = GridGeometry(-1.25, 3.5, 0.25, 5, 7)
CLASSES = {
    "footing": (0, 1, 2, 3, 4, 5, 6),
    "footing_friction": (0, 1, 2, 3, 4, 5, 6),
    "reach_class": tuple(range(9)),
    "hindrance": (0, 1, 6, HINDERED_BY + GROUND, BEYOND, UNSEEN),
}


@pytest.fixture
def stack(rng):
    """All layers with random content, unknown cells among them."""
    layers = {}
    for name in LAYERS:
        if name in CLASSES:
            layers[name] = rng.choice(np.array(CLASSES[name], np.uint8), GRID.shape)
        else:
            layers[name] = rng.normal(size=GRID.shape).astype(np.float32)
            layers[name][rng.random(GRID.shape) < 0.2] = np.nan
    return MapStack(GRID, 4, "conservative", layers, Provenance({}))


@pytest.mark.parametrize("name", ["maps.tif", "maps.tiff", "MAPS.TIF"])
def test_a_geotiff_comes_back_band_by_band(stack, tmp_path, name):
    write_maps(stack, tmp_path / name)
    with rasterio.open(tmp_path / name) as file:
        assert file.count == len(LAYERS)
        assert set(file.dtypes) == {"float32"}
        assert np.isnan(file.nodata)
        about = json.loads(file.tags()["FOOTFALL"])
        assert about == {"leg": 4, "stability": "conservative", "digest": stack.digest}
        for band, (layer, cells) in enumerate(stack.layers.items(), 1):
            unit = LAYERS[layer].unit
            assert file.descriptions[band - 1] == (f"{layer} [{unit}]" if unit else layer)
            np.testing.assert_array_equal(file.read(band)[::-1], cells.astype(np.float32), err_msg=layer)
        # every cell of the grid is found at its own coordinates
        for row, col in ((0, 0), (0, 6), (4, 0), (2, 3)):
            x, y = float(GRID.xs[col]), float(GRID.ys[row])
            (sampled,) = file.sample([(x, y)])
            np.testing.assert_array_equal(sampled, [cells[row, col] for cells in stack.layers.values()])


def test_the_same_maps_give_the_same_geotiff(stack):
    assert maps_geotiff(stack) == maps_geotiff(stack)


def test_a_geotiff_lies_on_its_terrain(stack, tmp_path):
    """It has the transform that a terrain on the same grid is written with: both lie on each other in any GIS."""
    write_maps(stack, tmp_path / "maps.tif")
    write_terrain(from_heights(np.zeros(GRID.shape), GRID.resolution, GRID.x0, GRID.y0, "flat"), tmp_path / "dem.tif")
    with rasterio.open(tmp_path / "maps.tif") as maps, rasterio.open(tmp_path / "dem.tif") as dem:
        assert maps.shape == dem.shape == GRID.shape
        np.testing.assert_allclose(maps.transform, dem.transform)


def test_maps_are_not_taken_for_heights(stack, tmp_path):
    write_maps(stack, tmp_path / "maps.tif")
    with pytest.raises(InvalidTerrain, match="heights must be the first band"):
        read_terrain(tmp_path / "maps.tif")


def test_an_npz_comes_back_to_the_last_bit(stack, tmp_path):
    write_maps(stack, tmp_path / "maps.npz")
    with np.load(tmp_path / "maps.npz", allow_pickle=False) as file:
        assert set(file.files) == {*LAYERS, "x0", "y0", "resolution", "leg", "stability"}
        for layer, cells in stack.layers.items():
            assert file[layer].dtype == cells.dtype
            np.testing.assert_array_equal(file[layer], cells, err_msg=layer)
        assert (file["x0"], file["y0"], file["resolution"]) == (GRID.x0, GRID.y0, GRID.resolution)
        assert (int(file["leg"]), str(file["stability"])) == (4, "conservative")


def test_one_layer_as_numbers_and_as_a_picture(stack, tmp_path):
    for layer in ("slope", "hindrance"):
        write_maps(stack, tmp_path / "one.NPY", layer)
        np.testing.assert_array_equal(np.load(tmp_path / "one.NPY"), stack.layers[layer])
        assert (tmp_path / "one.NPY").read_bytes() == layer_npy(stack, layer)
        write_maps(stack, tmp_path / "one.png", layer)
        with Image.open(tmp_path / "one.png") as image:
            np.testing.assert_array_equal(np.asarray(image)[::-1], layer_rgb(stack, layer))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.NPY", "one.png"]


@pytest.mark.parametrize(
    ("name", "layer", "error", "words"),
    [
        ("maps.docx", None, InvalidInput, r"\.tif, .*\.npz.*not '\.docx'"),
        ("maps", None, InvalidInput, "not 'maps'"),
        ("maps.png", None, InvalidInput, "which layer goes into maps.png"),
        ("maps.npy", None, InvalidInput, "which layer goes into maps.npy"),
        ("maps.tif", "slope", InvalidInput, "takes all layers"),
        ("maps.npz", "slope", InvalidInput, "takes all layers"),
        ("maps.png", "beauty", NotFound, "'beauty'.*footing"),
        ("maps.npy", "beauty", NotFound, "'beauty'.*footing"),
    ],
)
def test_refusals_leave_no_file(stack, tmp_path, name, layer, error, words):
    with pytest.raises(error, match=words):
        write_maps(stack, tmp_path / name, layer)
    assert list(tmp_path.iterdir()) == []


def test_a_name_is_judged_before_there_are_maps(tmp_path):
    for ending in ALL:
        require_map_file(tmp_path / f"maps{ending.upper()}", None)
    for ending in ONE:
        require_map_file(tmp_path / f"maps{ending}", "slope")
    with pytest.raises(InvalidInput):
        require_map_file(tmp_path / "maps.jpg", "slope")


def test_a_layer_that_these_maps_lack_is_named(stack, tmp_path):
    geometric = {name: cells for name, cells in stack.layers.items() if name != "torque_ratio"}
    lacking = MapStack(GRID, 4, "plain", geometric, Provenance({}))
    for name in ("one.png", "one.npy"):
        with pytest.raises(NotFound, match=r"'torque_ratio'.*footing"):
            write_maps(lacking, tmp_path / name, "torque_ratio")
    assert list(tmp_path.iterdir()) == []


def test_the_lit_ground_has_north_up_its_light_from_the_north_west_and_unknown_ground_in_its_colour():
    """A pyramid: the two of its sides toward the light are brighter than level ground, and the two others darker."""
    away = np.abs(np.arange(41) - 20)
    heights = (0.3 * np.maximum(8.0 - np.maximum(away[:, None], away), 0.0) * 0.1).astype(np.float32)
    heights[-3:, :5] = np.nan  # in the north-west corner
    picture = np.asarray(Image.open(io.BytesIO(relief_png(from_heights(heights, 0.1)))).convert("RGB")).astype(int)
    assert picture.shape == (41, 41, 3)
    assert (picture[:3, :5] == UNKNOWN_RGB).all()
    assert (picture[3:, :] != UNKNOWN_RGB).any(axis=-1).all()
    brightness = picture.sum(axis=-1)
    level = brightness[38, 38]
    assert level == pytest.approx(0.9 * sum(BARE_RGB), abs=3)
    north, south, west, east = brightness[16, 20], brightness[24, 20], brightness[20, 16], brightness[20, 24]
    assert min(north, west) > level > max(south, east)
