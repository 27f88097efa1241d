"""Convex polygons against shapely as the second method."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import MultiPoint, Polygon

from footfall.core.polygon import area, clip, convex_hull

METRES = st.floats(-100, 100, allow_subnormal=False).map(lambda x: round(x, 6))
POINTS = st.lists(st.tuples(METRES, METRES), min_size=1, max_size=12)
LATTICE = st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=15)


def turns(corners):
    """Twice the area of the triangle at each corner; all positive: strictly convex and counter-clockwise."""
    a, b, c = corners, np.roll(corners, -1, axis=0), np.roll(corners, -2, axis=0)
    u, v = b - a, c - b
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


@given(POINTS | LATTICE)
def test_the_hull_is_shapelys(points):
    hull = convex_hull(points)
    want = MultiPoint(points).convex_hull
    if want.area < 1e-6:
        return
    assert Polygon(hull).symmetric_difference(want).area < 1e-9 * want.area + 1e-12
    assert area(hull) == pytest.approx(want.area, rel=1e-9)
    assert (turns(hull) > 0).all()


@given(LATTICE)
def test_corners_are_given_points_once_each_and_contain_all(points):
    hull = convex_hull(points)
    given_points = {tuple(map(float, p)) for p in points}
    corners = [tuple(p) for p in hull.tolist()]
    assert set(corners) <= given_points
    assert len(set(corners)) == len(corners)
    if len(hull) > 2:
        for a, b in zip(hull, np.roll(hull, -1, axis=0), strict=True):
            d = np.asarray(points, float) - a
            assert ((b - a)[0] * d[:, 1] - (b - a)[1] * d[:, 0] >= 0).all()


@given(POINTS, st.randoms(use_true_random=False))
def test_order_and_repetition_of_the_points_do_not_matter(points, random):
    mixed = points + points[:3]
    random.shuffle(mixed)
    np.testing.assert_array_equal(convex_hull(mixed), convex_hull(points))


def test_points_on_a_line_give_its_two_ends():
    assert convex_hull([(0, 0), (2, 2), (1, 1)]).tolist() == [[0, 0], [2, 2]]
    assert convex_hull([(3, 1), (3, 1)]).tolist() == [[3, 1]]
    assert convex_hull([]).shape == (0, 2)


def test_points_on_a_line_up_to_rounding_never_repeat_a_corner(rng):
    for _ in range(2000):
        along = rng.random(rng.integers(3, 7))
        line = rng.normal(size=2) + along[:, None] * rng.normal(size=2)
        hull = convex_hull(line)
        assert len(np.unique(hull, axis=0)) == len(hull)
        ends = line[[along.argmin(), along.argmax()]]
        assert {tuple(p) for p in ends} <= {tuple(p) for p in hull}


def test_area_has_the_sign_of_the_turning():
    square = [(0, 0), (2, 0), (2, 2), (0, 2)]
    assert area(square) == 4.0
    assert area(square[::-1]) == -4.0
    assert area(square[:2]) == area([]) == 0.0


@given(POINTS, st.floats(0, 6.3), st.floats(-100, 100))
def test_clip_is_shapelys_intersection_with_a_half_plane(points, angle, offset):
    hull = convex_hull(points)
    if len(hull) < 3 or area(hull) < 1e-6:
        return
    normal = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-normal[1], normal[0]])
    edge = normal * offset
    half_plane = Polygon(
        [edge - 1e3 * along, edge + 1e3 * along, edge + 1e3 * (along - normal), edge - 1e3 * (along + normal)]
    )
    kept = clip(hull, normal, offset)
    assert area(kept) == pytest.approx(Polygon(hull).intersection(half_plane).area, rel=1e-6, abs=1e-7)
    assert (kept @ normal <= offset + 1e-9).all()
    np.testing.assert_allclose(area(kept) + area(clip(hull, -normal, -offset)), area(hull), rtol=1e-9, atol=1e-9)


def test_clip_keeps_all_or_nothing_where_the_line_misses():
    square = np.array([(0, 0), (2, 0), (2, 2), (0, 2)], float)
    np.testing.assert_array_equal(clip(square, (1, 0), 2.0), square)
    assert clip(square, (1, 0), -0.1).shape == (0, 2)
    assert clip(np.zeros((0, 2)), (1, 0), 1.0).shape == (0, 2)
    assert area(clip(square, (1, 0), 0.5)) == 1.0
