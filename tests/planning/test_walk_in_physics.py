"""A walk's executions, carried out in physics one after the other: chassis, feet and loads are where they were said."""

import numpy as np
import pytest

import footfall
from footfall.planning.answers import Status
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.walk_execution.onward import onward
from footfall.planning.walk_execution.plan import plan_walk_execution
from footfall.planning.walk_execution.unpressed import unpressed
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.of_execution import sequence_of_execution
from tests.support.chassis_ground import wavy

pytest.importorskip("mujoco")

from footfall.planning.execution.body_plan import plan_body_execution
from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import RefereeSettings
from footfall.sim.physics.walked import carry_out, longest_slip

CALM = 2.0
"""Until the rover stands still [s]."""


@pytest.fixture(scope="module")
def dem():
    return wavy()


def at_rest(robot, dem, physics=None):
    rover = PhysicalRover(robot, dem, footfall.stand(robot, dem), physics)
    rover.step(CALM)
    return rover


def test_a_move_of_the_chassis_ends_in_physics_where_it_was_predicted(athlete, dem):
    rover = at_rest(athlete, dem)
    state, commanded = rover.state(), np.array(rover.commanded)
    plan = plan_body_move(athlete, dem, state, BodyShift(dx=0.1, dy=-0.05, dz=-0.3, dyaw=0.05)).plan
    assert plan is not None
    done = plan_body_execution(athlete, dem, state, plan, None, commanded).execution
    assert done is not None
    told = sequence_of_execution(done, athlete)
    report = referee(athlete, told, dem, RefereeSettings(rover.settings), poses=told.Ts_site_base, rover=rover)
    assert report.passed, report.failures
    assert np.linalg.norm(rover.T_site_base[:3, 3] - plan.Ts_site_base[-1, :3, 3]) < 0.001
    assert np.abs(rover.posture - done.predicted[-1]).max() < 0.001
    assert np.abs(rover.wheel_forces()[0] - done.forces[-1]).max() < 20.0
    assert report.chassis.max() < 0.02


def test_a_walk_planned_to_its_end_goes_in_physics_as_predicted(athlete, dem):
    """Two foot moves from one telemetry: what the second starts from is only predicted when it is planned."""
    rover = at_rest(athlete, dem)
    state, commanded = rover.state(), np.array(rover.commanded)
    walk = footfall.plan_walk(athlete, dem, state, goal=(0.4, 0.1, 0.0), seed=1).plan
    assert walk is not None
    result = plan_walk_execution(athlete, dem, state, walk, None, commanded, 0, 2)
    assert result.status is Status.FOUND, result.reason
    assert result.execution is not None
    reports = [carry_out(rover, move) for move in result.execution.moves]
    for report in reports:
        assert not report.report.failures
        assert (report.tipped, report.contacts, report.stayed) == (False, 0, 0)
        assert report.touch < 0.005
        assert report.rest < 0.002
        assert report.load > 100.0
    assert longest_slip(reports) < 0.002
    last = result.execution.parts[-1]
    assert np.abs(rover.posture - last.predicted[-1]).max() < 0.003
    assert np.abs(rover.wheel_forces()[0] - last.forces[-1]).max() < 60.0


def test_a_walk_goes_on_where_physics_differs_from_the_description(athlete, dem):
    """Softer joints and wheels, another mass, noise: after each foot move telemetry replaces the prediction."""
    physics = PhysicsSettings(
        stiffness_scale=0.8,
        wheel_scale=0.7,
        mass_scale=1.05,
        wheel_shape="crowned",
        noise=Noise(encoder=0.001, position=0.002, orientation=0.001, force=20.0),
        seed=3,
    )
    rover = at_rest(athlete, dem, physics)
    walk = footfall.plan_walk(athlete, dem, unpressed(athlete, rover.state()), goal=(0.4, 0.1, 0.0), seed=1).plan
    assert walk is not None
    reports = []
    for number in range(2):
        now = onward(athlete, dem, rover.state(), walk, number, ExecutionSettings(), np.array(rover.commanded))
        assert now.move is not None, now.reason
        assert not now.anew
        reports.append(carry_out(rover, now.move))
        report = reports[-1]
        assert (report.tipped, report.contacts, report.stayed) == (False, 0, 0)
        assert report.touch < 0.03
        assert report.rest < 0.02
        rover.step(CALM)
    assert longest_slip(reports) < 0.02
    # feet are where the walk has them, not farther off with every foot move
    hubs = wheel_centers(athlete, rover.posture) @ rover.T_site_base[:3, :3].T + rover.T_site_base[:3, 3]
    planned = walk.stances[2].contacts + athlete.wheel_radius * walk.stances[2].normals
    assert np.linalg.norm((hubs - planned)[:, :2], axis=1).max() < 0.05
