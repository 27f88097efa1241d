"""Kinematics and masses of foreign robots, against Pinocchio reading the same files."""

import numpy as np
import pinocchio as pin
import pytest

from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.judge_tree import body_inertia
from footfall.robot.legged.touching import sampled
from footfall.robot.legged.tree import RobotTree
from tests.support.robot_data import OTHERS, QUADRUPEDS, described
from tests.support.urdf import LIMIT, quadruped, written

SEED = 11


def configuration(model: pin.Model, posture: dict[str, float]) -> np.ndarray:
    """q of Pinocchio for a posture by joint names; a continuous joint is a point on the circle there."""
    q = pin.neutral(model)
    for name, angle in posture.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
    return q


def agree(path, tree: RobotTree) -> None:
    """Poses of all links at random postures, and the inertia of every rigid body, are those of Pinocchio."""
    model = pin.buildModelFromUrdf(str(path), mimic=True)
    frames = model.createData()
    rng = np.random.default_rng(SEED)
    for _ in range(5):
        posture = sampled(tree, rng)
        pin.framesForwardKinematics(model, frames, configuration(model, posture))
        for link, T_root_link in tree.poses(posture).items():
            found = frames.oMf[model.getFrameId(link, pin.FrameType.BODY)].homogeneous
            np.testing.assert_allclose(T_root_link, found, atol=1e-9, err_msg=f"{link}, seed {SEED}")
    for joint in tree.joints:
        if joint.moves:
            # Pinocchio keeps the inertia of a whole body in the frame of the joint that moves it
            other = model.inertias[model.getJointId(joint.name)]
            mass, center, inertia = body_inertia(tree, joint.child)
            assert mass == pytest.approx(other.mass, abs=1e-12)
            if mass > 0:
                np.testing.assert_allclose(center, other.lever, atol=1e-9, err_msg=joint.name)
                np.testing.assert_allclose(inertia, other.inertia, atol=1e-9, err_msg=joint.name)


@pytest.mark.parametrize("name", [*QUADRUPEDS, *OTHERS])
def test_robots_of_others_are_read_as_pinocchio_reads_them(name):
    path = described(name)
    agree(path, read_urdf(path))


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
def test_every_kind_of_joint_moves_as_in_pinocchio(tmp_path, kind):
    path = written(tmp_path, quadruped(lambda text: text.replace('type="revolute"', f'type="{kind}"')))
    agree(path, read_urdf(path))


def test_a_joint_that_follows_another_moves_as_in_pinocchio(tmp_path):
    head, tail = quadruped().split('<joint name="LF_knee"')
    followed = tail.replace(LIMIT, f'{LIMIT}<mimic joint="LF_hip" multiplier="-2" offset="0.3"/>', 1)
    path = written(tmp_path, f'{head}<joint name="LF_knee"{followed}')
    tree = read_urdf(path)
    assert "LF_knee" not in tree.neutral()
    agree(path, tree)
