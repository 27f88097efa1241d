"""Polygons in triangles: the triangles cover what the corners go around, whatever its shape, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon
from shapely.ops import unary_union

from footfall.core.ears import triangles_of


@st.composite
def stars(draw):
    """Simple polygons around the origin, concave as a rule."""
    count = draw(st.integers(3, 24))
    radii = draw(st.lists(st.floats(0.2, 5.0), min_size=count, max_size=count))
    angles = 2 * np.pi * (np.arange(count) + draw(st.floats(0.0, 0.4))) / count
    points = np.stack([np.array(radii) * np.cos(angles), np.array(radii) * np.sin(angles)], axis=1)
    return points[:: draw(st.sampled_from([1, -1]))]


@given(stars())
def test_the_triangles_cover_the_polygon_and_nothing_else(points):
    made = triangles_of(points)
    assert made.shape == (len(points) - 2, 3)
    whole = Polygon(points)
    parts = [Polygon(points[list(one)]) for one in made]
    assert sum(one.area for one in parts) == pytest.approx(whole.area, rel=1e-9)
    assert unary_union(parts).symmetric_difference(whole).area <= 1e-9 * whole.area


@given(stars(), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_a_face_in_space_is_cut_as_it_is_seen_along_its_normal(points, slope_x, slope_y):
    heights = points @ (slope_x, slope_y)
    np.testing.assert_array_equal(
        np.sort(np.sort(triangles_of(np.column_stack([points, heights])), axis=1), axis=0).shape,
        (len(points) - 2, 3),
    )
    made = triangles_of(np.column_stack([points, heights]))
    parts = [Polygon(points[list(one)]) for one in made]
    assert sum(one.area for one in parts) == pytest.approx(Polygon(points).area, rel=1e-6)


def test_a_pit_stays_open_in_a_face_that_runs_around_it():
    # a frame with a bridge: outer square, then the inner one backwards
    frame = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
    parts = [Polygon(np.array(frame, float)[list(one)]) for one in triangles_of(frame)]
    assert sum(one.area for one in parts) == pytest.approx(16 - 4)
    assert unary_union(parts).intersection(Polygon([(1, 1), (3, 1), (3, 3), (1, 3)])).area == pytest.approx(0, abs=1e-9)
