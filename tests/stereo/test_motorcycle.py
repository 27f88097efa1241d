"""The photographed pair: Middlebury 2014 "Motorcycle" (Scharstein et al., GCPR 2014) at quarter size."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.io.image_files import read_pair
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs.stereo import depth, disparity
from footfall.terrain.photographs import terrain_from_pairs
from footfall.terrain.terrain_settings import TerrainSettings

FOCAL, BASELINE, DOFFS = 994.978, 0.193001, 31.086
SETTINGS = TerrainSettings(min_range=2.0, max_range=6.0, half_size=2.0)


@pytest.fixture(scope="module")
def pair(shared_data) -> ImagePair:
    # the camera looks along +x of base, 1.2 m above the site's ground (the pose is a statement, not a measurement)
    return read_pair(
        shared_data / "motorcycle_left.png",
        shared_data / "motorcycle_right.png",
        focal_length=FOCAL,
        cx=311.193,
        cy=254.877,
        baseline=BASELINE,
        doffs=DOFFS,
        T_site_base=frames.transform(None, (0.0, 0.0, 1.2)),
        name="motorcycle",
    )


@pytest.fixture(scope="module")
def truth(shared_data) -> np.ndarray:
    with np.load(shared_data / "motorcycle_disp.npz") as file:
        return file["arr_0"]


@pytest.mark.parametrize("matcher", ["hh", "3way"])
def test_disparity_against_ground_truth(pair, truth, matcher):
    found = disparity(pair, TerrainSettings(min_range=2.0, max_range=6.0, matcher=matcher))
    known = np.isfinite(truth)
    both = known & np.isfinite(found)
    assert both.sum() / known.sum() >= 0.80
    assert (np.abs(found - truth)[both] > 2.0).mean() <= 0.08


def test_depth_against_ground_truth(pair, truth):
    found = depth(pair, disparity(pair, SETTINGS))
    expected = FOCAL * BASELINE / (truth + DOFFS)
    both = np.isfinite(found) & np.isfinite(expected)
    assert np.median(np.abs(found - expected)[both]) < 0.015


def test_terrain_lies_on_the_photographed_scene(pair, truth):
    """Each height of the map is that of some true point straight above or below it."""
    dem = terrain_from_pairs([pair], SETTINGS)
    assert 0.02 < np.isfinite(dem.heights).mean() < 0.95
    assert dem.texture is not None
    assert (dem.texture[np.isfinite(dem.heights)] > 0).all()
    assert not dem.texture[np.isnan(dem.heights)].any()
    z = FOCAL * BASELINE / (truth + DOFFS)
    v, u = np.nonzero(np.isfinite(truth))
    z = z[v, u]
    x, y, height = z, -(u - 311.193) / FOCAL * z, 1.2 - (v - 254.877) / FOCAL * z
    cell_row, cell_col = dem.geometry.cell(x, y)
    inside = dem.geometry.contains(x, y)
    low, high = np.full(dem.heights.shape, np.inf), np.full(dem.heights.shape, -np.inf)
    np.minimum.at(low, (cell_row[inside], cell_col[inside]), height[inside])
    np.maximum.at(high, (cell_row[inside], cell_col[inside]), height[inside])
    compared = np.isfinite(low) & np.isfinite(dem.heights)
    assert compared.sum() > 3000
    within = (dem.heights >= low - 0.03) & (dem.heights <= high + 0.03)
    assert within[compared].mean() > 0.85


def test_swapped_photographs_are_refused(pair):
    swapped = ImagePair(
        pair.name, pair.time, pair.right, pair.left, pair.camera_left, pair.camera_right, pair.T_site_base
    )
    with pytest.raises(InvalidImages, match="swapped"):
        disparity(swapped, SETTINGS)
