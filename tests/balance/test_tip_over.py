"""The energy stability margin against turning the rover over by brute force."""

import itertools

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tip_over import tip_over
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from tests.balance.peers import random_stance

MASS, GRAVITY = 850.0, 9.81


def brute_force(contacts, com):
    """Least rise over the edges of shapely's hull, each turned outward in small steps and then in finer ones."""
    hull = shapely.get_coordinates(shapely.MultiPoint(contacts[:, :2]).convex_hull.normalize())[::-1]
    corners = [int(np.argmin(np.abs(contacts[:, :2] - corner).sum(axis=1))) for corner in hull]
    rises = {}
    for a, b in itertools.pairwise(corners):
        axis = (contacts[b] - contacts[a]) / np.linalg.norm(contacts[b] - contacts[a])
        arm = com - contacts[a]

        def height(angles, axis=axis, arm=arm):
            return Rotation.from_rotvec(np.outer(angles, axis)).apply(arm)[:, 2]

        angles = np.linspace(-np.pi, np.pi, 721)
        for _ in range(4):
            best = angles[np.argmax(height(angles))]
            angles = best + np.linspace(-2, 2, 81) * (angles[1] - angles[0])
        rises[frozenset((a, b))] = float(height(angles).max() - arm[2])
    return rises


def test_it_is_the_least_rise_over_the_edges_of_the_hull(rng):
    compared = 0
    for _ in range(60):
        contacts, _ = random_stance(rng)
        contacts[:, 2] += 0.3 * rng.normal() * contacts[:, 0]  # a slope
        com = np.append(contacts[:, :2].mean(axis=0) + 0.3 * rng.normal(size=2), 0.3 * rng.normal())
        found = tip_over(contacts, com, MASS, GRAVITY)
        if found.reason:
            assert found.energy == 0
            continue
        rises = brute_force(contacts, com)
        assert found.rise == pytest.approx(min(rises.values()), abs=1e-6)
        assert found.energy == pytest.approx(MASS * GRAVITY * found.rise)
        assert found.feet is not None
        assert rises[frozenset(found.feet)] == pytest.approx(found.rise, abs=1e-6)
        assert found.edge is not None
        assert np.array_equal(found.edge, contacts[list(found.feet)])
        compared += 1
    assert compared > 30


def test_a_square_by_hand():
    square = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], float)
    found = tip_over(square, [0, 0, 1], MASS, GRAVITY)
    assert found.rise == pytest.approx(np.sqrt(2) - 1)
    nearer = tip_over(square, [0.5, 0, 1], MASS, GRAVITY)
    assert nearer.rise == pytest.approx(np.sqrt(1.25) - 1)
    assert set(nearer.feet or ()) == {0, 3}


def test_on_a_slope_the_downhill_edge_binds_and_takes_less():
    square = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], float)
    com, energies = np.array([0, 0, 1.0]), []
    for slope in np.radians([0, 10, 20, 30, 40, 44]):
        R = BalanceSettings(slope=slope, uphill=0.0).R_level_site
        found = tip_over(square @ R.T, R @ com, MASS, GRAVITY)
        energies.append(found.energy)
        if slope:
            assert set(found.feet or ()) == {1, 2}
    assert (np.diff(energies) < 0).all()
    # the centre of mass is above the downhill edge at 45°
    R = BalanceSettings(slope=np.radians(46), uphill=0.0).R_level_site
    over = tip_over(square @ R.T, R @ com, MASS, GRAVITY)
    assert over.energy == 0
    assert set(over.feet or ()) == {1, 2}
    assert "not above" in over.reason


def test_it_moves_with_the_stance_and_scales_with_size_mass_and_gravity(rng):
    for _ in range(20):
        contacts, _ = random_stance(rng, feet=5)
        com = np.append(contacts[:, :2].mean(axis=0), 0.2)
        R, shift, scale = rotation("z", rng.uniform(-3, 3)), 30 * rng.normal(size=3), rng.uniform(0.3, 3)
        before = tip_over(contacts, com, MASS, GRAVITY)
        after = tip_over(scale * contacts @ R.T + shift, scale * R @ com + shift, 2 * MASS, 1.62)
        assert after.rise == pytest.approx(scale * before.rise, abs=1e-9)
        assert after.energy == pytest.approx(2 * scale * before.energy * 1.62 / GRAVITY, rel=1e-6)
        # a lower centre of mass takes more energy
        lower = tip_over(contacts, com - [0, 0, 0.3], MASS, GRAVITY)
        assert lower.energy >= before.energy


def test_without_a_polygon_it_takes_nothing_and_says_so():
    two = tip_over([[0, 0, 0], [1, 0, 0]], [0.5, 0, 1], MASS)
    assert (two.energy, two.feet) == (0.0, None)
    assert "no three span an area" in two.reason
    line = tip_over([[0, 0, 0], [1, 1, 0], [2, 2, 0]], [0.5, 0.5, 1], MASS)
    assert line.energy == 0
    assert line.reason


def test_bad_input_is_refused_by_name():
    feet = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    with pytest.raises(InvalidInput, match="centre of mass"):
        tip_over(feet, [0, np.nan, 0], MASS)
    with pytest.raises(InvalidInput, match="mass"):
        tip_over(feet, [0.2, 0.2, 1], 0.0)
    with pytest.raises(InvalidInput, match="contacts"):
        tip_over([[0, 0], [1, 0], [0, 1]], [0.2, 0.2, 1], MASS)
