"""Cameras seldom see the ground under a wheel: filled at its height, that does not tell how high the ground is."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.planning.answers import Status
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.terrain.generate import plane

LEG = 2


@pytest.fixture(scope="module")
def flat():
    return plane(size=10.0, resolution=0.05)


@pytest.fixture(scope="module")
def rest(athlete, flat):
    stood = footfall.stand(athlete, flat)
    return CompliantRover(athlete, flat).let_down(stood.posture, stood.T_site_base)


def near_wheels(flat, rest, legs, radius):
    """Cells that nobody saw, (rows, cols)."""
    grid = flat.geometry
    xs, ys = grid.x0 + grid.resolution * np.arange(grid.cols), grid.y0 + grid.resolution * np.arange(grid.rows)
    return np.any([np.hypot(xs - x, ys[:, None] - y) < radius for x, y, _ in rest.contacts[legs]], axis=0)


def test_only_wheels_on_ground_that_was_seen_tell_how_high_it_is(athlete, flat, rest):
    higher = replace(rest, raised=np.array([0.02, 0.02, 0.001, 0.02, 0.003, 0.02]))
    assert CompliantRover(athlete, flat).found_higher(higher) == pytest.approx(0.02)
    partly = CompliantRover(athlete, flat, unseen=near_wheels(flat, rest, [0, 1, 3, 5], 0.1))
    assert partly.found_higher(higher) == pytest.approx(0.002)
    nowhere = CompliantRover(athlete, flat, unseen=np.ones(flat.geometry.shape, bool))
    assert nowhere.found_higher(higher) == 0.0


def test_a_wheel_comes_down_on_the_map_though_no_ground_was_seen_under_the_others(athlete, flat, rest):
    holes = near_wheels(flat, rest, list(athlete.legs), 0.2)
    seen = replace(flat, heights=np.where(holes, np.float32(np.nan), flat.heights))
    state = CompliantRover(athlete, flat).state(rest)
    x, y, _ = rest.contacts[LEG]
    plan = footfall.plan_step(athlete, seen, state, LEG, (float(x) + 0.5, float(y) - 0.05))
    assert plan.plan is not None, plan.reason
    ends = []
    for dem in (flat, seen):
        found = footfall.plan_execution(athlete, dem, state, plan.plan, commanded=rest.commanded)
        assert found.status is Status.FOUND, found.reason
        ends.append(found.execution)
    # pressed wheels are 2 cm in the ground that they are made to stand on: that is no height of the map
    assert ends[1].touch_down[2] == pytest.approx(0.0, abs=0.002)
    assert np.abs(ends[1].loads[-1] - ends[0].loads[-1]).max() < 40.0
