"""Images over REST: which ground a pixel shows, lines over an image, how a build sees it, which pairs it takes."""

import io
import itertools
from dataclasses import replace
from typing import cast

import cv2
import httpx
import numpy as np
import pytest
from PIL import Image

from footfall.core import frames
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from tests.support.jobs import finished, result
from tests.support.server import Running, running_server
from tests.support.waiting import until

IMAGES = "/sessions/current/images"


def _prepare(sessions: Sessions) -> None:
    """The sample that has images, with three of its nine pairs: so a test need not wait for all."""
    live = sessions.open_sample("rock-step")
    taken = cast(Snapshot, live.get(str(live.state.snapshot)))
    by_name = {pair.name: pair for pair in taken.pairs}
    dark = replace(by_name["nav0"], left=np.zeros_like(by_name["nav0"].left))
    live.rover.take_images(Snapshot(taken.state, (by_name["haz0"], by_name["haz2"], dark), {"nav5": "pair nav5: late"}))


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running_server(tmp_path_factory.mktemp("images"), prepare=_prepare) as running:
        yield running


@pytest.fixture(scope="module")
def client(server: Running):
    with server.client() as made:
        yield made


@pytest.fixture
def live(server: Running) -> LiveSession:
    assert server.sessions.current is not None
    return server.sessions.current


@pytest.fixture
def haz2(live) -> ImagePair:
    return cast(Snapshot, live.get(str(live.state.snapshot))).pairs[1]


@pytest.fixture
def dem(live) -> Dem:
    return cast(Dem, live.get(str(live.state.dem)))


def camera_of(pair: ImagePair, side: str) -> Camera:
    return pair.camera_left if side == "left" else pair.camera_right


def pixels(pair: ImagePair, side: str, points: np.ndarray, correction: np.ndarray | None = None) -> np.ndarray:
    """Where OpenCV has points of the site, (n, 2): the second, independent method."""
    camera = camera_of(pair, side)
    T = frames.inverse((np.eye(4) if correction is None else correction) @ pair.T_site_base @ camera.T_base_camera)
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    return cv2.projectPoints(points, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], K, np.zeros(4))[0][:, 0]


def at(client: httpx.Client, pair: str, side: str, u: float, v: float) -> dict:
    answer = client.get(f"{IMAGES}/{pair}/{side}/at", params={"u": u, "v": v})
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_list_says_when_they_came_and_whether_the_rover_has_moved_since(client, live):
    listed = client.get(IMAGES).json()
    assert [pair["name"] for pair in listed["pairs"]] == ["haz0", "haz2", "nav0"]
    assert listed["left_out"] == {"nav5": "pair nav5: late"}
    taken = next(event for event in reversed(live.events()) if event.type == "snapshot_taken")
    assert listed["taken"] == taken.time
    unknown = {"moved": None, "reason": "the rover has sent no telemetry yet"}
    assert listed["since"] == unknown
    assert client.get("/sessions/current").json()["look"] == {"taken": taken.time, **unknown}
    state = cast(Snapshot, live.get(listed["snapshot"])).state
    numbers = itertools.count(1)

    def since(**changes) -> dict:
        """What is said right after telemetry came: on a busy machine it may be old again by then."""

        def said() -> dict | None:
            live.rover.take_telemetry(TelemetryFrame(next(numbers), replace(state, **changes), state.posture))
            found, look = client.get(IMAGES).json()["since"], client.get("/sessions/current").json()["look"]
            if found["moved"] is None or look["moved"] is None:
                return None
            assert look == {"taken": taken.time, **found}
            return found

        return until(said, "an answer to fresh telemetry")

    assert since() == since(posture=state.posture + 0.002) == {"moved": False, "reason": ""}
    turned = since(posture=state.posture + np.eye(36)[14] * 0.05)
    assert (turned["moved"], "has turned by +2.9° since" in turned["reason"]) == (True, True)
    shifted = since(T_site_base=frames.transform(None, (0.0, 0.4, 0.0)) @ state.T_site_base)
    assert (shifted["moved"], "has moved by 0.40 m since" in shifted["reason"]) == (True, True)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_pixel_shows_the_ground_that_opencv_projects_there(client, haz2, dem, side):
    found = 0
    for u, v in np.random.default_rng(2).uniform((-0.5, 200), (639.5, 479.5), (40, 2)):
        point = at(client, "haz2", side, u, v)["point"]
        if point is None:
            continue
        found += 1
        assert pixels(haz2, side, np.array([point]))[0] == pytest.approx([u, v], abs=1e-3)
        assert point[2] == pytest.approx(float(height_at(dem, point[0], point[1])), abs=1e-6)
    assert found > 20


def test_images_are_seen_from_where_the_rover_is_on_the_map(client, live, haz2, dem):
    """A snapshot that had to be moved onto the map: clicks and lines follow."""
    moved = frames.transform(frames.rotation("z", 0.05), (0.12, -0.07, 0.0))
    live.terrains.load(replace(dem, correction=moved), "made for the tests")
    try:
        point = np.array(at(client, "haz2", "left", 230, 300)["point"])
        assert pixels(haz2, "left", point[None], moved)[0] == pytest.approx([230, 300], abs=1e-3)
        drawn = client.get(f"{IMAGES}/haz2/left/overlay").json()
        chosen = live.maps.footfall_answer(live.state.footfall)
        expected = pixels(haz2, "left", np.array([[chosen["x"], chosen["y"], chosen["z"]]]), moved)[0]
        assert drawn["footfall"]["at"] == pytest.approx(expected, abs=0.06)
    finally:
        live.terrains.undo()


def test_what_is_no_ground_says_what_it_is(client):
    assert "rover itself" in at(client, "haz2", "left", 300, 5)["reason"]
    sky = at(client, "nav0", "left", 630, 2)
    assert (sky["point"], "no ground there" in sky["reason"]) == (None, True)
    for bad in ({"u": 640, "v": 3}, {"u": 3, "v": 480}, {"u": -1, "v": 3}, {"u": "nan", "v": 3}, {"u": 3}):
        assert client.get(f"{IMAGES}/haz2/left/at", params=bad).status_code == 422, bad
    assert client.get(f"{IMAGES}/other/left/at", params={"u": 1, "v": 1}).status_code == 404
    assert client.get(f"{IMAGES}/haz2/middle/at", params={"u": 1, "v": 1}).status_code == 422
    assert client.get(f"{IMAGES}/haz2/left/at", params={"u": 1, "v": 1, "of": "0" * 32}).status_code == 404


def test_lines_over_an_image_lie_where_the_ground_has_them(client, haz2, live):
    drawn = client.get(f"{IMAGES}/haz2/left/overlay").json()
    assert (drawn["dem"], drawn["plan"], drawn["spacing"]) == (live.state.dem, live.state.plan, 0.5)
    lines = [np.array(line) for line in (*drawn["grid"], *(one["line"] for one in drawn["path"]))]
    assert all((line >= -0.6).all() and (line <= (639.6, 479.6)).all() for line in lines)
    on_line = []
    for line in drawn["grid"]:
        point = at(client, "haz2", "left", *line[len(line) // 2])["point"]
        on_line += (
            [] if point is None else [np.abs(np.array(point[:2]) - 0.5 * np.round(np.array(point[:2]) / 0.5)).min()]
        )
    assert len(on_line) > 20
    assert np.median(on_line) < 0.01
    assert np.quantile(on_line, 0.9) < 0.05  # rays that graze a rim meet other ground
    finer = client.get(f"{IMAGES}/haz2/left/overlay", params={"spacing": 0.25}).json()
    assert len(finer["grid"]) > 1.3 * len(drawn["grid"])


def test_plan_and_footfall_are_where_the_leg_goes(client, haz2, live):
    drawn = client.get(f"{IMAGES}/haz2/left/overlay").json()
    assert {one["phase"] for one in drawn["path"]} == {"lift", "swing", "lower"}
    plan = client.get("/sessions/current/plans/current").json()["plan"]
    chosen = live.maps.footfall_answer(live.state.footfall)
    footfall = drawn["footfall"]
    assert (footfall["leg"], footfall["seen"]) == (2, "in sight")
    expected = pixels(haz2, "left", np.array([[chosen["x"], chosen["y"], chosen["z"]]]))[0]
    assert footfall["at"] == pytest.approx(expected, abs=0.06)
    # the wheel ends a radius above the contact
    above = np.array(plan["contact"]) + live.robot.wheel_radius * np.array(plan["normal"])
    last = pixels(haz2, "left", above[None])[0]
    ends = np.array([one["line"][-1] for one in drawn["path"] if one["phase"] == "lower"])
    assert np.linalg.norm(ends - last, axis=1).min() < 8
    ring = np.concatenate([np.array(line) for line in footfall["ring"]])
    assert np.linalg.norm(ring - expected, axis=1).max() < 40
    assert footfall["seen_by"] == ["haz0", "haz2"]
    elsewhere = client.get(f"{IMAGES}/nav0/left/overlay").json()["footfall"]
    assert (elsewhere["seen"], elsewhere["at"], elsewhere["seen_by"]) == ("outside", None, ["haz0", "haz2"])


def test_a_footfall_chosen_in_an_image_is_the_one_that_the_image_shows(client):
    before = client.get("/sessions/current").json()["footfall"]
    point = at(client, "haz2", "left", 230, 300)["point"]
    answer = client.post("/sessions/current/footfalls", json={"leg": 2, "x": point[0], "y": point[1]}).json()
    assert answer["known"]
    assert answer["z"] == pytest.approx(point[2], abs=1e-6)
    drawn = client.get(f"{IMAGES}/haz2/left/overlay").json()["footfall"]
    assert drawn["at"] == pytest.approx([230, 300], abs=0.06)
    client.post("/sessions/current/footfalls", json=before)


def picture(client: httpx.Client, name: str) -> np.ndarray:
    answer = client.get(f"{IMAGES}/{name}.png")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "image/png"
    return np.asarray(Image.open(io.BytesIO(answer.content)))


def test_views_have_pictures_and_legends(client):
    about = client.get(f"{IMAGES}/haz2/views").json()
    legend, mask = about["disparity"], about["mask"]
    assert legend["far"]["depth"] > legend["near"]["depth"] > 0.5
    assert legend["far"]["disparity"] < legend["near"]["disparity"]
    colours = picture(client, "haz2/disparity")
    assert colours.shape == (480, 640, 3)
    assert (colours == legend["unknown"]).all(axis=-1).mean() == pytest.approx(1 - legend["known"], abs=1e-6)
    tinted = picture(client, "haz2/mask").astype(float)
    grey = picture(client, "haz2/left")[..., None].astype(float)
    robot = np.abs(tinted - (0.45 * grey + 0.55 * np.array(mask["robot"]))).max(axis=-1) <= 1
    assert robot.mean() == pytest.approx(mask["robot_share"], abs=1e-3)
    assert 0 < mask["rim_share"] < 0.2
    assert about["used"] < legend["known"]


def test_a_pair_that_cannot_be_matched_says_why(client):
    about = client.get(f"{IMAGES}/nav0/views").json()
    assert about["disparity"] is None
    assert "black" in about["reason"]
    refused = client.get(f"{IMAGES}/nav0/disparity.png")
    assert refused.status_code == 404
    assert "black" in refused.json()["detail"]
    assert picture(client, "nav0/mask").shape == (480, 640, 3)


def test_a_terrain_is_built_from_the_chosen_pairs(client):
    def order(*pairs: str) -> httpx.Response:
        return client.post("/sessions/current/terrains", json={"source": "images", "settings": {"pairs": pairs}})

    refused = order("haz2", "nav7")
    assert refused.status_code == 422
    assert "no pair nav7" in refused.json()["detail"]
    before = client.get("/sessions/current").json()["dem"]
    terrain = result(client, finished(client, order("haz2")))
    assert terrain["sources"] == ["haz2"]
    assert set(terrain["left_out"]) == {"haz0", "nav0", "nav5"}
    client.post("/sessions/current/terrains/undo")
    assert client.get("/sessions/current").json()["dem"] == before


def test_without_terrain_or_images_it_says_so(client):
    client.post("/sessions", json={"name": "empty"})
    assert client.get(IMAGES).json() == {"snapshot": None, "pairs": [], "taken": None, "since": None, "left_out": {}}
    assert client.get(f"{IMAGES}/haz2/views").status_code == 404
    assert client.get(f"{IMAGES}/haz2/left/overlay").status_code == 404
