"""Every finding of `examine`, in each of its grades, on robots broken on purpose."""

import re

import pytest

from footfall.io.any_robot import load_legged
from footfall.io.urdf.examine import examine
from footfall.robot.legged.finding import Grade
from tests.support.proposed import edited, proposed
from tests.support.urdf import FOOT, INERTIA, LIMIT, link, quadruped, replaced, written
from tests.support.walkers import ring

GOOD, DOUBTFUL, UNUSABLE = Grade.GOOD, Grade.DOUBTFUL, Grade.UNUSABLE
CHECKS = (
    "mass",
    "inertia",
    "limits",
    "effort",
    "velocity",
    "mesh size",
    "legs",
    "feet",
    "collision",
    "mimic",
    "symmetry",
    "walking",
)


def moments(xx: float, yy: float, zz: float):
    return replaced(INERTIA, f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>')


def of_foot(old: str, new: str):
    """A change of the first foot alone."""
    return replaced(link("LF_foot", 0.1, FOOT), link("LF_foot", 0.1, FOOT).replace(old, new))


def without_legs(*names: str):
    def change(text: str) -> str:
        return "\n".join(line for line in text.splitlines() if not any(f'"{name}_' in line for name in names))

    return change


MASS_OF_RF = replaced(
    '<link name="RF_shank"><inertial><mass value="1.0"/>', '<link name="RF_shank"><inertial><mass value="1.1"/>'
)
ROD = '<origin xyz="0 0 -0.15"/><geometry><cylinder radius="0.02" length="0.2"/></geometry>'


def test_a_sound_robot_is_good_in_every_check(tmp_path):
    findings = examine(written(tmp_path, ring(4)))
    assert tuple(one.check_name for one in findings) == CHECKS
    assert {one.grade for one in findings} == {GOOD}
    assert re.fullmatch(r"\d+ links weigh \d+\.\d{3} kg", findings[0].text)


def test_a_robot_of_two_joints_a_leg_is_good_but_for_walking(tmp_path):
    *others, a, b, c, d = examine(written(tmp_path, quadruped()))
    assert tuple(one.check_name for one in others) == CHECKS[:-1]
    assert {one.grade for one in others} == {GOOD}
    assert others[0].text == "13 links weigh 22.400 kg"
    unable = [(one.check_name, one.grade, one.where) for one in (a, b, c, d)]
    assert unable == [("walking", DOUBTFUL, leg) for leg in ("LF", "RF", "LH", "RH")]


@pytest.mark.parametrize(
    ("grade", "check", "where", "number", "change"),
    [
        (UNUSABLE, "mass", "base", "-1", replaced('<mass value="10.0"/>', '<mass value="-1"/>')),
        (UNUSABLE, "mass", "base", "nan", replaced('<mass value="10.0"/>', '<mass value="nan"/>')),
        (UNUSABLE, "mass", "base", "weigh 0 kg", lambda text: re.sub('mass value="[^"]*"', 'mass value="0"', text)),
        (DOUBTFUL, "mass", "LF_thigh", "0 kg", replaced('<mass value="2.0"/>', '<mass value="0"/>')),
        (UNUSABLE, "inertia", "base", "-0.01", moments(-0.01, 0.02, 0.02)),
        (UNUSABLE, "inertia", "base", "not finite", moments(float("nan"), 0.02, 0.02)),
        (DOUBTFUL, "inertia", "base", "0.05 kg·m² is more than 0.02 + 0.02", moments(0.05, 0.02, 0.02)),
        (DOUBTFUL, "inertia", "base", "a point mass", moments(0, 0, 0)),
        (DOUBTFUL, "inertia", "LF_foot", "LF_shank is sound", of_foot('ixx="0.02"', 'ixx="-0.001"')),
        (
            UNUSABLE,
            "limits",
            "LF_hip",
            "lower 1, upper -1 rad",
            replaced(LIMIT, LIMIT.replace('"-1"', '"2"').replace('"1"', '"-1"').replace('"2"', '"1"')),
        ),
        (UNUSABLE, "limits", "LF_hip", "without limits", replaced(LIMIT, '<limit effort="40" velocity="8"/>')),
        (UNUSABLE, "limits", "LF_hip", "both limits are 1", replaced(LIMIT, LIMIT.replace('"-1"', '"1"'))),
        (
            DOUBTFUL,
            "limits",
            "LF_hip",
            "28.6 times round",
            replaced(LIMIT, LIMIT.replace('"-1"', '"-90"').replace('"1"', '"90"')),
        ),
        (DOUBTFUL, "effort", "LF_hip", "is 0", replaced('effort="40"', 'effort="0"')),
        (DOUBTFUL, "effort", "LF_hip", "not said", replaced(' effort="40"', "")),
        (UNUSABLE, "effort", "LF_hip", "-40", replaced('effort="40"', 'effort="-40"')),
        (DOUBTFUL, "velocity", "LF_hip", "is 0", replaced('velocity="8"', 'velocity="0"')),
        (UNUSABLE, "velocity", "LF_hip", "-8", replaced('velocity="8"', 'velocity="-8"')),
        (
            UNUSABLE,
            "mesh size",
            "base",
            "700 m large, and the joints reach 0.961 m",
            replaced("0.7 0.3 0.1", "700 300 100"),
        ),
        (DOUBTFUL, "mesh size", "base", "7 m large", replaced("0.7 0.3 0.1", "7 3 1")),
        (
            DOUBTFUL,
            "mesh size",
            "base",
            "cone.obj is 6e-05 m large, and the joints reach 0.961 m: scaled twice",
            replaced('<box size="0.7 0.3 0.1"/>', '<mesh filename="cone.obj" scale="0.001 0.001 0.001"/>'),
        ),
        (UNUSABLE, "legs", "base", "2 legs, and 3 to 12", without_legs("LF", "RF")),
        (UNUSABLE, "legs", "base", "no joint that moves", without_legs("LF", "RF", "LH", "RH")),
        (
            DOUBTFUL,
            "legs",
            "LF",
            "0.130 m above",
            replaced('<origin xyz="0.3 0.2 0"/>', '<origin xyz="0.3 0.2 0.13"/>'),
        ),
        (
            DOUBTFUL,
            "feet",
            "LF_foot",
            "frame lies 0.070 m off",
            of_foot("<collision>", '<collision><origin xyz="0 0 -0.1"/>'),
        ),
        (
            DOUBTFUL,
            "feet",
            "LF_foot",
            "neither round nor flat",
            of_foot(FOOT, '<geometry><mesh filename="cone.obj"/></geometry>'),
        ),
        (DOUBTFUL, "collision", "LF_thigh", "no collision shape", replaced(f"<collision>{ROD}</collision>", "")),
        (DOUBTFUL, "mimic", "LF_knee", "one free joint fewer", lambda text: mimicking(text, "LF_hip")),
        (UNUSABLE, "mimic", "LF_knee", "no joint of leg LF", lambda text: mimicking(text, "RF_knee")),
        (DOUBTFUL, "symmetry", "RF and LF", "3.2 kg, the other 3.1 kg", MASS_OF_RF),
        (
            DOUBTFUL,
            "symmetry",
            "RF and LF",
            "effort of RF_hip is 40, of LF_hip 41",
            replaced('effort="40"', 'effort="41"'),
        ),
        (
            DOUBTFUL,
            "symmetry",
            "RF and LF",
            "limits of RF_hip are -1 … 1, of LF_hip -1 … 1.5",
            replaced('upper="1"', 'upper="1.5"'),
        ),
        (
            DOUBTFUL,
            "symmetry",
            "RF and LF",
            "0.3000 m long, the other 0.3200 m",
            replaced('xyz="0 0 -0.3"', 'xyz="0 0 -0.32"'),
        ),
        (
            DOUBTFUL,
            "symmetry",
            "RF and LF",
            "radius 0.03 m, the other 0.02 m",
            of_foot('radius="0.03"', 'radius="0.02"'),
        ),
        (UNUSABLE, "reading", "robot.urdf", "document type", lambda text: "<!DOCTYPE robot>" + text),
    ],
)
def test_what_is_broken_is_told_with_name_and_number(tmp_path, grade, check, where, number, change):
    (tmp_path / "cone.obj").write_text(CONE)
    findings = examine(written(tmp_path, quadruped(change)))
    told = [one for one in findings if (one.check_name, one.where) == (check, where)]
    assert [one.grade for one in told if number in one.text] == [grade], [(one.where, one.text) for one in findings]
    assert all(one.grade is not GOOD for one in told)


CONE = "v 0 0 -0.05\nv 0.03 0 0\nv -0.02 0.03 0\nv -0.02 -0.03 0\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n"


def mimicking(text: str, leader: str) -> str:
    """The knee of the first leg follows another joint; a third joint keeps two that are free."""
    head, tail = text.split('<joint name="LF_knee"')
    tail = tail.replace(LIMIT, f'{LIMIT}<mimic joint="{leader}"/>', 1)
    return f'{head}<joint name="LF_knee"{tail}'.replace(
        '<joint name="LF_sole" type="fixed">', '<joint name="LF_sole" type="continuous">'
    )


@pytest.mark.parametrize(("upper", "grade"), [(1.0, GOOD), (1.0004, GOOD), (1.2, DOUBTFUL)])
def test_mirrored_limits_are_the_same(tmp_path, upper, grade):
    mirrored = f'<limit lower="-{upper}" upper="0.5" effort="40" velocity="8"/>'
    plain = quadruped().replace(LIMIT, '<limit lower="-0.5" upper="1" effort="40" velocity="8"/>')
    findings = examine(
        written(tmp_path, plain.replace('<limit lower="-0.5" upper="1" effort="40" velocity="8"/>', mirrored, 1))
    )
    assert {one.grade for one in findings if one.check_name == "symmetry"} == {grade}


ROD = (
    '<link name="rod"/><joint name="l0_rod" type="revolute"><parent link="l0_thigh"/><child link="rod"/>'
    '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/><mimic joint="l0_knee"/></joint></robot>'
)


def test_what_follows_a_leg_beside_its_chain_is_told(tmp_path):
    path = proposed(tmp_path, ring(4))
    written(tmp_path, ring(4).replace("</robot>", ROD))
    (found,) = [one for one in examine(path) if one.check_name == "mimic"]
    assert (found.grade, found.where) == (DOUBTFUL, "l0_rod")
    assert "it follows l0_knee of leg 0 beside its chain" in found.text
    assert "l0_rod" not in load_legged(path).joint_names


@pytest.mark.parametrize("legs", [3, 4])
def test_three_legs_are_told_not_to_walk(tmp_path, legs):
    told = [one for one in examine(written(tmp_path, ring(legs))) if one.check_name == "walking"]
    assert [one.grade for one in told] == [DOUBTFUL if legs == 3 else GOOD]
    assert ("it stands on 3 legs, and none of them can be lifted" in told[0].text) == (legs == 3)


def test_a_leg_whose_name_is_another_number_is_told(tmp_path):
    path = proposed(tmp_path, ring(4))
    assert [one.grade for one in examine(path) if one.check_name == "legs"] == [GOOD]
    edited(path, 'name = "3"', 'name = "7"')
    (told,) = [one for one in examine(path) if one.check_name == "legs" and one.grade is DOUBTFUL]
    assert told.where == "7"
    assert "it is leg 3" in told.text
