"""What the number of a branch says, and which way a joint turns, against where the links are."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.robot.description import JOINTS
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import leg_link_poses, leg_wheel_pose
from footfall.robot.leg_branches import (
    BRANCHES,
    bend_of,
    bend_text,
    branch_number,
    elbow_of,
    other_knee,
    shoulder_of,
    wrist_of,
)
from footfall.robot.leg_frames import JOINT_AXES

ALL = np.arange(BRANCHES)


def test_a_number_is_made_of_its_parts_again():
    np.testing.assert_array_equal(branch_number(bend_of(ALL), wrist_of(ALL)), ALL)
    np.testing.assert_array_equal(2 * shoulder_of(ALL) + elbow_of(ALL), bend_of(ALL))
    assert [branch_number(bend_of(one), wrist_of(one)) for one in range(BRANCHES)] == ALL.tolist()


@pytest.mark.parametrize("branch", range(BRANCHES))
def test_the_other_knee_differs_in_the_elbow_alone(branch):
    other = other_knee(branch)
    assert elbow_of(other) == 1 - elbow_of(branch)
    assert (shoulder_of(other), wrist_of(other)) == (shoulder_of(branch), wrist_of(branch))


def test_the_words_tell_shoulder_and_elbow():
    assert [bend_text(one) for one in (0, 3, 5, 6)] == [
        "the knee up (branch 0)",
        "the knee down (branch 3)",
        "reaching back over the hip, the knee up (branch 5)",
        "reaching back over the hip, the knee down (branch 6)",
    ]


def test_solutions_are_bent_as_the_number_of_their_branch_says(athlete):
    rng, seen = np.random.default_rng(0), set()
    for q in rng.uniform(-3.0, 3.0, (40, len(JOINTS))):
        (solutions,) = solve_leg(athlete, 0, leg_wheel_pose(athlete, q, 0)[None]).q
        for branch in np.flatnonzero(np.isfinite(solutions).all(axis=1)).tolist():
            poses = list(leg_link_poses(athlete, solutions[branch], 0).values())
            hip, ankle = poses[0], poses[4]
            knee, pitch = solutions[branch][[2, 4]]
            out = (ankle[:3, 3] - hip[:3, 3]) @ hip[:3, 0]
            if min(abs(out), abs(knee), abs(pitch)) > 1e-6:
                found = (int(out < 0), int(knee < 0), int(pitch < 0))
                assert (shoulder_of(branch), elbow_of(branch), wrist_of(branch)) == found
                seen.add(branch)
    assert seen == set(range(BRANCHES))


def test_each_joint_turns_its_link_about_its_axis(athlete):
    q, turn = np.array([0.3, -0.4, 0.9, 0.2, -0.5, 0.7]), 1e-3
    before = list(leg_link_poses(athlete, q, 1).values())
    for joint, axis in enumerate(JOINT_AXES):
        turned = q.copy()
        turned[joint] += turn
        after = list(leg_link_poses(athlete, turned, 1).values())[joint]
        about = Rotation.from_matrix(after[:3, :3] @ before[joint][:3, :3].T).as_rotvec() / turn
        np.testing.assert_allclose(about, before[joint][:3, axis], atol=1e-9)
