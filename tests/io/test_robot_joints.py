"""What a robot.toml says of joints and loads: it counts, it is judged, and stiffness of all joints makes it sag."""

import re

import numpy as np
import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.any_robot import load_legged
from footfall.robot.legged.posture import center_of_mass
from tests.support.command_line import run
from tests.support.urdf import written
from tests.support.walkers import ring


@pytest.fixture(scope="module")
def proposed(tmp_path_factory):
    """The folder of a robot with four legs of three joints, and the text that is proposed for it."""
    folder = tmp_path_factory.mktemp("ring")
    run("robot", "init", written(folder, ring(4, effort=60.0)), "--samples", 5)
    return folder, (folder / "robot.toml").read_text(encoding="utf-8")


def loaded(proposed, more: str):
    folder, text = proposed
    path = folder / "edited.toml"
    path.write_text(text + more, encoding="utf-8")
    return load_legged(path)


def stiff(joints, stiffness: float) -> str:
    return "".join(f'\n[joints."{name}"]\nstiffness = {stiffness}\n' for name in joints)


def test_what_is_proposed_says_where_to_write_it_and_says_nothing_itself(proposed):
    _, text = proposed
    assert '# [joints."l0_yaw"]\n# stiffness = ' in text
    robot = loaded(proposed, "")
    assert not robot.sags
    assert np.isinf(robot.stiffness).all()
    assert (robot.efforts == 60.0).all()


def test_what_it_says_counts_before_the_urdf(proposed):
    robot = loaded(proposed, "\n[joints.l1_knee]\neffort = 20\nvelocity = 1.5\n")
    at = robot.joint_names.index("l1_knee")
    assert robot.efforts[at] == 20.0
    assert robot.speeds[at] == 1.5
    assert (np.delete(robot.efforts, at) == 60.0).all()
    assert not robot.sags
    assert robot.digest != loaded(proposed, "").digest


def test_limits_count_before_those_of_the_urdf(proposed):
    bare, robot = loaded(proposed, ""), loaded(proposed, "\n[joints.l1_knee]\nlower = 0.2\nupper = 1.1\n")
    at = robot.joint_names.index("l1_knee")
    assert (robot.lower[at], robot.upper[at]) == (0.2, 1.1)
    np.testing.assert_array_equal(np.delete(robot.lower, at), np.delete(bare.lower, at))
    np.testing.assert_array_equal(np.delete(robot.upper, at), np.delete(bare.upper, at))
    one = loaded(proposed, "\n[joints.l1_knee]\nupper = 1.1\n")
    assert (one.lower[at], one.upper[at]) == (bare.lower[at], 1.1)


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
def test_a_joint_without_limits_walks_once_they_are_said(tmp_path, kind):
    urdf = ring(4, effort=60.0)
    bare = re.sub(
        r'(<joint name="l1_yaw" type=)"revolute"(.*?)lower="[^"]*" upper="[^"]*"', rf'\1"{kind}"\2', urdf, flags=re.S
    )
    assert bare != urdf
    run("robot", "init", written(tmp_path, bare), "--samples", 5)
    text = (tmp_path / "robot.toml").read_text(encoding="utf-8")
    if kind == "revolute":
        assert "# not in the URDF: lower and upper of l1_yaw\n" in text
        with pytest.raises(InvalidRobot, match=r'say them in the robot.toml, under \[joints."l1_yaw"\]'):
            load_legged(tmp_path / "robot.toml")
        with pytest.raises(InvalidRobot, match=r"joints.l1_yaw needs both limits: the URDF says no lower of l1_yaw"):
            loaded((tmp_path, text), "\n[joints.l1_yaw]\nupper = 0.5\n")
    robot = loaded((tmp_path, text), "\n[joints.l1_yaw]\nlower = -0.4\nupper = 0.5\n")
    at = robot.joint_names.index("l1_yaw")
    assert (robot.lower[at], robot.upper[at]) == (-0.4, 0.5)


def test_it_sags_once_the_stiffness_of_every_joint_is_said(proposed):
    names = loaded(proposed, "").joint_names
    assert not loaded(proposed, stiff(names[:-1], 800.0)).sags
    robot = loaded(proposed, stiff(names, 800.0))
    assert robot.sags
    assert (robot.stiffness == 800.0).all()


LOAD = """
[[payload]]
name = "tool"
link = "base"
mass = 3.0
center = [0.1, -0.05, 0.2]
"""


def test_a_load_weighs_where_it_lies(proposed):
    bare, robot = loaded(proposed, ""), loaded(proposed, LOAD)
    assert robot.mass == pytest.approx(bare.mass + 3.0)
    q = np.zeros(len(robot.joint_names))
    expected = (bare.mass * center_of_mass(bare, q) + 3.0 * np.array([0.1, -0.05, 0.2])) / robot.mass
    np.testing.assert_allclose(center_of_mass(robot, q), expected, atol=1e-12)
    (before, about, old), (after, there, new) = (
        (link.mass, link.center, link.inertia) for link in (one.model.tree.link("base") for one in (bare, robot))
    )
    # about any point, the parts' moments add up
    assert _about(np.zeros(3), after, there, new) == pytest.approx(
        _about(np.zeros(3), before, about, old)
        + _about(np.zeros(3), 3.0, np.array([0.1, -0.05, 0.2]), np.zeros((3, 3)))
    )
    folder, _ = proposed
    line = next(
        one for one in run("robot", "check", folder / "edited.toml").stdout.splitlines() if "mass_check says" in one
    )
    assert line.endswith(": 0.0% apart")


def _about(point: np.ndarray, mass: float, center: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    away = center - point
    return inertia + mass * (away @ away * np.eye(3) - np.outer(away, away))


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ("\n[joints.l9_knee]\nstiffness = 5\n", "joints: the URDF has no joint 'l9_knee' that moves"),
        ("\n[joints.l0_sole]\nstiffness = 5\n", "joints: the URDF has no joint 'l0_sole' that moves"),
        ("\n[joints.l0_knee]\nstiffness = 0\n", "joints.l0_knee.stiffness must be above zero"),
        ("\n[joints.l0_knee]\neffort = -3\n", "joints.l0_knee.effort must be above zero"),
        ("\n[joints.l0_knee]\nlower = 1\nupper = 0.5\n", "joints.l0_knee: its lower limit must be below its upper one"),
        ("\n[joints.l0_knee]\nlower = -inf\n", "joints.l0_knee.lower"),
        ("\n[joints.l0_knee]\nstiffness = nan\n", "joints.l0_knee.stiffness"),
        ('\n[joints.l0_knee]\nstiffness = "stiff"\n', "joints.l0_knee.stiffness must be a"),
        (
            "\n[joints.l0_knee]\nstifness = 5\n",
            "joints.l0_knee has no entry 'stifness'",
        ),
        ("\n[joints]\nl0_knee = 5\n", "joints.l0_knee must be a table"),
        (LOAD.replace("base", "roof"), "payload tool: the URDF has no link 'roof'"),
        (LOAD.replace("3.0", "-1"), "payload tool: its mass must be above zero [kg]"),
        (LOAD.replace("mass = 3.0\n", ""), "payload[0].mass"),
    ],
)
def test_what_can_not_be_is_refused_by_name(proposed, more, why):
    with pytest.raises(InvalidRobot) as refused:
        loaded(proposed, more)
    assert why in refused.value.message
