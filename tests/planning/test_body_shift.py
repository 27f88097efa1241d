"""The chassis moved over standing feet: what stays, what comes back, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.value import flatten, unflatten
from footfall.maps.standing import contacts
from footfall.planning.between_rows import base_path
from footfall.planning.body.body_shift import BodyShift, PredictedState, ShiftRefused
from footfall.planning.body.shift import shifted_state
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import center_of_mass, link_poses, wheel_pose
from tests.support.chassis_ground import lifted, wavy
from tests.support.shifts import back, shift_between

SHIFTS = st.builds(
    BodyShift,
    st.floats(-0.12, 0.12),
    st.floats(-0.12, 0.12),
    st.floats(-0.6, -0.3),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.08, 0.08),
)


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy()
    return dem, footfall.stand(athlete, dem)


def wheels_in_site(robot, posture, T_site_base):
    """By the whole robot's model: not the one that the shift is followed with."""
    poses = link_poses(robot, posture)
    return np.array([T_site_base @ poses[f"leg{leg}_wheel"] for leg in robot.legs])


def test_no_shift_is_the_same_rover(athlete, scene):
    dem, state = scene
    same = shifted_state(athlete, dem, state, BodyShift())
    assert isinstance(same, PredictedState)
    assert np.array_equal(same.posture, state.posture)
    assert np.array_equal(same.T_site_base, state.T_site_base)
    assert np.allclose(same.wheel_forces, state.wheel_forces, atol=1e-6)
    assert np.allclose(same.joint_torques, state.joint_torques, atol=1e-6)


@given(SHIFTS)
def test_the_wheels_stay_and_the_way_back_leads_back(athlete, scene, shift):
    dem, state = scene
    there = shifted_state(athlete, dem, state, shift)
    if isinstance(there, ShiftRefused):
        return  # what is refused is looked at below
    assert np.allclose(there.T_site_base, shift.applied(state.T_site_base), atol=1e-12)
    before = wheels_in_site(athlete, state.posture, state.T_site_base)
    assert np.abs(wheels_in_site(athlete, there.posture, there.T_site_base) - before).max() < 1e-9
    assert (there.posture >= athlete.lower).all()
    assert (there.posture <= athlete.upper).all()
    again = shifted_state(athlete, dem, there, back(shift))
    assert isinstance(again, PredictedState), again.reason
    assert np.abs(again.T_site_base - state.T_site_base).max() < 1e-12
    assert np.abs(again.posture - state.posture).max() < 1e-6


def test_most_of_those_shifts_are_possible(athlete, scene, rng):
    """So the law above speaks of something."""
    dem, state = scene
    draws = rng.uniform((-0.12, -0.12, -0.6, -0.05, -0.05, -0.08), (0.12, 0.12, -0.3, 0.05, 0.05, 0.08), (20, 6))
    done = [isinstance(shifted_state(athlete, dem, state, BodyShift(*map(float, d))), PredictedState) for d in draws]
    assert sum(done) >= 10


@given(SHIFTS, SHIFTS)
def test_shifts_undo_and_are_recovered_from_poses(first, second):
    T = first.applied(np.eye(4))
    there = second.applied(T)
    assert np.allclose(back(second).applied(there), T, atol=1e-12)
    assert np.allclose(shift_between(T, there).vector, second.vector, atol=1e-12)


def test_the_signs_of_a_shift():
    T = BodyShift(dx=1.0, dyaw=np.pi / 2).applied(np.eye(4))
    assert np.allclose(T[:3, 3], (1, 0, 0))
    assert np.allclose(T[:3, 0], (0, 1, 0), atol=1e-12)  # forward turned to the left
    assert BodyShift(dpitch=0.1).applied(np.eye(4))[2, 0] < 0  # front down
    assert BodyShift(droll=0.1).applied(np.eye(4))[2, 1] > 0  # left side up
    # translation is along the site's axes, the turn about the chassis's own
    turned = BodyShift(dyaw=np.pi / 2).applied(np.eye(4))
    assert np.allclose(BodyShift(dx=1.0).applied(turned)[:3, 3], (1, 0, 0))
    assert BodyShift(droll=0.1).applied(turned)[2, 1] > 0


def test_the_path_of_the_chassis_is_a_line_and_one_turn(rng):
    T_from = BodyShift(0.3, -0.2, 1.0, 0.1, -0.2, 0.5).applied(np.eye(4))
    T_to = BodyShift(0.2, 0.1, -0.3, -0.3, 0.2, 0.4).applied(T_from)
    t = np.linspace(0, 1, 9)
    Ts = base_path(T_from, T_to, t)
    assert np.array_equal(Ts[0], T_from)
    assert np.array_equal(Ts[-1], T_to)
    assert np.allclose(Ts[:, :3, 3], T_from[:3, 3] + t[:, None] * (T_to - T_from)[:3, 3], atol=1e-12)
    steps = np.swapaxes(Ts[:-1, :3, :3], 1, 2) @ Ts[1:, :3, :3]
    assert np.abs(steps - steps[0]).max() < 1e-12


def test_the_forces_carry_the_rover_and_say_that_they_are_predicted(athlete, scene):
    dem, state = scene
    there = shifted_state(athlete, dem, state, BodyShift(dx=0.1, dz=-0.4, dyaw=0.05))
    assert isinstance(there, PredictedState)
    assert there.predicted == ("wheel_forces", "joint_torques")
    assert there.provenance.parents["state"] == state.digest
    weight = athlete.mass * 9.81
    assert np.allclose(there.wheel_forces.sum(axis=0), (0, 0, weight), atol=1e-3)
    com = there.T_site_base[:3, :3] @ center_of_mass(athlete, there.posture) + there.T_site_base[:3, 3]
    feet = contacts(athlete, dem, state.posture, state.T_site_base, athlete.legs).points
    assert np.abs(np.cross(feet - com, there.wheel_forces).sum(axis=0)).max() < 1e-2
    again = unflatten(*flatten(there))
    assert again.digest == there.digest
    # and every map can be asked of it
    assert footfall.compute_maps(athlete, dem, there, leg=2).layers


def test_a_leg_in_the_air_keeps_its_angles(athlete, scene):
    dem, state = scene
    up = lifted(athlete, state, [2])
    there = shifted_state(athlete, dem, up, BodyShift(dz=-0.3))
    assert isinstance(there, PredictedState)
    assert np.array_equal(there.leg(2), up.leg(2))
    assert not there.wheel_forces[2].any()
    assert not np.array_equal(there.leg(1), up.leg(1))


def test_too_far_names_the_leg_and_how_much_it_is_short(athlete, scene):
    dem, state = scene
    shift = BodyShift(dx=0.6)
    no = shifted_state(athlete, dem, state, shift)
    assert isinstance(no, ShiftRefused)
    assert no.joint == ""
    assert f"leg {no.leg} is {no.excess:.3f} m too short" in no.reason
    # from the hip-pitch axis to the ankle, by hand; no other leg is worse
    shorts = []
    for leg in athlete.legs:
        spec = athlete.description.legs[leg]
        T_base_wheel = np.linalg.inv(shift.applied(state.T_site_base)) @ state.T_site_base
        T_hip_wheel = np.linalg.inv(spec.T_base_hip) @ T_base_wheel @ wheel_pose(athlete, state.posture, leg)
        ankle = T_hip_wheel[:3, 3] - spec.foot * T_hip_wheel[:3, 0]
        out = np.hypot(ankle[0], ankle[1]) - spec.hip_offset[0]
        shorts.append(np.hypot(out, ankle[2] - spec.hip_offset[2]) - spec.thigh - spec.shank)
    assert no.leg == int(np.argmax(shorts))
    assert no.excess == pytest.approx(max(shorts), abs=1e-9)


def test_a_joint_limit_is_named_with_the_excess(athlete, scene):
    """The foot points down the shank: a wheel locked a little aside of it makes the knee roll swing round."""
    dem, state = scene
    rng = np.random.default_rng(0)
    for _ in range(300):
        draw = rng.uniform(-1, 1, 6) * (0.3, 0.3, 0.5, 0.15, 0.15, 0.3) - (0, 0, 0.6, 0, 0, 0)
        shift = BodyShift(*map(float, draw))
        no = shifted_state(athlete, dem, state, shift)
        if isinstance(no, ShiftRefused) and no.joint and "with the chassis there" in no.reason:
            break
    else:
        raise AssertionError("no such shift in 300")
    assert no.leg is not None
    assert no.joint in athlete.joint_names
    assert f"{no.joint} would be {no.excess:.3f} rad" in no.reason
    joint = athlete.joint_names.index(no.joint)
    assert joint // 6 == no.leg
    T_base_wheel = np.linalg.inv(shift.applied(state.T_site_base)) @ state.T_site_base
    T_base_wheel = T_base_wheel @ wheel_pose(athlete, state.posture, no.leg)
    q = solve_leg(athlete, no.leg, T_base_wheel[None]).q[0, :, joint % 6]
    q = np.concatenate([q, q + 2 * np.pi, q - 2 * np.pi])
    outside = np.maximum(athlete.lower[joint] - q, q - athlete.upper[joint])
    assert np.nanmin(np.abs(outside - no.excess)) < 1e-9


def test_a_rover_whose_mass_leaves_its_feet_would_tip(athlete, scene):
    dem, state = scene
    no = shifted_state(athlete, dem, lifted(athlete, state, [2, 3, 4]), BodyShift(dz=-0.05))
    assert isinstance(no, ShiftRefused)
    assert no.leg is None
    assert "would tip" in no.reason
    assert 0.5 < no.excess < 2.0
    no = shifted_state(athlete, dem, lifted(athlete, state, [1, 2, 3, 4]), BodyShift(dz=-0.05))
    assert isinstance(no, ShiftRefused)
    assert "2 wheels are on the ground" in no.reason


@pytest.mark.parametrize("name", ["dx", "dz", "droll", "dyaw"])
@pytest.mark.parametrize("number", [np.nan, np.inf, 6.0])
def test_senseless_shifts_are_refused(name, number):
    with pytest.raises(InvalidInput, match="a shift of the chassis"):
        BodyShift(**{name: number})


def test_other_things_than_shifts_are_refused(athlete, scene):
    dem, state = scene
    with pytest.raises(InvalidInput, match="BodyShift"):
        shifted_state(athlete, dem, state, (0.1, 0.0, 0.0))  # pyright: ignore[reportArgumentType]
