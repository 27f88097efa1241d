"""The Ambler as it ships: made of its sizes, sound, and standing as its source says."""

import numpy as np
import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.any_robot import load_legged, load_robot
from footfall.io.robot_files import load_robot as load_athlete_s_build
from footfall.io.robot_files import robot_toml
from footfall.io.urdf.examine import examine
from footfall.io.urdf.proposed import read_proposed
from footfall.robot.assets.ambler_sizes import AmblerSizes
from footfall.robot.assets.generate import ambler_texts
from footfall.robot.legged.finding import Grade
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.legged.touching import touching

WIDER = AmblerSizes(width=5.0, apart=1.7, lowest=3.6, shortest=1.05)


def made(sizes, folder):
    for name, text in ambler_texts(sizes).items():
        (folder / name).write_text(text)
    return folder / "robot.toml"


def extent(robot):
    """Length, width and height of the posture "stand": of the feet, and from the feet to the highest point [m]."""
    where = placed(robot, robot.posture("stand"))
    top = max(
        float((corners @ T[2, :3]).max() + T[2, 3])
        for corners, T in zip(robot.corners, where.Ts_base_body, strict=True)
        if len(corners)
    )
    return (*np.ptp(where.soles[:, :2], axis=0), top - float(where.soles[:, 2].min()))


def test_the_committed_files_are_what_the_sizes_make():
    for name, text in ambler_texts(AmblerSizes()).items():
        assert (robot_toml("ambler").parent / name).read_text() == text, name


def test_it_is_known_by_name_and_by_path():
    by_name, by_path = load_robot("ambler"), load_legged(robot_toml("ambler"))
    assert isinstance(by_name, LeggedRobot)
    assert by_name.digest == by_path.digest


def test_what_takes_athlete_s_legs_alone_says_so_of_it():
    with pytest.raises(InvalidRobot, match="takes ATHLETE's legs alone"):
        load_athlete_s_build("ambler")


@pytest.mark.parametrize("sizes", [AmblerSizes(), WIDER], ids=["published", "wider"])
def test_all_findings_are_good(sizes, tmp_path):
    findings = examine(made(sizes, tmp_path))
    assert [one.text for one in findings if one.grade is not Grade.GOOD] == []
    assert len(findings) == 14


@pytest.mark.parametrize("sizes", [AmblerSizes(), WIDER], ids=["published", "wider"])
def test_the_stance_has_the_sizes_it_was_made_for(sizes, tmp_path):
    robot = load_legged(made(sizes, tmp_path))
    np.testing.assert_allclose(extent(robot), (sizes.length, sizes.width, sizes.height), atol=1e-9)


def test_the_published_stance_is_5_m_tall_4_5_m_wide_and_3_5_m_long():
    np.testing.assert_allclose(extent(load_legged("ambler")), (3.5, 4.5, 5.0), atol=1e-9)


def test_masses_are_those_of_the_sizes():
    sizes, robot = AmblerSizes(), load_legged("ambler")
    assert robot.mass == pytest.approx(sizes.arch_mass + 6 * sum(sizes.leg_masses))
    # a vertical alone bears half of the weight
    assert robot.efforts.reshape(6, 3)[:, 2].min() > robot.mass * 9.81 / 2


def test_the_telescopes_hold_their_inner_parts_at_both_ends_of_their_way():
    robot = load_legged("ambler")
    for leg in robot.legs:
        hub = robot.slices[leg].start + 1
        for end in (robot.lower, robot.upper):
            q = robot.posture("stand")
            q[robot.slices[leg]][1:] = end[robot.slices[leg]][1:]
            Ts = placed(robot, q).Ts_base_body
            lowest = (robot.corners[hub + 1] @ Ts[hub + 1, 2, :3] + Ts[hub + 1, 2, 3]).min()
            inner = robot.corners[hub + 2] @ Ts[hub + 2, 2, :3] + Ts[hub + 2, 2, 3]
            assert inner.min() < lowest < inner.max()


def test_some_pairs_touch_in_some_postures_and_none_in_all():
    tree = read_proposed(robot_toml("ambler")).model.tree
    found = touching(tree, 100)
    joined = {frozenset((tree.bodies()[joint.parent], joint.child)) for joint in tree.joints if joint.moves}
    assert {frozenset(pair) for pair in found.always} <= joined
    # legs of one stack can meet, and legs of both between the stacks
    stacks = [{name.split("_")[0] for name in pair.split("|")} for pair in found.sometimes]
    assert {"left"} in stacks
    assert {"left", "right"} in stacks
