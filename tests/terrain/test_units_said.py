"""A unit that a mesh or a scan says in a comment or in its header is heeded, in every format."""

import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import decode_terrain, encode_terrain
from footfall.terrain.generate import plane

GROUND = plane(size=2.0, resolution=0.5)
ROWS = "".join(f"{x} {y} 0\n" for x in (0, 1000, 2000) for y in (0, 1000, 2000))
SAYINGS = ("units mm", "units: mm", "UNITS=mm", "unit = millimeter", "File units = millimeters", "1 unit = 1 mm",
           "all coordinates in mm", "unit of length: mm", "units are millimetres", 'unit "mm"')  # fmt: skip
OTHERS = ("units m", "unit vectors in mm", "units: px", "unit mm/s", "units in which it was seen", "1 unit = 1000 mm")


def ply(said):
    return encode_terrain(GROUND, ".ply").replace(b"\nelement vertex", f"\ncomment {said}\nelement vertex".encode(), 1)


def obj(said):
    return f"# {said}\n".encode() + encode_terrain(GROUND, ".obj")


def off(said):
    return encode_terrain(GROUND, ".off").replace(b"OFF\n", f"OFF\n# {said}\n".encode(), 1)


def stl(said):
    return said.encode().ljust(80, b" ") + encode_terrain(GROUND, ".stl")[80:]


def text_stl(said):
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 2 2 0\nendloop\nendfacet\n"
    return f"solid ground {said}\n{facet}endsolid ground\n".encode()


MESHES = {"a.ply": ply, "a.obj": obj, "a.off": off, "a.stl": stl, "text.stl": text_stl}


@pytest.mark.parametrize("said", SAYINGS)
@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_in_millimetres_is_not_read_as_metres(name, said):
    content = MESHES[name](said)
    with pytest.raises(InvalidTerrain, match=r"says itself that its unit is m(m|ill).*read as metres.*--scale 0.001"):
        decode_terrain(content, name)
    dem = decode_terrain(content, name, scale=0.001, resolution=0.001)
    assert np.ptp(dem.geometry.xs) == pytest.approx(0.002, rel=0.3)
    with pytest.raises(InvalidTerrain, match=r"would be multiplied by 0.3048: read it with --scale 0.001"):
        decode_terrain(content, name, scale=0.3048)


@pytest.mark.parametrize("said", OTHERS)
@pytest.mark.parametrize("name", MESHES)
def test_metres_and_what_is_no_unit_of_length_change_nothing(name, said):
    for scale in (1.0, 2.5):
        assert decode_terrain(MESHES[name](said), name, scale=scale).heights[0, 0] == 0.0


@pytest.mark.parametrize(("said", "scale"), [("inches", 0.0254), ("feet", 0.3048), ("us survey feet", 1200 / 3937)])
def test_other_units_are_told_with_their_scale(said, scale):
    with pytest.raises(InvalidTerrain, match=f"--scale {scale:.9g} "):
        decode_terrain(obj(f"File units = {said}"), "a.obj")
    with pytest.raises(InvalidTerrain, match="degrees"):
        decode_terrain(obj("units: degrees"), "a.obj")


SCANS = {
    "a.ply": "ply\nformat ascii 1.0\ncomment {}\nelement vertex 9\nproperty double x\nproperty double y\n"
    f"property double z\nend_header\n{ROWS}",
    "a.pcd": "# .PCD v0.7\n# {}\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 9\nHEIGHT 1\n"
    f"POINTS 9\nDATA ascii\n{ROWS}",
    "a.vtk": f"# vtk DataFile Version 3.0\n{{}}\nASCII\nDATASET POLYDATA\nPOINTS 9 double\n{ROWS}",
    "a.xyz": f"# by hand\n# {{}}\n{ROWS}",
    "slashes.csv": f"// {{}}\nx y z\n{ROWS}",
}


@pytest.mark.parametrize("name", SCANS)
def test_a_scan_is_read_with_the_unit_that_it_says_alone(name):
    content = SCANS[name].format("units: mm").encode()
    with pytest.raises(InvalidTerrain, match="says itself that its unit is mm, not m: state --unit mm"):
        decode_terrain(content, name, unit="m", up="z")
    assert decode_terrain(content, name, unit="mm", up="z").geometry.bounds[2] == pytest.approx(2.0, abs=1.0)
    assert decode_terrain(SCANS[name].format("by hand").encode(), name, unit="m", up="z").geometry.bounds[2] >= 2000


def test_a_heading_behind_a_comment_says_its_unit_too():
    for heading in ("x[mm] y[mm] z[mm]", "# Easting [mm] Northing [mm] Elevation [mm]"):
        content = f"# by hand\n{heading}\n{ROWS}".encode()
        with pytest.raises(InvalidTerrain, match="unit is mm, not m: state --unit mm"):
            decode_terrain(content, "a.xyz", unit="m", up="z")
