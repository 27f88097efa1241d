"""A move of the chassis of a rover that sags: its pose is held on the planned way, or the move is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.forces import equilibrium_matrix
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.io.artifacts import decode, encode
from footfall.planning.answers import Status
from footfall.planning.body.body_move import No, plan_body_move
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import advanced, predict
from footfall.planning.execution.begin import beginning
from footfall.planning.execution.body_course import ENDS, LEAST_FORCE, LEAST_TORQUE, NEAREST, faded
from footfall.planning.execution.body_plan import body_executed, plan_body_execution
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.prediction_checks import WORSE
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.of_execution import sequence_of_execution
from tests.support.chassis_ground import lifted, wavy

MOON = ComplianceSettings(balance=BalanceSettings(gravity=1.62))


@pytest.fixture(scope="module")
def dem():
    return wavy(seed=5)


@pytest.fixture(scope="module")
def rest(athlete, dem):
    state = footfall.stand(athlete, dem)
    return CompliantRover(athlete, dem).let_down(state.posture, state.T_site_base)


def executed(robot, dem, rest, shift, asked=None, state=None):
    state = state or CompliantRover(robot, dem).state(rest)
    planned = plan_body_move(robot, dem, state, shift)
    assert planned.plan is not None, planned.reason
    return plan_body_execution(robot, dem, state, planned.plan, asked, rest.commanded)


@pytest.fixture(scope="module")
def found(athlete, dem, rest):
    return executed(athlete, dem, rest, BodyShift(dx=0.15, dy=-0.1, dz=-0.4, droll=0.04, dpitch=-0.03, dyaw=0.1))


def done_in(result):
    assert result.status is Status.FOUND, result.reason
    assert all(check.holds for check in result.checks)
    assert result.execution is not None
    return result.execution


def test_the_chassis_goes_where_it_was_planned_over_wheels_that_stay(athlete, rest, found):
    done = done_in(found)
    assert np.abs(done.Ts_site_base - done.wanted).max() < 1e-4
    assert np.allclose(done.wanted[-1], done.plan.Ts_site_base[-1])
    assert np.array_equal(done.commanded[0], rest.commanded)
    hubs = np.array(
        [apply(T, wheel_centers(athlete, q)) for T, q in zip(done.Ts_site_base, done.predicted, strict=True)]
    )
    # a wheel stays where the ground holds its rim; its middle goes by what its spring gives way
    given_way = -(done.forces - done.forces[0]) / athlete.description.wheel_stiffness
    assert np.abs(hubs - hubs[0] - given_way).max() < 2e-4
    assert set(done.phases) == {"body"}
    travel = np.abs(np.diff(done.commanded, axis=0)) / np.maximum(done.durations[1:, None], 1e-12)
    assert travel.max() <= 0.7 * athlete.speed_limits.max() + 1e-9
    assert np.flatnonzero(done.pauses).tolist() == [len(done.phases) - 1]


def test_the_ground_bears_the_rover_all_the_way(athlete, found):
    done = done_in(found)
    weight = (0.0, 0.0, athlete.mass * 9.81)
    assert np.abs(done.forces.sum(axis=1) - weight).max() < 1e-2
    # moments about the centre of mass, by kinematics of their own
    for T, q, forces in zip(done.Ts_site_base, done.predicted, done.forces, strict=True):
        com = apply(T, center_of_mass(athlete, q))
        below = apply(T, wheel_centers(athlete, q)) - (0.0, 0.0, athlete.wheel_radius)
        assert np.abs(equilibrium_matrix(below, com) @ forces.ravel())[3:].max() < 60.0


def test_the_prediction_is_that_of_the_set_points_alone(athlete, dem, rest, found):
    done = done_in(found)
    rover = CompliantRover(athlete, dem)
    motion = predict(rover, measured(rover, rover.state(rest), rest.commanded), done.commanded[1:])
    assert not motion.reason
    assert np.abs(motion.Ts_site_base - done.Ts_site_base[1:]).max() < 1e-6
    assert np.abs(motion.forces - done.forces[1:]).max() < 0.5


def test_what_is_stored_and_done_again_is_the_same(athlete, dem, rest, found):
    assert decode(encode(found)).digest == found.digest
    again = executed(athlete, dem, rest, done_in(found).plan.shift)
    assert again.digest == found.digest
    assert done_in(found).parents.keys() == {"plan", "state", "dem", "robot"}


def test_its_commands_are_its_set_points(athlete, dem, rest, found):
    done = done_in(found)
    told = sequence_of_execution(done, athlete)
    assert [one.name for one in told.commands] == ["POSTURE_MOVE"] * (len(done.phases) - 1) + ["WAIT"]
    assert np.array_equal([one.joints for one in told.commands[:-1] if one.joints is not None], done.commanded[1:])
    assert not told.failures
    checked = sequence_of_execution(done, athlete, dem)
    assert np.abs(checked.predicted[-1] - done.predicted[-1]).max() < 1e-5
    assert not checked.failures


def test_a_leg_in_the_air_stays_there(athlete, dem, rest):
    state = lifted(athlete, CompliantRover(athlete, dem).state(rest), [1])
    rover = CompliantRover(athlete, dem)
    hanging = rover.let_down(state.posture, state.T_site_base)
    done = done_in(executed(athlete, dem, hanging, BodyShift(dx=-0.03, dz=-0.08)))
    assert not done.forces[:, 1].any()
    assert np.abs(done.predicted[:, 6:12] - done.predicted[0, 6:12]).max() < 0.02
    assert np.abs(done.Ts_site_base - done.wanted).max() < 1e-4


def test_less_weight_needs_less_deflection(athlete, dem):
    state = footfall.stand(athlete, dem)
    rover = CompliantRover(athlete, dem, MOON)
    rest = rover.let_down(state.posture, state.T_site_base)
    shift = BodyShift(dx=0.1, dz=-0.3)
    moon = done_in(executed(athlete, dem, rest, shift, ExecutionSettings(compliance=MOON), rover.state(rest)))
    assert np.allclose(moon.forces.sum(axis=1), (0, 0, athlete.mass * 1.62), atol=1e-2)
    assert np.abs(moon.Ts_site_base - moon.wanted).max() < 1e-4
    assert moon.commanded[-1] != pytest.approx(moon.predicted[-1], abs=1e-4)


def test_a_chassis_that_starts_beside_the_plan_ends_on_it(athlete, dem, rest):
    rover = CompliantRover(athlete, dem)
    state = rover.state(rest)
    plan = plan_body_move(athlete, dem, state, BodyShift(dx=0.1, dz=-0.3)).plan
    assert plan is not None
    beside = replace(plan, Ts_site_base=transform(translation=(0.01, -0.012, 0.008)) @ plan.Ts_site_base)
    done = done_in(plan_body_execution(athlete, dem, state, beside, None, rest.commanded))
    assert np.allclose(done.wanted[0], state.T_site_base)
    assert np.abs(done.Ts_site_base[-1] - beside.Ts_site_base[-1]).max() < 1e-4


@settings(max_examples=50, derandomize=True, deadline=None)
@given(
    off=st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    turn=st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    count=st.integers(2, 9),
)
def test_what_is_off_fades_evenly(off, turn, count):
    planned = np.array([transform(rotation_rpy(0.01 * i, 0.02, 0.1 * i), (0.1 * i, 0.0, 1.0)) for i in range(count)])
    start = transform(rotation_rpy(*turn), off) @ planned[0]
    shares = np.linspace(0.0, 1.0, count)
    found = faded(start, planned, shares)
    assert np.allclose(found[0], start, atol=1e-12)
    assert np.allclose(found[-1], planned[-1], atol=1e-12)
    away = np.linalg.norm(found[:, :3, 3] - planned[:, :3, 3], axis=1)
    assert np.allclose(away, (1 - shares) * away[0], atol=1e-12)
    angles = [
        np.arccos(np.clip((np.trace(a[:3, :3] @ b[:3, :3].T) - 1) / 2, -1, 1))
        for a, b in zip(found, planned, strict=True)
    ]
    assert np.allclose(angles, (1 - shares) * angles[0], atol=1e-6)
    assert np.allclose(found[:, :3, :3] @ found[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=1e-12)


def test_refusals_say_what_fails_and_what_to_try(athlete, dem, rest):
    shift = BodyShift(dx=0.1, dz=-0.3)
    heavy = executed(athlete, dem, rest, shift, ExecutionSettings(least_load=2000.0))
    assert heavy.status is Status.NO_PATH
    assert heavy.execution is not None
    assert "load on the supporting wheels" in heavy.reason
    assert "move the chassis" in heavy.reason
    slippery = ComplianceSettings(balance=BalanceSettings(friction=0.001))
    slid = executed(athlete, dem, rest, shift, ExecutionSettings(compliance=slippery))
    assert slid.status is Status.NO_PATH
    assert slid.execution is None
    assert "no contact forces inside friction" in slid.reason
    state = CompliantRover(athlete, dem).state(rest)
    plan = plan_body_move(athlete, dem, state, shift).plan
    assert plan is not None
    elsewhere = replace(state, T_site_base=transform(translation=(0.2, 0.0, 0.0)) @ state.T_site_base)
    away = plan_body_execution(athlete, dem, elsewhere, plan)
    assert away.status is Status.START_INVALID
    assert "0.200 m" in away.reason


@pytest.fixture(scope="module")
def strained(athlete, dem, rest):
    """At rest with leg 2 pressed outwards."""
    target = np.array(rest.commanded)
    target[14] -= 0.06
    found = advanced(CompliantRover(athlete, dem), rest, target)
    assert found.settled
    return found


def test_a_joint_that_bears_too_much_at_first_is_led_back(athlete, dem, strained):
    most = (np.abs(strained.torques) / athlete.torque_limits).max()
    weak = Robot(replace(athlete.description, torque_limits=0.9 * most * athlete.torque_limits))
    done = done_in(executed(weak, dem, strained, BodyShift(dz=-0.3)))
    motion = predict(CompliantRover(weak, dem), strained, done.commanded[1:])
    shares = np.abs([one.torques for one in (strained, *motion.rests)]) / weak.torque_limits
    assert shares[0].max() == pytest.approx(1 / 0.9)
    assert shares.max() <= 1 + WORSE * (1 / 0.9 - 1)
    assert shares[-1].max() <= 1.0
    # nothing else may be beyond its limit on the way
    beyond = shares[0] > 1.0
    assert shares[:, ~beyond].max() <= 1.0
    # the rules of its commands see it alike, and refuse commands that leave off half way
    whole = sequence_of_execution(done, weak, dem)
    assert not whole.failures
    assert "bears too much already" in next(one.text for one in whole.rules if one.rule == "torque")
    each = (
        "commanded",
        "predicted",
        "wanted",
        "Ts_site_base",
        "durations",
        "pauses",
        "forces",
        "loads",
        "friction_use",
    )
    half = replace(done, **{name: getattr(done, name)[:3] for name in each})
    left = sequence_of_execution(half, weak, dem).failures
    assert {one.rule for one in left} == {"torque"}
    assert left[-1].row == len(half.commanded) - 2


def test_where_forces_that_change_least_bear_too_much_others_are_taken(athlete, dem, strained):
    rover = CompliantRover(athlete, dem)
    state, shift = rover.state(strained), BodyShift(dz=-0.1)
    plan = plan_body_move(athlete, dem, state, shift).plan
    assert plan is not None
    began = beginning(athlete, dem, state, ExecutionSettings(), strained.commanded)
    assert not isinstance(began, No)
    found = {end: body_executed(began, plan, ExecutionSettings(), plan.provenance, end=end).end for end in ENDS}
    ends = {end: one for end, one in found.items() if one is not None}
    assert list(ends) == list(ENDS)
    most = {end: (np.abs(one.torques) / athlete.torque_limits).max() for end, one in ends.items()}
    assert most[LEAST_TORQUE] < most[NEAREST]
    assert np.linalg.norm(ends[LEAST_FORCE].forces) < np.linalg.norm(ends[NEAREST].forces)
    between = (min(most.values()) + most[NEAREST]) / 2
    weak = Robot(replace(athlete.description, torque_limits=between * athlete.torque_limits))
    done = done_in(executed(weak, dem, strained, shift))
    assert np.abs(done.forces[-1] - ends[NEAREST].forces).max() > 10.0
    # a limit that no forces keep is refused by what the first ones lack
    feeble = Robot(replace(athlete.description, torque_limits=0.9 * min(most.values()) * athlete.torque_limits))
    refused = executed(feeble, dem, strained, shift)
    assert refused.status is Status.NO_PATH
    assert "torque" in refused.reason


def test_misuse_raises_and_cancelling_ends_it(athlete, dem, rest):
    state = CompliantRover(athlete, dem).state(rest)
    plan = plan_body_move(athlete, dem, state, BodyShift(dx=0.05, dz=-0.2)).plan
    assert plan is not None
    with pytest.raises(InvalidInput, match="ExecutionSettings"):
        plan_body_execution(athlete, dem, state, plan, MOON)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InvalidInput, match="robot"):
        plan_body_execution(athlete, dem, replace(state, robot="other"), plan)

    def cancel(share, text):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        plan_body_execution(athlete, dem, state, plan, progress=cancel)
