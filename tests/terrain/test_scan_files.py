"""Scans of every format, written here by libraries or by hand, come out at the same heights."""

import io
import json
import zlib
from typing import Any

import laspy
import meshio
import numpy as np
import pytest
from PIL import Image
from pypcd4.pypcd4 import Encoding, PointCloud
from rasterio.crs import CRS
from typer.testing import CliRunner

import footfall
from footfall.cli import app
from footfall.core.errors import InvalidTerrain
from footfall.core.frames import inverse, quat_wxyz, rotation, transform
from footfall.io.depth_files import read_depth
from footfall.io.scan_files import read_scan
from footfall.io.scan_terrain import pose_of, terrain_from_scan
from footfall.io.terrain_files import decode_terrain
from footfall.terrain.ground.surface import height_at

RUN = CliRunner()


@pytest.fixture(scope="module")
def points():
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0, 4, 0.02), np.arange(0, 3, 0.02)))
    return np.round(np.column_stack([x, y, 0.3 * np.sin(x) + 0.1 * y]), 4)


def pcd(points, kind="binary"):
    held = io.BytesIO()
    PointCloud.from_xyz_points(points.astype(np.float32)).save(held, encoding=Encoding(kind))
    return held.getvalue()


def las(points, crs=None, classes=None, compressed=False):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = np.floor(points.min(axis=0)), np.full(3, 0.0001)
    made = laspy.LasData(header)
    made.x, made.y, made.z = points.T
    if classes is not None:
        made.classification = classes
    if crs is not None:
        record = laspy.vlrs.known.WktCoordinateSystemVlr(crs)
        header.vlrs.append(record)
    held = io.BytesIO()
    made.write(held, do_compress=compressed)
    return held.getvalue()


def ply(points, text=False):
    kind = "ascii" if text else "binary_little_endian"
    head = f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\n"
    head += "property double x\nproperty double y\nproperty double z\nend_header\n"
    body = "\n".join(" ".join(map(str, p)) for p in points) + "\n"
    return head.encode() + (body.encode() if text else points.astype("<f8").tobytes())


def vtk(points, text=True):
    head = f"# vtk DataFile Version 3.0\nscan\n{'ASCII' if text else 'BINARY'}\nDATASET POLYDATA\n"
    head += f"POINTS {len(points)} double\n"
    if not text:
        return head.encode() + points.astype(">f8").tobytes()
    vertices = f"VERTICES {len(points)} {2 * len(points)}\n" + "\n".join(f"1 {i}" for i in range(len(points)))
    return (head + "\n".join(" ".join(map(str, p)) for p in points) + "\n" + vertices + "\n").encode()


def text(points, separator=" ", heading=""):
    return (heading + "\n".join(separator.join(map(str, p)) for p in points) + "\n").encode()


FORMATS = {
    "a.ply": ply,
    "text.ply": lambda p: ply(p, text=True),
    "binary.pcd": pcd,
    "ascii.pcd": lambda p: pcd(p, "ascii"),
    "packed.pcd": lambda p: pcd(p, "binary_compressed"),
    "a.las": las,
    "a.laz": lambda p: las(p, compressed=True),
    "a.xyz": text,
    "counted.txt": lambda p: text(p, heading=f"{len(p)}\n"),
    "commented.xyz": lambda p: text(p, heading="# made by hand\n"),
    "a.csv": lambda p: text(p[:, [2, 0, 1]], ",", "z [m],x [m],y [m]\n"),
    "german.csv": lambda p: text(np.column_stack([p, p[:, :1]]), ";", "X;Y;Z;intensity\n"),
    "a.vtk": vtk,
    "binary.vtk": lambda p: vtk(p, text=False),
}


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_ground(name, points):
    content = FORMATS[name](points)
    scan = read_scan(content, name)
    # PCD has 32 bits a number
    np.testing.assert_allclose(scan.points, points, atol=1e-6)
    dem = decode_terrain(content, name, unit="m", up="z", resolution=0.1)
    assert dem.geometry.resolution == 0.1
    assert height_at(dem, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)
    assert dem.remembers


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in ("a.las", "a.laz")])
def test_what_a_file_does_not_say_is_asked_for(name, points):
    with pytest.raises(InvalidTerrain, match="--unit m --up z"):
        decode_terrain(FORMATS[name](points[::50]), name)


def test_las_says_what_is_up_and_its_coordinate_system_the_unit(points):
    with pytest.raises(InvalidTerrain, match=r"such as --unit m\)"):
        decode_terrain(las(points), "a.las")
    utm = points + np.array([500_000.0, 5_180_919.0, 0.0])
    dem = decode_terrain(las(utm, CRS.from_epsg(32633).to_wkt()), "a.las", resolution=0.1, center=(500_000, 5_180_919))
    assert height_at(dem, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)
    for code, words in ((4326, "degrees"), (2263, "reproject"), (3857, "true to scale")):
        with pytest.raises(InvalidTerrain, match=words):
            decode_terrain(las(utm, CRS.from_epsg(code).to_wkt()), "a.las", resolution=0.1)


def test_points_that_a_las_file_withholds_are_left_out(points):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = np.floor(points.min(axis=0)), np.full(3, 0.0001)
    made = laspy.LasData(header)
    lifted = points + np.where(np.arange(len(points)) % 3 == 0, 1.0, 0.0)[:, None] * (0.0, 0.0, 1.0)
    made.x, made.y, made.z = lifted.T
    made.withheld = np.arange(len(points)) % 3 == 0
    held = io.BytesIO()
    made.write(held)
    scan = read_scan(held.getvalue(), "a.las")
    assert scan.dropped == -(-len(points) // 3)
    dem = decode_terrain(held.getvalue(), "a.las", unit="m", resolution=0.1)
    assert height_at(dem, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)


def test_points_that_are_none_are_left_out(points):
    holed = points.copy()
    holed[::7, 2] = np.nan
    scan = read_scan(pcd(holed), "a.pcd")
    assert scan.dropped == len(holed[::7])
    assert len(scan.points) == len(points) - scan.dropped


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_files_that_are_cut_are_refused_by_name(name, share, points):
    whole = FORMATS[name](points[::20])
    # of VTK the second half lists the points' numbers only
    cut = whole[: int(share * len(whole) * (0.5 if name == "a.vtk" else 1.0))]
    # a text is whole after every row
    if name.endswith((".xyz", ".txt", ".csv")) and share > 0:
        cut = cut.rsplit(b"\n", 1)[0] + b"\n1.0 nonsense\n"
    with pytest.raises(InvalidTerrain, match=name):
        decode_terrain(cut, name, unit="m", up="z", resolution=0.5)


def test_headings_and_rows_that_make_no_sense_are_named():
    with pytest.raises(InvalidTerrain, match="columns x, y and z"):
        decode_terrain(b"lat,lon,height\n1,2,3\n", "a.csv", unit="m", up="z")
    with pytest.raises(InvalidTerrain, match=r"line 3, column 3 \(z\) has .x., which is no number"):
        decode_terrain(b"x,y,z\n1,2,3\n1,2,x\n", "a.csv", unit="m", up="z")
    surface = vtk(np.eye(3)).replace(b"VERTICES 3 6\n1 0\n1 1\n1 2", b"POLYGONS 1 4\n3 0 1 2")
    with pytest.raises(InvalidTerrain, match="surface"):
        decode_terrain(surface, "a.vtk", unit="m", up="z")


def camera():
    """Looks forward and down from 1.6 m."""
    return transform(rotation("z", 0.3) @ rotation("x", -np.pi / 2 - 0.7), (1.0, 0.5, 1.6))


def depths(T, rows=240, cols=320, focal=200.0):
    """Depth along the camera's axis [m] of the ground z = 0.1 x, by the meeting of rays and plane."""
    row, col = np.indices((rows, cols), dtype=float)
    rays = np.stack([(col - cols / 2) / focal, (row - rows / 2) / focal, np.ones_like(row)], axis=-1) @ T[:3, :3].T
    normal = np.array([-0.1, 0.0, 1.0])
    depth = -(normal @ T[:3, 3]) / (rays @ normal)
    return np.where((depth > 0) & (depth < 8), depth, np.nan)


def test_depth_images_with_their_pose_are_ground(tmp_path):
    T = camera()
    pose = [*T[:3, 3], *quat_wxyz(T[:3, :3])]
    assert pose_of(pose) == pytest.approx(T)
    depth = depths(T)
    members: dict[str, Any] = {"focal_length": 200.0, "cx": 160.0, "cy": 120.0}
    held = io.BytesIO()
    np.savez(held, depth=depth, **members)
    picture = io.BytesIO()
    Image.fromarray(np.nan_to_num(np.round(depth / 0.0005)).astype(np.uint16)).save(picture, "PNG")
    for content, name, calibration in (
        (held.getvalue(), "depth.npz", None),
        (picture.getvalue(), "depth.png", {**members, "depth_scale": 0.0005}),
    ):
        dem = terrain_from_scan(content, name, pose=pose, calibration=calibration)
        known = np.isfinite(dem.heights)
        x, _ = np.moveaxis(dem.geometry.centers(), -1, 0)
        assert known.sum() > 1000
        assert dem.heights[known] == pytest.approx(0.1 * x[known], abs=0.01)
        with pytest.raises(InvalidTerrain, match="--pose"):
            terrain_from_scan(content, name, calibration=calibration)
    with pytest.raises(InvalidTerrain, match="depth_scale"):
        terrain_from_scan(picture.getvalue(), "depth.png", pose=pose, calibration=members)
    (tmp_path / "d.png").write_bytes(picture.getvalue())
    (tmp_path / "c.json").write_text(json.dumps({**members, "depth_scale": 0.0005}))
    args = ["terrain", "build", "--scan", str(tmp_path / "d.png"), "--calibration", str(tmp_path / "c.json")]
    args += [
        "--pose",
        ",".join(map(repr, map(float, pose))),
        "--out",
        str(tmp_path / "out.npz"),
        "--resolution",
        "0.05",
    ]
    told = RUN.invoke(app, args)
    assert told.exit_code == 0, told.output
    assert footfall.read_terrain(tmp_path / "out.npz").geometry.resolution == 0.05


def test_a_lidar_with_its_pose_builds_the_ground_from_the_command_line(points, tmp_path):
    T = transform(rotation("z", 1.0) @ rotation("y", 0.4), (1.0, 1.0, 2.0))
    seen = points @ inverse(T)[:3, :3].T + inverse(T)[:3, 3]
    (tmp_path / "scan.pcd").write_bytes(pcd(seen))
    pose = ",".join(map(repr, map(float, [*T[:3, 3], *quat_wxyz(T[:3, :3])])))
    build = ["terrain", "build", "--scan", str(tmp_path / "scan.pcd"), "--out", str(tmp_path / "g.tif"), "--json"]
    told = RUN.invoke(app, [*build, "--resolution", "0.1", "--pose", pose, "--unit", "m"])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout)["remembers"] is True
    dem = footfall.read_terrain(tmp_path / "g.tif")
    assert height_at(dem, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=3e-3)
    for wrong, words in (
        ([], "--unit"),
        (["--unit", "m", "--pose", "1,2,3"], "seven"),
        (["--unit", "m", "--pose", "0,0,0,2,0,0,0"], "length 1"),
    ):
        told = RUN.invoke(app, [*build, *wrong])
        assert told.exit_code == 2
        assert words in told.output


def test_vtk_that_is_no_polydata_is_read_too(points, tmp_path):
    some = points[::10]
    grid = meshio.Mesh(some, [("vertex", np.arange(len(some))[:, None])])
    meshio.vtk.write(tmp_path / "a.vtk", grid)
    np.testing.assert_allclose(read_scan((tmp_path / "a.vtk").read_bytes(), "a.vtk").points, some)
    meshio.vtk.write(tmp_path / "b.vtk", meshio.Mesh(some, [("triangle", np.array([[0, 1, 2]]))]))
    with pytest.raises(InvalidTerrain, match="triangle"):
        read_scan((tmp_path / "b.vtk").read_bytes(), "b.vtk")


def test_a_volume_in_vtk_is_no_scan():
    """The corners of its voxels were read as returns: ground as flat as its lid."""
    head = "# vtk DataFile Version 3.0\nesdf\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 4 3\n"
    held = "ORIGIN 0 0 0\nSPACING 0.1 0.1 0.1\nPOINT_DATA 48\nSCALARS d float 1\nLOOKUP_TABLE default\n"
    with pytest.raises(InvalidTerrain, match=r"holds cells .hexahedron., no scan"):
        read_scan((head + held + "1.0\n" * 48).encode(), "a.vtk")


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in ("a.las", "a.laz")])
def test_rays_without_a_return_make_no_ground_at_the_sensor(name, points):
    """Many drivers write (0, 0, 0) for them: a pillar as high as the sensor stood where it stood."""
    sensor = np.array([2.0, 1.5, 1.2])
    rays = np.concatenate([points - sensor, np.zeros((len(points) // 4, 3))])
    scan = read_scan(FORMATS[name](rays), name)
    assert len(scan.points) == len(points)
    assert scan.dropped == len(points) // 4
    dem = terrain_from_scan(FORMATS[name](rays), name, unit="m", pose=[*sensor, 1, 0, 0, 0])
    assert height_at(dem, 2.0, 1.5) == pytest.approx(0.3 * np.sin(2.0) + 0.15, abs=0.01)


def test_one_point_at_the_origin_is_a_point_and_none_but_such_are_refused(points):
    assert not points[0].any()
    assert len(read_scan(text(points), "a.xyz").points) == len(points)
    with pytest.raises(InvalidTerrain, match="which stands for no return"):
        read_scan(text(np.zeros((3, 3))), "a.xyz")


def test_units_multiply(points):
    dem = decode_terrain(text(points * 1000), "a.xyz", unit="mm", up="z", resolution=0.1)
    assert height_at(dem, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)
    with pytest.raises(InvalidTerrain, match="for scans"):
        decode_terrain(b"ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n0\n", "a.asc", unit="ft")


FAR = np.array([500_000.0, 5_180_000.0, 0.0])


@pytest.mark.parametrize("name", ["a.ply", "text.ply", "binary.pcd", "ascii.pcd", "a.vtk", "binary.vtk"])
def test_numbers_of_32_bit_far_from_the_origin_are_refused(name, points):
    near, far = (FORMATS[name](p) for p in (points, points + FAR))
    near, far = (c.replace(b"property double", b"property float") for c in (near, far))
    if name == "a.ply":
        head, body = (points + FAR).astype("<f4"), far.index(b"end_header\n") + 11
        far = far[:body] + head.tobytes()
    if name.endswith(".vtk"):
        far = far.replace(b" double", b" float", 1)
    if name == "binary.vtk":
        far = far[: far.index(b"float\n") + 6] + (points + FAR).astype(">f4").tobytes()
    with pytest.raises(InvalidTerrain, match="seven digits"):
        decode_terrain(far, name, unit="m", up="z", resolution=0.1)
    if name.endswith(".pcd"):
        assert decode_terrain(near, name, unit="m", up="z", resolution=0.1).remembers


def test_doubles_far_from_the_origin_are_read(points):
    for name in ("a.ply", "a.vtk", "binary.vtk", "a.csv"):
        dem = decode_terrain(FORMATS[name](points + FAR), name, unit="m", up="z", resolution=0.1)
        assert height_at(dem, FAR[0] + 1.5, FAR[1] + 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)


def test_a_viewpoint_that_a_pcd_names_is_not_passed_over(points):
    seen = (
        pcd(points)
        .replace(b"VIEWPOINT 0.0 0.0 0.0", b"VIEWPOINT 1.0 0.0 2.5")
        .replace(b"VIEWPOINT 0 0 0", b"VIEWPOINT 1 0 2.5")
    )
    assert seen != pcd(points)
    with pytest.raises(InvalidTerrain, match="viewpoint") as refused:
        decode_terrain(seen, "a.pcd", unit="m", up="z", resolution=0.1)
    assert "--pose 1" in refused.value.message
    raised = decode_terrain(seen, "a.pcd", unit="m", pose=[1, 0, 2.5, 1, 0, 0, 0], resolution=0.1)
    assert height_at(raised, 2.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 2.7, abs=2e-3)
    same = decode_terrain(seen, "a.pcd", unit="m", pose=[0, 0, 0, 1, 0, 0, 0], resolution=0.1)
    assert height_at(same, 1.5, 2.0) == pytest.approx(0.3 * np.sin(1.5) + 0.2, abs=2e-3)


@pytest.mark.parametrize(
    ("heading", "unit", "words"),
    [
        ("x [mm],y [mm],z [mm]", "m", "--unit mm"),
        ("X(ft);Y(ft);Z(ft)", "m", "--unit ft"),
        ("x [m],y [m],z [cm]", "m", "--unit cm"),
        ("x [deg],y [deg],z [m]", "m", "degrees"),
        ("x [m],y [m],z [m]", "m", None),
        ("x [a],y (b),z", "m", None),
    ],
)
def test_the_unit_that_a_heading_says_is_not_passed_over(heading, unit, words, points):
    separator = ";" if ";" in heading else ","
    content = text(points, separator, heading + "\n")
    if words is None:
        assert decode_terrain(content, "a.csv", unit=unit, up="z", resolution=0.1).remembers
        return
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(content, "a.csv", unit=unit, up="z", resolution=0.1)


def test_counts_that_a_depth_image_declares_transparent_are_unknown():
    T = camera()
    counts = np.nan_to_num(np.round(depths(T) / 0.0005)).astype(np.uint16)
    counts[counts == 0] = 65535
    picture = io.BytesIO()
    Image.fromarray(counts).save(picture, "PNG")
    chunk = b"tRNS" + (65535).to_bytes(2, "big")
    content = picture.getvalue()
    content = content[:33] + (2).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big") + content[33:]
    calibration = {"focal_length": 200.0, "cx": 160.0, "cy": 120.0, "depth_scale": 0.0005}
    scan = read_depth(content, "d.png", calibration)
    assert len(scan.points) == (counts != 65535).sum()
    assert 0 < len(scan.points) < counts.size
