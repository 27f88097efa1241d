"""Laws of the grid: cells and centres are inverse, bounds and containment agree."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry

GRIDS = st.builds(
    GridGeometry,
    x0=st.floats(-1e4, 1e4),
    y0=st.floats(-1e4, 1e4),
    resolution=st.floats(0.005, 10),
    rows=st.integers(1, 30),
    cols=st.integers(1, 30),
)


@given(GRIDS)
def test_cell_is_the_inverse_of_centers(grid):
    centers = grid.centers()
    assert centers.shape == (*grid.shape, 2)
    row, col = grid.cell(centers[..., 0], centers[..., 1])
    want_row, want_col = np.indices(grid.shape)
    np.testing.assert_array_equal(row, want_row)
    np.testing.assert_array_equal(col, want_col)
    assert grid.contains(centers[..., 0], centers[..., 1]).all()


@given(GRIDS, st.floats(-0.49, 0.49), st.floats(-0.49, 0.49))
def test_a_cell_reaches_half_a_cell_around_its_centre(grid, dx, dy):
    centers = grid.centers() + grid.resolution * np.array([dx, dy])
    row, col = grid.cell(centers[..., 0], centers[..., 1])
    np.testing.assert_array_equal(np.stack([row, col]), np.indices(grid.shape))


@given(GRIDS)
def test_bounds_are_the_outermost_centres(grid):
    west, south, east, north = grid.bounds
    centers = grid.centers()
    assert (west, south) == tuple(centers[0, 0]) == (grid.xs[0], grid.ys[0])
    assert (east, north) == tuple(centers[-1, -1]) == (grid.xs[-1], grid.ys[-1])
    over = 0.6 * grid.resolution
    assert not grid.contains([west - over, east + over, west, west], [south, south, south - over, north + over]).any()


@given(st.floats() | st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300, 2.0**63]))
def test_any_number_has_an_answer(x):
    grid = GridGeometry(-1.0, -1.0, 0.5, 5, 5)
    inside = -1.25 <= x < 1.25
    assert bool(grid.contains(x, 0.0)) == inside
    assert bool(grid.contains(0.0, x)) == inside
    row, col = grid.cell(x, 0.0)
    assert row.dtype == col.dtype == np.int64


def test_rows_count_to_the_north_and_columns_to_the_east():
    grid = GridGeometry(10.0, 20.0, 2.0, 3, 4)
    row, col = grid.cell(14.0, 22.0)
    assert (int(row), int(col)) == (1, 2)
    row, col = grid.cell(9.0 - 2e-9, 25.0)
    assert (int(row), int(col)) == (3, -1)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"x0": math.nan}, "origin"),
        ({"y0": math.inf}, "origin"),
        ({"resolution": 0.0}, "resolution"),
        ({"resolution": -1.0}, "resolution"),
        ({"resolution": math.inf}, "resolution"),
        ({"resolution": math.nan}, "resolution"),
        ({"rows": 0}, "at least one cell"),
        ({"cols": -3}, "at least one cell"),
        ({"rows": 2.0}, "whole numbers"),
        ({"cols": math.nan}, "whole numbers"),
        ({"cols": None}, "whole numbers"),
    ],
)
def test_impossible_grids_are_refused(change, text):
    fields = {"x0": 0.0, "y0": 0.0, "resolution": 1.0, "rows": 2, "cols": 2} | change
    with pytest.raises(InvalidInput, match=text):
        GridGeometry(**fields)
