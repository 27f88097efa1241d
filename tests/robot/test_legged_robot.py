"""Legged robots that compute: masses and places as pin reads them, legs that reach, bodies that keep apart."""

import pickle
import re

import numpy as np
import pinocchio as pin
import pytest

from footfall.core.errors import InvalidInput, InvalidRobot, NotFound
from footfall.core.frames import rotation_rpy, transform
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.apart import BodyPairs
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_model import LegChain, LeggedModel, Sole
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import chassis_pose, legs_to, placed
from tests.support.legged_recheck import Recheck
from tests.support.robot_data import described
from tests.support.urdf import quadruped, replaced, written
from tests.support.walkers import ring

REAL = ["A1", "HyQ", "ANYmal C", "Go2"]


def made(folder, legs: int = 6) -> tuple:
    path = written(folder, ring(legs))
    return path, LeggedRobot(legged_model(read_urdf(path)))


def real(name: str) -> tuple:
    path = described(name)
    return path, LeggedRobot(legged_model(read_urdf(path)))


def drawn(robot: LeggedRobot, count: int, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, len(robot.lower)))


@pytest.mark.parametrize("name", [*REAL, 3, 5, 12])
def test_soles_and_weight_are_where_pin_has_them(name, tmp_path):
    path, robot = real(name) if isinstance(name, str) else made(tmp_path, name)
    other = Recheck(path, robot, list(path.parents[2:5]))
    assert robot.mass == pytest.approx(other.mass)
    for q in drawn(robot, 8):
        where = placed(robot, q)
        np.testing.assert_allclose(where.soles, other.soles_at(q, np.eye(4)), atol=1e-9)
        np.testing.assert_allclose(where.com, other.center_of_mass(other.full(q)), atol=1e-9)


def test_legs_that_weigh_nothing_leave_the_weight_to_the_base(tmp_path):
    """Their centre was no number, so that no stance kept the weight over its feet."""
    text = re.sub(r'mass value="0\.\d+"', 'mass value="0"', ring(4)).replace(
        'xyz="0 0 0"/><mass', 'xyz="0.1 0 0"/><mass'
    )
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, text))))
    assert robot.mass == 8.0
    for q in drawn(robot, 3):
        np.testing.assert_allclose(placed(robot, q).com, (0.1, 0.0, 0.0), atol=1e-12)


@pytest.mark.parametrize("name", [*REAL, 4, 7])
def test_legs_go_back_to_where_their_soles_were(name, tmp_path):
    _, robot = real(name) if isinstance(name, str) else made(tmp_path, name)
    T_site_base = transform(rotation_rpy(0.1, -0.2, 2.0), (3.0, -1.0, 0.7))
    rng = np.random.default_rng(5)
    middle = (robot.lower + robot.upper) / 2
    for q in middle + rng.uniform(-0.3, 0.3, (6, len(middle))) * (robot.upper - robot.lower) / 2:
        soles = placed(robot, q).soles @ T_site_base[:3, :3].T + T_site_base[:3, 3]
        near = np.clip(q + rng.uniform(-0.02, 0.02, len(q)), robot.lower, robot.upper)
        there = legs_to(robot, T_site_base, soles, near)
        for leg in robot.legs:  # a leg that is stretched straight may have no way back
            part = robot.slices[leg]
            if np.isfinite(there[part]).all():
                np.testing.assert_allclose(
                    placed(robot, np.nan_to_num(there)).soles[leg], placed(robot, q).soles[leg], atol=1e-6
                )
        assert np.isfinite(there).mean() > 0.8


def test_a_leg_that_does_not_reach_has_no_angles(tmp_path):
    _, robot = made(tmp_path)
    q = (robot.lower + robot.upper) / 2
    soles = placed(robot, q).soles.copy()
    soles[2] += (0.0, 0.0, -2.0)
    there = legs_to(robot, np.eye(4), soles, q)
    assert np.isnan(there[robot.slices[2]]).all()
    assert np.isfinite(np.delete(there, np.r_[robot.slices[2]])).all()


@pytest.mark.parametrize("legs", [3, 6])
def test_distances_between_bodies_are_never_told_too_large(legs, tmp_path):
    path, robot = made(tmp_path, legs)
    apart, other = BodyPairs(robot), Recheck(path, robot, [])
    apart.least = np.full(len(apart.pairs), 0.15)
    names = [other.model.frames[one.parentFrame].name for one in other.shapes.geometryObjects]
    first = robot.model.tree.bodies()
    near = 0
    for q in drawn(robot, 25):
        told = apart.distances(placed(robot, q).Ts_base_body)
        pin.updateGeometryPlacements(other.model, other.data, other.shapes, other.shape_data, other.full(q))
        pin.computeDistances(other.shapes, other.shape_data)
        true: dict[frozenset, float] = {}
        for pair, one in zip(other.shapes.collisionPairs, other.shape_data.distanceResults, strict=True):
            key = frozenset((first[names[pair.first]], first[names[pair.second]]))
            true[key] = min(true.get(key, np.inf), one.min_distance)
        for row, (a, b) in enumerate(apart.pairs):
            distance = true[frozenset((robot.body_names[a], robot.body_names[b]))]
            assert told[row] <= max(distance, 0.0) + 1e-3  # round shapes are read as meshes inside them
            if told[row] < apart.least[row]:  # exact there
                near += 1
                assert told[row] == pytest.approx(max(distance, 0.0), abs=3e-3)
    assert near > 5


def test_bodies_that_are_built_near_each_other_keep_half_of_that(tmp_path):
    _, robot = made(tmp_path)
    apart = BodyPairs(robot)
    poses = placed(robot, (robot.lower + robot.upper) / 2).Ts_base_body
    apart.least = np.full(len(apart.pairs), 10.0)
    distances = apart.distances(poses)
    apart.at_ease(poses)
    np.testing.assert_allclose(apart.least, 0.5 * distances)


def test_a_robot_pickles_as_what_it_was_made_of(tmp_path):
    _, robot = made(tmp_path)
    again = pickle.loads(pickle.dumps(robot))
    q = (robot.lower + robot.upper) / 2
    np.testing.assert_array_equal(placed(again, q).soles, placed(robot, q).soles)
    assert again.digest == robot.digest


def test_all_that_decides_what_is_planned_is_in_the_digest(tmp_path):
    _, plain = made(tmp_path, 4)
    model, joint = plain.model, plain.joint_names[0]
    bodies = (plain.body_names[1], plain.body_names[4])
    changes = [
        LeggedRobot(model, {"stand": {joint: 0.0}}),
        LeggedRobot(model, {"stand": {joint: 0.1}}),
        LeggedRobot(model, None, {"ground": 0.5}),
        LeggedRobot(model, None, {"own_leg": 0.5}),
        LeggedRobot(model, None, None, (bodies,)),
    ]
    assert len({robot.digest for robot in [plain, *changes]}) == 1 + len(changes)
    one, other = {"ground": 0.5, "base": 0.4}, {"base": 0.4, "ground": 0.5}
    assert LeggedRobot(model, None, one, (bodies,)).digest == LeggedRobot(model, None, other, (bodies[::-1],)).digest


def test_a_misspelled_joint_of_a_posture_is_not_taken_for_zero(tmp_path):
    _, robot = made(tmp_path, 4)
    with pytest.raises(InvalidRobot, match="posture stand: the URDF has no joint 'l0_yew'"):
        LeggedRobot(robot.model, {"stand": {"l0_yew": 0.3}})


def test_joints_that_turn_further_than_once_are_taken_for_one_turn():
    _, robot = real("ANYmal B")
    assert (robot.upper - robot.lower <= 2 * np.pi + 1e-12).all()
    assert (robot.lower <= 0).all()
    assert (robot.upper >= 0).all()


def test_efforts_that_are_not_said_are_no_limit(tmp_path):
    path = written(tmp_path, ring(4, effort=0.0))
    assert np.isinf(LeggedRobot(legged_model(read_urdf(path))).efforts).all()


def test_robots_that_cannot_walk_are_refused_by_name(tmp_path):
    with pytest.raises(InvalidRobot, match="leg LF can't walk: it has 2 joints, and one that walks needs 3 to 7"):
        LeggedRobot(legged_model(read_urdf(written(tmp_path, quadruped()))))
    limit = '<limit lower="-0.9" upper="0.9" effort="60.0" velocity="6"/>'
    text = replaced(limit, '<limit effort="60.0" velocity="6"/>')(ring(4))
    with pytest.raises(InvalidRobot, match="joint l0_yaw has no limits"):
        LeggedRobot(legged_model(read_urdf(written(tmp_path, text))))
    model = legged_model(read_urdf(written(tmp_path, ring(4))))
    corners = np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)], float)
    flat = Sole("flat", np.zeros(3), 0.0, np.array([0.0, 0.0, -1.0]), 0.0, corners)
    legs = tuple(LegChain(leg.name, leg.joints, leg.foot, flat, leg.group) for leg in model.legs)
    with pytest.raises(InvalidRobot, match="can't walk: it has a flat sole"):
        LeggedRobot(LeggedModel(model.tree, model.base, legs, {}))


def test_what_a_robot_does_not_have_is_refused(tmp_path):
    _, robot = made(tmp_path, 4)
    with pytest.raises(InvalidInput, match="needs 12 finite numbers"):
        placed(robot, np.zeros(11))
    with pytest.raises(InvalidInput, match="legs 0 to 3"):
        robot.require_leg(4)
    with pytest.raises(NotFound, match="no posture 'tall'; it has none"):
        robot.posture("tall")


def test_a_chassis_pose_leans_and_heads_as_asked():
    rng = np.random.default_rng(2)
    for _ in range(50):
        yaw, up = rng.uniform(-3, 3), np.append(rng.uniform(-0.5, 0.5, 2), 1.0)
        T = chassis_pose(1.0, 2.0, 3.0, yaw, up)
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-12)
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
        np.testing.assert_allclose(T[:3, 2], up / np.linalg.norm(up), atol=1e-12)
        assert np.arctan2(T[1, 0], T[0, 0]) == pytest.approx(yaw)
