"""The compiled plane fit: the same numbers whatever the tiles, the threads and the orientation of the map."""

import os
import subprocess
import sys

import numpy as np
import pytest

from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps import traversability as fitting
from footfall.maps.layers import MapSettings
from footfall.maps.plane_fit import TILE_COLS, TILE_ROWS
from footfall.maps.traversability import LEAST_CERTAINTY, WIDEST, traversability, updated_traversability
from footfall.terrain.dem import Dem

LAYERS = ("slope", "roughness", "step", "goodness", "certainty")
SETTINGS = MapSettings(window=0.45)
HALF = 4
RESOLUTION = 0.05


def ground(heights):
    heights = np.asarray(heights, np.float32)
    return Dem(heights, GridGeometry(0.0, 0.0, RESOLUTION, *heights.shape), "ground", Provenance({}))


def rough(rng, rows, cols, holes=0.2):
    heights = 0.1 * rng.normal(size=(rows, cols)).cumsum(axis=0).cumsum(axis=1) / np.sqrt(rows)
    heights[rng.random(heights.shape) < holes] = np.nan
    heights[rows // 3 : rows // 3 + 30, cols // 4 : cols // 4 + 20] = np.nan
    return heights


def test_tiles_leave_no_seams(rng):
    """Cells about every tile's border against the same cells of a crop, where no border is."""
    heights = rough(rng, 8 * TILE_ROWS + 40, TILE_COLS + 50)
    whole = traversability(ground(heights), SETTINGS)
    for row, col in ((TILE_ROWS, TILE_COLS), (4 * TILE_ROWS, TILE_COLS), (8 * TILE_ROWS, TILE_COLS)):
        crop = traversability(ground(heights[row - 14 : row + 14, col - 14 : col + 14]), SETTINGS)
        inner = slice(HALF, 28 - HALF)
        for name in LAYERS:
            expected = getattr(crop, name)[inner, inner]
            found = getattr(whole, name)[row - 14 : row + 14, col - 14 : col + 14][inner, inner]
            assert np.isfinite(expected).any()
            np.testing.assert_allclose(found, expected, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (3, 3), (TILE_ROWS, TILE_COLS), (TILE_ROWS + 1, TILE_COLS + 1)])
def test_every_cell_is_written_on_grids_of_any_shape(rng, shape):
    found = traversability(ground(rng.normal(size=shape)), SETTINGS)
    row, col = np.indices(shape)
    across = [
        np.minimum(at + HALF, end - 1) - np.maximum(at - HALF, 0) + 1 for at, end in ((row, shape[0]), (col, shape[1]))
    ]
    share = across[0] * across[1] / (2 * HALF + 1) ** 2
    assert found.certainty == pytest.approx(share, abs=1e-6)
    fitted = np.isfinite(found.slope)
    assert not fitted[share < LEAST_CERTAINTY].any()
    for name in LAYERS[1:4]:
        assert (np.isfinite(getattr(found, name)) == fitted).all()
    assert (np.isfinite(found.gradient).all(axis=-1) == fitted).all()
    assert ((found.goodness[fitted] >= 0) & (found.goodness[fitted] <= 1)).all()


def test_a_tile_without_any_known_cell_is_unknown(rng):
    heights = np.full((3 * TILE_ROWS, 3 * TILE_COLS), np.nan)
    heights[:10, :12] = rng.normal(size=(10, 12))
    found = traversability(ground(heights), SETTINGS)
    for name in LAYERS[:4]:
        assert np.isnan(getattr(found, name)[10:]).all()
        assert np.isfinite(getattr(found, name)[4, 5])
    assert (found.certainty[2 * TILE_ROWS :] == 0).all()
    assert np.isnan(found.gradient[10:]).all()


def test_turning_the_map_turns_the_layers(rng):
    heights = rough(rng, 60, 90)
    found = traversability(ground(heights), SETTINGS)
    turned = traversability(ground(np.rot90(heights)), SETTINGS)
    for name in LAYERS:
        np.testing.assert_allclose(getattr(turned, name), np.rot90(getattr(found, name)), atol=1e-6, rtol=1e-6)
    # a quarter turn to the north-west: what rose to the east now falls to the south
    east, north = np.rot90(found.gradient[..., 0]), np.rot90(found.gradient[..., 1])
    np.testing.assert_allclose(turned.gradient[..., 1], -east, atol=1e-9)
    np.testing.assert_allclose(turned.gradient[..., 0], north, atol=1e-9)


def test_adding_a_plane_adds_to_the_gradient_alone(rng):
    heights = rough(rng, 60, 90).astype(np.float32).astype(np.float64)
    north, east = RESOLUTION * np.indices(heights.shape)
    flat = traversability(ground(heights), SETTINGS)
    tilted = traversability(ground(heights + 0.5 * east - 0.25 * north), SETTINGS)
    np.testing.assert_allclose(tilted.gradient, flat.gradient + np.array([0.5, -0.25]), atol=1e-5)
    np.testing.assert_allclose(tilted.roughness, flat.roughness, atol=1e-6)
    np.testing.assert_allclose(tilted.step, flat.step, atol=2e-6)


def test_one_high_cell_is_a_step_wherever_a_window_sees_it():
    """The step is a maximum over the whole window, not over samples of it."""
    heights = np.zeros((41, 41))
    heights[20, 20] = 0.2
    seen = traversability(ground(heights), SETTINGS).step > 0.1
    expected = np.zeros_like(seen)
    expected[20 - HALF : 21 + HALF, 20 - HALF : 21 + HALF] = True
    assert (seen == expected).all()


def test_the_widest_window_against_least_squares(rng):
    side = WIDEST + 20
    heights = rough(rng, side, side).astype(np.float32)
    heights[: side // 2, : side // 3] = np.nan
    found = traversability(ground(heights), MapSettings(window=(WIDEST - 1) * RESOLUTION))
    half = WIDEST // 2
    cells = np.argwhere(np.isfinite(found.slope))
    for row, col in cells[rng.choice(len(cells), 20, replace=False)]:
        i, j = np.nonzero(np.isfinite(heights))
        near = (abs(i - row) <= half) & (abs(j - col) <= half)
        i, j = i[near], j[near]
        matrix = np.column_stack([RESOLUTION * j, RESOLUTION * i, np.ones(len(i))])
        z = heights[i, j].astype(np.float64)
        plane = np.linalg.lstsq(matrix, z, rcond=None)[0]
        residual = z - matrix @ plane
        assert found.gradient[row, col] == pytest.approx(plane[:2], abs=1e-10)
        assert found.roughness[row, col] == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-6)
        assert found.step[row, col] == pytest.approx(np.ptp(residual), rel=1e-6)


def test_the_number_of_threads_changes_nothing():
    program = (
        "import numpy as np, numba\n"
        "from footfall.core.grid import GridGeometry\n"
        "from footfall.core.value import Provenance\n"
        "from footfall.maps.layers import MapSettings\n"
        "from footfall.maps.traversability import traversability\n"
        "from footfall.terrain.dem import Dem\n"
        "rng = np.random.default_rng(20081)\n"
        "heights = rng.normal(size=(300, 700)).astype(np.float32)\n"
        "heights[rng.random(heights.shape) < 0.2] = np.nan\n"
        "dem = Dem(heights, GridGeometry(0.0, 0.0, 0.05, 300, 700), 'ground', Provenance({}))\n"
        "print(numba.get_num_threads(), traversability(dem, MapSettings()).digest)\n"
    )
    answers = []
    for threads in ("1", "2", "5"):
        run = subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "NUMBA_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        )
        used, digest = run.stdout.split()
        assert used == threads
        answers.append(digest)
    assert len(set(answers)) == 1


@pytest.mark.parametrize("window", [SETTINGS.window, (WIDEST - 1) * RESOLUTION])
@pytest.mark.parametrize("corner", [(0, 0), (31, 255), (32, 256), (100, 290)])
def test_a_newer_map_is_fitted_near_what_changed_and_as_one_that_is_fitted_whole(rng, monkeypatch, window, corner):
    """Changes on either side of a tile's border and at the map's; a window may be wider than a tile is high."""
    settings = MapSettings(window=window)
    heights = rough(rng, 4 * TILE_ROWS + 5, TILE_COLS + 50)
    before = traversability(ground(heights), settings)
    newer = heights.copy()
    row, col = corner
    newer[row : row + 3, col : col + 3] = [[0.5, np.nan, 0.2], [np.nan, 0.1, 0.0], [0.3, 0.3, np.nan]]
    tiles = []
    fit = fitting.fit_tiles
    monkeypatch.setattr(fitting, "fit_tiles", lambda h, some, *rest: tiles.append(len(some)) or fit(h, some, *rest))
    found = updated_traversability(ground(newer), settings, before, heights.astype(np.float32))
    asked, whole = sum(tiles), traversability(ground(newer), settings)
    assert found.digest == whole.digest != before.digest
    assert 0 < asked <= (sum(tiles) - asked if window > 1 else 4)


def test_a_map_in_which_nothing_changed_is_not_fitted_again(rng, monkeypatch):
    heights = rough(rng, 50, 60)
    before = traversability(ground(heights), SETTINGS)
    monkeypatch.setattr(fitting, "fit_tiles", None)
    again = updated_traversability(ground(heights), SETTINGS, before, heights.astype(np.float32))
    assert again.digest == before.digest


def test_a_newer_map_of_another_shape_is_fitted_whole(rng):
    heights = rough(rng, 50, 60)
    before = traversability(ground(heights), SETTINGS)
    newer = ground(heights[:40])
    found = updated_traversability(newer, SETTINGS, before, heights.astype(np.float32))
    assert found.digest == traversability(newer, SETTINGS).digest
