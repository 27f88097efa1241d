"""A step onto the place where the wheel stands, on ground that no camera saw: up and back, to look at what it hides."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.maps.standing import contacts
from footfall.planning.answers import Status
from footfall.planning.looking.how_to_see import LIFTED, unknown_around
from footfall.planning.looking.in_view import in_view
from footfall.planning.step.problem import StepSettings
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import render_snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.generate import rock_field
from footfall.terrain.terrain_settings import TerrainSettings

SETTINGS = StepSettings(lift=LIFTED)


@pytest.fixture(scope="module")
def rocks():
    return rock_field(size=12.0, resolution=0.05, abundance=0.03, smallest=0.1, largest=0.4, seed=3)


@pytest.fixture(scope="module")
def state(athlete, rocks):
    return footfall.stand(athlete, rocks, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def seen(athlete, rocks, state):
    """The ground as images from where it stands show it, with holes at the wheels."""
    return build_terrain(athlete, render_snapshot(athlete, state, rocks, seed=1, scale=0.5), TerrainSettings())


def place_of(athlete, dem, state, leg):
    found = contacts(athlete, dem, state.posture, state.T_site_base, [leg])
    assert not found.seen[0]
    return float(found.points[0, 0]), float(found.points[0, 1])


@pytest.mark.parametrize("leg", range(6))
def test_the_leg_goes_straight_up_and_comes_back_joint_for_joint(athlete, seen, state, leg):
    result = footfall.plan_step(athlete, seen, state, leg, place_of(athlete, seen, state, leg), settings=SETTINGS)
    plan = result.plan
    assert plan is not None, result.reason
    assert all(check.holds for check in result.checks)
    np.testing.assert_array_equal(plan.waypoints, plan.waypoints[::-1])
    np.testing.assert_array_equal(plan.waypoints[0], state.posture)
    middle = len(plan.phases) // 2
    assert plan.phases == ("lift",) * (middle + 1) + ("lower",) * middle
    wheels = np.array([apply(state.T_site_base, wheel_centers(athlete, q)) for q in plan.waypoints])
    away = wheels - wheels[0]
    np.testing.assert_array_equal(np.delete(away, leg, axis=1), 0.0)
    np.testing.assert_allclose(away[:, leg, :2], 0.0, atol=1e-3)
    assert away[middle, leg, 2] == pytest.approx(LIFTED, abs=1e-3)
    # lifted it shows at least half of what is not known around its wheel
    hidden = unknown_around(seen, wheels[0, leg, :2], athlete.wheel_radius)
    assert len(hidden) > 10
    assert in_view(athlete, seen, state, hidden).mean() < 0.2
    assert in_view(athlete, seen, replace(state, posture=plan.waypoints[middle]), hidden).mean() > 0.5


def test_it_becomes_commands_that_keep_every_rule(athlete, seen, state):
    result = footfall.plan_step(athlete, seen, state, 2, place_of(athlete, seen, state, 2), settings=SETTINGS)
    assert result.plan is not None
    sequence = footfall.make_sequence(result.plan, athlete, seen)
    assert sequence.valid, sequence.failures
    assert [one.phase for one in sequence.commands] == list(result.plan.phases[1:])
    np.testing.assert_allclose(sequence.predicted[-1], state.posture, atol=1e-9)


def test_ground_beside_it_is_as_unknown_as_before(athlete, seen, state):
    x, y = place_of(athlete, seen, state, 2)
    beside = footfall.plan_step(athlete, seen, state, 2, (x + 0.03, y), settings=SETTINGS)
    assert beside.status is Status.UNKNOWN_GROUND
    assert "as in a step onto its own place" in beside.reason
    way = footfall.plan_step(athlete, seen, state, 2, (x, y), settings=SETTINGS, through=[(x, y, 1.0)])
    assert way.status is Status.UNKNOWN_GROUND


def test_a_wheel_that_bears_nothing_has_nothing_to_come_back_to(athlete, seen, state):
    forces = np.tile((0.0, 0.0, 2000.0), (6, 1))
    forces[2] = 0.0
    x, y = place_of(athlete, seen, state, 2)
    hangs = footfall.plan_step(athlete, seen, replace(state, wheel_forces=forces), 2, (x, y), settings=SETTINGS)
    assert hangs.status is Status.UNKNOWN_GROUND
    forces[2] = 1500.0
    bears = footfall.plan_step(athlete, seen, replace(state, wheel_forces=forces), 2, (x, y), settings=SETTINGS)
    assert bears.plan is not None, bears.reason


def test_what_forbids_to_lift_the_leg_forbids_it_here_too(athlete, seen, state):
    x, y = place_of(athlete, seen, state, 2)
    refused = footfall.plan_step(athlete, seen, state, 2, (x, y), settings=replace(SETTINGS, least_margin=1.5))
    assert refused.plan is None
    assert refused.status is not Status.UNKNOWN_GROUND
    assert "balance" in refused.reason or "margin" in refused.reason
