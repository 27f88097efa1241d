"""Forces that are tried and refusals that are proven, by least squares of numpy and programs of HiGHS."""

import numpy as np
import pytest

from footfall.balance.refusal_kernel import refused
from footfall.balance.trial_forces_kernel import approach_bounds, inside_cones, smallest_forces, spread_of
from tests.balance.peers import balance_rows, is_held, random_stance

WEIGHT = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def stances(rng, count):
    """Contacts from a centre of mass that is over the feet or beyond them, and normals up to steep ones."""
    for _ in range(count):
        contacts, normals = random_stance(rng, tilt=rng.choice([0.1, 0.3, 0.6]))
        com = np.append(contacts[:, :2].mean(axis=0) + rng.uniform(0, 1.2) * rng.normal(size=2), rng.uniform(-0.5, 0.5))
        yield np.ascontiguousarray(contacts - com), normals


def within(unit, friction, forces, spare=0.0):
    along = (unit * forces).sum(axis=1)
    return bool((np.linalg.norm(forces - along[:, None] * unit, axis=1) <= friction * along + spare).all())


def test_the_smallest_forces_are_those_of_least_squares(rng):
    spread = np.empty((4, 3))
    for arms, _ in stances(rng, 200):
        forces = np.empty_like(arms)
        assert spread_of(arms, spread)
        smallest_forces(arms, spread, forces)
        assert forces.ravel() == pytest.approx(np.linalg.pinv(balance_rows(arms)) @ WEIGHT, abs=1e-9)


def test_feet_on_a_line_have_no_spread(rng):
    along = rng.normal(size=3)
    for feet in (1, 2, 3, 6):
        arms = np.array([1.0, -2.0, 0.5]) + rng.normal(size=(feet, 1)) * along
        assert not spread_of(arms, np.empty((4, 3)))
        arms[0] += [0.0, 0.0, 0.3]
        assert spread_of(arms, np.empty((4, 3))) == (feet > 2)


def approached(arms, unit, friction, effect, constant, most, rounds=100):
    spread, forces, past = np.empty((4, 3)), np.empty_like(arms), np.empty_like(arms)
    spread_of(arms, spread)
    smallest_forces(arms, spread, forces)
    found = approach_bounds(arms, unit, spread, friction, effect, constant, most, rounds, forces, past)
    return found, forces


def test_what_is_approached_balances_and_keeps_its_bounds(rng):
    """And where HiGHS says that there is room, it is mostly found."""
    none = np.zeros((0, 6, 3)), np.zeros((0, 6))
    found_cones = found_all = roomy = missed = moved = 0
    for arms, unit in stances(rng, 400):
        friction = rng.uniform(0.3, 1.0)
        found, forces = approached(arms, unit, friction, *none, 0.0)
        assert balance_rows(arms) @ forces.ravel() == pytest.approx(WEIGHT, abs=1e-9)
        if found:
            assert within(unit, friction, forces)
            assert inside_cones(unit, friction, forces)
            found_cones += 1
            moved += not approached(arms, unit, friction, *none, 0.0, 1)[0]
        # the pyramid of less friction lies deep inside the cone
        elif is_held(arms, unit, [0.0, 0.0], 0.8 * friction, 16):
            missed += 1
        roomy += is_held(arms, unit, [0.0, 0.0], 0.8 * friction, 16)
        effect, constant = rng.normal(size=(len(arms), 6, 3)), 0.1 * rng.normal(size=(len(arms), 6))
        most = rng.uniform(0.3, 1.2)
        found, forces = approached(arms, unit, friction, effect, constant, most)
        if found:
            ratios = constant + (effect @ forces[:, :, None])[:, :, 0]
            assert np.abs(ratios).max() <= most
            assert within(unit, friction, forces)
            found_all += 1
        assert balance_rows(arms) @ forces.ravel() == pytest.approx(WEIGHT, abs=1e-9)
    assert moved > 20
    assert found_all > 20
    assert found_cones > 100
    assert missed < 0.1 * roomy


def test_nothing_is_refused_that_any_forces_hold(rng):
    """Pyramids inside the cones never hold what is refused; what wide pyramids around them don't hold mostly is."""
    refusals = hopeless = missed = 0
    for arms, unit in stances(rng, 600):
        friction = rng.uniform(0.05, 0.6)
        no = refused(arms, unit, friction)
        if no:
            assert not is_held(arms, unit, [0.0, 0.0], friction, 16)
            refusals += 1
        if not is_held(arms, unit, [0.0, 0.0], 1.1 * friction, 16):
            hopeless += 1
            missed += not no
    assert 150 < refusals < 500
    assert missed < 0.03 * hopeless


def test_a_slope_is_refused_from_the_friction_angle_on():
    """The boundary itself, from both sides, in every direction and with feet alike."""
    angle = np.pi / 3 * np.arange(6)
    arms = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), np.full(6, -0.01)])
    for uphill in np.linspace(0, 2 * np.pi, 13):
        for friction in (0.2, 0.6, 1.2):
            for factor, no in ((1.05, True), (0.99, False)):
                steep = factor * friction
                normal = np.array([-steep * np.cos(uphill), -steep * np.sin(uphill), 1.0])
                unit = np.tile(normal / np.linalg.norm(normal), (6, 1))
                assert refused(arms, unit, friction) == no
