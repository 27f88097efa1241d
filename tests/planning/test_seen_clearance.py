"""The clearance that telemetry shows, how sure it is, and what an execution predicts for the same set points."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.body.stand import stand
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import UNEXPLAINED
from footfall.planning.execution.seen_clearance import (
    NORMAL_95,
    ON_THE_WAY,
    along,
    clearance_of,
    seen_clearance,
)
from footfall.robot.kinematics import wheel_centers
from footfall.terrain.generate import plane
from tests.support.chassis_ground import wavy

LEG = 2


@pytest.fixture(scope="module")
def ground():
    return plane(size=10.0, resolution=0.1)


@pytest.fixture(scope="module")
def lifted(athlete, ground):
    """(state, standing): a rover that sags on level ground, with a leg in the air."""
    rover = CompliantRover(athlete, ground)
    stood = stand(athlete, ground)
    rest = rover.let_down(stood.posture, stood.T_site_base)
    up = rest.commanded.copy()
    up[6 * LEG + 1] -= 0.25
    rest = rover.after(rest, up)
    assert rest.settled
    state = rover.state(rest)
    standing = [leg for leg in athlete.legs if rest.touching[leg]]
    assert standing == [leg for leg in athlete.legs if leg != LEG]
    return state, standing


def seen(robot, dem, state, leg, standing):
    found = seen_clearance(robot, dem, state, leg, standing)
    assert found is not None
    return found


def test_over_level_ground_it_is_the_height_of_the_lowest_point(athlete, ground, lifted):
    state, standing = lifted
    hub = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    found = seen(athlete, ground, state, LEG, standing)
    assert found.clearance == pytest.approx(hub[2] - athlete.wheel_radius, abs=1e-6)
    assert found.clearance == clearance_of(athlete, ground, state.posture, state.T_site_base, LEG)
    assert 0.01 < found.clearance < 0.2


def test_the_share_of_the_joints_is_what_noise_on_them_does(athlete, ground, lifted, rng):
    state, standing = lifted
    told = seen(athlete, ground, state, LEG, standing)
    noise = np.zeros((4000, len(state.posture)))
    noise[:, 6 * LEG : 6 * LEG + 6] = UNEXPLAINED * rng.standard_normal((4000, 6))
    heights = [apply(state.T_site_base, wheel_centers(athlete, state.posture + one)[LEG])[2] for one in noise]
    assert told.joints == pytest.approx(np.std(heights), rel=0.05)


def test_wheels_that_stand_tell_of_the_pose(athlete, ground, lifted):
    state, standing = lifted
    right = seen(athlete, ground, state, LEG, standing)
    # its wheels are pressed in just as their springs say
    assert right.pose is not None
    assert right.pose < 1e-3
    raised = state.T_site_base.copy()
    raised[2, 3] += 0.04
    wrong = seen(athlete, ground, replace(state, T_site_base=raised), LEG, standing)
    assert wrong.clearance == pytest.approx(right.clearance + 0.04)
    assert wrong.pose == pytest.approx(0.04, abs=1e-3)
    assert wrong.uncertainty > 0.04 * NORMAL_95
    # as far off as it may be, it is within what is told
    assert abs(wrong.clearance - right.clearance) <= wrong.uncertainty
    # wheels over ground that nobody saw say nothing, nor do two alone
    hubs = apply(state.T_site_base, wheel_centers(athlete, state.posture))
    heights = ground.heights.copy()
    X, Y = np.meshgrid(ground.geometry.xs, ground.geometry.ys)
    for one in standing[:3]:
        heights[np.hypot(X - hubs[one, 0], Y - hubs[one, 1]) < 0.15] = np.nan
    hidden = seen(athlete, replace(ground, heights=heights), state, LEG, standing)
    assert hidden.pose is None
    assert hidden.whole
    assert hidden.clearance == right.clearance
    assert seen(athlete, ground, state, LEG, standing[:2]).pose is None


def test_the_map_adds_its_variance(athlete, ground, lifted):
    state, standing = lifted
    none = seen(athlete, ground, state, LEG, standing)
    assert none.ground is None
    hub = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    grid = ground.geometry
    unsure = np.full(ground.heights.shape, 1e-6, np.float32)
    X, Y = np.meshgrid(grid.xs, grid.ys)
    near = np.hypot(X - hub[0], Y - hub[1]) < 2 * grid.resolution
    unsure[near] = 0.03**2
    told = seen(athlete, replace(ground, variance=unsure), state, LEG, standing)
    assert told.ground == pytest.approx(0.03, rel=1e-5)
    assert told.sigma**2 == pytest.approx(none.sigma**2 + 0.03**2, rel=1e-5)
    elsewhere = np.where(near, np.float32(1e-6), np.float32(0.03**2))
    told = seen(athlete, replace(ground, variance=elsewhere), state, LEG, standing).ground
    assert told is not None
    assert told < 0.002


def test_over_unknown_ground_nothing_is_seen(athlete, lifted):
    state, standing = lifted
    hub = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    partly = seen(athlete, wavy(hole=(hub[0], hub[1], 0.12)), state, LEG, standing)
    assert not partly.whole
    assert partly.ground is None
    hole = wavy(hole=(hub[0], hub[1], 0.6))
    assert seen_clearance(athlete, hole, state, LEG, standing) is None
    assert clearance_of(athlete, hole, state.posture, state.T_site_base, LEG) is None


def test_a_place_on_the_way_is_found_and_one_beside_it_is_not(rng):
    way = np.cumsum(rng.uniform(-0.3, 0.3, (6, 12)), axis=0)
    for at, share in ((0, 0.0), (2, 0.25), (4, 0.9)):
        found = along(way, way[at] + share * (way[at + 1] - way[at]))
        assert found == (at, pytest.approx(share, abs=1e-9))
    assert along(way, way[-1]) == (4, pytest.approx(1.0))
    aside = way[3].copy()
    aside[5] += 40 * ON_THE_WAY
    assert along(way, aside) is None
    # a pause, twice the same set points
    assert along(np.array([way[0], way[0]]), way[0]) == (0, 0.0)
    with pytest.raises(InvalidInput, match="two waypoints or more"):
        along(way, way[0, :6])
