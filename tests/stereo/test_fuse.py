import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.terrain.fusion.fuse import despike, fuse
from footfall.terrain.fusion.grid_depth import CellSamples

GRID = GridGeometry(0.0, 0.0, 0.1, 6, 7)


def random_samples(rng, n=150):
    return CellSamples(
        cell=rng.integers(0, 30, n),
        height=rng.normal(0, 0.04, n),
        variance=rng.uniform(0.1, 3.0, n),
        grey=rng.uniform(1, 255, n),
    )


def one_cell(height, weight, grey, gate):
    """The definition, for one cell."""
    order = np.argsort(height)
    height, weight, grey = height[order], weight[order], grey[order]
    median = height[np.flatnonzero(np.cumsum(weight) >= (0.5 - 1e-9) * weight.sum())[0]]
    near = np.abs(height - median) <= gate
    return (weight * height)[near].sum() / weight[near].sum(), grey[near][np.argmax(weight[near])]


def test_agrees_with_the_definition_cell_by_cell(rng):
    views = [random_samples(rng), random_samples(rng)]
    heights, texture, *_ = fuse(views, GRID, gate=0.03)
    cell, height, weight, grey = (
        np.concatenate([f(s) for s in views])
        for f in (lambda s: s.cell, lambda s: s.height, lambda s: 1 / s.variance, lambda s: s.grey)
    )
    for c in range(GRID.rows * GRID.cols):
        here = cell == c
        if not here.any():
            assert np.isnan(heights.flat[c])
            assert texture.flat[c] == 0
            continue
        expected, expected_grey = one_cell(height[here], weight[here], grey[here], 0.03)
        assert heights.flat[c] == pytest.approx(expected, abs=1e-6)
        assert abs(texture.flat[c] - expected_grey) <= 0.5


def test_order_of_views_and_samples_does_not_matter(rng):
    first, second = random_samples(rng), random_samples(rng)
    order = rng.permutation(len(first.cell))
    mixed = CellSamples(first.cell[order], first.height[order], first.variance[order], first.grey[order])
    expected = fuse([first, second], GRID, 0.03)
    got = fuse([second, mixed], GRID, 0.03)
    assert np.array_equal(expected[0], got[0], equal_nan=True)
    assert np.array_equal(expected[1], got[1])


def test_one_wrong_view_does_not_pull_the_others():
    samples = CellSamples(np.zeros(3, np.int64), np.array([0.0, 0.01, 0.9]), np.ones(3), np.full(3, 9.0))
    heights, *_ = fuse([samples], GRID, gate=0.05)
    assert heights[0, 0] == pytest.approx(0.005)


def test_no_samples_leave_all_unknown():
    none = CellSamples(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))
    heights, texture, *_ = fuse([none], GRID, gate=0.05)
    assert np.isnan(heights).all()
    assert not texture.any()


@pytest.mark.parametrize("cell", [-1, 42])
def test_samples_of_another_grid_are_refused(cell):
    one = CellSamples(np.array([3, cell]), np.zeros(2), np.ones(2), np.ones(2))
    with pytest.raises(InvalidTerrain, match=r"of a grid that has 42"):
        fuse([one], GRID, gate=0.05)


def test_despike_agrees_with_the_definition(rng):
    heights = rng.normal(0, 0.02, (20, 30)).astype(np.float32)
    heights[rng.random(heights.shape) < 0.5] = np.nan
    got = despike(heights, 0.02, 9)
    for row in range(20):
        for col in range(30):
            around = heights[max(row - 2, 0) : row + 3, max(col - 2, 0) : col + 3]
            known = np.sort(around[np.isfinite(around)])
            if np.isnan(heights[row, col]) or len(known) < 9:
                assert np.isnan(got[row, col])
                continue
            median = known[(len(known) - 1) // 2]
            spread = np.sort(np.abs(known - median))[(len(known) - 1) // 2]
            spike = abs(heights[row, col] - median) > max(0.02, 3 * 1.4826 * spread)
            assert got[row, col] == (median if spike else heights[row, col])


def test_despike_of_a_large_map_has_no_seams(rng):
    heights = rng.normal(0, 0.02, (520, 30)).astype(np.float32)
    whole = despike(heights, 0.01, 8)
    assert np.array_equal(despike(heights[250:270], 0.01, 8)[2:-2], whole[252:268])


def test_despike_takes_spikes_and_islands_and_keeps_edges():
    heights = np.zeros((21, 21), np.float32)
    heights[:, 10:] = 0.3
    heights[5, 5] = 1.0
    heights[:, 17:20] = np.nan
    heights[3:5, 20] = np.nan
    cleaned = despike(heights, 0.02, 8)
    assert cleaned[5, 5] == 0.0
    assert (cleaned[:, :5] == 0.0).all()
    assert np.isnan(cleaned[:, 17:20]).all()
    assert (cleaned[1:-1, 9] == 0.0).all()
    assert (cleaned[1:-1, 10] == np.float32(0.3)).all()


def test_despike_leaves_the_top_of_a_rock_that_only_its_front_shows():
    """A half ball 20 cm wide on 2 cm cells, unknown behind its crest: the top is further from the median than 2 cm."""
    y, x = np.mgrid[-10:11, -10:11] * 0.02
    rock = np.sqrt(np.maximum(0.1**2 - x**2 - y**2, 0.0)).astype(np.float32)
    rock[y > 0.02] = np.nan
    median = np.nanmedian(rock[8:13, 8:13])
    assert rock[10, 10] - median > 0.008
    cleaned = despike(rock, 0.005, 8)
    assert cleaned[10, 10] == rock[10, 10]
    rock[3, 3] = 0.05
    assert despike(rock, 0.005, 8)[3, 3] == 0.0
