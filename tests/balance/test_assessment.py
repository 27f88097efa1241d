"""All margins of a standing rover at once: legs by number, tilted sites, payloads."""

import numpy as np
import pytest

from footfall.balance.assessment import assess, from_level, level
from footfall.balance.region import equilibrium_region, region_margin
from footfall.balance.settings import BalanceSettings
from footfall.balance.support import margin
from footfall.balance.torques import contact_points
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.robot.kinematics import center_of_mass

POSE = transform(rotation_rpy(0.0, 0.0, 0.4), [3.0, -2.0, 1.6])
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def stand(athlete):
    posture = athlete.posture("stand")
    return posture, contact_points(athlete, posture, POSE, range(6), np.tile(UP, (6, 1)))


def test_on_level_ground_all_measures_agree(athlete, stand):
    posture, contacts = stand
    found = assess(athlete, posture, POSE, range(6), contacts, np.tile(UP, (6, 1)), BalanceSettings())
    com = apply(POSE, center_of_mass(athlete, posture))
    assert found.com == pytest.approx(com)
    assert found.mass == athlete.mass
    assert found.plain.margin == pytest.approx(margin(contacts, com[:2]))
    assert found.conservative.margin == pytest.approx(margin(contacts, com[:2], conservative=True))
    assert found.region.margin == pytest.approx(found.plain.margin, abs=1e-4)
    assert found.surviving.margin == pytest.approx(found.conservative.margin, abs=1e-4)
    assert found.region.held
    assert found.tipping.energy > 0


def test_feet_are_named_by_leg(athlete, stand):
    posture, contacts = stand
    legs = [5, 3, 2, 1]
    # over the line between legs 5 and 1: leg 0 is in the air
    heavy = BalanceSettings(payload_mass=300.0, payload_position=np.array([1.0, 0.0, 0.3]))
    found = assess(athlete, posture, POSE, legs, contacts[legs], np.tile(UP, (4, 1)), heavy)
    assert set(found.plain.feet or ()) == {1, 5}
    assert set(found.region.carrying) == {1, 5}
    assert set(found.tipping.feet or ()) == {1, 5}
    assert found.surviving.lost in legs
    assert found.conservative.lost in legs
    assert "no area" in found.conservative.reason
    assert (
        found.plain.margin
        < assess(athlete, posture, POSE, legs, contacts[legs], np.tile(UP, (4, 1)), BalanceSettings()).plain.margin
    )


def test_a_tilted_site_is_a_tilted_rover(athlete, stand):
    posture, contacts = stand
    settings = BalanceSettings(slope=np.radians(10), uphill=1.0)
    found = assess(athlete, posture, POSE, range(6), contacts, np.tile(UP, (6, 1)), settings)
    T = transform(settings.R_level_site) @ POSE
    turned = assess(
        athlete,
        posture,
        T,
        range(6),
        level(contacts, settings),
        np.tile(level(UP, settings), (6, 1)),
        BalanceSettings(),
    )
    for name in ("plain", "conservative", "region", "surviving"):
        assert getattr(found, name).margin == pytest.approx(getattr(turned, name).margin, abs=1e-9)
    assert found.tipping.energy == pytest.approx(turned.tipping.energy)
    flat = assess(athlete, posture, POSE, range(6), contacts, np.tile(UP, (6, 1)), BalanceSettings())
    assert found.plain.margin < flat.plain.margin
    assert found.tipping.energy < flat.tipping.energy


def test_the_centre_of_mass_moves_downhill_in_the_site(athlete, stand):
    """Drawn back onto the site the region is where it was; the centre of mass moved by its height · tan(slope)."""
    posture, contacts = stand
    settings = BalanceSettings(slope=0.1, uphill=0.0)
    ground = float(contacts[:, 2].mean())
    points = level(contacts, settings)
    region = equilibrium_region(points, np.tile(level(UP, settings), (6, 1)))
    corners = from_level(region.corners, ground, settings)
    assert corners[:, 2] == pytest.approx(np.full(len(corners), ground))
    assert level(corners, settings)[:, :2] == pytest.approx(region.corners)
    com = apply(POSE, center_of_mass(athlete, posture))
    below = from_level(level(com, settings)[None, :2], ground, settings)[0]
    assert below == pytest.approx(com + np.array([-(com[2] - ground) * np.tan(0.1), 0, ground - com[2]]))
    # on even ground that does not slip the region, drawn on it, is the hull of the feet
    assert margin(corners, below[:2]) == pytest.approx(margin(contacts, below[:2]), abs=1e-4)
    assert region_margin(region, level(com, settings)[:2]).held


def test_too_few_feet_are_answered_with_the_reason(athlete, stand):
    posture, contacts = stand
    two = assess(athlete, posture, POSE, [0, 3], contacts[[0, 3]], np.tile(UP, (2, 1)), BalanceSettings())
    assert two.plain.margin == -np.inf
    assert "needs 3" in two.plain.reason
    assert "needs 4" in two.conservative.reason
    assert two.region.margin <= 0
    assert "2 feet" in two.region.reason
    assert two.surviving.margin < 0
    assert two.surviving.reason
    assert two.tipping.energy == 0
    assert two.tipping.reason
    none = assess(athlete, posture, POSE, [], np.zeros((0, 3)), np.zeros((0, 3)), BalanceSettings())
    assert none.region.reason == "no foot stands"


def test_bad_input_is_refused_by_name(athlete, stand):
    posture, contacts = stand
    up, usual = np.tile(UP, (6, 1)), BalanceSettings()
    with pytest.raises(InvalidInput, match="finite joint angles"):
        assess(athlete, posture * np.nan, POSE, range(6), contacts, up, usual)
    with pytest.raises(InvalidInput, match="T_site_base"):
        assess(athlete, posture, POSE * np.nan, range(6), contacts, up, usual)
    with pytest.raises(InvalidInput, match="contacts need"):
        assess(athlete, posture, POSE, range(6), contacts * np.nan, up, usual)
    with pytest.raises(InvalidInput, match="only once"):
        assess(athlete, posture, POSE, [0, 0, 1], contacts[:3], up[:3], usual)
    with pytest.raises(InvalidInput, match="one contact"):
        assess(athlete, posture, POSE, [0, 1], contacts[:3], up[:3], usual)
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        assess(athlete, posture, POSE, [0, 1, 7], contacts[:3], up[:3], usual)
    with pytest.raises(InvalidInput, match="three numbers"):
        assess(athlete, posture, POSE, [0, 1, 2], contacts[:3, :2], up[:3], usual)
    with pytest.raises(InvalidInput, match="must point up"):
        assess(athlete, posture, POSE, range(6), contacts, -up, usual)
