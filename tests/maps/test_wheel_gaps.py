"""How high wheels are over the ground, also where no camera saw the ground under them."""

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.standing import LOWEST_PART, standing, wheel_gaps
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.terrain.dem import Dem

GRID = GridGeometry(-4.0, -4.0, 0.02, 401, 401)
LEG = 1


def ground(robot=None, state=None, hole=0.0, rock=0.0) -> Dem:
    """Level ground; unknown within ``hole`` [m] of the wheel of LEG, ``rock`` [m] high beyond, to one side."""
    heights = np.zeros(GRID.shape, np.float32)
    if robot is not None and state is not None:
        x, y, _ = contact_point(robot, state.posture, LEG, state.T_site_base)
        away = np.hypot(*(GRID.centers() - (x, y)).transpose(2, 0, 1))
        beside = (away < hole + 0.1) & (GRID.centers()[..., 0] > x)
        heights[beside] = rock
        heights[away < hole] = np.nan
    return Dem(heights, GRID, "level", Provenance({}))


@pytest.fixture(scope="module")
def state(athlete):
    return stand(athlete, ground())


def lifted(state, height: float) -> np.ndarray:
    """T_site_base with the whole rover ``height`` [m] up."""
    T = np.array(state.T_site_base)
    T[2, 3] += height
    return T


@pytest.mark.parametrize("height", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("hole", [0.0, 0.1, 0.2])
def test_a_hole_under_the_wheel_does_not_raise_it(athlete, state, height, hole):
    dem = ground(athlete, state, hole)
    gap = wheel_gaps(athlete, dem, state.posture, lifted(state, height), [LEG])[0]
    assert height - 2e-3 <= gap <= height + (LOWEST_PART if hole else 2e-3)
    assert (LEG in standing(athlete, dem, state.posture, lifted(state, height), [LEG])) == (height == 0.0)


def test_a_rock_beside_hidden_ground_does_not_bury_the_wheel(athlete, state):
    dem = ground(athlete, state, hole=0.2, rock=0.05)
    assert wheel_gaps(athlete, dem, state.posture, state.T_site_base, [LEG])[0] == 0.0
    # raised by less than the rock is high, it may still stand: nobody saw what is under it
    assert wheel_gaps(athlete, dem, state.posture, lifted(state, 0.03), [LEG])[0] == 0.0
    assert wheel_gaps(athlete, dem, state.posture, lifted(state, 0.3), [LEG])[0] == pytest.approx(0.25, abs=5e-3)


def test_where_nothing_near_is_known_nobody_can_tell(athlete, state):
    dem = ground(athlete, state, hole=0.8)
    assert np.isnan(wheel_gaps(athlete, dem, state.posture, lifted(state, 0.3), [LEG])[0])
    assert standing(athlete, dem, state.posture, lifted(state, 0.3), [LEG]) == [LEG]


def test_a_wheel_in_known_ground_is_in_it(athlete, state):
    gaps = wheel_gaps(athlete, ground(), state.posture, lifted(state, -0.07), list(athlete.legs))
    assert gaps == pytest.approx(np.full(6, -0.07), abs=2e-3)
    with pytest.raises(InvalidInput):
        wheel_gaps(athlete, ground(), np.zeros(5), state.T_site_base, [LEG])
