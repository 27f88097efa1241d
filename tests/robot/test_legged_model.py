"""Legs, feet and groups that are found in a robot's tree."""

import re

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidRobot
from footfall.core.frames import rotation_rpy, transform
from footfall.core.mesh import Mesh
from footfall.io.urdf.proposed import read_proposed
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.soles import sole_of
from footfall.robot.legged.touching import touching
from footfall.robot.legged.tree import RobotTree, TreeJoint, TreeLink, TreeShape
from tests.support.command_line import run
from tests.support.robot_data import OTHERS, QUADRUPEDS, described
from tests.support.urdf import FOOT, LIMIT, joint, leg, link, quadruped, written
from tests.support.walkers import ring

DOWN = np.array([0.0, 0.0, -1.0])
angles = st.floats(-3.0, 3.0)


def foot(solid: trimesh.Trimesh, T_link_shape: np.ndarray, kind: str = "mesh", size=None) -> TreeLink:
    mesh = Mesh(np.array(solid.vertices, float), np.array(solid.faces, np.int32))
    shape = TreeShape(kind, T_link_shape, np.ptp(mesh.vertices, axis=0) if size is None else np.array(size), mesh)
    return TreeLink("foot", 1.0, np.zeros(3), np.eye(3), (shape,))


def sole(one: TreeLink, down=DOWN):
    return sole_of((one,), {"foot": np.eye(4)}, np.asarray(down, float))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.01, 0.2), angles, angles, angles)
def test_a_ball_as_a_mesh_is_the_ball_as_a_primitive(radius, roll, pitch, yaw):
    T_link_shape = transform(rotation_rpy(roll, pitch, yaw), (0.1, -0.2, 0.3))
    solid = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    guessed = sole(foot(solid, T_link_shape))
    told = sole(foot(solid, T_link_shape, "sphere", [radius] * 3))
    assert (guessed.kind, told.kind) == ("ball", "ball")
    assert guessed.radius == pytest.approx(radius, rel=0.02)
    np.testing.assert_allclose(guessed.center, told.center, atol=0.02 * radius)
    assert (bool(guessed.doubt), bool(told.doubt)) == (True, False)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.02, 0.3), st.floats(0.2, 1.8), angles, st.floats(-0.4, 0.4))
def test_a_wheel_as_a_mesh_is_the_wheel_as_a_primitive(radius, share, yaw, lean):
    width = share * radius
    T_link_shape = transform(rotation_rpy(np.pi / 2 + lean, 0.0, yaw), (0.1, 0.0, -0.2))
    solid = trimesh.creation.cylinder(radius=radius, height=width, sections=48)
    guessed = sole(foot(solid, T_link_shape))
    told = sole(foot(solid, T_link_shape, "cylinder", [radius, radius, width]))
    assert (guessed.kind, told.kind) == ("wheel", "wheel")
    assert guessed.radius == pytest.approx(told.radius, rel=1e-6)
    assert guessed.width == pytest.approx(told.width, rel=1e-6)
    assert abs(guessed.axis @ told.axis) == pytest.approx(1.0)
    np.testing.assert_allclose(guessed.center, told.center, atol=1e-6)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.05, 0.3), st.floats(0.05, 0.3), angles, angles, angles)
def test_a_flat_sole_is_the_lower_face_of_a_box(length, width, roll, pitch, yaw):
    R = rotation_rpy(roll, pitch, yaw)
    one = foot(trimesh.creation.box(extents=(length, width, 0.04)), transform(R, (0.0, 0.1, 0.2)), "box")
    flat = sole(one, -R[:, 2])
    assert flat.kind == "flat"
    assert len(flat.polygon) == 4
    np.testing.assert_allclose((flat.polygon - (0.0, 0.1, 0.2)) @ R[:, 2], -0.02, atol=1e-9)
    # the area by the cross products about the outward normal is positive: counter-clockwise seen from outside
    turned = np.cross(flat.polygon, np.roll(flat.polygon, -1, axis=0)).sum(axis=0) / 2
    assert turned @ flat.axis == pytest.approx(length * width)


def test_a_cone_is_a_point_and_an_empty_foot_lies_at_its_frame():
    tip = sole(foot(trimesh.creation.cone(radius=0.05, height=0.2), transform(rotation_rpy(np.pi, 0, 0))))
    assert tip.kind == "point"
    np.testing.assert_allclose(tip.center, (0, 0, -0.2), atol=1e-9)
    empty = sole(TreeLink("foot", 1.0, np.zeros(3), np.eye(3), ()))
    assert (empty.kind, empty.center.tolist()) == ("point", [0.0, 0.0, 0.0])
    assert "no collision shape" in empty.doubt


@pytest.mark.parametrize("name", QUADRUPEDS)
def test_quadrupeds_stand_on_four_legs_of_one_group(name):
    model = legged_model(read_urdf(described(name)))
    assert [len(group) for group in model.groups()] == [4]
    assert len({leg.foot for leg in model.legs}) == 4
    kind = "wheel" if name in ("Solo-12", "Centauro (wheels for feet)") else "ball"
    assert {leg.sole.kind for leg in model.legs} == {kind}
    joints = 6 if "Centauro" in name else 3
    assert {len(leg.joints) for leg in model.legs} == {joints}
    # the lowest point of every sole, at the posture in the middle, is nearly the robot's lowest
    poses = model.tree.poses(model.tree.neutral())
    lowest = [(poses[leg.foot][:3, :3] @ leg.sole.center + poses[leg.foot][:3, 3])[2] for leg in model.legs]
    assert np.ptp(lowest) < 0.1 * abs(min(lowest))


def test_arms_on_quadrupeds_are_left_out_with_a_reason():
    model = legged_model(read_urdf(described("ANYmal B with Kinova arm")))
    ((limb, why),) = model.left_out.items()
    assert "j2s6s200" in limb
    assert "above the lowest" in why


@pytest.mark.parametrize("name", OTHERS)
def test_robots_without_three_legs_are_refused_with_the_reason(name):
    with pytest.raises(InvalidRobot, match="3 to 12"):
        legged_model(read_urdf(described(name)))


def test_sensors_turrets_and_hands_are_no_legs(tmp_path):
    def dressed(text: str) -> str:
        mast = link("mast", 0.2, '<geometry><box size="0.05 0.05 0.3"/></geometry>')
        turret = joint("pan", "base", "mast", "0 0 0.2")
        camera = link("camera", 0.1, '<geometry><box size="0.1 0.1 0.1"/></geometry>')
        held = joint("bolt", "base", "camera", "0.4 0 0", "fixed")
        arm = link("arm", 1, "<geometry><sphere radius='0.1'/></geometry>") + joint(
            "shoulder", "base", "arm", "0 0 -0.4"
        )
        fingers = "".join(
            link(f"finger{i}", 0.1, "<geometry><sphere radius='0.1'/></geometry>")
            + joint(f"grip{i}", "arm", f"finger{i}", "0 0 -0.2")
            for i in (1, 2)
        )
        return text.replace("</robot>", f"{mast}{turret}{camera}{held}{arm}{fingers}</robot>")

    model = legged_model(read_urdf(written(tmp_path, quadruped(dressed))))
    assert [one.name for one in model.legs] == ["LF", "RF", "LH", "RH"]
    assert "1 joint that moves can't place a foot" in model.left_out["pan … pan"]
    assert "forks" in model.left_out["shoulder … grip1"]


def test_a_shape_at_the_knee_is_no_foot(tmp_path):
    """Where feet are bare frames, a shaped part beside the knee was taken for the foot, and the leg ended there."""

    def padded(text: str) -> str:
        for name in ("LF", "RF", "LH", "RH"):
            foot, pad = link(f"{name}_foot", 0.1, FOOT), link(f"{name}_pad", 0.1, FOOT)
            bare = foot[: foot.index("<collision>")] + "</link>"
            text = text.replace(
                foot, bare + pad + joint(f"{name}_bolt", f"{name}_shank", f"{name}_pad", "0 0.04 0", "fixed")
            )
        return text

    model = legged_model(read_urdf(written(tmp_path, quadruped(padded))))
    assert [one.foot for one in model.legs] == ["LF_foot", "RF_foot", "LH_foot", "RH_foot"]


@pytest.mark.parametrize("count", [2, 3, 6, 12, 13])
def test_three_to_twelve_legs_are_taken(tmp_path, count):
    turns = 2 * np.pi * np.arange(count) / count
    legs = "".join(leg(f"n{i:02}", np.cos(turn), np.sin(turn)) for i, turn in enumerate(turns))
    base = link("base", 9, "<geometry><sphere radius='0.2'/></geometry>")
    path = written(tmp_path, f'<robot name="star">{base}{legs}</robot>')
    if not 3 <= count <= 12:
        with pytest.raises(InvalidRobot, match=f"{count} legs, and 3 to 12"):
            legged_model(read_urdf(path))
        return
    assert len(legged_model(read_urdf(path)).legs) == count


@pytest.mark.parametrize("up", [0.3, 0.58, 0.64, 1.0])
def test_a_root_on_the_ground_is_told(tmp_path, up):
    footprint = f'<link name="footprint"/>{joint("up", "footprint", "base", f"0 0 {up}", "fixed")}</robot>'
    tree = read_urdf(written(tmp_path, quadruped(lambda text: text.replace("</robot>", footprint))))
    told = f"the frame of the root link footprint lies {up:.2f} m below it"
    if up < 0.315:
        assert [one.doubt for one in legged_model(tree).legs] == [""] * 4
    elif up < 0.63:
        assert all(told in one.doubt for one in legged_model(tree).legs)
    else:
        with pytest.raises(InvalidRobot, match=f"it does not reach below the base; {told}"):
            legged_model(tree)


def test_legs_that_zero_stretches_out_above_the_base_are_found_hanging(tmp_path):
    """As of spiders whose frame lies at the belly: they are refused with what to do, and then the same legs."""
    known = legged_model(read_urdf(written(tmp_path, ring(6))))
    text = ring(6).replace('lower="0.3" upper="2.6"', 'lower="-1.3" upper="2.6"')
    path = written(tmp_path, re.sub(r'(child link="l\d_coxa"/><origin xyz="\S+ \S+) 0"', r'\1 0.05"', text))
    with pytest.raises(InvalidRobot, match=r"0\.\d\d m below it as low as they let it: .*robot init --hanging"):
        legged_model(read_urdf(path))
    model = legged_model(read_urdf(path), hanging=True)
    assert model.left_out == {}
    assert [(one.name, one.joints, one.foot, one.sole.kind) for one in model.legs] == [
        (one.name, one.joints, one.foot, one.sole.kind) for one in known.legs
    ]
    out = tmp_path / "hanging.toml"
    run("robot", "init", path, "--hanging", "--out", out)
    assert [leg.name for leg in read_proposed(out).model.legs] == [one.name for one in known.legs]


def test_a_number_in_a_name_is_the_legs_own_or_none(tmp_path):
    for first, names in ((0, ["0", "1", "2"]), (1, ["n1_foot", "n2_foot", "n3_foot"])):
        legs = "".join(leg(f"n{first + i}", np.cos(2 * i), np.sin(2 * i)) for i in range(3))
        base = link("base", 9, "<geometry><sphere radius='0.2'/></geometry>")
        model = legged_model(read_urdf(written(tmp_path, f'<robot name="star">{base}{legs}</robot>')))
        assert [one.name for one in model.legs] == names


def test_unlike_legs_are_in_groups_of_their_own(tmp_path):
    def longer(text: str) -> str:
        for name in ("LH", "RH"):
            text = text.replace(
                f'<child link="{name}_shank"/><origin xyz="0 0 -0.3"/>',
                f'<child link="{name}_shank"/><origin xyz="0 0 -0.4"/>',
            )
        return text

    model = legged_model(read_urdf(written(tmp_path, quadruped(longer))))
    assert [[one.name for one in group] for group in model.groups()] == [["LF", "RF"], ["LH", "RH"]]


def test_the_neutral_posture_keeps_the_limits(tmp_path):
    changed = quadruped(
        lambda text: text.replace(LIMIT, '<limit lower="-2.7" upper="-0.8" effort="1" velocity="1"/>', 1)
    )
    neutral = read_urdf(written(tmp_path, changed)).neutral()
    assert neutral["LF_hip"] == pytest.approx(-1.75)
    assert neutral["LF_knee"] == 0.0


def test_what_touches_is_what_balls_say():
    """Two balls on arms of one length: they touch exactly where their centres are nearer than two radii."""
    ball = foot(trimesh.creation.icosphere(subdivisions=2, radius=0.2), transform(None, (1.0, 0.0, 0.0)))
    links = tuple(
        TreeLink(name, 1.0, np.zeros(3), np.eye(3), ball.shapes if name != "base" else ())
        for name in ("base", "a", "b", "c")
    )
    z = np.array([0.0, 0.0, 1.0])

    def turning(name: str, height: float, most: float) -> TreeJoint:
        return TreeJoint(
            f"to_{name}", "revolute", "base", name, transform(None, (0, 0, height)), z, 0.0, most, 1.0, 1.0
        )

    tree = RobotTree("balls", links, (turning("a", 0.0, 2.0), turning("b", 0.0, 2.0), turning("c", 1.0, 2.0)))
    found = touching(tree, samples=400, seed=3)
    assert found.never == (("a", "c"), ("b", "c"))
    assert found.always == ()
    # |difference| of two even angles on [0, 2] is below d with probability 1 − (1 − d/2)²
    most_apart = 2 * np.arcsin(0.2)
    assert found.sometimes["a|b"] == pytest.approx(1 - (1 - most_apart / 2) ** 2, abs=0.08)
    assert touching(tree, samples=400, seed=3).digest == found.digest


def test_neighbours_that_overlap_touch_in_every_posture(tmp_path):
    tree = read_urdf(written(tmp_path, quadruped(lambda text: text.replace('length="0.2"', 'length="0.32"'))))
    found = touching(tree, samples=50, seed=1)
    assert ("LF_thigh", "LF_shank") in found.always
    assert ("LF_thigh", "RF_thigh") in found.never
