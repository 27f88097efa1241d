"""`footfall robot init` and `footfall robot check`: what they print, write and answer with."""

import json
import tomllib

import numpy as np
import pytest

from footfall.io.urdf.proposed import read_proposed
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from tests.support.command_line import run
from tests.support.robot_data import QUADRUPEDS, described
from tests.support.urdf import LIMIT, quadruped, replaced, written
from tests.support.walkers import ring


@pytest.mark.parametrize("name", ["ANYmal C", "Solo-12", "HyQ", "Go2", "Centauro (wheels for feet)"])
def test_what_is_proposed_reads_back_as_what_was_found(name, tmp_path):
    urdf, out = described(name), tmp_path / "proposed" / "robot.toml"
    out.parent.mkdir()
    run("robot", "init", urdf, "--out", out, "--samples", 5, "--seed", 4)
    proposed, found = read_proposed(out), legged_model(read_urdf(urdf))
    for one, other in zip(proposed.model.legs, found.legs, strict=True):
        assert (one.name, one.foot, one.joints, one.group) == (other.name, other.foot, other.joints, other.group)
        assert one.sole.kind == other.sole.kind
        np.testing.assert_allclose(one.sole.center, other.sole.center, atol=1e-5)
        assert one.sole.radius == pytest.approx(other.sole.radius, rel=1e-5)
    assert proposed.mass_check == pytest.approx(found.tree.mass, rel=1e-5)
    assert proposed.postures["neutral"] == pytest.approx(found.tree.neutral(), abs=1e-5)


def test_init_writes_beside_the_urdf_and_never_over_a_file_unasked(tmp_path):
    urdf = written(tmp_path, quadruped())
    said = run("robot", "init", urdf).stdout
    assert "leg LF: 2 joints to LF_foot, ball, group 0" in said
    first = (tmp_path / "robot.toml").read_text()
    assert "is there already" in run("robot", "init", urdf, code=2).stderr
    told = json.loads(run("robot", "init", urdf, "--force", "--json").stdout)
    assert (tmp_path / "robot.toml").read_text() == first, "the same seed proposes the same"
    assert [leg["name"] for leg in told["legs"]] == ["LF", "RF", "LH", "RH"]
    assert sum(told["pairs"].values()) == 9 * 8 / 2


def test_every_number_says_where_it_comes_from(tmp_path):
    run("robot", "init", written(tmp_path, quadruped()))
    text = (tmp_path / "robot.toml").read_text()
    raw = tomllib.loads(text)
    for name in raw["clearances"]:
        assert f"\n{name} = 0.012  # (assumed)" in text
    assert "(sampled) 200 postures" in text
    assert f"mass_check = {raw['mass_check']:g}  # [kg] (URDF)" in text
    assert "seldomer than in 1.50% of postures" in text


@pytest.mark.parametrize("name", ['say "hi"', "back\\slash", "ü\u2028new", "]]", "# no", "a\x7fb"])
def test_names_that_toml_must_quote_come_back(tmp_path, name):
    from xml.sax.saxutils import quoteattr

    urdf = written(tmp_path, quadruped().replace('"LF_foot"', quoteattr(name)))
    run("robot", "init", urdf, "--samples", 1)
    assert read_proposed(tmp_path / "robot.toml").model.legs[0].foot == name


def test_check_says_the_grade_in_words_and_by_its_exit_code(tmp_path):
    good = written(tmp_path, quadruped())
    said = run("robot", "check", good).stdout
    assert "● good          mass" in said
    assert said.endswith("11 good, 4 doubtful, 0 can't be used\n")
    for leg in ("LF", "RF", "LH", "RH"):
        unable = f"▲ doubtful      walking     {leg}: FootFall can't walk with it: it has 2 joints, and one that walks"
        assert f"{unable} needs 3 to 7\n" in said
    walks = run("robot", "check", written(tmp_path, ring(4))).stdout
    assert "● good          walking     every leg can walk" in walks
    assert walks.endswith(" 0 doubtful, 0 can't be used\n")
    doubtful = written(tmp_path, quadruped(replaced('effort="40"', 'effort="0"')))
    assert "▲ doubtful      effort      LF_hip: its effort is 0" in run("robot", "check", doubtful).stdout
    bad = written(tmp_path, quadruped(replaced(LIMIT, "")))
    assert "✕ can't be used limits      LF_hip: " in run("robot", "check", bad, code=1).stdout
    told = json.loads(run("robot", "check", bad, "--json", code=1).stdout)
    assert (told["ok"], told["counts"]["unusable"]) == (False, 1)
    (fault,) = [one for one in told["findings"] if one["grade"] == "can't be used"]
    assert (fault["check_name"], fault["where"]) == ("limits", "LF_hip")


def test_what_is_not_there_is_misuse(tmp_path):
    for ending in ("urdf", "toml"):
        assert "there is no" in run("robot", "check", tmp_path / f"lost.{ending}", code=2).stderr
    assert "there is no URDF" in run("robot", "init", tmp_path / "lost.urdf", code=2).stderr


@pytest.mark.parametrize(
    ("old", "new", "code", "told"),
    [
        ("mass_check = 22.4", "mass_check = 22.6", 0, "● good          mass_check"),
        (
            "mass_check = 22.4",
            "mass_check = 25",
            0,
            "mass_check  base: the links weigh 22.400 kg, mass_check says 25.000 kg: 10.4%",
        ),
        ("mass_check = 22.4", "mass_check = 60", 1, "✕ can't be used mass_check"),
        ("mass_check = 22.4", "mass_check = -1", 1, "mass_check must be above zero"),
        ('"LF_hip" = 0', '"LF_hip" = 1.5', 1, "LF_hip at 1.5 is outside its limits -1 … 1"),
        ('"LF_hip" = 0', '"hip" = 0', 1, "hip is no joint that moves by itself"),
        ('"LF_hip" = 0\n', "", 0, "▲ doubtful      posture     neutral: LF_hip not said"),
        ('foot = "LF_foot"', 'foot = "foot"', 1, "leg LF: the URDF has no link 'foot'"),
        ('["LF_hip", "LF_knee"]', '["LF_knee", "LF_hip"]', 1, "are LF_hip, LF_knee, not LF_knee, LF_hip"),
        ('base = "base"', 'base = "trunk"', 1, "the root link of the URDF is 'base'"),
        ("radius = 0.03", "radius = 0", 1, "radius must be above zero"),
        ('sole = "ball"', 'sole = "hoof"', 1, "a sole is one of wheel, ball, flat, point"),
        ("own_leg = 0.012", "own_leg = -1", 1, "clearances.own_leg must not be negative"),
        ('name = "RF"', 'name = "LF"', 1, "two legs have one name"),
        ("group = 0", 'group = "a"', 1, "group must be a whole number"),
        ("[clearances]", "[clearance]", 1, "has no entry 'clearance'"),
        ("never = [", 'never = [["base", "lost"],', 1, "collisions.never: the URDF has no link 'lost'"),
        ("base = ", "base ==", 1, "is not readable TOML"),
    ],
)
def test_an_edited_robot_is_judged_with_its_urdf(tmp_path, old, new, code, told):
    run("robot", "init", written(tmp_path, quadruped()), "--samples", 20)
    path = tmp_path / "robot.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert told in run("robot", "check", path, code=code).stdout


def test_a_robot_elsewhere_keeps_its_packages(tmp_path):
    import trimesh

    meshes = tmp_path / "far" / "my_robot"
    meshes.mkdir(parents=True)
    trimesh.creation.box(extents=(0.7, 0.3, 0.1)).export(meshes / "base.stl")
    here = tmp_path / "here"
    here.mkdir()
    given = replaced('<box size="0.7 0.3 0.1"/>', '<mesh filename="package://my_robot/base.stl"/>')
    urdf = written(here, quadruped(given))
    assert "--packages" in run("robot", "init", urdf, code=2).stderr
    run("robot", "init", urdf, "--packages", tmp_path / "far", "--samples", 1)
    run("robot", "check", here / "robot.toml")
    run("robot", "check", urdf, "--packages", tmp_path / "far")
    assert "is missing" in run("robot", "check", urdf, code=1).stdout


def test_packages_of_a_robot_toml_are_told_there(tmp_path):
    """Its refusal said to use --packages, which no command heeds beside a robot.toml."""
    given = replaced('<box size="0.7 0.3 0.1"/>', '<mesh filename="package://my_robot/base.stl"/>')
    run("robot", "init", written(tmp_path, quadruped()), "--samples", 1)
    written(tmp_path, quadruped(given))
    robot = tmp_path / "robot.toml"
    assert "among the packages of its robot.toml" in run("robot", "check", robot, code=1).stdout
    said = run("robot", "check", robot, "--packages", tmp_path, code=2).stderr
    assert "robot.toml names its folders itself" in said


@pytest.mark.parametrize("name", QUADRUPEDS)
def test_robots_of_others_are_judged(name):
    code = 1 if name == "Centauro (wheels for feet)" else 0
    told = json.loads(run("robot", "check", described(name), "--json", code=code).stdout)
    assert told["counts"]["good"] >= 6
