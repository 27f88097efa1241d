"""Stereo pairs and terrains from elsewhere through the REST interface: jobs, refusals, and a replay to the same map."""

import json

import numpy as np
import pytest

from footfall.io.image_files import encode_png
from footfall.io.terrain_files import decode_terrain, encode_terrain
from footfall.session.replay.recompute import replay
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from tests.support import yard
from tests.support.problems import problem
from tests.support.waiting import until

QUICK = {"resolution": 0.05, "half_size": 3.0, "matcher": "3way"}


@pytest.fixture(scope="module")
def ground():
    return rock_field(12.0, 0.05, smallest=0.1, largest=0.5, seed=5)


@pytest.fixture(scope="module")
def sent(ground, tmp_path_factory) -> dict[str, bytes]:
    """The files of three pairs by their names, calibration and pairs.yaml among them."""
    folder = tmp_path_factory.mktemp("yard")
    yard.write(folder, [yard.photograph(ground, name) for name in yard.PLACES])
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*.*"))}


def form(files: dict[str, bytes]) -> list:
    kinds = {"calibration.yaml": "calibration", "pairs.yaml": "pairs"}
    return [(kinds.get(name, "images"), (name, content)) for name, content in files.items()]


@pytest.fixture
def path(client):
    return client.post("/sessions", json={"name": "yard"}).headers["location"].removeprefix("/api/v1")


def post(client, path, files, **options):
    data = {"options": json.dumps({"settings": QUICK} | options)}
    return client.post(f"{path}/terrains/photographs", files=form(files), data=data)


def finished(client, answer) -> dict:
    assert answer.status_code == 202, answer.text
    job = answer.headers["location"].removeprefix("/api/v1")
    return until(lambda: (found := client.get(job).json())["state"] not in ("queued", "running") and found, "the job")


def test_pairs_become_a_terrain_that_replays_to_the_same(client, path, sent, ground):
    lost = {name: content for name, content in sent.items() if name != "west_right.png"}
    answer = post(client, path, lost)
    reason = "pair west: the right image is missing (west_right.png)"
    assert answer.json()["left_out"] == {"west": reason}
    assert answer.json()["pairs"] == ["east", "north"]
    job = finished(client, answer)
    assert job["state"] == "done", job
    about = client.get(job["result_url"].removeprefix("/api/v1")).json()
    assert about["sources"] == ["east", "north"]
    assert about["left_out"] == {"west": reason}
    assert about["name"] == "images, 2 pairs, without west (the right image is missing)"
    got = client.get(f"{path}/terrains/current.tif").content
    dem = decode_terrain(got, "got.tif")
    off = dem.heights - height_at(ground, dem.geometry.xs[None, :], dem.geometry.ys[:, None])
    assert np.nanmedian(np.abs(off)) < 0.015

    x = np.arange(-12, 13) * 0.5
    orbit = from_heights(height_at(ground, x[None, :], x[:, None]) - 40.0, 0.5, -6.0, -6.0, "orbit")
    options = {"settings": {"level": True, "deviation": 0.3, "reach": 4.0}}
    answer = client.post(
        f"{path}/terrains/blend",
        files={"file": ("orbit.tif", encode_terrain(orbit, ".tif"))},
        data={"options": json.dumps(options)},
    )
    blended = finished(client, answer)
    assert blended["state"] == "done", blended
    about = client.get(blended["result_url"].removeprefix("/api/v1")).json()
    assert about["known"] > 0.95
    assert "orbit.tif raised by 40.0" in about["name"]
    assert about["sources"] == ["east", "north", "orbit.tif"]

    bundle = client.get(f"/recordings/{path.split('/')[-1]}.zip").content
    report = replay(bundle)
    assert report.ok, report.problems
    assert [(one.kind, one.verdict) for one in report.products] == [("photographs", "same"), ("blend", "same")]
    assert [one.recomputed for one in report.products] == [job["result"], blended["result"]]
    assert client.post(f"{path}/terrains/undo").json()["digest"] == job["result"]


def test_the_rover_of_the_session_can_be_taken_out(client, path, sent):
    problem(post(client, path, sent, with_rover=True), 404, "not-found")
    flat = encode_terrain(rock_field(12.0, 0.1, seed=1), ".npz")
    assert client.post(f"{path}/terrains", files={"file": ("flat.npz", flat)}).status_code == 201
    assert client.post(f"{path}/state", json={"stand": {"x": 0.0, "y": 0.0}}).status_code == 201
    job = finished(client, post(client, path, sent, with_rover=True))
    # the yard's cameras would sit inside of the chassis and see nothing but it
    assert job["state"] == "failed"
    assert job["error"]["kind"] == "invalid-images"


def without(sent, *names) -> dict:
    return {name: content for name, content in sent.items() if name not in names}


def test_uploads_that_make_no_sense_are_refused_by_name(client, path, sent):
    garbage = {name: b"GIF89a" if name.endswith(".png") else content for name, content in sent.items()}
    bomb = encode_png(np.zeros((8000, 8000), np.uint8))
    for files, says in (
        ({}, "images"),
        (without(sent, "calibration.yaml"), "calibration"),
        ({"calibration.yaml": sent["calibration.yaml"]}, "images"),
        (without(sent, "calibration.yaml") | {"calibration.yaml": b"\0" * 99}, "calibration.yaml"),
        (without(sent, "calibration.yaml") | {"calibration.yaml": b"x" * (2 << 20)}, "calibration.yaml is larger"),
        (sent | {"panorama.png": sent["east_left.png"]}, "'panorama.png' is no image of a pair"),
        (sent | {"a\0_left.png": b""}, "is no image of a pair"),
        (sent | {"x" * 300 + "_left.png": b""}, "is no image of a pair"),
        (sent | {"east_left.exe": b"MZ"}, "east_left.exe"),
        (sent | {"huge_left.png": b"\0" * (17 << 20)}, "huge_left.png is larger"),
        (garbage, "east_left.png is no readable image"),
        (
            {"calibration.yaml": sent["calibration.yaml"], "a_left.png": bomb, "a_right.png": bomb},
            "a_left.png has 8000",
        ),
        (sent | {"pairs.yaml": b"pairs: ["}, "pairs.yaml"),
    ):
        answer = post(client, path, files)
        assert answer.status_code in (400, 422), (says, answer.text)
        assert answer.headers["content-type"] == "application/problem+json"
        assert says in answer.json()["detail"], answer.json()["detail"]
    too_many = {f"n{i}_left.png": b"" for i in range(65)} | {"calibration.yaml": sent["calibration.yaml"]}
    assert post(client, path, too_many).status_code in (400, 422)
    assert post(client, path, sent, cameras=["up"]).status_code == 422
    assert post(client, path, sent, settings={"max_skew": -1.0}).status_code == 422
    problem(client.get(f"{path}/terrains/current"), 404, "not-found")


def test_a_path_in_a_name_leads_nowhere(client, path, sent, tmp_path):
    target = tmp_path / "planted_left.png"
    for name in (str(target), "../" * 12 + str(target).lstrip("/"), "..\\..\\planted_left.png"):
        answer = post(client, path, sent | {name: sent["east_left.png"]})
        assert answer.status_code == 202
        assert "planted" in answer.json()["left_out"]
        client.delete(answer.headers["location"].removeprefix("/api/v1"))
    assert not target.exists()


def test_a_damaged_image_costs_its_pair_only(client, path, sent):
    answer = post(client, path, sent | {"east_left.png": sent["east_left.png"][:1000]}, cameras=["east", "north"])
    assert answer.json()["pairs"] == ["north"]
    assert "east_left.png is damaged" in answer.json()["left_out"]["east"]
    assert finished(client, answer)["state"] == "done"


def test_blending_needs_a_map_that_remembers(client, path, sent):
    flat = {"file": ("flat.npz", encode_terrain(rock_field(12.0, 0.1, seed=1), ".npz"))}
    problem(client.post(f"{path}/terrains/blend", files=flat), 409, "conflict")
    assert client.post(f"{path}/terrains", files=flat).status_code == 201
    job = finished(client, client.post(f"{path}/terrains/blend", files=flat))
    assert job["state"] == "failed"
    assert "how sure" in job["error"]["message"]
    bad = {"file": ("flat.tif", b"nothing")}
    problem(client.post(f"{path}/terrains/blend", files=bad), 422, "invalid-terrain")
    wrong = {"options": json.dumps({"settings": {"seam": 0.0}})}
    problem(client.post(f"{path}/terrains/blend", files=flat, data=wrong), 422, "invalid-input")


def test_a_collision_mesh_comes_with_its_error(client):
    session = client.post("/sessions", json={"name": "mesh"}).headers["location"].removeprefix("/api/v1")
    rocks = encode_terrain(rock_field(6.0, 0.05, smallest=0.1, largest=0.5, seed=4), ".npz")
    assert client.post(f"{session}/terrains", files={"file": ("r.npz", rocks)}).status_code == 201
    answer = client.get(f"{session}/terrains/current/collision.obj", params={"tolerance": 0.02, "raise_by": 0.0})
    assert answer.status_code == 200, answer.text
    assert 0 < float(answer.headers["footfall-height-error"]) <= 0.02
    few, _, many = answer.headers["footfall-triangles"].partition(" of ")
    assert int(few) == sum(line.startswith(b"f ") for line in answer.content.splitlines()) < int(many)
    for wrong in ({"tolerance": 0.0}, {"raise_by": -1.0}, {"buffer": 99.0}, {"tolerance": "nan"}):
        assert client.get(f"{session}/terrains/current/collision.ply", params=wrong).status_code == 422
    assert client.get(f"{session}/terrains/current/collision.tif").status_code == 422
    assert client.get("/sessions/none/terrains/current/collision.ply").status_code == 404
