"""The Ambler by the planner of all legged robots: it stands, is mapped, and walks by a wave of foot moves."""

import numpy as np
import pytest

from footfall.io.any_robot import load_legged
from footfall.io.robot_files import robot_toml
from footfall.maps import refusals
from footfall.planning.answers import Status
from footfall.planning.any_robot import compute_maps, plan_step, plan_walk, stand
from footfall.planning.legged.problem import LeggedSettings
from footfall.terrain.generate import plane
from tests.support.legged_recheck import Recheck, faults

UNHURRIED = LeggedSettings(time_limit=1e5)


@pytest.fixture(scope="module")
def ambler():
    return load_legged("ambler")


@pytest.fixture(scope="module")
def stood(ambler):
    dem = plane((14, 10), 0.5)
    return dem, stand(ambler, dem)


def test_a_wave_of_foot_moves_holds_when_it_is_judged_by_other_means(ambler, stood):
    dem, state = stood
    result = plan_walk(ambler, dem, state, (0.6, 0.0), UNHURRIED)
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    assert result.unchecked == ()
    assert result.plan.Ts_site_base[-1, 0, 3] == pytest.approx(0.6, abs=0.1)
    recheck = Recheck(robot_toml("ambler").with_name("ambler.urdf"), ambler, [])
    assert faults(recheck.walk(dem, result.plan, 40)) == []


def test_a_step_leads_to_green_cells_and_to_none_that_is_out_of_reach(ambler, stood):
    dem, state = stood
    stack = compute_maps(ambler, dem, state, 1, UNHURRIED)
    classes = stack.layers["refused_by"]
    green = np.argwhere(classes == refusals.NOTHING)
    assert len(green) > 4
    for cell, yes in ((green[0], True), (green[-1], True), (np.argwhere(classes == refusals.OUT_OF_RANGE)[0], False)):
        target = float(stack.geometry.xs[cell[1]]), float(stack.geometry.ys[cell[0]])
        assert (plan_step(ambler, dem, state, 1, target, UNHURRIED).status is Status.FOUND) == yes, target
