"""Terrain from a photographed pair, a simulated rover from the command line, replay and the list of sessions."""

import json
import signal
import subprocess

import numpy as np
import pytest
from PIL import Image

from footfall.io.image_files import encode_png
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import plane
from tests.support.command_line import FOOTFALL, run
from tests.support.server import running_server
from tests.support.waiting import BOUND, until

HEIGHT, TILT = 1.5, 0.6


@pytest.fixture
def photographed(tmp_path):
    """A textured level floor 1.5 m under a camera that looks 0.6 rad down, as two pictures and their calibration."""
    width, height, focal, baseline = 320, 240, 250.0, 0.2
    rng = np.random.default_rng(3)
    texture = Image.fromarray(rng.integers(0, 255, (200, 200)).astype(np.uint8)).resize(
        (1600, 1600), Image.Resampling.BICUBIC
    )
    cells = np.asarray(texture)
    u, v = np.meshgrid(np.arange(width) - 159.5, np.arange(height) - 119.5)
    # rays in site axes: x forward, y left, z up
    down = np.array([-np.sin(TILT), np.cos(TILT)])
    forward, up = np.cos(TILT) + v / focal * down[0], -np.sin(TILT) - v / focal * np.cos(TILT)
    reach = HEIGHT / np.maximum(-up, 1e-3)
    images = []
    for shift in (0.0, -baseline):
        x, y = reach * forward, -reach * u / focal + shift
        images.append(cells[np.mod((x * 160).astype(int), 1600), np.mod((y * 160).astype(int), 1600)])
    for name, image in zip(("left.png", "right.png"), images, strict=True):
        (tmp_path / name).write_bytes(encode_png(np.ascontiguousarray(image)))
    c, s = np.cos(TILT), np.sin(TILT)
    pose = [[0, -s, c, 0], [-1, 0, 0, 0], [0, -c, -s, HEIGHT], [0, 0, 0, 1]]
    members = {"focal_length": focal, "cx": 159.5, "cy": 119.5, "baseline": baseline, "T_base_camera": pose}
    (tmp_path / "pair.json").write_text(json.dumps(members))
    return tmp_path, members


def test_terrain_from_a_photographed_pair(photographed):
    folder, _ = photographed
    left, right, out = folder / "left.png", folder / "right.png", folder / "floor.npz"
    asked = ["terrain", "build", left, right, out, "--calibration", folder / "pair.json", "--half-size", 1.5, "--json"]
    about = json.loads(run(*asked, "--resolution", 0.05).stdout)
    assert about["written"] == str(out)
    dem = read_terrain(out)
    known = np.isfinite(dem.heights)
    assert known.mean() > 0.2
    assert np.abs(dem.heights[known]).mean() < 0.03


def test_a_pair_that_makes_no_sense(photographed):
    folder, members = photographed
    left, right, out = folder / "left.png", folder / "right.png", folder / "floor.npz"
    run("terrain", "build", left, right, out, code=2)
    run("terrain", "build", left, out, "--calibration", folder / "pair.json", code=2)
    run("terrain", "build", out, code=2)
    run("terrain", "build", left, folder / "none.png", out, "--calibration", folder / "pair.json", code=2)
    run("terrain", "build", left, right, out, "--calibration", folder / "none.json", code=2)
    for changed in (
        {"baseline": 0},
        {"focal_length": "250"},
        {"cx": float("nan")},
        {"baslin": 1},
        {"T_site_base": [[1, 0], [0, 1]]},
        {"name": 3},
    ):
        (folder / "bad.json").write_text(json.dumps(members | changed))
        result = run("terrain", "build", left, right, out, "--calibration", folder / "bad.json", code=2)
        assert next(iter(changed)) in result.stderr.replace("the baseline", "baseline").replace(
            "focal lengths", "focal_length"
        )
    for text in ("{", "[]", "{}"):
        (folder / "bad.json").write_text(text)
        run("terrain", "build", left, right, out, "--calibration", folder / "bad.json", code=2)
    assert not out.exists()


def test_replay_of_a_session_and_the_list(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("by hand")
        live.terrains.load(plane(size=10.0, resolution=0.1))
        from footfall.planning.body.stand import stand

        live.stances.set(stand(live.robot, plane(size=10.0, resolution=0.1)))
        live.maps.compute(2).finish()
        name = live.id
    report = json.loads(run("replay", tmp_path / name, "--check", "--json").stdout)
    assert report["ok"] is True
    (products,) = [one["products"] for one in report["bundles"].values()]
    assert [(one["kind"], one["verdict"]) for one in products] == [("maps", "same")]
    assert "the same" in run("replay", tmp_path / name).stdout
    listed = run("sessions", "--data", tmp_path).stdout
    assert name in listed
    assert "by hand" in listed
    (about,) = json.loads(run("sessions", "--data", tmp_path, "--json").stdout)["sessions"]
    assert (about["id"], about["robot"]) == (name, "athlete")


def test_sim_is_a_rover_on_the_link(tmp_path):
    world = tmp_path / "level.npz"
    write_terrain(plane(size=10.0, resolution=0.1), world)
    with running_server(tmp_path / "sessions", prepare=lambda s: s.create("sim")) as server, server.client() as client:
        url = f"ws{server.api.removeprefix('http')}/rover"
        command = [*FOOTFALL, "sim", str(world), "--url", url, "--x", "0.5"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as rover:
            try:
                until(lambda: client.get("/sessions/current/telemetry").status_code == 200, "telemetry")
                telemetry = client.get("/sessions/current/telemetry").json()
                assert telemetry["mode"] == "idle"
                assert telemetry["T_site_base"][0][3] == pytest.approx(0.5, abs=5e-3)  # it settles on its springs
                rover.send_signal(signal.SIGINT)
                assert rover.wait(BOUND) == 0
            finally:
                rover.kill()
            assert rover.stderr is not None
            assert "Traceback" not in rover.stderr.read()
        until(lambda: not client.get("/sessions/current").json()["link"]["connected"], "the end of the link")


def test_sim_says_what_is_wrong(tmp_path):
    assert "missing" in run("sim", tmp_path / "missing.npz", code=2).stderr
