"""Files from outside: whatever comes, the answer is a problem document and the server goes on."""

import io
import json
from dataclasses import replace

import httpx
import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from footfall.io.artifacts import encode
from footfall.io.image_files import encode_png
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.generate import plane
from tests.support.problems import problem
from tests.support.zips import zipped

GRID = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n0 0 0\n0 1 0\n0 0 0\n"


@pytest.fixture(scope="module")
def path(server):
    """A session of its own, with ground and a state."""
    with server.client() as client:
        made = client.post("/sessions", json={"name": "uploads"}).headers["location"].removeprefix("/api/v1")
        flat = plane(size=10.0, resolution=0.1)
        server.sessions.current.terrains.load(flat)
        assert client.post(f"{made}/state", json={"stand": {"x": 0.0, "y": 0.0}}).status_code == 201
        return made


@pytest.fixture(autouse=True)
def alive(client):
    yield
    assert client.get("/info").status_code == 200


def npy(array) -> bytes:
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def npz(**arrays) -> bytes:
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    return out.getvalue()


HUGE = (
    b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000), }".ljust(127) + b"\n"
)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("all-unknown.asc", GRID.replace("0 0 0", "nan nan nan").replace("0 1 0", "nan nan nan")),
        ("endless.asc", GRID.replace("0 1 0", "0 inf 0")),
        ("huge.asc", GRID.replace("ncols 3", "ncols 3000000").replace("nrows 3", "nrows 3000000")),
        ("negative.asc", GRID.replace("cellsize 1", "cellsize -1")),
        ("grid.tif", GRID),
        ("grid.exe", GRID),
        ("grid", GRID),
        ("", GRID),
        ("..", GRID),
        (".", GRID),
        ("a" * 300 + "." + "b" * 300, GRID),
        ("a" * 300 + ".asc", "nothing"),
        ("nul\0.asc", "nothing"),
        ("empty.npz", b""),
        ("no-heights.npz", npz(other=np.zeros(3))),
        ("objects.npz", npz(heights=np.array([{}], object), resolution=0.1, x0=0.0, y0=0.0)),
        ("nan.npz", npz(heights=np.full((4, 4), np.nan), resolution=0.1, x0=0.0, y0=0.0)),
        ("resolution.npz", npz(heights=np.zeros((4, 4)), resolution=np.nan, x0=0.0, y0=0.0)),
        ("bomb.npz", npz(heights=np.zeros((20_000, 20_000), np.int8), resolution=0.1, x0=0.0, y0=0.0)),
        ("claim.npz", zipped(**{"heights.npy": HUGE, **{f"{n}.npy": npy(1.0) for n in ("resolution", "x0", "y0")}})),
        ("broken.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
        ("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("picture.png", b"\x89PNG\r\n\x1a\n broken"),
    ],
)  # fmt: skip
def test_terrain_files_that_make_no_sense(client, path, name, content):
    options = {"options": json.dumps({"size": [10, 10], "height_range": [0, 1]})} if name.endswith(".png") else {}
    answer = client.post(f"{path}/terrains", files={"file": (name, content)}, data=options)
    document = answer.json()
    assert answer.status_code == 422, document
    assert document["type"] in ("/problems/invalid-terrain", "/problems/invalid-input", "/problems/invalid-images")
    assert "Traceback" not in document["detail"]


@pytest.mark.parametrize(
    "options", ['{"scale": NaN}', '{"scale": Infinity}', '{"scale": 0}', '{"resolution": -1}', "{", "[]"]
)
def test_options_that_make_no_sense(client, path, options):
    answer = client.post(f"{path}/terrains", files={"file": ("g.asc", GRID)}, data={"options": options})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("name", ["\0.asc", "a\0b.asc", "a.asc\0", "a.\0asc"])
@pytest.mark.parametrize("where", ["terrains", "terrains/blend", "sequences/import"])
def test_a_file_name_with_a_nul_character_is_refused_by_name(server, path, where, name):
    disposition = f'Content-Disposition: form-data; name="file"; filename="{name}"'.encode()
    body = b"--B\r\n" + disposition + b"\r\n\r\n" + GRID.encode() + b"\r\n--B--\r\n"
    headers = {"content-type": "multipart/form-data; boundary=B"}
    answer = httpx.post(f"{server.api}{path}/{where}", content=body, headers=headers, trust_env=False, verify=False)
    problem(answer, 422, "invalid-input")
    assert "NUL character" in answer.json()["detail"]


def test_a_path_in_a_file_name_leads_nowhere(client, path, tmp_path):
    target = tmp_path / "planted.asc"
    for name in (str(target), "../" * 12 + str(target).lstrip("/"), "..\\..\\planted.asc"):
        assert client.post(f"{path}/terrains", files={"file": (name, GRID)}).status_code == 201
    assert not target.exists()


def bundle(**changed: bytes) -> bytes:
    session = {"format": "footfall-session", "version": 1, "id": "x", "name": "x", "created": 0.0}
    session |= {"robot": {"name": "athlete", "digest": "0" * 32}, "software": "0"}
    return zipped(**({"session.json": json.dumps(session).encode(), "events.jsonl": b""} | changed))


@pytest.mark.parametrize(
    "content",
    [
        b"PK\x03\x04 no zip",
        zipped(**{"readme.txt": b"hello"}),
        bundle(),
        bundle(**{"../../planted": b"x"}),
        bundle(**{"/tmp/planted": b"x"}),
        bundle(**{"artifacts/../../planted": b"x"}),
        bundle(**{"session.json": b"[" * 100_000}),
        bundle(**{"session.json": b'{"format": "footfall-session", "version": 99}'}),
        bundle(**{"events.jsonl": b'{"seq": 0}\n'}),
        bundle(**{"events.jsonl": b"\0" * 1000 + b"\n"}),
        bundle(**{"artifacts/" + "0" * 32 + ".npz": encode(plane())}),
        bundle(**{"artifacts/" + "0" * 32 + ".npz": b"\0" * 300_000_000}),
    ],
    ids=lambda content: str(len(content)),
)
def test_recordings_that_make_no_sense(client, content):
    before = client.get("/sessions").json()
    problem(
        client.post("/recordings", content=content, headers={"content-type": "application/zip"}), 422, "invalid-bundle"
    )
    assert client.get("/sessions").json() == before


def pair(width=64, height=48):
    rng = np.random.default_rng(1)
    left = rng.integers(0, 255, (height, width)).astype(np.uint8)
    return left, np.roll(left, -4, axis=1)


def calibration(width=64, height=48, **changed) -> str:
    pose = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0.8], [0, 0, 0, 1]]
    right = [*pose[:1], [-1, 0, 0, -0.2], *pose[2:]]
    camera = {"width": width, "height": height, "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5}
    return json.dumps(
        {
            "name": "hand",
            "camera_left": camera | {"T_base_camera": pose},
            "camera_right": camera | {"T_base_camera": right},
        }
        | changed
    )


def files_of(left, right) -> dict:
    return {"left": ("l.png", left), "right": ("r.png", right)}


def test_a_pair_goes_in_and_comes_out(client, path):
    left, right = pair()
    answer = client.post(
        f"{path}/images/upload",
        files=files_of(encode_png(left), encode_png(right)),
        data={"calibration": calibration()},
    )
    assert answer.status_code == 201, answer.text
    listed = client.get(f"{path}/images").json()
    assert listed["snapshot"] == answer.json()["digest"]
    (about,) = listed["pairs"]
    assert (about["name"], about["width"], about["height"]) == ("hand", 64, 48)
    assert about["baseline"] == pytest.approx(0.2)
    assert client.get(about["left"].removeprefix("/api/v1")).content == encode_png(left)
    assert client.get(about["right"].removeprefix("/api/v1")).content == encode_png(right)
    assert client.post(f"{path}/terrains", json={"source": "images"}).status_code == 202


def test_in_a_what_if_a_pair_was_taken_where_the_rover_stands(client, path, server):
    live, given = server.sessions.get(path.split("/")[-1]), files_of(*map(encode_png, pair()))
    stands = live.stances.set(replace(live.typed(RobotState, live.state.state), time=1.0))
    assert client.put(f"{path}/what-if", json={"dz": -0.1}).status_code == 200
    assert live.state.what_if == stands
    answer = client.post(f"{path}/images/upload", files=given, data={"calibration": calibration()})
    assert answer.status_code == 201, answer.text
    snapshot = live.typed(Snapshot, answer.json()["digest"])
    assert (snapshot.state.digest, live.state.state, live.state.what_if) == (stands, stands, None)
    np.testing.assert_array_equal(snapshot.pairs[0].T_site_base, snapshot.state.T_site_base)


@pytest.mark.parametrize(
    ("left", "right", "text"),
    [
        (encode_png(pair()[0]), encode_png(pair(32)[1]), calibration()),
        (encode_png(pair()[0]), b"", calibration()),
        (b"GIF89a", b"BM", calibration()),
        (encode_png(pair()[0]), encode_png(pair()[1]), calibration(width=65)),
        (encode_png(pair()[0]), encode_png(pair()[1]), calibration(camera_right=None)),
        (encode_png(pair()[0]), encode_png(pair()[1]), calibration().replace("60.0", "NaN")),
        (encode_png(pair()[0]), encode_png(pair()[1]), calibration().replace("60.0", "-1")),
        (encode_png(pair()[0]), encode_png(pair()[1]), calibration(T_site_base=[[2, 0, 0, 0]] * 4)),
        (encode_png(pair()[0]), encode_png(pair()[1]), "{"),
    ],
)
def test_pairs_that_make_no_sense(client, path, left, right, text):
    before = client.get(f"{path}/images").json()
    answer = client.post(f"{path}/images/upload", files=files_of(left, right), data={"calibration": text})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert client.get(f"{path}/images").json() == before


def test_a_pair_without_its_parts(client, path):
    one = {"left": ("l.png", encode_png(pair()[0]))}
    problem(client.post(f"{path}/images/upload", files=one, data={"calibration": calibration()}), 422, "invalid-input")
    both = files_of(encode_png(pair()[0]), encode_png(pair()[1]))
    problem(client.post(f"{path}/images/upload", files=both), 422, "validation")
    three = both | {"third": ("t.png", b"x")}
    assert client.post(f"{path}/images/upload", files=three, data={"calibration": calibration()}).status_code == 400
    assert client.post(f"{path}/images/upload", content=b"no form").status_code in (400, 422)


def grid_with_mask(tmp_path) -> dict[str, bytes]:
    heights = np.arange(16, dtype=np.float32).reshape(4, 4)
    profile = {"driver": "GTiff", "width": 4, "height": 4, "count": 1, "dtype": "float32", "crs": "EPSG:32633"}
    path = tmp_path / "g.tif"
    with (
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=False),
        rasterio.open(path, "w", **profile, transform=Affine(2, 0, 500_000, 0, -2, 5_180_000)) as target,
    ):
        target.write(heights, 1)
        target.write_mask(heights > 3)
    return {one.name: one.read_bytes() for one in tmp_path.iterdir()}


@pytest.mark.parametrize("name", ["g.tif", "Höhe im Süden.tif"])
def test_files_beside_a_terrain_go_along(client, path, tmp_path, name):
    made = grid_with_mask(tmp_path)
    assert set(made) == {"g.tif", "g.tif.msk"}
    alone = client.post(f"{path}/terrains", files=[("file", (name, made["g.tif"]))])
    assert alone.json()["known"] == 1.0
    parts = [("file", (name, made["g.tif"])), ("beside", (f"{name}.msk", made["g.tif.msk"]))]
    both = client.post(f"{path}/terrains", files=parts)
    assert both.status_code == 201, both.text
    assert both.json()["known"] == 0.75
    assert both.json()["true_north_deg"] is not None
    stranger = client.post(f"{path}/terrains", files=[*parts[:1], ("beside", ("other.prj", b"x"))])
    problem(stranger, 422, "invalid-input")
    assert "does not belong to" in stranger.json()["detail"]
