"""Wheels that stand stay pressed down while another is lifted, where any forces can see to it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.balance.forces import equilibrium_matrix
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.body.body_move import No
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import wheel_arms
from footfall.planning.execution.begin import REACH_OUT, beginning
from footfall.planning.execution.course import PRESSED_DOWN
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.forces import WELL_INSIDE, Holder
from footfall.planning.execution.plan import executed
from footfall.planning.walk_execution.unpressed import unpressed
from tests.support.chassis_ground import wavy

FRICTION = 0.6


@pytest.fixture(scope="module")
def dem():
    return wavy()


@pytest.fixture(scope="module")
def rest(athlete, dem):
    state = footfall.stand(athlete, dem)
    return CompliantRover(athlete, dem).let_down(state.posture, state.T_site_base)


@settings(max_examples=150, derandomize=True, deadline=None)
@given(leg=st.integers(0, 5), least=st.floats(0.0, 1500.0), pushed=st.lists(st.floats(-600.0, 600.0), min_size=18))
def test_forces_balance_and_press_where_there_are_any(athlete, dem, rest, leg, least, pushed):
    holder = Holder(CompliantRover(athlete, dem), rest)
    wheels = np.arange(6) != leg
    near = np.where(wheels[:, None], rest.forces + np.reshape(pushed[:18], (6, 3)), 0.0)
    plain = holder.least_change(rest.posture, rest.T_site_base, near, wheels)
    found = holder.pressed_down(rest.posture, rest.T_site_base, near, wheels, least)
    loads = np.sum(plain * rest.normals, axis=1)[wheels]
    if found is None:
        assert loads.min() < least
        return
    mass, center = holder.weighed(rest.posture)
    arms = wheel_arms(holder.rover, rest.hubs, rest.normals)
    wrench = equilibrium_matrix(arms, apply(rest.T_site_base, center)) @ found.ravel()
    assert np.allclose(wrench, [0, 0, mass * 9.81, 0, 0, 0], atol=1e-6)
    assert not found[leg].any()
    pressing = np.sum(found * rest.normals, axis=1)
    assert pressing[wheels].min() >= least - 1e-6
    if loads.min() >= least:
        assert np.array_equal(found, plain)
    kept = wheels & np.isclose(pressing, least, atol=1e-9)
    sideways = np.linalg.norm(found - pressing[:, None] * rest.normals, axis=1)
    assert (sideways[kept] <= WELL_INSIDE * FRICTION * least + 1e-6).all()


def test_no_forces_press_three_wheels_of_five_with_more_than_there_is(athlete, dem, rest):
    holder = Holder(CompliantRover(athlete, dem), rest)
    wheels = np.arange(6) != 0
    near = np.where(wheels[:, None], rest.forces, 0.0)
    assert holder.pressed_down(rest.posture, rest.T_site_base, near, wheels, 1e4) is None


def test_the_opposite_wheel_is_kept_down_while_a_leg_swings(athlete, dem, rest):
    """What the wheel of leg 3 bears with forces that change least is taken for too little: others see to it."""
    rover = CompliantRover(athlete, dem)
    state = rover.state(rest)
    there = rest.contacts[0] + (-0.2, 0.1, 0.0)
    plan = footfall.plan_step(athlete, dem, unpressed(athlete, state), 0, (there[0], there[1])).plan
    assert plan is not None

    def done(least_load):
        asked = ExecutionSettings(least_load=least_load)
        began = beginning(athlete, dem, state, asked, rest.commanded, REACH_OUT)
        assert not isinstance(began, No)
        return executed(began, dem, state, plan, asked, plan.provenance).result

    plain = done(50.0).execution
    assert plain is not None
    bears = plain.loads[:, 3].min()
    assert bears > 50.0 * PRESSED_DOWN[0]
    more = done(bears + 15.0)
    assert more.status is Status.FOUND, more.reason
    assert more.execution is not None
    assert more.execution.loads[:, 3].min() >= bears + 15.0
    assert more.execution.loads[:, 1:].min() >= bears + 15.0
    too_much = done(1400.0)
    assert too_much.status is Status.NO_PATH
    assert "load on the supporting wheels" in too_much.reason
