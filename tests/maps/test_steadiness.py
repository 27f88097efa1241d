"""What the wheels hold, and by how much: against a linear program of its own, and laws."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import footfall
from footfall.balance.balance_settings import BalanceSettings
from footfall.maps.standing import contacts
from footfall.maps.support_outlines import TOLERANCE, bearing, support_of
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane

MU = 0.25
"""Less than the slope under most wheels: they hold only by pushing against one another."""


@pytest.fixture(scope="module")
def ground():
    """A hill beside the rover: every wheel stands on a slope of its own."""
    x = np.arange(-4.0, 4.01, 0.05)
    X, Y = np.meshgrid(x, x)
    heights = -0.06 * ((X - 0.8) ** 2 + (Y - 0.3) ** 2)
    return from_heights(heights.astype(np.float32), 0.05, -4.0, -4.0, "hill")


@pytest.fixture(scope="module")
def level_ground():
    return plane(size=8.0, resolution=0.1)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return footfall.stand(athlete, ground)


def held(points, normals, com, mu, sides=64):
    """Whether forces inside cones with many sides balance a unit weight at com (2,): every force for itself."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rays, moments = [], []
    for point, normal in zip(points, normals, strict=True):
        across = np.cross(normal, [1.0, 0.0, 0.0])
        across /= np.linalg.norm(across)
        along = np.cross(normal, across)
        for a in angle:
            ray = normal + mu * (np.cos(a) * across + np.sin(a) * along)
            rays.append(ray)
            moments.append(np.cross(point - [*com, 0.0], ray))
    answer = linprog(
        np.zeros(len(rays)),
        A_eq=np.vstack([np.transpose(rays), np.transpose(moments)]),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        bounds=(0, None),
    )
    return answer.status == 0


@pytest.mark.parametrize("legs", [(0, 1, 2, 3, 4, 5), (0, 1, 3, 4, 5), (0, 2, 4)])
def test_the_region_is_where_a_program_with_round_cones_finds_forces(athlete, ground, stood, legs, rng):
    support = support_of(athlete, ground, stood.posture, stood.T_site_base, legs, BalanceSettings(friction=MU))
    feet = contacts(athlete, ground, stood.posture, stood.T_site_base, legs)
    assert support.assumed == ()
    coms = stood.T_site_base[:2, 3] + rng.uniform(-2.6, 2.6, (60, 2))
    margins = support.margins(coms)["friction"]
    inside = np.array([held(feet.points, feet.normals, com, MU) for com in coms])
    # the pyramids of eight sides lie inside the cones: what is said to hold holds, and little is given away
    assert inside[margins >= 0].all()
    assert not inside[margins < -0.2].any()
    assert 5 < (margins >= 0).sum() < 55
    # on this slope it is less than the hull of the feet; three feet have no choice
    assert len(legs) == 3 or (~inside & (support.margins(coms)["plain"] > 0.05)).any()


def test_the_less_friction_the_smaller(athlete, ground, stood, rng):
    arguments = athlete, ground, stood.posture, stood.T_site_base, (0, 1, 3, 4, 5)
    coms = stood.T_site_base[:2, 3] + rng.uniform(-2.6, 2.6, (60, 2))
    little, more = (
        support_of(*arguments, BalanceSettings(friction=mu)).margins(coms)["friction"] for mu in (0.25, 0.6)
    )
    assert (little <= more + TOLERANCE).all()
    assert (little < more - 0.1).any()


def test_a_slope_that_is_too_steep_holds_nothing_and_says_so(athlete):
    x = np.tile(np.arange(-4.0, 4.05, 0.1), (81, 1))
    slope = from_heights((0.2 * x).astype(np.float32), 0.1, -4.0, -4.0, "slope")
    stood = footfall.stand(athlete, slope)
    support = support_of(athlete, slope, stood.posture, stood.T_site_base, athlete.legs, BalanceSettings(friction=0.15))
    margins = support.margins(stood.T_site_base[None, :2, 3])
    assert margins["friction"][0] == -np.inf
    assert "no forces inside friction 0.15" in support.why["friction"]
    assert margins["plain"][0] > 1.0


@settings(max_examples=25, deadline=None, derandomize=True)
@given(legs=st.sets(st.integers(0, 5)), x=st.floats(-3, 3), y=st.floats(-3, 3))
def test_outlines_lie_inside_one_another(athlete, ground, stood, legs, x, y):
    support = support_of(athlete, ground, stood.posture, stood.T_site_base, sorted(legs))
    found = {name: one[0] for name, one in support.margins([(x, y)]).items()}
    assert found["conservative"] <= found["plain"] + 1e-9
    for name, least in (("plain", 3), ("conservative", 5)):
        assert (name in support.why) == (len(legs) < least)


def test_on_level_ground_friction_gives_the_hull(athlete, level_ground):
    stood = footfall.stand(athlete, level_ground)
    support = support_of(athlete, level_ground, stood.posture, stood.T_site_base, athlete.legs)
    coms = stood.T_site_base[:2, 3] + np.array([(0.0, 0.0), (0.8, 0.4), (-1.2, 0.9), (2.0, 0.2)])
    found = support.margins(coms)
    inside = found["plain"] > 0
    assert inside.any()
    assert np.abs(found["friction"] - found["plain"])[inside].max() <= 2 * TOLERANCE


def test_without_ground_nothing_is_known_of_friction(athlete, ground, stood):
    support = support_of(athlete, None, stood.posture, stood.T_site_base, athlete.legs)
    found = support.margins(stood.T_site_base[None, :2, 3])
    assert np.isnan(found["friction"]).all()
    assert support.why == {"friction": "there is no terrain: the slope under the wheels is not known"}
    assert found["plain"][0] > 1.0
    hidden = np.array(ground.heights)
    hidden[:] = np.nan
    hidden[0, 0] = 0.0
    unseen = support_of(athlete, replace(ground, heights=hidden), stood.posture, stood.T_site_base, athlete.legs)
    assert unseen.why == {"friction": "ground under the wheels not seen, taken as level"}


def test_a_wheel_without_load_bears_nothing(athlete, stood):
    forces = np.tile([0.0, 0.0, 1400.0], (6, 1))
    forces[2] = 0.0
    assert bearing(athlete, replace(stood, wheel_forces=forces)) == [0, 1, 3, 4, 5]
