"""Description files: what ships, a second robot without code changes, and refusals by name."""

import copy
import tomllib

import numpy as np
import pytest
import trimesh

import footfall
from footfall.core.errors import InvalidRobot, NotFound
from footfall.core.value import flatten, unflatten
from footfall.io.robot_files import load_robot, read_description
from footfall.resources import robot_assets_folder
from footfall.robot import ik, kinematics
from footfall.robot.assets.generate import generated_files
from footfall.robot.build import describe
from footfall.robot.meshes.collision import posture_collisions
from footfall.robot.model import Robot

ATHLETE = robot_assets_folder() / "athlete" / "athlete.toml"


@pytest.fixture
def raw():
    return tomllib.loads(ATHLETE.read_text())


def test_committed_files_are_what_the_description_generates():
    files = generated_files(ATHLETE)
    assert len(files) == 1 + 8
    for name, text in files.items():
        assert (ATHLETE.parent / name).read_text() == text, name
    assert {p.name for p in (ATHLETE.parent / "meshes").iterdir()} == {n[7:] for n in files if n.startswith("meshes/")}


def test_meshes_are_closed_and_of_the_stated_sizes(athlete):
    sizes = {
        "base": (2.75, 2.3816, 0.22),
        "leg0_hip_yaw": (0.43, 0.44, 0.41),
        "leg0_hip_pitch": (0.84, 0.39, 0.19),
        "leg0_knee_pitch": (0.17, 0.33, 0.15),
        "leg0_knee_roll": (0.42, 0.30, 0.16),
        "leg0_ankle_pitch": (0.17, 0.28, 0.15),
        "leg0_ankle_roll": (0.48, 0.25, 0.16),
        "leg0_wheel": (0.484, 0.22, 0.484),
    }
    for link, size in sizes.items():
        mesh = athlete.description.meshes[link]
        solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        assert solid.is_watertight
        assert solid.is_convex
        assert solid.volume > 0  # facing outwards
        np.testing.assert_allclose(solid.extents, size, atol=1e-3)
    assert athlete.description.meshes["base"].vertices[:, 2].max() == 0.0


def test_every_assumption_is_told(athlete):
    told = " ".join(athlete.description.assumed)
    for word in ("speed", "stiffness", "inertias", "clearances", "camera", "crouch"):
        assert word in told


def test_stiffness_is_five_times_the_torque_limit(athlete):
    np.testing.assert_allclose(athlete.stiffness, 5 * athlete.torque_limits)
    np.testing.assert_allclose(athlete.speed_limits, 0.2)


def test_description_is_a_value(athlete):
    description = athlete.description
    assert unflatten(*flatten(description)).digest == description.digest
    assert read_description(ATHLETE.parent).digest == description.digest
    with pytest.raises(ValueError, match="read-only"):
        description.lower[0] = 0.0


FOUR_LEGS = {"azimuths_deg": [45.0, 135.0, 225.0, 315.0], "mount_radius": 0.7, "mount_height": -0.05}


def four_legged(raw):
    other = copy.deepcopy(raw)
    other["name"] = "quadruped"
    other["legs"] = FOUR_LEGS
    other["chassis"]["shape"] = {"kind": "box", "size": [1.0, 1.0, 0.2], "center": [0.0, 0.0, -0.1]}
    other["chassis"]["mass"] = 40.0
    joints = {joint["name"]: joint for joint in other["joints"]}
    joints["hip_pitch"]["offset"] = [0.2, 0.0, -0.25]
    joints["knee_pitch"]["offset"] = [0.8, 0.0, 0.0]
    joints["ankle_pitch"]["offset"] = [0.5, 0.0, 0.0]
    other["wheel"] |= {"offset": [0.4, 0.0, 0.0], "radius": 0.2}
    return other


def test_second_robot_of_the_same_structure_needs_no_code(raw, tmp_path, rng):
    text = _toml(four_legged(raw))
    (tmp_path / "quadruped.toml").write_text(text)
    robot = load_robot(tmp_path)
    assert (robot.name, robot.leg_count, robot.posture("stand").shape) == ("quadruped", 4, (24,))
    assert robot.mass == pytest.approx(40.0 + 4 * 136.17)
    for leg in robot.legs:
        asked = rng.uniform(robot.lower[:6], robot.upper[:6], (200, 6))
        Ts = np.array([kinematics.leg_wheel_pose(robot, q, leg) for q in asked])
        solutions = ik.solve_leg(robot, leg, Ts)
        assert solutions.valid.any(axis=1).all()
        for i, branch in np.argwhere(solutions.valid)[:100]:
            back = kinematics.leg_wheel_pose(robot, solutions.q[i, branch], leg)
            np.testing.assert_allclose(back, Ts[i], atol=1e-9)
    assert posture_collisions(robot, robot.posture("stand"), np.eye(4)) == []


def _toml(table, prefix=""):
    """Just enough TOML for the test: tables, inline values, arrays of tables."""

    def inline(item):
        if isinstance(item, dict):
            return "{" + ", ".join(f"{k} = {inline(v)}" for k, v in item.items()) + "}"
        if isinstance(item, list):
            return "[" + ", ".join(inline(v) for v in item) + "]"
        return f'"{item}"' if isinstance(item, str) else repr(item)

    return "".join(f"{key} = {inline(item)}\n" for key, item in table.items())


def drop_joint(raw):
    del raw["joints"][3]


def swap_axis(raw):
    raw["joints"][3]["axis"] = "y"


def swap_order(raw):
    raw["joints"][2], raw["joints"][3] = raw["joints"][3], raw["joints"][2]


def no_wheel(raw):
    del raw["wheel"]


def other_axle(raw):
    raw["wheel"]["axle"] = "z"


def offset_wrist(raw):
    raw["joints"][5]["offset"] = [0.1, 0.0, 0.0]


def sideways_hip(raw):
    raw["joints"][1]["offset"] = [0.3, 0.1, 0.0]


def bent_thigh(raw):
    raw["joints"][2]["offset"] = [0.6, 0.0, 0.1]


def two_legs(raw):
    raw["legs"]["azimuths_deg"] = [0.0, 180.0]


def crossed_limits(raw):
    raw["joints"][1]["limits_deg"] = [90.0, -90.0]


def posture_outside(raw):
    raw["postures_deg"]["stand"][1] = 120.0


def misspelt(raw):
    raw["joints"][0]["stifness"] = 1.0


def missing(raw):
    del raw["joints"][4]["torque_limit"]


def true_as_number(raw):
    raw["wheel"]["radius"] = True


def later_format(raw):
    raw["format"] = 2


def unknown_part(raw):
    raw["clearance"]["chassis"]["toe"] = 0.1


def unknown_shape(raw):
    raw["chassis"]["shape"]["kind"] = "sphere"


def no_ground_clearance(raw):
    del raw["clearance"]["terrain"]["wheel"]


def no_wheel_left(raw):
    raw["clearance"]["wheel_sink"] = 0.2


def infinite(raw):
    raw["joints"][0]["mass"] = float("inf")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (drop_joint, "5 joints a leg.*six"),
        (swap_axis, "knee_roll turns about y.*it is x"),
        (swap_order, "'knee_roll' where 'knee_pitch' belongs"),
        (no_wheel, "no wheel"),
        (other_axle, "axle is z"),
        (offset_wrist, "offset of ankle_roll must be zero"),
        (sideways_hip, "leg's plane"),
        (bent_thigh, "knee_pitch must lie along x"),
        (two_legs, "2 legs.*3 to 9"),
        (crossed_limits, "leg0_hip_pitch_joint must be below"),
        (posture_outside, "posture 'stand' breaks the limit of leg0_hip_pitch_joint"),
        (misspelt, r"joints\[0\] has no entry 'stifness'"),
        (missing, r"lacks joints\[4\].torque_limit"),
        (true_as_number, "wheel.radius must be a finite number"),
        (later_format, "of format 1"),
        (unknown_part, "'toe' is no part"),
        (unknown_shape, "box or a prism"),
        (no_ground_clearance, "name every part"),
        (no_wheel_left, "leaves nothing of the wheel"),
        (infinite, r"joints\[0\].mass must be a finite number"),
    ],
)
def test_other_structures_are_refused_by_name(raw, change, words):
    change(raw)
    with pytest.raises(InvalidRobot, match=words):
        describe(raw)


def test_files_that_are_no_description(tmp_path):
    with pytest.raises(NotFound, match="athlete"):
        load_robot("curiosity")
    with pytest.raises(InvalidRobot, match="holds 0"):
        load_robot(tmp_path)
    (tmp_path / "x.toml").write_text("= broken")
    with pytest.raises(InvalidRobot, match="not readable TOML"):
        load_robot(tmp_path / "x.toml")
    (tmp_path / "x.urdf").write_text("<robot/>")
    with pytest.raises(InvalidRobot, match=r"reads \.toml"):
        load_robot(tmp_path / "x.urdf")


def test_public_name(athlete):
    assert footfall.load_robot("athlete").digest == athlete.digest
    assert isinstance(athlete, Robot)
    with pytest.raises(NotFound, match="nav0"):
        athlete.description.camera_pair("mast")
