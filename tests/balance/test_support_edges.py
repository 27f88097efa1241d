"""Support polygons at their edges: few feet, feet on a line, what is refused, and what a refusal says."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from footfall.balance.foot_pairs import MOST_FEET
from footfall.balance.support import (
    bindings_for_candidates,
    conservative_polygon,
    edges,
    margin,
    margins,
    margins_for_candidates,
    support_margin,
    support_polygon,
)
from footfall.core.errors import InvalidInput

SQUARE = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
LINE = np.array([[0, 0], [1, 1], [2, 2], [3, 3], [7, 7]], float)
HEXAGON = np.array([[np.cos(a), np.sin(a)] for a in np.arange(6) * np.pi / 3])
FAR = np.array([500000.0, 4000000.0])
"""As sites are that count from a map's origin [m]."""


def test_feet_on_one_line_up_to_rounding_span_its_two_ends():
    along = np.linspace(0.0, 1.0, 5)
    bent = np.stack([along, 0.1 + along / 3], axis=1)
    bent[2] += (1e-16, 3e-16)
    for feet in (bent, bent[::-1], bent[[2, 0, 4, 1, 3]]):
        assert np.allclose(support_polygon(feet), bent[[0, -1]])
    upright = np.stack([np.full(5, 0.3), along], axis=1)
    assert np.allclose(support_polygon(upright), upright[[0, -1]])


def test_two_feet_and_one_are_told_as_they_are():
    assert {tuple(foot) for foot in support_polygon(LINE[:2])} == {(0.0, 0.0), (1.0, 1.0)}
    assert support_polygon(LINE[:1]).tolist() == [[0.0, 0.0]]


def test_where_there_is_no_polygon_there_are_no_edges_of_the_right_shapes():
    for feet, conservative in ((LINE, False), (SQUARE[:2], False), (SQUARE[:3], True), (LINE, True)):
        found = edges(feet, conservative)
        assert found.normals.shape == (0, 2)
        assert [part.shape for part in found[1:]] == [(0,)] * 4
    assert len(edges(SQUARE[:3], False).offsets) == 3


def test_the_reason_says_how_many_feet_are_needed_or_how_they_stand():
    com = [0.0, 0.0]
    assert support_margin(SQUARE[:2], com).reason == "2 feet: a support polygon needs 3"
    assert support_margin(SQUARE[:3], com, True).reason == "3 feet: a conservative support polygon needs 4"
    line = "the {} feet stand on one line or in one place"
    for conservative, counts in ((False, (3, 4, 5)), (True, (4, 5))):
        for count in counts:
            assert support_margin(LINE[:count], com, conservative).reason == line.format(count)
    assert support_margin(HEXAGON, com).reason == support_margin(HEXAGON, com, True).reason == ""
    # five feet of which two are in one place leave a segment
    doubled = np.array([[0, 0], [0, 0], [2, 0], [2, 0], [1, 1.0]])
    assert len(conservative_polygon(doubled)) == 2
    assert "the 5 feet has no area" in support_margin(doubled, com, True).reason


def test_what_was_found_stays_as_it_was_found():
    found = support_margin(HEXAGON, [0.0, 0.0])
    with pytest.raises(FrozenInstanceError):
        found.margin = 1.0  # pyright: ignore[reportAttributeAccessIssue]


def test_what_survives_any_loss_does_not_depend_on_where_the_site_counts_from():
    for feet in (HEXAGON, 0.3 * HEXAGON, HEXAGON * (1.0, 0.02), HEXAGON * (0.02, 1.0)):
        here, there = conservative_polygon(feet), conservative_polygon(feet + FAR) - FAR
        assert len(here) == len(there) == 6
        away = np.linalg.norm(here[:, None] - there[None], axis=2).min(axis=1)
        assert away.max() < 1e-8
        moved = feet[-1:] * 1.1
        for conservative in (False, True):
            near = margins_for_candidates(feet[:-1], moved, np.zeros(2), conservative)
            far = margins_for_candidates(feet[:-1] + FAR, moved + FAR, FAR, conservative)
            assert far == pytest.approx(near, abs=1e-8)


def test_a_candidate_beside_no_other_feet_has_no_margin():
    for fixed in (np.zeros((0, 2)), np.zeros((0, 3))):
        found = bindings_for_candidates(fixed, np.ones((4, 2)), np.zeros(2))
        assert (found.margins == -np.inf).all()


def test_one_foot_less_than_the_most_may_stay_and_more_are_refused(rng):
    most = rng.normal(size=(MOST_FEET - 1, 2))
    assert margins_for_candidates(most, np.zeros((1, 2)), np.zeros(2)).shape == (1,)
    for more in (0, 1, 2):
        with pytest.raises(InvalidInput) as caught:
            margins_for_candidates(rng.normal(size=(MOST_FEET + more, 2)), np.zeros((1, 2)), np.zeros(2))
        assert caught.value.details["feet"] == MOST_FEET + more + 1


def test_a_polygon_is_the_plain_one_unless_the_conservative_is_asked_for():
    com, last = np.array([0.2, 0.1]), HEXAGON[-1:]
    plain, kept = margin(HEXAGON, com), margin(HEXAGON, com, True)
    assert plain > kept + 0.1
    assert margins(HEXAGON, com[None])[0] == support_margin(HEXAGON, com).margin == plain
    assert support_margin(HEXAGON, com, True).margin == margins(HEXAGON, com[None], True)[0] == kept
    for found in (margins_for_candidates, lambda *args: bindings_for_candidates(*args).margins):
        assert found(HEXAGON[:-1], last, com)[0] == pytest.approx(plain, abs=1e-12)
    assert margins_for_candidates(HEXAGON[:-1], last, com, True)[0] == pytest.approx(kept, abs=1e-12)


@pytest.mark.parametrize("wrong", [np.zeros(1), np.zeros(3), np.zeros((1, 2)), np.zeros(())])
def test_a_centre_of_mass_has_two_numbers(wrong):
    for act in (margin, support_margin):
        with pytest.raises(InvalidInput, match="centre of mass") as caught:
            act(HEXAGON, wrong)
        assert caught.value.details["shape"] == list(wrong.shape)


@pytest.mark.parametrize("wrong", [np.zeros(2), np.zeros((3, 1)), np.zeros((3, 3)), np.zeros((1, 3, 2))])
def test_centres_candidates_and_feet_have_two_numbers_each(wrong):
    with pytest.raises(InvalidInput, match="centres of mass"):
        margins(HEXAGON, wrong)
    with pytest.raises(InvalidInput, match="candidates"):
        margins_for_candidates(HEXAGON[:5], wrong, np.zeros(2))
    if wrong.shape != (3, 3):
        with pytest.raises(InvalidInput, match="contacts need"):
            margin(wrong, [0.0, 0.0])
    with pytest.raises(InvalidInput, match="contacts need"):
        margin(np.zeros((3, 4)), [0.0, 0.0])
