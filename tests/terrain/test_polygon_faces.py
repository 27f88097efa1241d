"""Faces of many corners: the same ground from every format, a pit stays a pit, what is wrong is said plainly."""

import struct

import numpy as np
import pytest
import trimesh

from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.io.polygon_faces import polygons_in, read_polygons
from footfall.io.terrain_files import decode_terrain
from footfall.terrain.ground.closed import closed_share

SQUARE = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]
PIT = [(1, 1, 0), (1, 3, 0), (3, 3, 0), (3, 1, 0)]
FLOOR = [(1, 1, -1), (3, 1, -1), (3, 3, -1), (1, 3, -1)]
VERTICES = np.array([*SQUARE, *PIT, *FLOOR], float)
FACES = [[0, 1, 2, 3, 0, 4, 5, 6, 7, 4], [8, 9, 10, 11], [4, 7, 9], [4, 9, 8]]


def obj():
    lines = [f"v {x} {y} {z}" for x, y, z in VERTICES]
    return "\n".join([*lines, *(f"f {' '.join(str(i + 1) for i in face)}" for face in FACES), ""]).encode()


def off():
    lines = ["OFF", f"{len(VERTICES)} {len(FACES)} 0", *(f"{x} {y} {z}" for x, y, z in VERTICES)]
    return "\n".join([*lines, *(f"{len(face)} {' '.join(map(str, face))}" for face in FACES), ""]).encode()


def ply(form):
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {len(VERTICES)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        lines = [f"{x} {y} {z}" for x, y, z in VERTICES]
        lines += [f"{len(face)} {' '.join(map(str, face))}" for face in FACES]
        return head + "\n".join([*lines, ""]).encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3d", *vertex) for vertex in VERTICES)
    body += b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in FACES)
    return head + body


FORMS = {
    "pit.obj": obj(),
    "pit.off": off(),
    "ascii.ply": ply("ascii"),
    "little.ply": ply("binary_little_endian"),
    "big.ply": ply("binary_big_endian"),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_pit_inside_a_concave_face_is_a_pit(name):
    dem = decode_terrain(FORMS[name], name, resolution=0.25, most_error=2.0)
    row, col = dem.geometry.cell(np.array([2.0, 0.5]), np.array([2.0, 0.5]))
    np.testing.assert_allclose(dem.heights[row, col], [-1.0, 0.0])
    inside = [dem.geometry.cell(np.array([x]), np.array([y])) for x in (1.5, 2.5) for y in (1.5, 2.5)]
    assert all(dem.heights[one][0] == -1.0 for one in inside)


@pytest.mark.parametrize("name", FORMS)
def test_every_format_gives_the_same_triangles(name):
    ending = name.rpartition(".")[2]
    assert polygons_in(FORMS[name], ending)
    vertices, triangles = read_polygons(FORMS[name], ending)
    np.testing.assert_allclose(vertices, VERTICES)
    np.testing.assert_array_equal(triangles, read_polygons(obj(), "obj")[1])


@pytest.mark.parametrize("name", FORMS)
def test_a_file_that_is_cut_is_refused_in_our_words(name):
    with pytest.raises(InvalidTerrain, match=r"cut|corrupt|past the") as refused:
        decode_terrain(FORMS[name][:-12], name, resolution=0.25)
    assert "ufunc" not in refused.value.message
    assert "kwarg" not in refused.value.message


def test_closed_solids_are_told_by_the_mesh_however_coarse_the_cells():
    """A thin plate whose two sides differ by less than its size's millionth looks like one surface from above."""
    plate = trimesh.creation.box((2000.0, 2000.0, 0.001))
    assert closed_share(Mesh(plate.vertices, plate.faces.astype(np.int32))) == 1.0
    stl = plate.export(file_type="stl")
    assert isinstance(stl, bytes)
    with pytest.raises(InvalidTerrain, match="closed solids"):
        decode_terrain(stl, "a.stl", resolution=1000.0)


def test_a_rock_on_open_ground_is_accepted():
    rock = trimesh.creation.icosphere(radius=0.5)
    square = np.array([(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)], float)
    vertices = np.concatenate([square, rock.vertices + np.array([5.0, 5.0, 0.0])])
    faces = np.concatenate([[[0, 1, 2], [0, 2, 3]], rock.faces + 4])
    share = closed_share(Mesh(vertices, faces.astype(np.int32)))
    assert share == pytest.approx(2 * np.pi * 0.25 / 100, rel=0.15)
    written = trimesh.Trimesh(vertices, faces, process=False).export(file_type="off")
    dem = decode_terrain(str(written).encode(), "a.off", resolution=0.25, most_error=1.0)
    assert dem.heights.max() > 0.45


def test_a_face_that_crosses_itself_is_refused_by_its_number():
    crossing = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 3 -1 0\nf 1 2 3\nf 1 2 3 4 5\n"
    with pytest.raises(InvalidTerrain, match=r"face 1 can't be cut .* crosses itself"):
        decode_terrain(crossing.encode(), "a.obj", resolution=0.5)


def stl_in_text(faces):
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    return "solid a\n{}endsolid a\n".format(
        "".join(facet.format("".join(f"vertex {x} {y} 0\n" for x, y in face)) for face in faces)
    ).encode()


def test_facets_of_stl_have_three_corners_or_are_refused():
    """Their reader takes vertices by threes whatever the loops: three quads became four wrong triangles."""
    quads = [[(x, 0), (x + 4, 0), (x + 4, 4), (x, 4)] for x in (0, 4, 8)]
    halves = [half for a, b, c, d in quads for half in ([a, b, c], [a, c, d])]
    assert np.isfinite(decode_terrain(stl_in_text(halves), "a.stl", resolution=0.5).heights).all()
    with pytest.raises(InvalidTerrain, match="facet 0 has 4 corners"):
        decode_terrain(stl_in_text(quads), "a.stl", resolution=0.5)
    with pytest.raises(InvalidTerrain, match="facet 1 has 6 corners"):
        decode_terrain(stl_in_text([halves[0], quads[0] + quads[1][:2]]), "a.stl", resolution=0.5)


def test_an_stl_in_text_that_is_cut_in_its_last_solid_is_refused():
    """Its reader took the solids before: what is cut off was unknown ground, and left out of a robot's shape."""
    halves = [[(x, 0), (x + 4, 0), (x + 4, 4)] for x in (0, 4)]
    whole = stl_in_text(halves[:1]) + stl_in_text(halves[1:])
    assert decode_terrain(whole, "a.stl", resolution=0.5).geometry.bounds[2] > 7.0
    for cut in (whole[: -len("endsolid a\n")], whole[:-40], stl_in_text(halves)[:-12]):
        with pytest.raises(InvalidTerrain, match="its last solid has no endsolid: the file is cut"):
            decode_terrain(cut, "a.stl", resolution=0.5)


@pytest.mark.parametrize(
    ("name", "more", "words"),
    [
        ("a.obj", b"surf 0 1 0 1 1 2 3 4\n", "'surf'"),
        ("a.obj", b"fo 1 2 3 4\n", "'fo'"),
        ("a.ply", b"", "triangle strips"),
    ],
)
def test_surfaces_that_no_reader_takes_are_refused(name, more, words):
    corners = "0 0 0\n4 0 0\n4 4 0\n0 4 0\n"
    if name == "a.obj":
        content = "".join(f"v {line}\n" for line in corners.split("\n") if line).encode() + b"f 1 2 3 # a half\n" + more
    else:
        head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        content = f"{head}{strips}{corners}4 0 1 3 2\n".encode()
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(content, name, unit="m" if name == "a.ply" else None, up="z" if name == "a.ply" else None)


def textured(order, faces, uneven):
    """A PLY whose faces have coordinates of a texture, too: as many as corners, or of the first face one more."""
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {len(VERTICES)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\n"
        "property list uchar float texcoord\nproperty uchar red\nend_header\n"
    ).encode()
    body = b"".join(struct.pack(f"{order}3d", *vertex) for vertex in VERTICES)
    for number, face in enumerate(faces):
        said = 2 * len(face) + (uneven and number == 0)
        body += struct.pack(f"{order}B{len(face)}iB{said}fB", len(face), *face, said, *[0.5] * said, 9)
    return head + body


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    "faces",
    [FACES, [[0, 1, 2, 7], [8, 9, 10, 11]], [[0, 1, 2], [0, 2, 3]]],
    ids=["mixed", "four", "three"],
)
def test_faces_with_a_texture_are_cut_as_those_without(faces, order, uneven):
    content = textured(order, faces, uneven)
    with_texture = decode_terrain(content, "t.ply", resolution=0.125, most_error=2.0)
    lines = [f"v {x} {y} {z}" for x, y, z in VERTICES]
    lines += [f"f {' '.join(str(i + 1) for i in face)}" for face in faces]
    without = decode_terrain("\n".join(lines).encode(), "t.obj", resolution=0.125, most_error=2.0)
    np.testing.assert_array_equal(with_texture.heights, without.heights)
    assert polygons_in(content, "ply") is (uneven or len(faces[0]) != 3)


def test_a_byte_order_mark_hides_no_vertex():
    marked = decode_terrain(b"\xef\xbb\xbf" + obj(), "pit.obj", resolution=0.25, most_error=2.0)
    np.testing.assert_array_equal(
        marked.heights, decode_terrain(obj(), "pit.obj", resolution=0.25, most_error=2.0).heights
    )
