"""Scans and depth images through the REST interface: ground with variance and count, or what has to be stated."""

import io
import json

import numpy as np
import pytest
from pypcd4.pypcd4 import Encoding, PointCloud

from footfall.core.frames import inverse, quat_wxyz, rotation, transform
from footfall.io.terrain_files import decode_terrain
from footfall.terrain.ground.surface import height_at
from tests.support.problems import problem


def height(x, y):
    return 0.2 * np.sin(x) + 0.1 * y


@pytest.fixture(scope="module")
def points():
    x, y = (a.ravel() for a in np.meshgrid(np.arange(-2, 2, 0.03), np.arange(-2, 2, 0.03)))
    return np.column_stack([x, y, height(x, y)])


def pcd(points):
    held = io.BytesIO()
    PointCloud.from_xyz_points(points.astype(np.float32)).save(held, encoding=Encoding.BINARY_COMPRESSED)
    return held.getvalue()


@pytest.fixture
def path(client):
    return client.post("/sessions", json={"name": "scans"}).headers["location"].removeprefix("/api/v1")


def post(client, path, name, content, **options):
    data = {"options": json.dumps(options)}
    return client.post(f"{path}/terrains/scans", files={"file": (name, content)}, data=data)


def test_a_cloud_with_its_sensors_pose_becomes_the_terrain(client, path, points):
    T = transform(rotation("z", 0.5) @ rotation("y", 0.6), (-1.0, 0.5, 1.8))
    seen = points @ inverse(T)[:3, :3].T + inverse(T)[:3, 3]
    pose = [*map(float, T[:3, 3]), *map(float, quat_wxyz(T[:3, :3]))]
    answer = post(client, path, "lidar.pcd", pcd(seen), unit="m", pose=pose, settings={"resolution": 0.1})
    assert answer.status_code == 201, answer.text
    told = answer.json()
    assert told["remembers"] is True
    assert told["height_error"] is None
    assert told["resolution"] == 0.1
    content = client.get(f"{path}/terrains/{told['digest']}.npz").content
    dem = decode_terrain(content, "a.npz")
    assert height_at(dem, 1.0, -0.5) == pytest.approx(height(1.0, -0.5), abs=2e-3)
    assert dem.count is not None
    assert int(dem.count.max()) > 5
    assert client.get(f"{path}/terrains/current").json()["digest"] == told["digest"]


def test_what_a_scan_does_not_say_is_asked_for(client, path, points):
    told = problem(post(client, path, "lidar.pcd", pcd(points)), 422, "invalid-terrain")
    assert "unit" in told["detail"]
    assert "up" in told["detail"]
    problem(post(client, path, "lidar.pcd", pcd(points), unit="furlong"), 422, "validation")
    problem(post(client, path, "lidar.pcd", pcd(points), unit="m", pose=[1.0, 2.0]), 422, "validation")
    problem(post(client, path, "lidar.pcd", pcd(points)[:500], unit="m", up="z"), 422, "invalid-terrain")
    assert post(client, path, "lidar.pcd", pcd(points), unit="m", up="z").status_code == 201


def test_a_depth_image_needs_pose_and_calibration(client, path):
    # straight down from 2 m
    held = io.BytesIO()
    np.savez(held, depth=np.full((100, 120), 2.0))
    pose, camera = [0.3, 0.4, 2.5, 0.0, 1.0, 0.0, 0.0], {"focal_length": 100.0, "cx": 60.0, "cy": 50.0}
    problem(post(client, path, "d.npz", held.getvalue(), calibration=camera), 422, "invalid-terrain")
    problem(post(client, path, "d.npz", held.getvalue(), pose=pose), 422, "invalid-terrain")
    answer = post(client, path, "d.npz", held.getvalue(), pose=pose, calibration=camera, settings={"resolution": 0.05})
    assert answer.status_code == 201, answer.text
    told = answer.json()
    assert (told["lowest"], told["highest"]) == pytest.approx((0.5, 0.5))
    assert told["bounds"]["west"] == pytest.approx(0.3 - 1.2, abs=0.05)
    bomb = io.BytesIO()
    np.savez_compressed(bomb, depth=np.zeros((8000, 8000), np.uint8))
    problem(post(client, path, "d.npz", bomb.getvalue(), pose=pose, calibration=camera), 422, "invalid-terrain")


def test_a_projection_goes_along_with_a_scan(client, path):
    from rasterio.crs import CRS

    rows = "".join(f"{700_000 + 0.5 * i} {5_180_000 + 0.5 * j} 0.0\n" for i in range(8) for j in range(8)).encode()
    data = {"options": json.dumps({"up": "z", "settings": {"resolution": 0.5}})}

    def load(*beside):
        files = [("file", ("scan.xyz", rows)), *(("beside", one) for one in beside)]
        return client.post(f"{path}/terrains/scans", files=files, data=data)

    assert "--unit" in load().json()["detail"]
    taken = load(("scan.prj", CRS.from_epsg(32633).to_wkt().encode()))
    assert taken.status_code == 201, taken.text
    assert taken.json()["true_north_deg"] is not None
    refused = load(("scan.prj", CRS.from_epsg(2263).to_wkt().encode()))
    assert refused.status_code == 422
    assert "US survey foot" in refused.json()["detail"]
    assert "does not belong to" in load(("other.prj", b"x")).json()["detail"]
