"""`footfall plan step`, `plan walk`, `map` with `--robot robot.toml`: from its URDF to steps, walks and maps."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import footfall
from footfall.io.any_robot import is_legged, load_legged
from footfall.io.artifacts import decode
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.maps.colors import REFUSED
from footfall.maps.layers import REACHABLE_STABLE
from footfall.maps.refusals import REFUSALS
from footfall.planning.legged.problem import LeggedResult
from footfall.planning.route.problem import RouteResult, settings_by_leg
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import plane
from tests.support.command_line import run
from tests.support.urdf import written
from tests.support.walkers import ring

LEVEL = "level.tif"


@pytest.fixture(scope="module")
def described(tmp_path_factory):
    """A folder with a hexapod's robot.toml and level ground."""
    folder = tmp_path_factory.mktemp("hexapod")
    run("robot", "init", written(folder, ring(6)), "--samples", 20)
    write_terrain(plane(4.0, 0.1), folder / "level.tif")
    return folder


def test_what_says_nothing_of_its_server_is_refused(described, tmp_path):
    own = ["serve", "--robot", described / "robot.toml", "--terrain", described / LEVEL, "--data", tmp_path]
    assert "--sample opens a copy of a sample" in run(*own, "--sample", "rock-step", code=2).stderr
    assert "the rover of a robot of your own is kinematic" in run(*own, "--physics", code=2).stderr


def test_what_takes_athletes_legs_alone_says_so_of_a_session(described, tmp_path):
    bundle = tmp_path / "own.zip"
    with Sessions(tmp_path / "kept", jobs=InlineJobs()) as sessions:
        bundle.write_bytes(sessions.create("own", described / "robot.toml").export_bundle())
    for asked in (["export", bundle, "--page"], ["referee", bundle, "--terrain", described / "level.tif"]):
        refused = run(*asked, code=2).stderr
        assert "this takes ATHLETE's legs alone, and the session is about ring" in refused


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
    judged = run("referee", out, *known).stdout
    assert judged.startswith("passed\n"), judged
    assert f"{len(lines) - 1} of {len(lines) - 1} commands done" in judged
    assert "assumed: a joint gives 0.05 rad" in judged
    said = run("referee", out, *known, "--payload", 100, "--wheels", 2, code=2).stderr
    assert "--wheels, --payload can't be simulated with ring" in said
    assert "give --terrain" in run("referee", out, *known[:2], code=2).stderr
    write_terrain(plane(5.0, 0.1), described / "other.tif")
    said = run("export", out, *known[:3], described / "other.tif", code=2).stderr
    assert "was planned with another terrain" in said


def test_a_wider_margin_is_kept(described):
    asked = ["plan", "walk", described / "level.tif", "--robot", described / "robot.toml", "--goal", 0.04, 0]
    told = [json.loads(run(*asked, "--time-limit", 1e6, *more, "--json").stdout) for more in ([], ["--margin", 0.08])]
    usual, wide = (answer["provenance"]["settings"]["least_margin"] for answer in told)
    assert wide * load_legged(described / "robot.toml").length == pytest.approx(0.08)
    assert usual < wide
    assert told[1]["status"] == "found"
    assert told[1]["digest"] != told[0]["digest"]


def test_no_is_an_answer_and_options_of_the_rover_are_refused(described):
    asked = ["plan", "walk", described / "level.tif", "--robot", described / "robot.toml"]
    assert (
        "off_map: the goal (9.00, 0.00) m lies 7 m off the map; the map spans x"
        in run(*asked, "--goal", 9, 0, code=1).stdout
    )
    said = run(*asked, "--goal", 0.1, 0, "--posture", "tall", "--tether", 1, 0, 2, code=2).stderr
    assert "--tether, --posture can't be planned with ring" in said
    said = run(*asked, "--goal", 0.1, 0, "--rounds", 2, "--seed", 0, "--tether-length", 3, code=2).stderr
    assert "--tether-length, --seed, --rounds can't be planned with ring" in said


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


def test_a_robot_of_your_own_is_mapped_into_the_files_of_maps(described, tmp_path):
    known = ["map", described / "level.tif", "--robot", described / "robot.toml", "--leg", 2]
    told = json.loads(run(*known, "--out", tmp_path / "maps.npz", "--json").stdout)
    assert (told["leg_name"], told["not_lifted"]) == (load_legged(described / "robot.toml").leg_names[2], "")
    with np.load(tmp_path / "maps.npz") as arrays:
        assert set(told["layers"]) == set(arrays.files) - {"x0", "y0", "resolution", "leg", "stability"}
        for name, area in told["area_m2"].items():
            code = next(code for code, one in REFUSALS.items() if one.name == name)
            assert area == pytest.approx((arrays["refused_by"] == code).sum() * 0.01)
        green = arrays["footing"] == REACHABLE_STABLE
        assert green.sum() * 0.01 == pytest.approx(told["area_m2"]["nothing"])
        assert green.any()
    lines = run(*known, "--layer", "refused_by", "--out", tmp_path / "why.png").stdout.splitlines()
    assert lines[0] == f"leg {told['leg_name']}: a step leads to {told['area_m2']['nothing']:.3f} m²"
    with Image.open(tmp_path / "why.png") as picture:
        colors = {color for _, color in picture.convert("RGB").getcolors() or ()}
    assert colors == {REFUSED[code][1] for code, one in REFUSALS.items() if one.name in told["area_m2"]}
    said = run(*known, "--suggest", 3, "--friction-aware", code=2).stderr
    assert "--friction-aware, --suggest can't be had in maps of ring: only with ATHLETE's legs" in said
    assert "ring has legs 0 to 5" in run(*known[:-1], 6, code=2).stderr


def test_a_gait_takes_no_robot_of_your_own_and_names_what_does(described):
    asked = ["plan", "gait", described / LEVEL, "--goal", 1, 0, "--robot", described / "robot.toml"]
    (line,) = run(*asked, code=2).stderr.strip().splitlines()
    assert "ATHLETE's legs alone" in line
    works = "footfall robot check, map, plan step, plan route, plan walk, view, referee and export"
    assert f"with such a robot work {works}" in line


def test_a_step_is_planned_and_its_commands_are_judged(described, tmp_path):
    robot, ground = load_legged(described / "robot.toml"), described / LEVEL
    known, out = ["--robot", described / "robot.toml", "--terrain", ground], tmp_path / "step.npz"
    foot = footfall.stand(robot, read_terrain(ground)).contacts[3]
    asked = ["plan", "step", ground, "--robot", described / "robot.toml", "--time-limit", 1e6, "--leg"]
    told = json.loads(run(*asked, 3, "--target", foot[0] + 0.02, foot[1], "--out", out, "--json").stdout)
    result = decode(out.read_bytes())
    assert isinstance(result, LeggedResult)
    assert (told["status"], told["digest"]) == ("found", result.digest)
    assert told["figures"]["foot_moves"] == 1
    assert result.plan is not None
    np.testing.assert_allclose(result.plan.end.contacts[3, :2], (foot[0] + 0.02, foot[1]), atol=1e-6)
    assert len(run("export", out, "--format", "csv", *known).stdout.splitlines()) == told["figures"]["waypoints"]
    assert run("referee", out, *known).stdout.startswith("passed\n")
    assert (
        "off_map: the footfall (9.00, 0.00) m lies 7 m off the map; the map spans x"
        in run(*asked, 3, "--target", 9, 0, code=1).stdout
    )
    assert "ring has legs 0 to 5" in run(*asked, 6, "--target", 0, 0, code=2).stderr
    said = run(*asked, 3, "--target", 0, 0, "--seed", 0, "--planner", "sbl", "--as-commanded", code=2).stderr
    assert "--planner, --seed, --as-commanded can't be planned with ring: only with ATHLETE's legs" in said


def test_a_simulated_robot_of_your_own_is_kinematic(described):
    said = run("sim", described / LEVEL, "--robot", described / "robot.toml", "--physics", code=2).stderr
    assert "ring has no masses and springs on the link: run it with --kinematic" in said


def test_a_server_asks_for_the_ground_of_a_robot_of_your_own(described):
    said = run("serve", "--robot", described / "robot.toml", code=2).stderr
    assert "robot.toml has no cameras to see the ground: give it one with --terrain" in said
    level = described / LEVEL
    assert "--terrain goes with --robot" in run("serve", "--terrain", level, code=2).stderr
    both = ("--robot", described / "robot.toml", "--terrain", level, "--session", "x")
    assert "a session has its own robot: leave out --session or --robot" in run("serve", *both, code=2).stderr


def test_a_server_has_the_robot_of_its_session(described):
    assert (
        "a server has the robot of its session, not other; leave out --robot"
        in run("serve", "--robot", "other", code=2).stderr
    )


def test_what_is_no_robot_toml_says_what_it_is_and_what_to_do(described):
    """A server said that it has the robot of its session, to leave out --robot."""
    urdf, walk = described / "robot.urdf", ["plan", "walk", described / LEVEL, "--goal", 1, 0]
    for asked in (walk, ["serve"]):
        said = run(*asked, "--robot", urdf, code=2).stderr
        assert "robot.urdf is no robot description: FootFall reads .toml; footfall robot init" in said
        assert "there is no robot" in run(*asked, "--robot", described / "robbot.toml", code=2).stderr


def test_a_robot_may_be_named_by_its_folder(described):
    """It was refused as a robot that the command does not take, with a list of commands that has it."""
    assert is_legged(described)
    assert load_legged(described).digest == load_legged(described / "robot.toml").digest


def test_a_route_is_planned_and_walked_along(described, tmp_path):
    known = [described / "level.tif", "--robot", described / "robot.toml"]
    route, walk = tmp_path / "route.npz", tmp_path / "walk.npz"
    told = json.loads(run("plan", "route", *known, "--goal", 0.08, 0.05, "--out", route, "--json").stdout)
    found = decode(route.read_bytes())
    assert isinstance(found, RouteResult)
    assert (told["status"], told["digest"]) == ("found", found.digest)
    length = load_legged(described / "robot.toml").length
    assert told["provenance"]["settings"]["highest"] == settings_by_leg(length).highest
    coarse = ["plan", "route", *known, "--goal", 0.08, 0.05, "--resolution", 0.2, "--json"]
    assert json.loads(run(*coarse).stdout)["provenance"]["settings"]["resolution"] == 0.2

    along = ["plan", "walk", *known, "--goal", 0.08, 0.05, "--time-limit", 1e6, "--along"]
    assert run(*along, route, "--out", walk).stdout.startswith("found")
    made = decode(walk.read_bytes())
    assert isinstance(made, LeggedResult)
    assert found.plan is not None
    assert made.provenance.parents["route"] == found.plan.digest
    said = run(*along, walk, code=2).stderr
    assert "walk.npz holds a LeggedResult, not what `footfall plan route --out` writes" in said
    assert "there is no file" in run(*along, tmp_path / "none.npz", code=2).stderr
    said = run("plan", "walk", described / "level.tif", "--goal", 1, 0, "--along", route, code=2).stderr
    assert "--along is for robots of your own" in said
    off = ["plan", "route", *known, "--goal", 9, 0, "--out", tmp_path / "off.npz"]
    assert run(*off, code=1).stdout.startswith("off_map")
    said = run(*along, tmp_path / "off.npz", code=2).stderr
    assert "off.npz holds no route: the goal (9, 0) lies off the map" in said


def test_a_walk_goes_along_no_route_of_another_terrain_or_robot(described, tmp_path):
    of, route = described / "robot.toml", tmp_path / "route.npz"
    run("plan", "route", described / "level.tif", "--robot", of, "--goal", 0.08, 0.05, "--out", route)
    higher = tmp_path / "higher.npz"
    level = read_terrain(described / "level.tif")
    write_terrain(replace(level, heights=level.heights + np.float32(0.01)), higher)
    along = ["--goal", 0.08, 0.05, "--along", route]
    said = run("plan", "walk", higher, "--robot", of, *along, code=2).stderr
    assert "route.npz was planned with another terrain" in said
    other = tmp_path / "other"
    other.mkdir()
    run("robot", "init", written(other, ring(8)), "--samples", 20)
    said = run("plan", "walk", described / "level.tif", "--robot", other / "robot.toml", *along, code=2).stderr
    assert "route.npz was planned with another robot" in said
