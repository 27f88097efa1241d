"""Support polygons against shapely, linear programs and the laws they must obey."""

import itertools

import numba
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from footfall.balance.foot_pairs import MOST_FEET, NONE, feet_of
from footfall.balance.support import (
    bindings_for_candidates,
    conservative_polygon,
    half_planes,
    margin,
    margins,
    margins_for_candidates,
    support_margin,
    support_polygon,
)
from footfall.balance.support_kernel import margin_of_feet
from footfall.core.errors import InvalidInput

HEXAGON = 2.3 * np.stack([np.cos(np.pi / 3 * np.arange(6)), np.sin(np.pi / 3 * np.arange(6))], axis=1)
coordinates = st.integers(-60, 60).map(lambda n: n / 20)
stances = st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=7).map(np.array)
points = st.tuples(coordinates, coordinates).map(np.array)


def random_stances(rng, count=200):
    for _ in range(count):
        feet = rng.integers(3, 8)
        yield rng.normal(size=(feet, 2)) * rng.uniform(0.1, 3.0) + rng.uniform(-50, 50, 2)


def survivors(feet):
    """The intersection of the hulls of all feet but one, by shapely."""
    region = shapely.MultiPoint(feet).convex_hull
    for lost in range(len(feet)):
        region = region.intersection(shapely.MultiPoint(np.delete(feet, lost, axis=0)).convex_hull)
    return region


def hausdorff(corners, region):
    """Largest distance between the corners of two convex regions."""
    ours, theirs = shapely.MultiPoint(corners), shapely.MultiPoint(shapely.get_coordinates(region))
    return shapely.hausdorff_distance(ours.convex_hull, theirs.convex_hull)


def test_support_polygon_is_the_hull_of_shapely(rng):
    for feet in random_stances(rng):
        assert hausdorff(support_polygon(feet), shapely.MultiPoint(feet).convex_hull) <= 1e-9


def test_conservative_polygon_is_the_intersection_of_the_hulls_without_one_foot(rng):
    compared = 0
    for feet in random_stances(rng, 400):
        region = survivors(feet)
        corners = conservative_polygon(feet)
        # four feet leave a point, where GEOS may return an area
        if region.area > 1e-6 and len(feet) > 4:
            compared += 1
            assert hausdorff(corners, region) <= 1e-9
    assert compared > 150


def test_margin_is_the_signed_distance_to_shapely_s_boundary_inside_and_no_more_outside(rng):
    inside = outside = 0
    for feet in random_stances(rng, 300):
        for conservative, region in ((False, shapely.MultiPoint(feet).convex_hull), (True, survivors(feet))):
            if region.area < 1e-6:
                continue
            for com in feet.mean(axis=0) + rng.normal(size=(5, 2)):
                distance = shapely.Point(com).distance(region.boundary)
                value = margin(feet, com, conservative)
                if region.contains(shapely.Point(com)):
                    inside += 1
                    assert value == pytest.approx(distance, abs=1e-9)
                else:
                    outside += 1
                    assert -distance - 1e-9 <= value <= 1e-9
    assert min(inside, outside) > 100


def farthest(feet, com, direction, conservative, most=None):
    """How far the centre of mass can go along a direction, staying a mix of the feet whichever is lost (LP)."""
    groups = list(itertools.combinations(range(len(feet)), len(feet) - int(conservative)))
    rows, bounds = [], []
    width = sum(map(len, groups)) + 1
    at = 1
    for group in groups:
        for axis in range(2):
            row = np.zeros(width)
            row[0] = -direction[axis]
            row[at : at + len(group)] = feet[list(group), axis] - com[axis]
            rows.append(row)
            bounds.append(0.0)
        row = np.zeros(width)
        row[at : at + len(group)] = 1.0
        rows.append(row)
        bounds.append(1.0)
        at += len(group)
    limits = [(0, most)] + [(0, None)] * (width - 1)
    answer = linprog(-np.eye(width)[0], A_eq=np.array(rows), b_eq=bounds, bounds=limits, method="highs")
    return -answer.fun if answer.status == 0 else None


def test_margin_agrees_with_linear_programs(rng):
    compared = outside = 0
    for feet in random_stances(rng, 40):
        for conservative in (False, True):
            normals, offsets = half_planes(feet, conservative)
            com = feet.mean(axis=0) + 0.1 * rng.normal(size=2)
            value = margin(feet, com, conservative)
            if value < -1e-3:
                outside += 1
                assert farthest(feet, com, np.zeros(2), conservative, most=1.0) is None
            if value < 1e-3:
                continue
            nearest = normals[np.argmin(offsets - normals @ com)]
            assert farthest(feet, com, nearest, conservative) == pytest.approx(value, abs=1e-8)
            for direction in rng.normal(size=(3, 2)):
                direction /= np.hypot(*direction)
                reached = farthest(feet, com, direction, conservative)
                assert reached is not None
                assert reached >= value - 1e-8
            compared += 1
    assert min(compared, outside) > 10


@given(stances, points, st.booleans())
def test_candidates_get_the_margin_of_the_whole_stance(feet, com, conservative):
    expected = margin(feet, com, conservative)
    found = margins_for_candidates(feet[:-1], feet[-1:], com, conservative)[0]
    assert found == pytest.approx(expected, abs=1e-9)


def test_candidates_agree_on_random_stances(rng):
    for conservative in (False, True):
        for k in (2, 3, 4, 5):
            fixed = rng.normal(size=(k, 2)) + 7.0
            moved = rng.normal(size=(60, 2)) + 7.0
            coms = rng.normal(size=(60, 2)) * 0.3 + 7.0
            found = margins_for_candidates(fixed, moved, coms, conservative)
            expected = [margin(np.vstack([fixed, m]), c, conservative) for m, c in zip(moved, coms, strict=True)]
            assert np.allclose(found, expected, atol=1e-12)


@given(stances, points, st.booleans())
def test_a_compiled_loop_gets_the_same_margin(feet, com, conservative):
    # sixteenths, which no sum with a power of two rounds
    feet, com = np.round(16 * feet) / 16, np.round(16 * com) / 16
    for away in (0.0, 2.0**30):
        x, y = np.ascontiguousarray(feet.T + away)
        found = margin_of_feet(x, y, com[0] + away, com[1] + away, int(conservative))
        assert found == pytest.approx(margin(feet, com, conservative), abs=1e-9)


def test_a_compiled_loop_is_told_what_has_no_margin():
    x, y = np.ascontiguousarray(HEXAGON.T)
    assert margin_of_feet(x, y, 0.0, 0.0, 1) > 0
    for few in (0, 1, 2):
        assert margin_of_feet(x[:few], y[:few], 0.0, 0.0, 0) == -np.inf
    assert margin_of_feet(x[:3], y[:3], 0.0, 0.0, 1) == -np.inf
    for bad in (np.nan, np.inf):
        assert np.isnan(margin_of_feet(x, y, bad, 0.0, 0))
        for foot in range(6):
            broken = x.copy()
            broken[foot] = bad
            assert np.isnan(margin_of_feet(broken, y, 0.0, 0.0, 0))
            assert np.isnan(margin_of_feet(x, broken, 0.0, 0.0, 1))


def test_the_feet_that_bind_carry_the_edge_nearest_to_the_centre_of_mass(rng):
    named = set()
    for feet in random_stances(rng, 200):
        com = feet.mean(axis=0) + 0.5 * rng.normal(size=2)
        for conservative in (False, True):
            found = support_margin(feet, com, conservative)
            assert found.margin == margin(feet, com, conservative)
            if found.feet is None:
                assert len(feet) < 4
                assert "needs 4" in found.reason
                continue
            assert found.edge is not None
            assert np.array_equal(found.edge, feet[list(found.feet)])
            start, end = found.edge
            along = (end - start) / np.hypot(*(end - start))
            assert along[0] * (com - start)[1] - along[1] * (com - start)[0] == pytest.approx(found.margin, abs=1e-9)
            if conservative and found.margin > 0:
                # the loss that is named leaves exactly this margin, every other loss leaves no less
                left = [margin(np.delete(feet, lost, axis=0), com) for lost in range(len(feet))]
                assert found.lost is not None
                assert left[found.lost] == pytest.approx(found.margin, abs=1e-9)
                assert min(left) == pytest.approx(found.margin, abs=1e-9)
                named.add(found.lost)
            elif not conservative:
                assert found.lost is None
    assert len(named) > 3


def test_candidates_are_told_the_same_binding_feet(rng):
    for conservative in (False, True):
        for k in (3, 4, 5, 8):
            fixed = rng.normal(size=(k, 2)) + 7.0
            moved, coms = rng.normal(size=(80, 2)) + 7.0, rng.normal(size=(80, 2)) * 0.3 + 7.0
            found = bindings_for_candidates(fixed, moved, coms, conservative)
            assert np.array_equal(found.margins, margins_for_candidates(fixed, moved, coms, conservative))
            start, end = feet_of(found.pairs)
            for i, (candidate, com) in enumerate(zip(moved, coms, strict=True)):
                one = support_margin(np.vstack([fixed, candidate]), com, conservative)
                assert (None if found.pairs[i] == NONE else (start[i], end[i])) == one.feet
                assert (None if found.lost[i] == NONE else found.lost[i]) == one.lost


def test_candidates_are_the_same_bytes_on_one_thread_and_on_two(rng):
    fixed, moved = rng.normal(size=(5, 2)), rng.normal(size=(5000, 2))
    every = [bindings_for_candidates(fixed, moved, np.zeros(2), True)]
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        every.append(bindings_for_candidates(fixed, moved, np.zeros(2), True))
    finally:
        numba.set_num_threads(before)
    for first, second in zip(*every, strict=True):
        assert first.tobytes() == second.tobytes()


@given(stances, points, st.permutations(range(7)))
def test_margin_does_not_depend_on_the_order_of_the_feet(feet, com, order):
    shuffled = feet[[i for i in order if i < len(feet)]]
    for conservative in (False, True):
        assert margin(shuffled, com, conservative) == pytest.approx(margin(feet, com, conservative), abs=1e-9)


@given(stances, points)
def test_the_conservative_margin_is_never_larger_and_more_feet_never_hurt(feet, com):
    assert margin(feet, com, True) <= margin(feet, com) + 1e-9
    for conservative in (False, True):
        fewer, more = margin(feet[:-1], com, conservative), margin(feet, com, conservative)
        if fewer >= 0:
            assert more >= fewer - 1e-9


@given(stances, points, st.floats(-3, 3), st.tuples(st.floats(-100, 100), st.floats(-100, 100)))
def test_margin_moves_with_the_stance(feet, com, angle, shift):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if abs(margin(feet, com)) < 1e-6 or np.linalg.matrix_rank(feet - feet[0], 1e-9) < 2:
        return
    for conservative in (False, True):
        expected = margin(feet, com, conservative)
        found = margin(feet @ turn.T + shift, turn @ com + shift, conservative)
        # three feet on one line may fall to either side of it by rounding; the polygon stays
        assert found == pytest.approx(expected, abs=1e-8) or expected <= 0


def test_the_hexagon():
    apothem = 2.3 * np.cos(np.pi / 6)
    assert margin(HEXAGON, [0, 0]) == pytest.approx(apothem, abs=1e-12)
    # the loss of one leg leaves the diagonal between its neighbours
    assert margin(HEXAGON, [0, 0], conservative=True) == pytest.approx(1.15, abs=1e-12)
    assert len(conservative_polygon(HEXAGON)) == 6
    assert margin(HEXAGON, [2.3, 0]) == pytest.approx(0, abs=1e-12)
    assert margin(HEXAGON, [5.0, 0]) < -2


def test_four_feet_leave_a_point_three_leave_nothing():
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
    assert conservative_polygon(square) == pytest.approx(np.zeros((1, 2)), abs=1e-9)
    assert margin(square, [0, 0], conservative=True) == pytest.approx(0, abs=1e-12)
    assert margin(square, [0.1, 0], conservative=True) < 0
    assert margin(square, [0, 0]) == pytest.approx(1)
    assert "no area" in support_margin(square, [0, 0], conservative=True).reason
    assert support_margin(square, [0, 0]).reason == ""
    assert conservative_polygon(square[:3]).shape == (0, 2)
    assert margin(square[:3], [0.0, 0.0], conservative=True) == -np.inf
    triangle_with_one_inside = np.array([[0, 2], [-2, -1], [2, -1], [0.1, 0.2]])
    assert conservative_polygon(triangle_with_one_inside) == pytest.approx(np.array([[0.1, 0.2]]), abs=1e-9)


@pytest.mark.parametrize("conservative", [False, True])
@pytest.mark.parametrize(
    "feet",
    [
        np.zeros((0, 2)),
        np.zeros((1, 2)),
        np.zeros((5, 2)),
        np.array([[0, 0], [1, 0]]),
        np.array([[0, 0], [1, 1], [2, 2], [3, 3], [7, 7]]),
        np.array([[0, 0], [0, 0], [0.3, 0.1], [0.3, 0.1], [0.3, 0.1]]),
        np.stack([np.linspace(0, 1, 5), 0.1 + np.linspace(0, 1, 5) / 3], axis=1),
    ],
)
def test_no_polygon_means_a_margin_of_minus_infinity(feet, conservative):
    assert margin(feet, [0.0, 0.0], conservative) == -np.inf
    assert len(support_polygon(feet)) < 3
    assert len(conservative_polygon(feet)) == 0
    told = support_margin(feet, [0.0, 0.0], conservative)
    assert told.margin == -np.inf
    assert told.feet is None
    assert told.reason
    if len(feet) > 1:
        assert bindings_for_candidates(feet[:-1], feet[-1:], np.zeros(2), conservative).pairs[0] == NONE
        assert margins_for_candidates(feet[:-1], feet[-1:], np.zeros(2), conservative)[0] == -np.inf


def test_two_feet_in_one_place_carry_each_other():
    feet = np.array([[0, 0], [0, 0], [1, 0], [0, 1.0]])
    assert conservative_polygon(feet) == pytest.approx(np.zeros((1, 2)), abs=1e-9)
    doubled = np.repeat(np.array([[0, 0], [4, 0], [0, 3.0]]), 2, axis=0)
    assert margin(doubled, [1, 1], conservative=True) == pytest.approx(margin(doubled, [1, 1]))


def test_heights_are_ignored_and_many_centres_agree_with_one(rng):
    feet = rng.normal(size=(6, 3))
    coms = rng.normal(size=(20, 2))
    for conservative in (False, True):
        found = margins(feet, coms, conservative)
        assert found == pytest.approx([margin(feet[:, :2], com, conservative) for com in coms])


def test_bad_input_is_refused_by_name(rng):
    with pytest.raises(InvalidInput, match="contacts"):
        margin(np.array([[0, 0], [1, np.nan], [0, 1]]), [0, 0])
    with pytest.raises(InvalidInput, match="centre of mass"):
        margin(HEXAGON, [0, 0, 0])
    with pytest.raises(InvalidInput, match="centres of mass"):
        margins(HEXAGON, [[np.inf, 0]])
    with pytest.raises(InvalidInput, match="candidates"):
        margins_for_candidates(HEXAGON[:5], np.zeros(2), np.zeros(2))
    with pytest.raises(InvalidInput, match="finite x and y"):
        support_margin(HEXAGON, [np.nan, 0])
    with pytest.raises(InvalidInput, match=f"at most {MOST_FEET} feet"):
        margins_for_candidates(rng.normal(size=(MOST_FEET, 2)), np.zeros((3, 2)), np.zeros(2))
    with pytest.raises(InvalidInput, match="com_xy"):
        margins_for_candidates(HEXAGON[:5], np.zeros((3, 2)), np.zeros((2, 2)))


def test_an_unknown_candidate_has_an_unknown_margin():
    moved = np.array([[2.0, 0.1], [np.nan, 0], [np.inf, 1]])
    found = bindings_for_candidates(HEXAGON[1:], moved, np.zeros(2))
    assert np.isnan(found.margins).tolist() == [False, True, True]
    assert found.pairs[1:].tolist() == [NONE, NONE]
