"""The equilibrium region against HiGHS, and the laws that it must obey."""

import numpy as np
import pytest
import shapely

from footfall.balance.balance_settings import SIDES_ALLOWED
from footfall.balance.region import (
    TOLERANCE,
    equilibrium_region,
    region_margin,
    region_margins,
    regions_without_each,
    surviving_margin,
)
from footfall.balance.region_kernel import MOST_FORCE
from footfall.balance.support import margin
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from tests.balance.peers import farthest, is_held, random_stance

UP = np.array([0.0, 0.0, 1.0])


def test_no_disagreement_with_linear_programs_beyond_a_millimetre_of_the_boundary(rng):
    answers = []
    for _ in range(200):
        contacts, normals = random_stance(rng)
        friction, sides = rng.uniform(0.2, 1.0), int(rng.choice(SIDES_ALLOWED))
        region = equilibrium_region(contacts, normals, friction, sides)
        middle = contacts[:, :2].mean(axis=0)
        for com in middle + np.array([[0, 0], [1, 1], [-1, 1], [-1, -1], [1, -1]]) * rng.uniform(0.2, 1.6, 2):
            found = region_margin(region, com)
            if abs(found.margin) > 1e-3:
                assert found.held == is_held(contacts, normals, com, friction, sides)
                answers.append(found.held)
    assert len(answers) > 900
    assert 0.15 < np.mean(answers) < 0.85


def test_both_polygons_are_within_the_gap_of_the_farthest_points_of_highs(rng):
    for _ in range(25):
        contacts, normals = random_stance(rng, feet=int(rng.integers(4, 7)))
        for tolerance in (TOLERANCE, 1e-2):
            region = equilibrium_region(contacts, normals, 0.7, 8, tolerance)
            assert region.gap <= tolerance
            if len(region.corners) == 0:
                assert farthest(contacts, normals, [1.0, 0.0], 0.7) is None
                continue
            for angle in rng.uniform(-np.pi, np.pi, 4):
                direction = np.array([np.cos(angle), np.sin(angle)])
                exact = farthest(contacts, normals, direction, 0.7)
                inner = (region.corners @ direction).max()
                assert exact is not None
                assert inner <= exact + 1e-8
                assert exact <= inner + tolerance + 1e-8
            # no outer line cuts anything off
            for normal, offset in list(zip(region.normals, region.offsets, strict=True))[::5]:
                assert farthest(contacts, normals, normal, 0.7) == pytest.approx(offset, abs=1e-7)


def test_answers_come_from_the_inner_polygon_only_inside_and_from_the_outer_only_outside(rng):
    contacts, normals = random_stance(rng, feet=6)
    coarse = equilibrium_region(contacts, normals, 0.5, 16, tolerance=0.05)
    fine = equilibrium_region(contacts, normals, 0.5, 16)
    assert coarse.gap > 1e-3
    undecided = 0
    for com in rng.uniform(-2.5, 2.5, (4000, 2)):
        found, true = region_margin(coarse, com), region_margin(fine, com)
        assert found.margin <= true.most + 1e-9
        assert found.most >= true.margin - 1e-9
        if found.held is None:
            undecided += 1
        elif true.held is not None:
            assert found.held == true.held
    assert 0 < undecided < 400


def test_the_margin_is_shapely_s_distance_to_the_inner_polygon(rng):
    for _ in range(30):
        contacts, normals = random_stance(rng, feet=5)
        region = equilibrium_region(contacts, normals, 0.8)
        if len(region.corners) < 3:
            continue
        polygon = shapely.Polygon(region.corners)
        coms = contacts[:, :2].mean(axis=0) + rng.normal(size=(20, 2))
        found = region_margins(region, coms)
        for com, value in zip(coms, found, strict=True):
            point = shapely.Point(com)
            sign = 1.0 if polygon.contains(point) else -1.0
            assert value == pytest.approx(sign * polygon.boundary.distance(point), abs=1e-9)
            one = region_margin(region, com)
            assert one.margin == value
            assert one.edge is not None
            assert shapely.LineString(one.edge).distance(point) == pytest.approx(abs(value), abs=1e-9)


def test_on_level_ground_it_is_the_hull_of_the_feet(rng):
    for _ in range(30):
        contacts, _ = random_stance(rng)
        contacts[:, 2] = 0.3
        normals = np.tile(UP, (len(contacts), 1))
        for conservative in (False, True):
            for com in rng.normal(size=(5, 2)):
                if conservative:
                    found = surviving_margin(regions_without_each(contacts, normals, 0.4), com).margin
                else:
                    found = region_margin(equilibrium_region(contacts, normals, 0.4), com).margin
                expected = margin(contacts, com, conservative)
                if found > 0:
                    assert found == pytest.approx(expected, abs=1e-5)
                elif len(contacts) > 3 or not conservative:
                    # outside, the polygon's margin is the distance to a line, which is never the larger one
                    assert found <= expected + 1e-5


def test_more_feet_more_friction_and_more_sides_never_shrink_it(rng):
    compared = 0
    for _ in range(60):
        contacts, normals = random_stance(rng, feet=5)
        base = equilibrium_region(contacts[:4], normals[:4], 0.5, 4)
        wider = (
            equilibrium_region(contacts, normals, 0.5, 4),
            equilibrium_region(contacts[:4], normals[:4], 0.7, 4),
            equilibrium_region(contacts[:4], normals[:4], 0.5, 8),
        )
        for other in (*wider, equilibrium_region(contacts[:4], normals[:4], 0.5, 16)):
            for corner in base.corners:
                assert region_margin(other, corner).most >= -1e-9
                compared += 1
    assert compared > 400


def test_what_survives_a_loss_lies_inside_the_whole_and_names_the_leg(rng):
    named = set()
    for _ in range(40):
        contacts, normals = random_stance(rng, feet=int(rng.integers(4, 7)))
        region, rests = equilibrium_region(contacts, normals), regions_without_each(contacts, normals)
        assert [rest.feet for rest in rests] == [
            tuple(foot for foot in range(len(contacts)) if foot != lost) for lost in range(len(contacts))
        ]
        for com in contacts[:, :2].mean(axis=0) + 0.4 * rng.normal(size=(5, 2)):
            found = surviving_margin(rests, com)
            assert found.margin <= region_margin(region, com).most + 1e-9
            assert found.lost is not None
            assert found.lost not in found.carrying
            rest = [foot for foot in range(len(contacts)) if foot != found.lost]
            alone = equilibrium_region(contacts[rest], normals[rest])
            assert region_margin(alone, com).margin == found.margin
            named.add(found.lost)
    assert len(named) > 3


def test_tipping_is_told_by_the_two_feet_that_carry_all():
    contacts = np.array([[2, 0, 0], [1, 2, 0], [-1, 2, 0], [-2, 0, 0], [-1, -2, 0], [1, -2, 0]], float)
    region = equilibrium_region(contacts, np.tile(UP, (6, 1)))
    assert region_margin(region, [0, 1.9]).carrying == (1, 2)
    assert region_margin(region, [-1.4, 0.9]).carrying == (2, 3)
    # on level ground the loads are the lever rule
    assert region.loads.sum(axis=1) == pytest.approx(np.ones(len(region.corners)))
    assert region.loads @ contacts[:, :2] == pytest.approx(region.corners)


def test_where_friction_gives_way_more_feet_carry():
    contacts = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], float)
    # every foot on a slope that falls outward, barely held
    tilted = np.column_stack([0.35 * contacts[:, :2], np.ones(4)])
    region = equilibrium_region(contacts, tilted, 0.3)
    assert len(region.corners) > 2
    found = region_margin(region, [0.0, 0.0])
    assert found.margin < 0.9
    assert len(found.carrying) > 2


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_it_moves_with_the_stance_by_quarter_turns_and_grows_with_it(rng, turns):
    """Quarter turns take the pyramids along exactly; see the next test for any turn."""
    R = rotation("z", 0.5 * np.pi * turns)
    for _ in range(20):
        contacts, normals = random_stance(rng)
        com, shift, scale = 0.5 * rng.normal(size=2), 40 * rng.normal(size=3), rng.uniform(0.2, 5.0)
        before = region_margin(equilibrium_region(contacts, normals, 0.6), com)
        moved = equilibrium_region(scale * contacts @ R.T + shift, normals @ R.T, 0.6, tolerance=scale * TOLERANCE)
        after = region_margin(moved, scale * R[:2, :2] @ com + shift[:2])
        assert after.most == pytest.approx(scale * before.most, abs=3 * scale * TOLERANCE) or before.margin == -np.inf
        assert after.margin == pytest.approx(scale * before.margin, abs=3 * scale * TOLERANCE)


def test_under_any_turn_a_cone_inside_the_pyramid_stays_inside(rng):
    """A pyramid of s sides holds the cone of friction · cos(π / s), whichever way it is turned."""
    for _ in range(20):
        contacts, normals = random_stance(rng, feet=5)
        R = rotation("z", rng.uniform(-np.pi, np.pi))
        whole = equilibrium_region(contacts, normals, 0.6, 8)
        less = equilibrium_region(contacts @ R.T, normals @ R.T, 0.6 * np.cos(np.pi / 8), 8)
        for corner in less.corners:
            assert region_margin(whole, R[:2, :2].T @ corner).most >= -1e-9


def test_opposite_walls_are_bounded_by_the_largest_force():
    walls = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], float)
    toward = np.column_stack([-walls[:, :2] * np.sin(1.3), np.full(4, np.cos(1.3))])
    region = equilibrium_region(walls, toward, 0.6)
    assert np.isfinite(region.corners).all()
    for angle in (0.0, 0.4, 2.0):
        direction = np.array([np.cos(angle), np.sin(angle)])
        exact = farthest(walls, toward, direction, 0.6, most_force=MOST_FORCE)
        assert (region.corners @ direction).max() == pytest.approx(exact, abs=2 * TOLERANCE)
    # without the bound there would be no end to it
    assert farthest(walls, toward, [1.0, 0.0], 0.6) is None


def test_the_same_stance_gives_the_same_bytes(rng):
    contacts, normals = random_stance(rng)
    first, second = equilibrium_region(contacts, normals), equilibrium_region(contacts, normals)
    for name in ("corners", "loads", "normals", "offsets"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_few_or_coincident_feet_leave_no_area_and_say_so():
    one = equilibrium_region([[1, 2, 0.0]], [UP])
    assert one.corners == pytest.approx(np.array([[1, 2.0]]))
    assert "1 feet" in one.reason
    assert region_margin(one, [1, 2]).held
    away = region_margin(one, [1, 5])
    assert away.margin == pytest.approx(-3)
    assert away.held is False
    two = equilibrium_region([[0, 0, 0], [2, 0, 0.0]], [UP, UP])
    assert region_margin(two, [1, 1]).margin == pytest.approx(-1)
    assert region_margin(two, [3, 0]).margin == pytest.approx(-1)
    assert region_margin(two, [1, 0]).margin == pytest.approx(0, abs=1e-9)
    assert "2 feet" in two.reason
    same = equilibrium_region(np.ones((4, 3)), np.tile(UP, (4, 1)))
    assert len(same.corners) == 1
    assert same.reason
    none = region_margin(equilibrium_region(np.zeros((0, 3)), np.zeros((0, 3))), [0, 0])
    assert none.margin == -np.inf
    assert none.reason == "no foot stands"
    assert surviving_margin((), [0, 0]).reason == "no foot stands"
    assert surviving_margin(regions_without_each([[1, 2, 0.0]], [UP]), [1, 2]).reason == "no foot stands"


def test_ground_too_steep_holds_nothing_anywhere_and_says_so():
    contacts = np.array([[1, 0, 0], [-1, 1, 0], [-1, -1, 0.0]])
    region = equilibrium_region(contacts, np.tile([np.sin(0.4), 0, np.cos(0.4)], (3, 1)), 0.3)
    assert len(region.corners) == 0
    found = region_margin(region, [0, 0])
    assert found.margin == -np.inf
    assert found.held is False
    assert "too steep" in found.reason
    assert region_margins(region, [[0, 0], [1, 1]]).tolist() == [-np.inf, -np.inf]


def test_bad_input_is_refused_by_name():
    contacts, up = np.eye(3), np.tile(UP, (3, 1))
    with pytest.raises(InvalidInput, match="contacts"):
        equilibrium_region(contacts * np.nan, up)
    with pytest.raises(InvalidInput, match="one normal"):
        equilibrium_region(contacts, up[:2])
    with pytest.raises(InvalidInput, match="normal of contact 1 must point up"):
        equilibrium_region(contacts, [UP, -UP, UP])
    with pytest.raises(InvalidInput, match="can't be zero"):
        equilibrium_region(contacts, up * 0)
    with pytest.raises(InvalidInput, match="friction"):
        equilibrium_region(contacts, up, friction=0.0)
    with pytest.raises(InvalidInput, match="4, 8, 16 sides"):
        equilibrium_region(contacts, up, sides=6)
    with pytest.raises(InvalidInput, match="tolerance"):
        regions_without_each(contacts, up, tolerance=0.0)
    region = equilibrium_region(contacts, up)
    with pytest.raises(InvalidInput, match="finite x and y"):
        region_margin(region, [np.nan, 0])
    with pytest.raises(InvalidInput, match="n × 2"):
        region_margins(region, [0.0, 0.0])
    assert np.isnan(region_margins(region, [[np.nan, 0.0]])).all()
