"""The same odd text in every format: refused, by its place and with what would be right."""

from typing import Any

import pytest

from footfall.core.errors import FootFallError, InvalidSequence
from footfall.io.calibration_files import read_calibration
from footfall.io.camera_info import read_camera_info
from footfall.io.imports import from_csv
from footfall.io.imports.parsed import decimal
from footfall.io.robot_files import read_description
from footfall.io.terrain_files import decode_terrain
from footfall.io.urdf.proposed import read_proposed
from footfall.io.urdf.read import read_urdf
from footfall.io.urdf.shapes import read_mesh

ROWS = "0 0 {}\n1 0 0\n1 1 0\n0 1 0\n"
FACETS = "facet normal 0 0 1\nouter loop\nvertex 0 0 {}\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
PLY = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
PCD = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    "WIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n"
)
VTK = "# vtk DataFile Version 3.0\nscan\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n"
ASC = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
GROUND = {
    "triangles.obj": "v 0 0 {}\nv 1 0 0\nv 1 1 0\nf 1 2 3\n",
    "polygons.obj": "v 0 0 {}\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
    "triangles.off": f"OFF\n4 2 0\n{ROWS}3 0 1 2\n3 0 2 3\n",
    "polygons.off": f"OFF\n4 1 0\n{ROWS}4 0 1 2 3\n",
    "triangles.ply": f"{PLY}element face 1\nproperty list uchar int vertex_indices\nend_header\n{ROWS}3 0 1 2\n",
    "polygons.ply": f"{PLY}element face 1\nproperty list uchar int vertex_indices\nend_header\n{ROWS}4 0 1 2 3\n",
    "points.ply": f"{PLY}end_header\n{ROWS}",
    "a.stl": f"solid a\n{FACETS}endsolid a\n",
    "a.pcd": PCD + ROWS,
    "a.vtk": VTK + ROWS,
    "a.xyz": ROWS,
    "commented.xyz": f"# by hand\n\n{ROWS}",
    "a.csv": "x,y,z\n" + ROWS.replace(" ", ","),
    "a.asc": ASC + "{} 0 0 0\n",
    "header.asc": ASC.replace("xllcorner 0", "xllcorner {}") + "0 0 0 0\n",
}


def read(name, text, coding="utf-8"):
    scan: dict[str, Any] = (
        {} if name.endswith((".obj", ".off", ".asc", ".stl")) or "element face" in text else {"unit": "m", "up": "z"}
    )
    return decode_terrain(text.encode(coding), name, resolution=None if name.endswith("asc") else 0.5, **scan)


@pytest.mark.parametrize("name", GROUND)
def test_ground_takes_no_number_that_only_python_reads(name):
    read(name, GROUND[name].format("0.05"))
    for word in ("0.0_5", "０.05"):
        line = next(i for i, row in enumerate(GROUND[name].split("\n"), 1) if "{}" in row)
        told = f"line {line}.*has '{word}', which is no number.*0.05|{word}.*no number.*0.05|not text"
        with pytest.raises(FootFallError, match=told):
            read(name, GROUND[name].format(word))


@pytest.mark.parametrize("name", GROUND)
def test_ground_in_utf_16_is_called_so(name):
    if not name.endswith(".stl"):  # whose text begins as its binary form may
        with pytest.raises(FootFallError, match="UTF-16 text; save it as UTF-8"):
            read(name, GROUND[name].format("0.05"), "utf-16")


@pytest.mark.parametrize("word", ["0.66_5", "０.665", "0,665"])
def test_commands_take_no_number_that_only_python_reads(word):
    with pytest.raises(InvalidSequence, match=r"row 1, hip must be a number, not '.*'; write .*: 0.665"):
        decimal(word, "row 1, hip")


def test_commands_that_are_not_utf_8_are_called_so():
    with pytest.raises(InvalidSequence, match="it is no UTF-8 text: byte 8, in line 2, is not of UTF-8; save it"):
        from_csv.decode("row,seq\nä".encode("latin-1"))
    with pytest.raises(InvalidSequence, match="it is no UTF-8 text: it is UTF-16 text; save it as UTF-8"):
        from_csv.decode("row,seq\n".encode("utf-16"))


@pytest.mark.parametrize(
    ("name", "reads"),
    [
        ("a.yaml", read_calibration),
        ("a.yaml", lambda path: read_camera_info(path, path)),
        ("a.toml", read_description),
        ("robot.toml", read_proposed),
    ],
)
def test_descriptions_that_are_not_utf_8_are_called_so(name, reads, tmp_path):
    path = tmp_path / name
    for content, told in (("a = 'x'\n".encode("utf-16"), "UTF-16 text"), (b"a = '\xe4'\n", "byte 5, in line 1,")):
        path.write_bytes(content)
        with pytest.raises(FootFallError, match=f"{name} .*{told}.*save it as UTF-8"):
            reads(path)


@pytest.mark.parametrize("word", ["1_0", "１０"])
def test_calibrations_and_urdf_take_no_number_that_only_python_reads(word, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(f"image_width: {word}\nimage_height: 480\n", encoding="utf-8")
    with pytest.raises(FootFallError, match=f"image_width must be a whole number above zero, not '{word}'"):
        read_camera_info(path, path)
    urdf = tmp_path / "a.urdf"
    urdf.write_text(
        f'<robot name="a"><link name="base"/><link name="arm"/><joint name="j" type="fixed"><parent link="base"/>'
        f'<child link="arm"/><origin xyz="0 0 {word}"/></joint></robot>',
        encoding="utf-8",
    )
    with pytest.raises(FootFallError, match="3 numbers would be right"):
        read_urdf(urdf, [])


def test_commands_that_are_no_number_or_in_other_columns_are_called_so():
    with pytest.raises(InvalidSequence, match="row 1, hip must be a number, not NaN"):
        decimal("NaN", "row 1, hip")
    with pytest.raises(InvalidSequence, match="separated by commas; it begins with 'sequence;robot;row'"):
        from_csv.decode(b"sequence;robot;row\na;athlete;1\n")


def test_a_robot_s_mesh_loses_no_indented_face(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\n  f 1 3 4\n")
    assert len(read_mesh(tmp_path / "a.obj", "a.obj")[0].triangles) == 2
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0\nv 1 1 0\nf 1 2 3\n")
    with pytest.raises(FootFallError, match="line 2, 'v 1 0', is no vertex of three numbers"):
        read_mesh(tmp_path / "a.obj", "a.obj")
