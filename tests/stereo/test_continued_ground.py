"""Doubtful heights that go on with sure ground, and those that start something new."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.terrain.fusion.continued_ground import REACH, ROUNDS, SHARE, continued_ground
from footfall.terrain.terrain_settings import TerrainSettings

CELL = 0.05


def one_by_one(heights, doubtful, resolution):
    """Every cell against every one around it."""
    reach = max(1, round(REACH / resolution))
    side, heights = 2 * reach + 1, heights.copy()
    whole = np.zeros(heights.shape, bool)
    for _ in range(ROUNDS):
        padded = np.pad(heights, reach, constant_values=np.nan)
        for row, col in np.argwhere(np.isnan(heights) & np.isfinite(doubtful)):
            around = padded[row : row + side, col : col + side]
            known = around[np.isfinite(around)]
            if len(known) >= SHARE * side**2 and known.min() <= doubtful[row, col] <= known.max():
                whole[row, col] = True
        heights = np.where(whole, doubtful, heights)
    return whole


@given(seed=st.integers(0, 9999), sure=st.floats(0.0, 1.0), cell=st.sampled_from([0.02, 0.05, 0.3]))
def test_agrees_with_looking_at_each_cell(seed, sure, cell):
    rng = np.random.default_rng(seed)
    heights, doubtful = rng.normal(0.0, 0.02, (2, 14, 17)).astype(np.float32)
    heights[rng.random(heights.shape) > sure] = np.nan
    doubtful[rng.random(heights.shape) > 0.7] = np.nan
    assert np.array_equal(continued_ground(heights, doubtful, cell), one_by_one(heights, doubtful, cell))


@given(seed=st.integers(0, 9999))
def test_nothing_is_taken_that_is_known_or_that_nobody_saw_or_beyond_what_is_sure_nearby(seed):
    rng = np.random.default_rng(seed)
    heights, doubtful = rng.normal(0.0, 0.02, (2, 20, 20)).astype(np.float32)
    heights[:, 8:] = np.nan
    doubtful[rng.random(heights.shape) < 0.2] = np.nan
    taken = continued_ground(heights, doubtful, CELL)
    assert not taken[:, :8].any()
    assert not taken[np.isnan(doubtful)].any()
    assert not taken[:, 8 + ROUNDS * round(REACH / CELL) :].any()
    assert doubtful[taken].max(initial=-9.0) <= np.nanmax(heights)
    assert doubtful[taken].min(initial=9.0) >= np.nanmin(heights)


def test_a_leg_that_stands_on_the_ground_is_not_taken_and_the_ground_around_it_is():
    rng = np.random.default_rng(1)
    ground = rng.normal(0.0, 0.003, (21, 21)).astype(np.float32)
    heights, doubtful = ground.copy(), ground.copy()
    heights[8:13, 8:13] = np.nan
    doubtful[9:12, 9:12] = 0.12
    taken = continued_ground(heights, doubtful, 0.02)
    assert not taken[9:12, 9:12].any()
    assert taken[8:13, 8:13].sum() >= 12  # of 16; the others lie above or below all that are near
    # nor is it part by part, on a flank that rises little by little
    flank = np.full((21, 21), np.nan, np.float32)
    flank[:, 8:] = 0.02 * np.arange(1, 14)
    heights[:, 8:] = np.nan
    assert not continued_ground(heights, flank, 0.02).any()


def test_a_slope_goes_on_between_its_ends():
    slope = np.tile(0.02 * np.arange(20, dtype=np.float32), (20, 1))
    heights = slope.copy()
    heights[:, 9:12] = np.nan
    assert continued_ground(heights, slope, CELL)[:, 9:12].all()


def test_how_doubtful_pixels_may_be_is_a_number_of_metres():
    with pytest.raises(InvalidInput, match="doubtful_deviation"):
        TerrainSettings(doubtful_deviation=-0.1)
    with pytest.raises(InvalidInput, match="doubtful_deviation"):
        TerrainSettings(doubtful_deviation=float("nan"))
