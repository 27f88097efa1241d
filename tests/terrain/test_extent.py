"""How far a place lies off a map, against the distances of its corners' box found one axis at a time."""

import math

from hypothesis import given
from hypothesis import strategies as st

from footfall.core.grid import GridGeometry
from footfall.terrain.extent import outside, spans

GRIDS = st.builds(
    GridGeometry,
    st.floats(-1e6, 1e6),
    st.floats(-1e6, 1e6),
    st.floats(0.01, 10.0),
    st.integers(2, 400),
    st.integers(2, 400),
)


@given(GRIDS, st.floats(-0.5, 1.5), st.floats(-0.5, 1.5))
def test_a_place_is_off_the_map_by_what_brings_it_back(grid, along_x, along_y):
    x = grid.xs[0] + along_x * (grid.xs[-1] - grid.xs[0])
    y = grid.ys[0] + along_y * (grid.ys[-1] - grid.ys[0])
    back_x = min(max(x, grid.xs[0]), grid.xs[-1])
    back_y = min(max(y, grid.ys[0]), grid.ys[-1])
    moved = max(abs(back_x - x), abs(back_y - y))
    off = outside(grid, x, y)
    assert max(off, 0.0) == moved
    assert (off <= 0) == (moved == 0)


def test_a_place_that_is_no_number_is_not_on_the_map():
    assert not outside(GridGeometry(0.0, 0.0, 1.0, 3, 3), math.nan, 1.0) <= 0


def test_a_map_is_told_by_its_outermost_cells():
    assert spans(GridGeometry(-1.0, 2.0, 0.5, 3, 5)) == "the map spans x -1.00…1.00 m, y 2.00…3.00 m"
