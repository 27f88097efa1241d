"""OBJ and OFF as people and programs write them: no line of theirs is passed over."""

import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import decode_terrain

VERTICES = "v 0 0 0\nv 2 0 1\nv 2 2 2\nv 0 2 1\n"
FACES = "f 1 2 3\nf 1 3 4\n"
OBJ = VERTICES + FACES
ROWS = "0 0 0\n2 0 1\n2 2 2\n0 2 1\n"
OFF = f"OFF\n4 2 0\n{ROWS}3 0 1 2\n3 0 2 3\n"
HEIGHTS = [[0.0, 0.5, 1.0], [0.5, 1.0, 1.5], [1.0, 1.5, 2.0]]
CONTINUED = OBJ.replace("f 1 3 4", "f 1 3\\\n  4")

WRITTEN = {
    "plain.obj": OBJ,
    "indented.obj": "  " + OBJ.replace("\n", "\n  "),
    "one face indented.obj": OBJ.replace("f 1 3 4", "\tf 1 3 4"),
    "one vertex indented.obj": OBJ.replace("v 2 2 2", "  v 2 2 2"),
    "tabs.obj": OBJ.replace(" ", "\t"),
    "one tab.obj": OBJ.replace("f 1 3 4", "f\t1 3 4"),
    "commented.obj": OBJ.replace("2 2 2", "2 2 2 # the top"),
    "continued.obj": CONTINUED,
    "continued on Windows.obj": CONTINUED.replace("\n", "\r\n"),
    "a polygon, indented.obj": VERTICES + "  f 1 2 3 4\n",
    "coloured.obj": OBJ.replace("\nv", " 0.1 0.2 0.3\nv").replace("0 2 1\n", "0 2 1 0.1 0.2 0.3\n"),
    "plain.off": OFF,
    "commented.off": OFF.replace("2 2 2", "2 2 2 # the top").replace("4 2 0", "4 2 0 # counts"),
    "spaced.off": OFF.replace("\n", "\n\n"),
    "coloured.off": OFF.replace("OFF", "COFF").replace(ROWS, ROWS.replace("\n", " 9 9 9 1\n")),
    "a coloured polygon.off": f"COFF\n4 1 0\n{ROWS}4 0 1 2 3\n".replace(ROWS, ROWS.replace("\n", " 9 9 9 1\n")),
    "normals.off": OFF.replace("OFF", "NOFF").replace(ROWS, ROWS.replace("\n", " 0 0 1\n")),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_every_way_to_write_it_is_the_same_ground(name):
    dem = decode_terrain(WRITTEN[name].encode(), name, resolution=1.0)
    np.testing.assert_allclose(dem.heights, HEIGHTS, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("short.obj", OBJ.replace("v 2 2 2", "v 2 2"), "line 3, 'v 2 2', is no vertex of three numbers"),
        ("empty.obj", OBJ.replace("v 2 2 2", "v"), "line 3, 'v', is no vertex of three numbers"),
        ("four.off", OFF.replace("OFF", "4OFF").replace(ROWS, ROWS.replace("\n", " 2\n")), "it is '4OFF': vertices of"),
        ("many.off", OFF.replace("OFF", "nOFF\n3"), "it is 'nOFF'"),
    ],
)
def test_vertices_of_other_dimensions_are_refused(name, text, words):
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(text.encode(), name, resolution=1.0)
