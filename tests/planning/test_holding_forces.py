"""Forces that hold the rover on some of its wheels: they balance it, none are better at what they are chosen for."""

import numpy as np
import pytest

import footfall
from footfall.balance.forces import equilibrium_matrix
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import holding, wheel_arms
from footfall.planning.execution import course
from footfall.planning.execution.course import SPARE
from footfall.planning.execution.forces import Holder
from footfall.planning.execution.plan import plan_execution
from footfall.robot.kinematics import center_of_mass, wheel_centers
from tests.support.chassis_ground import wavy

OTHERS = np.array([True, True, False, True, True, True])


@pytest.fixture(scope="module")
def holder(athlete):
    dem = wavy()
    state = footfall.stand(athlete, dem)
    rover = CompliantRover(athlete, dem)
    return Holder(rover, rover.let_down(state.posture, state.T_site_base))


def balance_of(holder):
    """(6, legs × 3) of forces on all wheels, and what they must give."""
    rover, rest = holder.rover, holder.start
    com = apply(rest.T_site_base, center_of_mass(rover.robot, rest.posture))
    matrix = equilibrium_matrix(wheel_arms(rover, rest.hubs, holder.normals), com)
    return matrix, np.append(-rover.mass * rover.gravity, np.zeros(3))


def ratios_of(holder, forces):
    rest, rover = holder.start, holder.rover
    torques = holding(rover, rest.posture, rest.T_site_base, rest.hubs, holder.normals, forces)
    return torques / rover.robot.torque_limits


def chosen(holder):
    rest = holder.start
    plain = rest.forces.copy()
    plain[~OTHERS] = 0.0
    return {
        "change": holder.least_change(rest.posture, rest.T_site_base, plain, OTHERS),
        "torque": holder.least_torque(rest.posture, rest.T_site_base, OTHERS),
        "norm": holder.inside_friction(rest.posture, rest.T_site_base, OTHERS, 0.1),
    }


@pytest.mark.parametrize("how", ["change", "torque", "norm"])
def test_they_balance_the_rover_on_the_wheels_that_stand(holder, how):
    forces = chosen(holder)[how]
    matrix, wanted = balance_of(holder)
    assert np.abs(matrix @ forces.ravel() - wanted).max() < 1e-2
    assert not forces[~OTHERS].any()


@pytest.mark.parametrize("seed", range(10))
def test_no_others_that_balance_it_are_better(holder, seed):
    found, rest = chosen(holder), holder.start
    matrix, _ = balance_of(holder)
    columns = np.repeat(OTHERS, 3)
    null = np.linalg.svd(matrix[:, columns])[2][6:]
    shift = np.zeros(18)
    shift[columns] = null.T @ np.random.default_rng(seed).normal(0.0, 50.0, len(null))
    shift = shift.reshape(6, 3)
    least = found["torque"]
    own = OTHERS.repeat(6)
    assert np.sum(ratios_of(holder, least)[own] ** 2) < np.sum(ratios_of(holder, least + shift)[own] ** 2)
    before = rest.forces * OTHERS[:, None]
    assert np.linalg.norm(found["change"] - before) < np.linalg.norm(found["change"] + shift - before)


def test_what_is_spare_is_the_least_of_load_friction_and_torque(holder):
    rest, forces = holder.start, chosen(holder)["norm"]
    spare = holder.spare(rest.posture, rest.T_site_base, forces, OTHERS)
    friction = holder.rover.settings.balance.friction
    weight = holder.rover.mass * np.linalg.norm(holder.rover.gravity)
    parts = []
    for leg in np.flatnonzero(OTHERS):
        load = forces[leg] @ holder.normals[leg]
        sideways = np.linalg.norm(np.cross(forces[leg], holder.normals[leg]))
        parts += [load / (weight / 6), 1.0 - sideways / (friction * load)]
    parts.append(1.0 - np.abs(ratios_of(holder, forces)).max())
    assert spare == pytest.approx(min(parts), abs=1e-9)
    assert spare > SPARE
    # a wheel that pulls has less than nothing to spare
    pulled = forces.copy()
    pulled[0] = -forces[0]
    assert holder.spare(rest.posture, rest.T_site_base, pulled, OTHERS) < 0


def test_a_step_takes_the_forces_that_leave_more_to_spare(athlete, holder, monkeypatch):
    rover, rest, leg = holder.rover, holder.start, 2
    state = rover.state(rest)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[leg]
    plan = footfall.plan_step(athlete, rover.dem, state, leg, (x + 0.1, y - 0.2)).plan
    assert plan is not None
    spares = []
    for wanted in (SPARE, np.inf):
        monkeypatch.setattr(course, "SPARE", wanted)
        result = plan_execution(athlete, rover.dem, state, plan, None, rest.commanded)
        assert result.status is Status.FOUND, result.reason
        assert result.execution is not None
        done = result.execution
        unloaded = max(i for i, phase in enumerate(done.phases) if phase == "unload")
        assert np.linalg.norm(done.Ts_site_base[unloaded, :3, 3] - state.T_site_base[:3, 3]) < 1e-3
        spares.append(holder.spare(done.predicted[unloaded], state.T_site_base, done.forces[unloaded], OTHERS))
    assert spares[1] > spares[0] + 0.005
