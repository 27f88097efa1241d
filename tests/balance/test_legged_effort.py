"""Efforts that hold a legged robot: the compiled program against HiGHS on pin's own model."""

import numpy as np
import pytest

from footfall.balance import legged_effort
from footfall.balance.cones import generators
from footfall.balance.friction import FRICTION
from footfall.balance.legged_effort import effort_ratio
from footfall.balance.simplex import UNFINISHED
from footfall.core.frames import rotation_rpy, transform
from footfall.io.any_robot import load_legged
from footfall.io.robot_files import robot_toml
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from tests.support.legged_recheck import Recheck
from tests.support.robot_data import described
from tests.support.urdf import written
from tests.support.walkers import ring


def robot_of(name, folder) -> tuple[LeggedRobot, Recheck]:
    path = described(name) if isinstance(name, str) else written(folder, ring(name))
    robot = LeggedRobot(legged_model(read_urdf(path)))
    return robot, Recheck(path, robot, list(path.parents[2:5]))


@pytest.mark.parametrize("name", ["A1", "HyQ", "ANYmal C", 3, 6])
def test_the_least_share_is_that_of_a_linear_program_on_another_model(name, tmp_path):
    robot, other = robot_of(name, tmp_path)
    rng = np.random.default_rng(11)
    middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
    held = 0
    for _ in range(12):
        q = np.clip(0.3 * middle + 0.2 * rng.uniform(-1, 1, len(middle)) * half, robot.lower, robot.upper)
        roll, pitch = rng.uniform(-0.15, 0.15, 2)
        T = transform(rotation_rpy(roll, pitch, rng.uniform(-3, 3)), rng.uniform(-5, 5, 3))
        standing = sorted(rng.permutation(robot.legs)[: rng.integers(3, len(robot.legs) + 1)])
        normals = np.column_stack([rng.uniform(-0.2, 0.2, (len(standing), 2)), np.ones(len(standing))])
        contacts = (placed(robot, q).soles @ T[:3, :3].T + T[:3, 3])[standing]
        contacts[:, 2] -= robot.radii[standing]
        told = effort_ratio(robot, q, T, standing, contacts, normals)
        edges = generators(normals, FRICTION)
        expected = other.least_share(q, T, standing, contacts, normals, edges)
        if np.isinf(expected):
            assert np.isinf(told)
        else:
            held += 1
            assert told == pytest.approx(expected, rel=1e-5, abs=1e-7)
    assert held > 2


def test_a_search_that_loses_its_way_begins_with_another_foot(monkeypatch):
    """As it does with feet in a row to within rounding: the program is the same whichever foot is first."""
    robot = load_legged("ambler")
    other = Recheck(robot_toml("ambler").with_name("ambler.urdf"), robot, [])
    rng, q, standing = np.random.default_rng(4), robot.posture("stand"), [0, 1, 3, 4, 5]
    up, real = np.tile((0.0, 0.0, 1.0), (5, 1)), legged_effort.least_ratio
    firsts = []

    def lost_at_first(arms, *given):
        firsts.append(arms[0])
        return (UNFINISHED, np.inf) if len(firsts) == 1 else real(arms, *given)

    monkeypatch.setattr(legged_effort, "least_ratio", lost_at_first)
    for _ in range(4):
        T = np.eye(4)
        T[:2, 3] = rng.uniform(-0.1, 0.1, 2)
        contacts = (placed(robot, q).soles + T[:3, 3])[standing]
        contacts[:, 1] += 1e-3 * rng.normal(size=5)
        firsts.clear()
        told = effort_ratio(robot, q, T, standing, contacts, up)
        assert told == pytest.approx(
            other.least_share(q, T, standing, contacts, up, generators(up, FRICTION)), rel=1e-5
        )
        assert len(firsts) >= 2
        assert np.abs(firsts[0] - firsts[1]).max() > 0.1


def test_a_posture_is_held_by_the_same_whatever_was_asked_before(tmp_path):
    """Work space of pin is kept between calls."""
    robot, _ = robot_of(4, tmp_path)
    low, high = (robot.lower + (robot.upper - robot.lower) * share for share in (0.4, 0.6))
    up = np.tile((0.0, 0.0, 1.0), (4, 1))

    def asked(q):
        where = placed(robot, q)
        return [effort_ratio(robot, q, np.eye(4), robot.legs, where.soles, up), *where.com, *where.soles.ravel()]

    first, other, again = asked(low), asked(high), asked(low)
    assert first == again
    assert first != other


def test_joints_without_a_limit_do_not_count_but_friction_does(tmp_path):
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, ring(4, effort=0.0)))))
    q = (robot.lower + robot.upper) / 2
    contacts, up = placed(robot, q).soles, np.tile((0.0, 0.0, 1.0), (4, 1))
    assert effort_ratio(robot, q, np.eye(4), robot.legs, contacts, up) == pytest.approx(0.0, abs=1e-9)
    steep = np.tile((2.0, 0.0, 1.0), (4, 1))  # no friction holds on ground that leans by 63° all one way
    assert np.isinf(effort_ratio(robot, q, np.eye(4), robot.legs, contacts, steep))


def test_a_leg_in_the_air_counts_with_its_own_weight(tmp_path):
    """With hardly any weight on the others, a foot that is lifted is what its hip must hold."""
    robot = LeggedRobot(legged_model(read_urdf(written(tmp_path, ring(6)))))
    q = np.clip(np.zeros(18), robot.lower, robot.upper)
    q[robot.slices[0]] = 0.0, 0.0, robot.lower[2]  # stretched out
    contacts, up = placed(robot, q).soles[1:], np.tile((0.0, 0.0, 1.0), (5, 1))
    told = effort_ratio(robot, q, np.eye(4), range(1, 6), contacts, up)
    thigh, shank, foot = 0.5 * 0.11, 0.3 * (0.22 + 0.13 * np.cos(0.3)), 0.05 * (0.22 + 0.26 * np.cos(0.3))
    own = 9.81 * (thigh + shank + foot) / 60.0
    assert told >= own - 1e-9
