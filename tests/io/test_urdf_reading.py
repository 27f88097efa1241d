"""Reading URDFs: what is refused, by name and with what would be right; meshes, packages and paths."""

import shutil

import numpy as np
import pytest
import trimesh

from footfall.core.errors import InvalidRobot, NotFound
from footfall.io.urdf import shapes
from footfall.io.urdf.read import read_urdf
from tests.support.urdf import LIMIT, quadruped, replaced, written

BOX = '<box size="0.7 0.3 0.1"/>'
BOMB = (
    '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;">]>'
    '<robot name="&c;"><link name="base"/></robot>'
)
EXTERNAL = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="r"><link name="base"/>&x;</robot>'
LOOP = (
    replaced('<parent link="base"/><child link="LF_thigh"/>', '<parent link="LF_foot"/><child link="LF_thigh"/>'),
    "LF_thigh, LF_shank, LF_foot hang in a cycle",
)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (BOMB, "document type or entities"),
        (EXTERNAL, "document type or entities"),
        ('<!DOCTYPE robot SYSTEM "http://localhost/robot.dtd"><robot name="r"/>', "document type or entities"),
        ('<robot name="r">&lost;</robot>', "not readable XML"),
        ("<robot>" + "<a>" * 100 + "</a>" * 100 + "</robot>", "nested deeper than 64"),
        ("", "not readable XML"),
        ("<robot><link", "not readable XML"),
        ('<?xml version="1.0" encoding="klingon"?><robot/>', "not readable XML"),
        ("<sdf/>", "<robot> would be right"),
        ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:leg/></robot>', "expand it first"),
        ('<robot xmlns:xacro="http://ros.org/wiki/xacro"><link name="a"/><xacro:leg/></robot>', "expand it first"),
        ('<robot xmlns:x="http://wiki.ros.org/xacro"><link name="a"/><x:leg/></robot>', "expand it first"),
        ("<robot name='r'/>", "r has no link"),
    ],
)
def test_files_that_are_no_plain_urdf_are_refused(tmp_path, text, told):
    with pytest.raises(InvalidRobot, match=told):
        read_urdf(written(tmp_path, text))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        LOOP,
        (replaced('type="revolute"', 'type="floating"'), "joint LF_hip is floating; revolute, continuous"),
        (replaced('<child link="LF_thigh"/>', '<child link="lost"/>'), "LF_hip names the link lost"),
        (replaced('<child link="LF_shank"/>', '<child link="LF_thigh"/>'), "LF_thigh hangs from two joints, LF_hip"),
        (replaced('name="LF_knee"', 'name="LF_hip"'), "two joints are called LF_hip"),
        (replaced('<link name="LF_shank">', '<link name="LF_thigh">'), "two links are called LF_thigh"),
        (replaced("</robot>", '<link name="spare"/></robot>'), "this one has base, spare"),
        (replaced('<mass value="10.0"/>', '<mass value="ten"/>'), "value of <mass> is 'ten'; a number"),
        (replaced('size="0.7 0.3 0.1"', 'size="0.7 0.3"'), "link base: size of <box> is '0.7 0.3'; 3 numbers"),
        (replaced('size="0.7 0.3 0.1"', 'size="0.7 0 0.1"'), "above zero would be right"),
        (replaced('size="0.7 0.3 0.1"', 'size="0.7 inf 0.1"'), "above zero would be right"),
        (replaced('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'), "a direction would be right"),
        (replaced('xyz="0 0 -0.3"', 'xyz="0 0 nan"'), "origin that is not finite"),
        (replaced(LIMIT, f'{LIMIT}<mimic joint="lost"/>'), "LF_hip mimics lost"),
        (replaced(LIMIT, f'{LIMIT}<mimic joint="LF_hip"/>'), "LF_hip mimics itself"),
        (replaced(BOX, "<cone/>"), "link base has a cone"),
        (replaced(BOX, '<mesh filename="base.stl"/>'), "base.stl is missing"),
        (replaced(BOX, '<mesh filename="package://lost/base.stl"/>'), "no folder lost with base.stl.*--packages"),
        (replaced(BOX, '<mesh filename="https://localhost/base.stl"/>'), "https addresses are not read"),
        (replaced(BOX, '<mesh filename="/etc/hostname"/>'), "lies outside"),
        (replaced(BOX, '<mesh filename="../../../../etc/hostname"/>'), "lies outside"),
        (replaced(BOX, '<mesh filename="package://../etc/hostname"/>'), "names no package"),
        (replaced(BOX, '<mesh filename="robot.urdf"/>'), "STL, OBJ and DAE, not .urdf"),
    ],
)
def test_broken_robots_are_refused_by_name(tmp_path, change, told):
    with pytest.raises(InvalidRobot, match=told):
        read_urdf(written(tmp_path, quadruped(change)))


def test_a_cycle_without_a_root_is_told(tmp_path):
    two = '<robot name="r"><link name="a"/><link name="b"/>{}{}</robot>'
    row = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
    with pytest.raises(InvalidRobot, match="go round in a cycle"):
        read_urdf(written(tmp_path, two.format(row.format("j", "a", "b"), row.format("k", "b", "a"))))


def test_all_missing_meshes_are_told_at_once(tmp_path):
    text = quadruped(replaced('<sphere radius="0.03"/>', '<mesh filename="foot.stl"/>'))
    with pytest.raises(InvalidRobot) as refused:
        read_urdf(written(tmp_path, text.replace(BOX, '<mesh filename="package://p/base.dae"/>')))
    assert len(refused.value.details["missing"]) == 2


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(NotFound, match="there is no URDF"):
        read_urdf(tmp_path / "robot.urdf")


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="{n}">{points}</float_array><technique_common>
<accessor source="#pa" count="{count}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{m}"><input semantic="VERTEX" source="#v" offset="0"/><p>{triangles}</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def mesh_file(folder, ending: str):
    """A box of 0.7 × 0.3 × 0.1 m as a file."""
    solid = trimesh.creation.box(extents=(0.7, 0.3, 0.1))
    path = folder / f"base.{ending}"
    path.parent.mkdir(parents=True, exist_ok=True)
    if ending == "dae":
        points, triangles = (" ".join(map(str, part.ravel())) for part in (solid.vertices, solid.faces))
        counts = {"n": solid.vertices.size, "count": len(solid.vertices), "m": len(solid.faces)}
        path.write_text(DAE.format(points=points, triangles=triangles, **counts))
    else:
        solid.export(path)
    return path


@pytest.mark.parametrize("ending", ["stl", "obj", "dae"])
def test_meshes_are_what_was_written(tmp_path, ending):
    mesh_file(tmp_path / "meshes", ending)
    given = f'<mesh filename="meshes/base.{ending}" scale="1 -1 2"/>'
    shape = read_urdf(written(tmp_path, quadruped(replaced(BOX, given)))).link("base").shapes[0]
    assert shape.size == pytest.approx([0.7, 0.3, 0.2], abs=1e-6)
    solid = trimesh.Trimesh(shape.mesh.vertices, shape.mesh.triangles, process=True)
    assert solid.volume == pytest.approx(0.7 * 0.3 * 0.2, rel=1e-5), "mirrored and still its right side out"
    assert shape.source == f"meshes/base.{ending}"


@pytest.mark.parametrize("ending", ["stl", "obj", "dae"])
def test_meshes_that_are_no_meshes_are_refused(tmp_path, ending):
    (tmp_path / f"base.{ending}").write_bytes(b"\x00nothing")
    text = quadruped(replaced(BOX, f'<mesh filename="base.{ending}"/>'))
    with pytest.raises(InvalidRobot, match=rf"base\.{ending}"):
        read_urdf(written(tmp_path, text))


METRES = '<unit name="meter" meter="1"/>'
INCHES = '<unit name="inch" meter="0.0254"/>'


def in_dae(folder, unit: str, scale: str = "1 1 1", said: str = METRES):
    """A quadruped whose base is the box in a DAE file that states a unit; said: what is replaced by it there."""
    path = mesh_file(folder, "dae")
    path.write_text(path.read_text().replace(said, unit))
    return written(folder, quadruped(replaced(BOX, f'<mesh filename="base.dae" scale="{scale}"/>')))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        (INCHES, 0.0254),
        ("<unit meter = '1.0E-2'\n name='cm'/>", 0.01),
        (f"<!-- {INCHES} -->{METRES}", 1.0),
        ("", 1.0),
        ('<unit name="centimeter" meter="1.0"/>', 1.0),
    ],
)
def test_the_unit_of_a_collada_file_is_heeded(tmp_path, unit, factor):
    shape = read_urdf(in_dae(tmp_path, unit)).link("base").shapes[0]
    assert shape.size == pytest.approx(factor * np.array([0.7, 0.3, 0.1]), rel=1e-5)


def test_the_unit_of_a_part_of_a_collada_file_is_not_the_file_s(tmp_path):
    path = in_dae(tmp_path, f'<geometry id="g"><asset>{INCHES}</asset>', said='<geometry id="g">')
    assert read_urdf(path).link("base").shapes[0].size == pytest.approx([0.7, 0.3, 0.1], rel=1e-5)


def test_a_mirroring_scale_goes_with_the_unit_of_a_collada_file(tmp_path):
    shape = read_urdf(in_dae(tmp_path, INCHES, "1 -2 1")).link("base").shapes[0]
    assert shape.size == pytest.approx(0.0254 * np.array([0.7, 0.6, 0.1]), rel=1e-5)


def test_a_unit_that_the_urdf_says_once_more_is_refused(tmp_path):
    path = in_dae(tmp_path, '<unit meter="0.001"/>', "0.001 -0.001 0.001")
    with pytest.raises(InvalidRobot, match=r"link base: base\.dae says itself that its unit is 0\.001 m, .* once more"):
        read_urdf(path)


@pytest.mark.parametrize("unit", ["0", "-1", "inf", "nan", "mm"])
def test_a_unit_of_a_collada_file_that_is_none_is_refused(tmp_path, unit):
    with pytest.raises(InvalidRobot, match=f"base.dae states a unit of '{unit}' metres; a number above zero"):
        read_urdf(in_dae(tmp_path, f'<unit meter="{unit}"/>'))


def test_a_hostile_collada_file_is_refused(tmp_path):
    path = mesh_file(tmp_path, "dae")
    path.write_text(
        path.read_text().replace('<?xml version="1.0"?>', '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "b">]>')
    )
    with pytest.raises(InvalidRobot, match="document type or entities"):
        read_urdf(written(tmp_path, quadruped(replaced(BOX, '<mesh filename="base.dae"/>'))))


def test_too_many_triangles_are_refused(tmp_path, monkeypatch):
    mesh_file(tmp_path, "stl")
    text = quadruped(replaced(BOX, '<mesh filename="base.stl"/>'))
    monkeypatch.setattr(shapes, "MAX_TRIANGLES", 12)
    read_urdf(written(tmp_path, text))
    monkeypatch.setattr(shapes, "MAX_TRIANGLES", 11)
    with pytest.raises(InvalidRobot, match="12 triangles, more than 11 are refused"):
        read_urdf(written(tmp_path, text))


def test_packages_are_found_upward_and_in_given_folders(tmp_path):
    text = quadruped(replaced(BOX, '<mesh filename="package://my_robot/meshes/base.stl"/>'))
    home = tmp_path / "my_robot"
    mesh_file(home / "meshes", "stl")
    (home / "urdf").mkdir()
    assert read_urdf(written(home / "urdf", text)).link("base").shapes
    far = tmp_path / "far"
    far.mkdir()
    shutil.move(home, far / "my_robot")
    here = tmp_path / "here"
    here.mkdir()
    alone = written(here, text)
    with pytest.raises(InvalidRobot, match="is missing"):
        read_urdf(alone)
    for folder in (far, far / "my_robot"):
        assert read_urdf(alone, [folder]).link("base").shapes


def test_neither_dots_nor_links_lead_out_of_a_package(tmp_path):
    mesh_file(tmp_path / "secret", "stl")
    home = tmp_path / "my_robot"
    home.mkdir()
    (home / "link.stl").symlink_to(tmp_path / "secret" / "base.stl")
    for rest in ("../secret/base.stl", "%2e%2e/secret/base.stl", "link.stl"):
        text = quadruped(replaced(BOX, f'<mesh filename="package://my_robot/{rest}"/>'))
        with pytest.raises(InvalidRobot, match="leads out of its package"):
            read_urdf(written(home, text))


def test_limits_of_a_joint_are_what_is_said_and_nan_where_nothing_is(tmp_path):
    tree = read_urdf(written(tmp_path, quadruped(replaced(LIMIT, '<limit upper="0.5" effort="3"/>'))))
    first, second = tree.joint("LF_hip"), tree.joint("LF_knee")
    assert (first.lower, first.upper, first.effort) == (0.0, 0.5, 3.0)
    assert np.isnan(first.velocity)
    assert (second.lower, second.upper, second.effort, second.velocity) == (-1.0, 1.0, 40.0, 8.0)


SAFETY = '<safety_controller k_velocity="10" k_position="50" soft_lower_limit="-0.8" soft_upper_limit="0.9"/>'


@pytest.mark.parametrize(
    ("safety", "limits"),
    [
        (SAFETY, (-0.8, 0.9)),
        (SAFETY.replace("-0.8", "-2"), (-1.0, 0.9)),
        (SAFETY.replace(' soft_lower_limit="-0.8"', ""), (0.0, 0.9)),
        (SAFETY.replace(' k_position="50"', ""), (-1.0, 1.0)),
        ('<safety_controller k_velocity="10" k_position="50"/>', (-1.0, 1.0)),
    ],
)
def test_a_joint_goes_no_farther_than_its_controller_lets_it(tmp_path, safety, limits):
    """Soft limits were passed over: plans went where the robot's own controller stops."""
    joint = read_urdf(written(tmp_path, quadruped(replaced(LIMIT, LIMIT + safety)))).joint("LF_hip")
    assert (joint.lower, joint.upper) == limits


def test_a_turn_that_an_origin_says_as_a_quaternion_is_that_turn(tmp_path):
    """URDF 1.1 may say it so: it was passed over, and the part stood unturned."""
    box = '<collision><origin xyz="1 2 3" {}/><geometry><box size="1 2 3"/></geometry></collision>'

    def turned(said):
        return read_urdf(written(tmp_path, f'<robot name="r"><link name="a">{box.format(said)}</link></robot>')).links[
            0
        ]

    expected = turned('rpy="0 0 0.6"').shapes[0].T_link_shape
    half = np.sin(0.3), np.cos(0.3)
    np.testing.assert_allclose(turned(f'quat_xyzw="0 0 {half[0]} {half[1]}"').shapes[0].T_link_shape, expected)
    for said, told in (
        ('quat_xyzw="0 0 0.6 0.1"', "one of length 1"),
        ('quat_xyzw="0 0 1"', "4 numbers would be right"),
        ('quat_xyzw="0 0 0 1" rpy="0 0 0"', "rpy and quat_xyzw"),
    ):
        with pytest.raises(InvalidRobot, match=told):
            turned(said)
