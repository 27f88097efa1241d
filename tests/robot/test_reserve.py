"""The reserves of a posture, against forward kinematics and against the joints' own limits."""

import numpy as np
import pytest

from footfall.robot.kinematics import link_poses
from footfall.robot.reserve import joint_reserves, reach_reserves


def test_the_reserve_of_reach_is_what_is_left_to_straight_and_to_folded(athlete, rng):
    for _ in range(30):
        q = rng.uniform(athlete.lower, athlete.upper)
        poses = link_poses(athlete, q)
        for leg in athlete.legs:
            spec = athlete.description.legs[leg]
            away = np.linalg.norm(poses[f"leg{leg}_knee_roll"][:3, 3] - poses[f"leg{leg}_hip_pitch"][:3, 3])
            ankle = np.linalg.norm(poses[f"leg{leg}_ankle_pitch"][:3, 3] - poses[f"leg{leg}_hip_pitch"][:3, 3])
            left = min(spec.thigh + spec.shank - ankle, ankle - abs(spec.thigh - spec.shank))
            assert reach_reserves(athlete, q)[leg] == pytest.approx(left, abs=1e-9), away


def test_a_straight_leg_has_none_and_a_bent_one_has_most_in_between(athlete):
    q = np.zeros((181, 36))
    q[:, 2::6] = np.linspace(0.0, np.pi, 181)[:, None]
    found = reach_reserves(athlete, q)
    assert np.allclose(found[0], 0.0, atol=1e-12)
    assert np.allclose(found[-1], 0.0, atol=1e-12)
    assert (found[1:-1] > 0).all()
    assert np.array_equal(reach_reserves(athlete, -q), found)


def test_the_reserve_of_joints_is_to_the_nearer_limit_and_negative_beyond(athlete):
    assert np.allclose(joint_reserves(athlete, athlete.lower), 0.0)
    middle = 0.5 * (athlete.lower + athlete.upper)
    assert np.allclose(joint_reserves(athlete, middle), 0.5 * (athlete.upper - athlete.lower))
    assert np.allclose(joint_reserves(athlete, athlete.upper + 0.1), -0.1)
