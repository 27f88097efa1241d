"""Closed-form inverse kinematics: exact against pin, complete, inside limits; contacts and their inverses."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.robot import ik, kinematics


def pin_wheel_poses(robot, leg, qs):
    """Wheel poses by pin from the URDF: (n, 4, 4)."""
    data = robot.model.createData()
    frame = robot.model.getFrameId(f"leg{leg}_wheel")
    joint = robot.model.frames[frame].parentJoint
    T_joint_wheel = robot.model.frames[frame].placement
    q = np.zeros(robot.model.nq)
    poses = np.empty((len(qs), 4, 4))
    for i, q_leg in enumerate(qs):
        q[6 * leg : 6 * leg + 6] = q_leg
        pin.forwardKinematics(robot.model, data, q)
        poses[i] = (data.oMi[joint] * T_joint_wheel).homogeneous
    return poses


def rotation_error(A, B):
    return np.linalg.norm(A - B, axis=(-2, -1)) / np.sqrt(2)  # ≈ angle [rad] where small


def test_every_branch_reproduces_ten_thousand_random_poses(athlete, rng):
    leg, n = 2, 10_000
    lower, upper = athlete.lower[12:18], athlete.upper[12:18]
    asked = rng.uniform(lower, upper, (n, 6))
    Ts = pin_wheel_poses(athlete, leg, asked)
    solutions = ik.solve_leg(athlete, leg, Ts)
    exists = ~np.isnan(solutions.q).any(axis=2)
    assert (solutions.valid <= exists).all()
    which = np.argwhere(exists)
    back = pin_wheel_poses(athlete, leg, solutions.q[exists])
    want = Ts[which[:, 0]]
    assert np.abs(back[:, :3, 3] - want[:, :3, 3]).max() < 1e-9
    assert rotation_error(back[:, :3, :3], want[:, :3, :3]).max() < 1e-9
    # limits are respected, and nothing inside the limits is called invalid
    inside = ((solutions.q >= lower) & (solutions.q <= upper)).all(axis=2)
    assert (inside == solutions.valid).all()
    # the posture that made the pose is among the valid ones
    off = np.abs(solutions.q - asked[:, None]).max(axis=2)
    assert np.nanmin(np.where(solutions.valid, off, np.nan), axis=1).max() < 1e-5
    assert solutions.valid.sum(axis=1).max() <= 4


def test_agreement_of_all_legs(athlete, rng):
    for leg in athlete.legs:
        asked = rng.uniform(athlete.lower[:6], athlete.upper[:6], (200, 6))
        Ts = pin_wheel_poses(athlete, leg, asked)
        solutions = ik.solve_leg(athlete, leg, Ts)
        assert solutions.valid.any(axis=1).all()


def test_branch_ids_mean_what_they_say(athlete, rng):
    asked = rng.uniform(athlete.lower[:6], athlete.upper[:6], (2000, 6))
    Ts = pin_wheel_poses(athlete, 0, asked)
    q = ik.solve_leg(athlete, 0, Ts).q
    turn = (q + np.pi) % (2 * np.pi) - np.pi
    exists = ~np.isnan(q[..., 0])
    spec = athlete.description.legs[0]
    out = spec.hip_offset[0] + spec.thigh * np.cos(q[..., 1]) + spec.shank * np.cos(q[..., 1] + q[..., 2])
    for branch in range(8):
        there = exists[:, branch]
        shoulder, elbow, wrist = branch >> 2, (branch >> 1) & 1, branch & 1
        assert ((out[there, branch] < 0) == bool(shoulder)).all()
        assert ((turn[there, branch, 2] < 0) == bool(elbow)).all()
        assert ((turn[there, branch, 4] < 0) == bool(wrist)).all()


@pytest.mark.parametrize("name", ["stand", "crouch", "tall"])
def test_named_postures_are_branch_zero(athlete, name):
    posture = athlete.posture(name)
    for leg in athlete.legs:
        T = kinematics.wheel_pose(athlete, posture, leg)
        solutions = ik.solve_leg(athlete, leg, T[None])
        np.testing.assert_allclose(solutions.q[0, 0], posture[6 * leg : 6 * leg + 6], atol=1e-9)
        assert solutions.valid[0, 0]


def test_singular_wrist_and_stretched_knee(athlete):
    for q in (
        [0.3, 0.2, 0.4, 0.0, 0.0, 0.7],
        [0.3, 0.2, 0.0, 0.1, 0.5, 0.2],
        np.zeros(6),
        [0.1, 0.4, 0.5, 0.6, 1e-8, 0.3],
    ):
        T = pin_wheel_poses(athlete, 0, [q])
        solutions = ik.solve_leg(athlete, 0, T)
        assert solutions.valid[0].any()
        for q_found in solutions.q[0][solutions.valid[0]]:
            back = pin_wheel_poses(athlete, 0, [q_found])[0]
            np.testing.assert_allclose(back, T[0], atol=1e-9)


def test_knee_angles_past_the_half_turn_fold_into_the_limits(athlete):
    # −110° … 180°: a bend of −170° exists only as −170° (outside), 175° only as 175°
    T = pin_wheel_poses(athlete, 0, [np.deg2rad([10, 20, 175, 30, 40, 50])])
    solutions = ik.solve_leg(athlete, 0, T)
    knees = np.rad2deg(solutions.q[0, :, 2])
    assert np.isclose(knees, 175).sum() >= 1
    assert not solutions.valid[0][knees < -110.001].any()


def test_out_of_reach_has_no_solution(athlete):
    T = transform(translation=(6.0, 0.0, 0.0))
    solutions = ik.solve_leg(athlete, 0, T[None])
    assert np.isnan(solutions.q).all()
    assert not solutions.valid.any()
    assert ik.solve_leg(athlete, 0, np.empty((0, 4, 4))).q.shape == (0, 8, 6)
    with pytest.raises(InvalidInput, match="n, 4, 4"):
        ik.solve_leg(athlete, 0, T)


def test_nan_poses_give_nan(athlete):
    solutions = ik.solve_leg(athlete, 0, np.full((1, 4, 4), np.nan))
    assert np.isnan(solutions.q).all()
    assert not solutions.valid.any()


angles = st.floats(-0.5, 0.5)


@given(roll=angles, pitch=angles, yaw=st.floats(-3, 3), slope=angles, tilt=angles, leg=st.integers(0, 5))
def test_contact_and_wheel_pose_are_inverse(athlete, roll, pitch, yaw, slope, tilt, leg):
    T_site_base = transform(rotation_rpy(roll, pitch, yaw), (1.0, -2.0, 1.5))
    contact = apply(T_site_base, kinematics.wheel_centers(athlete, athlete.posture("stand"))[leg]) - (0, 0, 0.2)
    normal = rotation_rpy(slope, tilt, 0.0)[:, 2]
    heading = ik.leg_azimuth(athlete, leg, T_site_base)
    T = ik.wheel_pose_for_contact(athlete, contact, normal, heading, T_site_base)
    solutions = ik.solve_leg(athlete, leg, T[None])
    # upright on the slope, rolling along the heading
    T_site_wheel = T_site_base @ T
    np.testing.assert_allclose(T_site_wheel[:3, 0], -normal, atol=1e-12)
    assert abs(T_site_wheel[:3, 1] @ (np.cos(heading), np.sin(heading), 0)) < 1e-12
    for q_leg in solutions.q[0][solutions.valid[0]]:
        posture = np.array(athlete.posture("stand"))
        posture[6 * leg : 6 * leg + 6] = q_leg
        np.testing.assert_allclose(ik.contact_point(athlete, posture, leg, T_site_base, normal), contact, atol=1e-9)


def test_standing_wheel_is_where_the_contact_says(athlete):
    posture, T = athlete.posture("stand"), np.eye(4)
    for leg in athlete.legs:
        contact = ik.contact_point(athlete, posture, leg, T)
        center = kinematics.wheel_centers(athlete, posture)[leg]
        np.testing.assert_allclose(contact, center - (0, 0, athlete.wheel_radius), atol=1e-9)
        pose = ik.wheel_pose_for_contact(athlete, contact, (0, 0, 1), ik.leg_azimuth(athlete, leg, T), T)
        np.testing.assert_allclose(pose, kinematics.wheel_pose(athlete, posture, leg), atol=1e-9)


def test_contact_is_the_lowest_rim_point(athlete, rng):
    posture = rng.uniform(athlete.lower, athlete.upper)
    normal = np.array([0.2, -0.1, 0.9])
    for leg in athlete.legs:
        T = kinematics.wheel_pose(athlete, posture, leg)
        turn = np.linspace(0, 2 * np.pi, 20_000)
        rim = T[:3, 3] + athlete.wheel_radius * (np.outer(np.cos(turn), T[:3, 0]) + np.outer(np.sin(turn), T[:3, 2]))
        found = ik.contact_point(athlete, posture, leg, np.eye(4), normal)
        np.testing.assert_allclose(found, rim[np.argmin(rim @ normal)], atol=1e-4)
        assert (rim @ normal).min() >= found @ normal - 1e-12


def test_wheel_poses_come_in_stacks(athlete):
    contacts = np.zeros((4, 5, 3))
    poses = ik.wheel_pose_for_contact(athlete, contacts, (0, 0, 1), np.zeros((4, 1)), np.eye(4))
    assert poses.shape == (4, 5, 4, 4)
    with pytest.raises(InvalidInput, match="heading"):
        ik.wheel_pose_for_contact(athlete, np.zeros(3), (1, 0, 0), 0.0, np.eye(4))
