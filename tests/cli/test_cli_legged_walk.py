"""`footfall plan walk --robot robot.toml`: a robot that others described, from its URDF to a walk."""

import json

import pytest

import footfall
from footfall.io.any_robot import is_legged, load_legged
from footfall.io.artifacts import decode
from footfall.io.terrain_files import write_terrain
from footfall.planning.legged.problem import LeggedResult
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.terrain.generate import plane
from tests.support.command_line import run
from tests.support.urdf import written
from tests.support.walkers import ring


@pytest.fixture(scope="module")
def described(tmp_path_factory):
    """A folder with a hexapod's robot.toml and level ground."""
    folder = tmp_path_factory.mktemp("hexapod")
    run("robot", "init", written(folder, ring(6)), "--samples", 20)
    write_terrain(plane(4.0, 0.1), folder / "level.tif")
    return folder


def test_a_robot_of_your_own_walks(described):
    out = described / "walk.npz"
    asked = ["plan", "walk", described / "level.tif", "--robot", described / "robot.toml", "--goal", 0.08, 0]
    told = json.loads(run(*asked, "--time-limit", 1e6, "--out", out, "--json").stdout)
    assert told["status"] == "found"
    assert told["figures"]["foot_moves"] >= 6
    assert {"support", "ground", "self", "effort"} <= {check["name"] for check in told["checks"]}
    result = decode(out.read_bytes())
    assert isinstance(result, LeggedResult)
    assert result.digest == told["digest"]
    known = ["--robot", described / "robot.toml", "--terrain", described / "level.tif"]
    lines = run("export", out, "--format", "csv", *known).stdout.splitlines()
    assert lines[0].endswith("l5_yaw_rad,l5_hip_rad,l5_knee_rad")
    assert len(lines) == told["figures"]["waypoints"]
    assert "walk.npz is of ring: give its --robot and --terrain" in run("export", out, code=2).stderr
    write_terrain(plane(5.0, 0.1), described / "other.tif")
    said = run("export", out, *known[:3], described / "other.tif", code=2).stderr
    assert "was planned with another terrain" in said


def test_no_is_an_answer_and_options_of_the_rover_are_refused(described):
    asked = ["plan", "walk", described / "level.tif", "--robot", described / "robot.toml"]
    assert "off_map: the goal (9.00, 0.00) m is off the map" in run(*asked, "--goal", 9, 0, code=1).stdout
    said = run(*asked, "--goal", 0.1, 0, "--posture", "tall", "--tether", 1, 0, 2, code=2).stderr
    assert "--tether, --posture can't be planned with ring" in said


def test_what_robot_toml_says_is_what_the_robot_keeps(described):
    path = described / "robot.toml"
    assert is_legged(path)
    assert isinstance(footfall.load_robot(path), LeggedRobot)
    assert isinstance(footfall.load_robot("athlete"), Robot)
    changed = path.read_text().replace("ground = 0.0112", "ground = 0.03")
    changed = changed.replace("[postures.neutral]", "[postures.stand]")
    other = described / "other.toml"
    other.write_text(changed)
    robot = load_legged(other)
    assert robot.clearances["ground"] == 0.03
    assert robot.clearances["base"] == pytest.approx(0.0112)
    assert set(robot.postures) == {"stand"}
