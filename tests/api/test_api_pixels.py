"""Images by every door are counted by their heads against one budget, before a pixel of them is unpacked."""

import json

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.io import link_images
from footfall.io.link_images import encode_images
from footfall.session.pixels import OF_ONE, PixelBudget
from footfall.session.rover.light_time import LightTime
from footfall.telemetry.link import HelloMessage, encode
from tests.api.test_api_budgets import snapshot
from tests.support.hostile import png_that_claims
from tests.support.problems import problem
from tests.support.waiting import BOUND, until

BYTES = {"content-type": "application/octet-stream"}
IMAGES = "/rover/images?protocol=2"
PIXELS = 2 * 8 * 8


@pytest.fixture
def budget(plain):
    """Room for two pairs of 8 × 8 pixels of one client."""
    before, plain.sessions.pixels = plain.sessions.pixels, PixelBudget(2 * PIXELS, 2 * PIXELS)
    yield plain.sessions.pixels
    plain.sessions.pixels = before
    plain.sessions.set_light_time(LightTime())


def frame(number: int) -> bytes:
    return encode_images(f"r{number}", snapshot(1, 8))


def test_images_by_requests_are_held_while_the_light_time_lasts(plain, ground, budget):
    plain.sessions.create("far")
    plain.sessions.set_light_time(LightTime(telemetry=1000.0))
    for number in range(2):
        assert ground.post(IMAGES, content=frame(number), headers=BYTES).status_code == 200
    assert budget.held == 2 * PIXELS
    before = ground.get("/info").json()["rover_link"]["faults_by_kind"].get("images", 0)
    refused = ground.post(IMAGES, content=frame(2), headers=BYTES)
    told = problem(refused, 503, "busy")
    assert (told["pixels"], told["held"], told["limit"]) == (PIXELS, 2 * PIXELS, 2 * PIXELS)
    assert int(refused.headers["retry-after"]) > 0
    assert ground.get("/info").json()["rover_link"]["faults_by_kind"]["images"] == before + 1
    assert ground.post("/stop").json()["stopped"] is True
    ground.post("/stop/clear")


def test_more_than_a_client_may_ever_have_is_refused_unread(plain, ground, budget, monkeypatch):
    plain.sessions.create("near")
    monkeypatch.setattr(link_images, "_png", lambda image: png_that_claims(9, 9))
    content = encode_images("x", snapshot(2, 8))
    told = problem(ground.post(IMAGES, content=content, headers=BYTES), 422, "invalid-images")
    assert (told["pixels"], told["limit"]) == (4 * 81, 2 * PIXELS)
    assert budget.held == 0


def test_images_on_the_link_are_dropped_with_the_reason_and_the_link_stays(plain, ground, budget):
    live = plain.sessions.create("linked")
    url = "ws" + plain.api.removeprefix("http") + "/rover"
    with connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None) as rover:
        rover.send(encode(HelloMessage("athlete", 6)))
        until(lambda: live.rover.link.connected, "the link")
        rover.send(encode_images("large", snapshot(3, 8)))
        while (message := json.loads(rover.recv(timeout=BOUND)))["type"] != "error":
            pass
        assert f"have {3 * PIXELS} pixels; of one client at most {2 * PIXELS}" in message["text"]
        rover.send(frame(1))
        until(lambda: live.state.snapshot, "the next ones")
        until(lambda: budget.held == 0, "room")
    plain.until_rover_left()


def _pair(ground, left: bytes, right: bytes):
    camera = {"width": 8, "height": 8, "fx": 5.0, "fy": 5.0, "cx": 4.0, "cy": 4.0}
    pose = [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]
    moved = [[1.0, 0, 0, 0.3], *pose[1:]]
    calibration = {
        "name": "p",
        "camera_left": {**camera, "T_base_camera": pose},
        "camera_right": {**camera, "T_base_camera": moved},
    }
    files = {"left": ("l.png", left), "right": ("r.png", right)}
    return ground.post("/sessions/current/images/upload", files=files, data={"calibration": json.dumps(calibration)})


def test_an_uploaded_pair_is_counted_before_it_is_unpacked(plain, ground, budget):
    live = plain.sessions.create("uploads")
    live.stances.set(snapshot(1, 8).state)
    told = problem(_pair(ground, png_that_claims(16, 16), png_that_claims(1, 1)), 422, "invalid-images")
    assert (told["pixels"], told["limit"]) == (257, 2 * PIXELS)
    damaged = problem(_pair(ground, png_that_claims(8, 8), png_that_claims(8, 8)), 422, "invalid-images")
    assert "damaged" in damaged["detail"]
    with budget.of("192.0.2.7") as others:
        others.take(PIXELS + 1)
        busy = problem(_pair(ground, png_that_claims(8, 8), png_that_claims(8, 8)), 503, "busy")
        assert "of all are being worked on" in busy["detail"]
    good = link_images._png(snapshot(1, 8).pairs[0].left)
    assert _pair(ground, good, good).status_code == 201
    assert budget.held == 0


def test_photographs_together_are_counted_before_one_is_unpacked(plain, ground):
    plain.sessions.create("photographs")
    large = png_that_claims(20_000, 5_000)
    files = [("calibration", ("c.yaml", b"version: 0"))]
    files += [("images", (f"{name}_left.png", large)) for name in "abc"]
    told = problem(ground.post("/sessions/current/terrains/photographs", files=files), 422, "invalid-images")
    assert (told["pixels"], told["limit"]) == (300_000_000, OF_ONE)
    assert plain.sessions.pixels.held == 0


def test_the_limits_are_told(ground):
    told = ground.get("/info").json()["limits"]
    assert told["pixels_held_of_one"] == told["upload_pixels"] == OF_ONE < told["pixels_held"]
