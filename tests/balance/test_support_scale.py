"""Support polygons at every scale: what counts as one line and as one place is a share of the stance's size.

Each law is asked of the polygon, and of the compiled loop over candidates.
"""

import numpy as np
import pytest

from footfall.balance.foot_pairs import NONE, feet_of
from footfall.balance.support import (
    bindings_for_candidates,
    conservative_polygon,
    edges,
    margin,
    margins_for_candidates,
    support_margin,
    support_polygon,
)
from footfall.balance.support_kernel import COINCIDENT, candidate_margins, margin_of_feet

SCALES = (1e-3, 1.0, 1e3)
DIRECTIONS = np.arange(0.05, np.pi, 0.39)
"""Angles [rad]; x = y, along which |x − y| does not grow, is nearly one of them."""
SQUARE = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
PENTAGON = np.array([[0.1, 1], [-1, 0.4], [-0.6, -1], [0.7, -0.9], [1, 0.3]])
TWICE = np.repeat(np.array([[0, 0], [4, 0], [0, 3.0]]), 2, axis=0)
"""Two feet at each corner of a triangle: any one may be lost."""
PAIRED = np.array([[0, 0], [0, 0], [2, 0], [2, 0], [1, 1.0]])
"""The loss of the last leaves a segment."""


def size_of(feet):
    return np.ptp(feet, axis=0).max()


def asked_both_ways(feet, com, conservative):
    """Margins of a stance from its edges, and from the compiled loop with its last foot as the candidate."""
    return margin(feet, com, conservative), margins_for_candidates(feet[:-1], feet[-1:], com, conservative)[0]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(("feet", "left"), [(SQUARE, 1), (PENTAGON, 5), (TWICE, 3), (PAIRED, 2)])
def test_a_stance_and_what_survives_any_loss_grow_with_the_scale(feet, left, scale):
    small, large = conservative_polygon(feet), conservative_polygon(scale * feet)
    assert len(small) == len(large) == left
    assert large / scale == pytest.approx(small, abs=1e-8)
    com = feet.mean(axis=0) + np.array([0.03, 0.05])
    for conservative in (False, True):
        one, other = edges(feet, conservative), edges(scale * feet, conservative)
        for a, b in zip(one[2:], other[2:], strict=True):
            assert np.array_equal(a, b)
        assert other.normals == pytest.approx(one.normals, abs=1e-12)
        assert other.offsets / scale == pytest.approx(one.offsets, abs=1e-12)
        for found in asked_both_ways(scale * feet, scale * com, conservative):
            assert found / scale == pytest.approx(margin(feet, com, conservative), abs=1e-12)
    told = support_margin(scale * feet, scale * com, True)
    assert bool(told.reason) == (left < 3)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("angle", DIRECTIONS)
def test_feet_are_on_one_line_by_a_share_of_the_size(scale, angle):
    along, across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    straight = scale * np.array([-1.0, -0.4, 0.1, 0.5, 0.8])[:, None] * along
    for share, spans in ((0.1, False), (10.0, True)):
        bent = straight.copy()
        bent[2] += share * COINCIDENT * size_of(straight) * across
        for conservative in (False, True):
            assert (len(edges(bent, conservative).offsets) > 0) == spans
            for found in asked_both_ways(bent, straight[2], conservative):
                assert np.isfinite(found) == spans
            for last in range(5):
                # whichever foot is the candidate
                turned = np.roll(bent, last, axis=0)
                told = bindings_for_candidates(turned[:-1], turned[-1:], straight[2], conservative)
                assert (told.pairs[0] != NONE) == spans
        if not spans:
            assert np.array_equal(support_polygon(bent), bent[np.lexsort(bent.T[::-1])[[0, -1]]])


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("angle", DIRECTIONS)
def test_feet_are_in_one_place_by_a_share_of_the_size(scale, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    feet = scale * np.vstack([SQUARE, SQUARE[:1]]) @ turn.T
    beside, com = np.array([1.0, -1.0]) @ turn.T / np.sqrt(2), feet[0] + (1e-3 * scale)
    for share, apart in ((0.1, False), (10.0, True)):
        near = feet.copy()
        near[4] += share * COINCIDENT * size_of(feet) * beside
        pairs = {frozenset(pair) for pair in zip(*(part.tolist() for part in edges(near, True)[2:4]), strict=True)}
        assert (frozenset((0, 4)) in pairs) == apart
        # the nearest line to a centre of mass beyond the corner is the one through both, where it is one
        start, end = feet_of(bindings_for_candidates(near[:-1], near[-1:], com + 3 * scale * (turn @ (1, 1))).pairs)
        assert ({int(start[0]), int(end[0])} == {0, 4}) == apart


def test_a_foot_that_nobody_has_lost_is_minus_one():
    assert edges(PENTAGON, False).lost.tolist() == [-1] * 5
    assert set(edges(PENTAGON, True).lost) == {-1, 0, 1, 2, 3, 4}


def fitted(candidates=3):
    return [np.zeros((candidates, 2)), np.zeros(candidates), *np.zeros((2, candidates), np.uint8)]


def test_arrays_that_do_not_fit_each_other_are_refused():
    fixed, places = PENTAGON[:4], np.zeros((3, 2))
    for wrong in range(4):
        for count in (2, 4):
            coms, *found = [
                other if i == wrong else one for i, (one, other) in enumerate(zip(fitted(), fitted(count), strict=True))
            ]
            with pytest.raises(ValueError, match="don't fit"):
                candidate_margins(fixed, places, coms, 0, *found)
    for feet, refused in ((14, False), (15, True), (16, True)):
        coms, *found = fitted()
        if refused:
            with pytest.raises(ValueError, match="don't fit"):
                candidate_margins(np.zeros((feet, 2)), places, coms, 0, *found)
        else:
            candidate_margins(np.zeros((feet, 2)), places, coms, 0, *found)


@pytest.mark.parametrize("count", [0, 1, 255, 256, 257, 513])
def test_each_of_many_candidates_gets_what_it_gets_alone(rng, count):
    fixed, moved = rng.normal(size=(3, 2)), rng.normal(size=(count, 2))
    coms = 0.3 * rng.normal(size=(count, 2))
    found = bindings_for_candidates(fixed, moved, coms)
    assert len(found.margins) == len(found.pairs) == len(found.lost) == count
    for i in sorted({*range(min(count, 3)), *range(max(0, count - 3), count), *range(250, min(count, 260))}):
        alone = bindings_for_candidates(fixed, moved[i : i + 1], coms[i])
        assert found.margins[i] == pytest.approx(alone.margins[0], abs=1e-12)
        assert (found.pairs[i], found.lost[i]) == (alone.pairs[0], alone.lost[0])


def test_candidates_have_the_margin_of_their_stance_and_what_binds_it(rng):
    for conservative in (False, True):
        for feet in (3, 4, 5, 7):
            fixed, moved = rng.normal(size=(feet, 2)) + 7.0, rng.normal(size=(12, 2)) + 7.0
            coms = 0.5 * rng.normal(size=(12, 2)) + 7.0
            found = bindings_for_candidates(fixed, moved, coms, conservative)
            start, end = feet_of(found.pairs)
            for i, (place, com) in enumerate(zip(moved, coms, strict=True)):
                one = support_margin(np.vstack([fixed, place]), com, conservative)
                assert found.margins[i] == pytest.approx(one.margin, abs=1e-12)
                assert (None if found.pairs[i] == NONE else (start[i], end[i])) == one.feet
                assert (None if found.lost[i] == NONE else found.lost[i]) == one.lost
                x, y = np.vstack([fixed, place]).T.copy()
                assert margin_of_feet(x, y, com[0], com[1], int(conservative)) == pytest.approx(one.margin, abs=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_number_that_is_not_finite_makes_the_margin_unknown(bad):
    for at in range(4):
        numbers = np.array([0.5, 0.5, 0.1, 0.1])
        numbers[at] = bad
        found = bindings_for_candidates(PENTAGON[:4], numbers[None, :2], numbers[2:])
        assert np.isnan(found.margins[0])
        assert found.pairs[0] == found.lost[0] == NONE
    x, y = PENTAGON.T.copy()
    for com in ((bad, 0.0), (0.0, bad)):
        assert np.isnan(margin_of_feet(x, y, *com, 0))


def test_of_edges_that_are_equally_near_the_first_pair_is_named():
    for feet, expected in ((SQUARE, (0, 1)), (SQUARE[::-1], (1, 0))):
        found = bindings_for_candidates(feet[:-1], feet[-1:], np.zeros(2))
        assert found.margins[0] == 1.0
        assert tuple(int(foot[0]) for foot in feet_of(found.pairs)) == expected


def test_the_foot_beyond_an_edge_along_an_axis_is_named():
    feet = np.array([[0, 0], [4, 0], [4, 3], [0, 3], [2, -1.0]])
    for turned, com in ((feet, (2.0, 0.2)), (feet[:, ::-1], (0.2, 2.0))):
        found = bindings_for_candidates(turned[:-1], turned[-1:], np.array(com), True)
        assert found.margins[0] == pytest.approx(0.2, abs=1e-12)
        assert {int(foot[0]) for foot in feet_of(found.pairs)} == {0, 1}
        assert found.lost[0] == support_margin(turned, com, True).lost == 4
