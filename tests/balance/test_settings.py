"""What balance is judged by: clear refusals, the direction of gravity, and the payload."""

import numpy as np
import pytest

from footfall.balance.balance_settings import GRAVITIES, PAYLOAD_LIMIT, BalanceSettings, gravity_named
from footfall.balance.payload import loaded
from footfall.core.errors import InvalidInput, NotFound
from footfall.io.artifacts import decode, encode
from footfall.robot.description import with_payload
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"friction": 0.0}, "friction must be above zero"),
        ({"friction": -0.3}, "friction must be above zero"),
        ({"friction": float("nan")}, "friction must be above zero"),
        ({"friction": float("inf")}, "friction must be above zero"),
        ({"sides": 6}, "4, 8, 16 sides"),
        ({"gravity": 0.0}, "gravity"),
        ({"gravity": float("nan")}, "gravity"),
        ({"slope": -0.1}, "slope"),
        ({"slope": np.pi / 2}, "slope"),
        ({"slope": float("nan")}, "slope"),
        ({"uphill": float("inf")}, "uphill"),
        ({"payload_mass": PAYLOAD_LIMIT + 1}, "between 0 and 300 kg"),
        ({"payload_mass": -1.0}, "between 0 and 300 kg"),
        ({"payload_mass": float("nan")}, "between 0 and 300 kg"),
        ({"payload_mass": 1.0, "payload_position": np.array([0.0, np.nan, 0.0])}, "three finite numbers"),
        ({"payload_mass": 1.0, "payload_position": np.zeros(2)}, "three finite numbers"),
        ({"payload_position": np.zeros(3)}, "needs a payload_mass"),
    ],
)
def test_each_refusal_says_what_is_wrong(fields, told):
    with pytest.raises(InvalidInput, match=told):
        BalanceSettings(**fields)


def test_named_gravities():
    assert dict(GRAVITIES) == {"earth": 9.81, "moon": 1.62, "mars": 3.71}
    assert BalanceSettings(gravity=gravity_named("mars")).gravity == 3.71
    with pytest.raises(NotFound, match="earth, moon, mars"):
        gravity_named("venus")


def test_settings_go_through_a_file():
    settings = BalanceSettings(slope=0.2, payload_mass=20.0, payload_position=np.array([0.1, 0, 0.4]), sides=16)
    assert decode(encode(settings)).digest == settings.digest
    assert settings.digest != BalanceSettings().digest


@pytest.mark.parametrize("uphill", [-2.0, 0.0, 0.7, 3.0])
def test_the_site_rises_uphill(uphill):
    R = BalanceSettings(slope=0.17, uphill=uphill).R_level_site
    assert pytest.approx(np.eye(3)) == R @ R.T
    assert np.linalg.det(R) == pytest.approx(1)
    along = np.array([np.cos(uphill), np.sin(uphill), 0.0])
    across = np.array([-np.sin(uphill), np.cos(uphill), 0.0])
    assert (R @ along)[2] == pytest.approx(np.sin(0.17))
    assert R @ across == pytest.approx(across)
    # the ground's normal leans downhill
    assert (R @ [0, 0, 1])[:2] == pytest.approx(-np.sin(0.17) * along[:2])
    assert np.array_equal(BalanceSettings(uphill=uphill).R_level_site, np.eye(3))


def test_points_and_directions_are_levelled_alike(rng):
    settings, points = BalanceSettings(slope=0.17, uphill=0.7), rng.normal(size=(4, 5, 3))
    found = settings.level(points)
    assert found[2, 3] == pytest.approx(settings.R_level_site @ points[2, 3])
    assert settings.level(points[2, 3]) == pytest.approx(found[2, 3])
    # what points against gravity is the level z, and lengths stay
    assert settings.level(settings.R_level_site[2]) == pytest.approx([0, 0, 1])
    assert np.linalg.norm(found, axis=-1) == pytest.approx(np.linalg.norm(points, axis=-1))
    with pytest.raises(InvalidInput, match="three numbers"):
        settings.level(points[..., :2])


def test_the_payload_of_the_settings_stands_in_for_the_robot_s(athlete):
    posture = athlete.posture("stand")
    bare = center_of_mass(athlete, posture)
    place = np.array([0.2, -0.1, 0.5])
    carrying = Robot(with_payload(athlete.description, 120.0, position=place))
    expected = center_of_mass(carrying, posture)

    mass, com = loaded(athlete, bare, BalanceSettings(payload_mass=120.0, payload_position=place))
    assert mass == pytest.approx(carrying.mass)
    assert com == pytest.approx(expected)
    # its own payload, moved or taken away
    mass, com = loaded(carrying, expected, BalanceSettings(payload_mass=120.0))
    assert (mass, *com) == pytest.approx((carrying.mass, *expected))
    mass, com = loaded(carrying, np.tile(expected, (4, 1)), BalanceSettings(payload_mass=0.0))
    assert mass == pytest.approx(athlete.mass)
    assert com == pytest.approx(np.tile(bare, (4, 1)))
    assert loaded(carrying, expected, BalanceSettings()) == (carrying.mass, expected)
    # without a place of its own it stands on the deck
    mass, com = loaded(athlete, bare, BalanceSettings(payload_mass=50.0))
    assert com == pytest.approx((athlete.mass * bare + 50.0 * np.array([0, 0, 0.3])) / (athlete.mass + 50.0))
