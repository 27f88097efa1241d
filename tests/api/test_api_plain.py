"""Routes that need no rover: sessions, terrain files, state, notes, view, recordings, idempotency, events."""

import io
import json
import zipfile

import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from starlette.routing import Mount

from footfall.api.bodies.jsonable import dumps, jsonable
from footfall.io.image_files import decode_image
from footfall.resources import static_folder
from footfall_ui.app import create_app
from footfall_ui.page_files import PageFiles
from tests.support.local import Local
from tests.support.problems import problem
from tests.support.server import running_server


def test_unknown_numbers_become_null():
    cells = np.array([[1.0, np.nan], [np.inf, 2.5]], np.float32)
    assert jsonable({"a": float("nan"), "cells": cells}) == {"a": None, "cells": [[1.0, None], [None, 2.5]]}
    assert json.loads(dumps([-np.inf, np.float64(0.1), np.int32(3), True])) == [None, 0.1, 3, True]


def test_robot(client):
    robot = client.get("/robot").json()
    assert robot["name"] == "athlete"
    assert len(robot["joint_names"]) == len(robot["lower"]) == 6 * robot["legs"] == 36
    assert all(low < high for low, high in zip(robot["lower"], robot["upper"], strict=True))
    assert robot["athletes_build"]
    assert robot["leg_joints"][5] == [30, 31, 32, 33, 34, 35]
    assert robot["joint_units"] == ["rad"] * 36
    assert robot["foot_radii"] == [robot["wheel_radius"]] * 6
    assert robot["planned_by"] == {
        "step": {"kind": "plan", "folder": "plans"},
        "walk": {"kind": "walk", "folder": "walks"},
    }


def test_robot_whose_joints_slide_and_turn_without_end(tmp_path):
    def prepare(sessions) -> None:
        sessions.create("ambler", "ambler")

    with running_server(tmp_path, prepare=prepare) as running, running.client() as client:
        robot = client.get("/robot").json()
    assert robot["joint_units"] == ["rad", "m", "m"] * 6
    assert (robot["lower"][0], robot["upper"][0]) == (None, None)
    assert all(low < high for low, high in zip(robot["lower"][1:3], robot["upper"][1:3], strict=True))
    assert robot["foot_radii"] == [0.0] * 6


def test_info_says_that_there_is_no_scene(server, client):
    assert client.get("/info").json()["scene"]["available"] is False
    page = httpx.get(server.url + "/scene/", trust_env=False, verify=False)
    assert page.status_code == 503
    assert "switched off" in page.text


def test_page_is_served(server):
    assert "<html" in httpx.get(server.url + "/", trust_env=False, verify=False).text


@pytest.mark.parametrize("path", ["/", "/js/main.js", "/js/page.js", "/css/page.css", "/js/loginpage.js"])
def test_the_page_comes_compressed_and_whole(server, path):
    def get(**headers):
        return httpx.get(server.url + path, headers=headers, trust_env=False, verify=False)

    plain, packed = get(**{"Accept-Encoding": "identity"}), get(**{"Accept-Encoding": "gzip"})
    assert "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert "Accept-Encoding" in packed.headers["vary"]
    assert packed.content == plain.content
    assert packed.num_bytes_downloaded < 0.5 * plain.num_bytes_downloaded
    again = get(**{"Accept-Encoding": "gzip", "If-None-Match": packed.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_the_pages_folders_come_before_all_addresses_and_hide_none(server):
    app = create_app(server.sessions, scene=False)
    folders = {f"/{folder.name}" for folder in static_folder().iterdir() if folder.is_dir()}
    assert len(folders) > 2
    assert {route.path for route in app.routes[: len(folders)] if isinstance(route, Mount)} == folders
    page = Local(app)
    assert page.get("/js/main.js").headers["cache-control"] == "no-cache"
    for beside in ("/js", "/js/", "/js/none.js", "/js/../../pyproject.toml", "/js/%00.js", f"/js/{'long' * 99}.js"):
        assert page.get(beside).status_code == 404, beside
    assert page.request("POST", "/js/main.js").status_code == 405
    assert page.get("/api/v1/info").status_code == 200


def test_a_file_of_the_page_that_changes_is_read_anew(tmp_path):
    app, packed = FastAPI(), {"headers": {"Accept-Encoding": "gzip"}}
    app.mount("/", PageFiles(directory=tmp_path))
    (tmp_path / "long.js").write_text("let first;\n" * 100)
    (tmp_path / "short.js").write_text("let first;\n")
    page = Local(app)
    first = page.get("/long.js", **packed)
    assert (first.text, first.headers["content-encoding"]) == ("let first;\n" * 100, "gzip")
    assert first.headers["cache-control"] == "no-cache"
    assert page.request("HEAD", "/long.js", **packed).headers["etag"] == first.headers["etag"]
    (tmp_path / "long.js").write_text("let other;\n" * 100)
    assert page.get("/long.js", **packed).text == "let other;\n" * 100
    assert "content-encoding" not in page.get("/short.js", **packed).headers
    assert page.get("/longer.js", **packed).status_code == 404


def test_what_a_page_begins_with_comes_joined_and_anew_once_a_file_in_it_changes(tmp_path):
    app = FastAPI()
    app.mount("/", PageFiles(directory=tmp_path))
    (tmp_path / "page.js").write_text('import { first } from "./other.js";\nfirst();\n')
    (tmp_path / "other.js").write_text("export const first = () => 1;\n")
    (tmp_path / "page.css").write_text('@import "other.css";\n')
    (tmp_path / "other.css").write_text("b { color: red }\n")
    page = Local(app)
    script, style = page.get("/page.js"), page.get("/page.css")
    assert "const first = () => 1;" in script.text
    assert style.text.strip() == "b { color: red }"
    assert [one.headers["content-type"].partition(";")[0] for one in (script, style)] == ["text/javascript", "text/css"]
    assert {one.headers["cache-control"] for one in (script, style)} == {"no-cache"}
    known = {"headers": {"If-None-Match": script.headers["etag"]}}
    assert page.get("/page.js", **known).status_code == 304
    (tmp_path / "other.js").write_text("export const first = () => 2;\n")
    again = page.get("/page.js", **known)
    assert (again.status_code, "const first = () => 2;" in again.text) == (200, True)
    assert page.get("/other.js").text == "export const first = () => 2;\n"


def test_what_the_interface_answers_is_not_compressed(client):
    assert "content-encoding" not in client.get("/robot", headers={"Accept-Encoding": "gzip"}).headers


def test_sessions_are_listed_and_current_is_one_of_them(client):
    listed = client.get("/sessions").json()
    assert listed["current"] in [one["id"] for one in listed["sessions"]]
    summary = client.get("/sessions/current").json()
    assert summary["id"] == listed["current"]
    assert client.get(f"/sessions/{summary['id']}").json()["dem"] == summary["dem"]


def test_a_session_needs_a_sample_or_a_name(client):
    problem(client.post("/sessions", json={}), 422, "invalid-input")
    problem(client.post("/sessions", json={"sample": "rock-step", "name": "x"}), 422, "invalid-input")
    problem(client.post("/sessions", json={"sample": "none-such"}), 404, "not-found")


def test_terrain_is_described_and_downloaded(client, tmp_path):
    from footfall.io.terrain_files import read_terrain

    about = client.get("/sessions/current/terrains/current").json()
    assert about["rows"] == about["cols"] == 101
    path = tmp_path / "terrain.npz"
    path.write_bytes(client.get(f"/sessions/current/terrains/{about['digest']}.npz").content)
    assert read_terrain(path).heights.max() == pytest.approx(about["highest"])
    problem(client.get("/sessions/current/terrains/current.docx"), 422, "validation")
    picture = client.get("/sessions/current/terrains/current/relief.png")
    assert picture.headers["content-type"] == "image/png"
    assert decode_image(picture.content).shape[:2] == (about["rows"], about["cols"])


def test_pick_meets_the_ground_at_its_height(client):
    down = {"origin": [1.0, 2.0, 50.0], "direction": [0, 0, -1.0]}
    x, y, z = client.post("/sessions/current/pick", json=down).json()["point"]
    answer = client.post("/sessions/current/footfalls", json={"leg": 0, "x": x, "y": y}).json()
    assert (x, y) == pytest.approx((1.0, 2.0))
    assert z == pytest.approx(answer["z"], abs=1e-6)
    up = {"origin": [1.0, 2.0, 50.0], "direction": [0, 0, 1.0]}
    assert client.post("/sessions/current/pick", json=up).json()["point"] is None
    zero = {"origin": [0, 0, 0], "direction": [0, 0, 0]}
    problem(client.post("/sessions/current/pick", json=zero), 422, "invalid-input")


def test_view_and_notes(client):
    assert client.put("/sessions/current/view", json={"leg": 3, "scrub": 0.25}).json()["leg"] == 3
    view = client.get("/sessions/current/view").json()
    assert (view["leg"], view["scrub"]) == (3, 0.25)
    problem(client.put("/sessions/current/view", json={"layer": "beauty"}), 422, "invalid-input")
    client.post("/sessions/current/notes", json={"text": "dust on camera 3"})
    assert client.get("/sessions/current/notes").json()["notes"][-1]["text"] == "dust on camera 3"
    problem(client.post("/sessions/current/notes", json={"text": ""}), 422, "validation")


def test_stop_without_a_rover_is_latched_and_cleared(client):
    assert client.post("/stop", json={"reason": "test"}).json()["stopped"] is True
    assert client.post("/stop").json()["stopped"] is True
    assert client.get("/stop").json()["stopped"] is True
    assert client.get("/sessions/current").json()["stop"]["reason"] == "test"
    assert client.post("/stop/clear").json()["stopped"] is False


def test_upload_with_idempotency_key_happens_once(client):
    key = {"idempotency-key": "first-upload"}
    grid = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n" + "0 0 0\n0 1 0\n0 0 0\n"
    made = client.post("/sessions", json={"name": "upload"}, headers=key)
    assert made.status_code == 201
    again = client.post("/sessions", json={"name": "upload"}, headers=key)
    assert again.json() == made.json()
    assert again.headers["idempotent-replayed"] == "true"
    other = client.post("/sessions", json={"name": "another"}, headers=key)
    problem(other, 422, "idempotency-key-reused")

    session = made.headers["location"].removeprefix("/api/v1")
    files = {"file": ("grid.asc", grid, "text/plain")}
    form = {"options": '{"scale": 2.0}'}
    loaded = client.post(f"{session}/terrains", files=files, data=form)
    assert loaded.status_code == 201, loaded.text
    assert loaded.json()["highest"] == pytest.approx(2.0)
    bad = client.post(f"{session}/terrains", files=files, data={"options": '{"scale": true}'})
    problem(bad, 422, "validation")
    problem(
        client.post(f"{session}/terrains", files={"file": ("g.asc", "nothing", "text/plain")}), 422, "invalid-terrain"
    )
    problem(client.post(f"{session}/terrains", files={"flie": ("g.asc", grid, "text/plain")}), 422, "invalid-input")
    problem(client.post(f"{session}/terrains", json={"source": "images"}), 409, "conflict")
    problem(client.post(f"{session}/images", json={}), 409, "conflict")
    problem(client.post(f"{session}/state", json={}), 409, "conflict")


def test_recording_goes_out_and_comes_in(client):
    listed = client.get("/recordings").json()["recordings"]
    url = listed[0]["url"].removeprefix("/api/v1")
    content = client.get(url).content
    assert "events.jsonl" in zipfile.ZipFile(io.BytesIO(content)).namelist()
    taken = client.post("/recordings", content=content, headers={"content-type": "application/zip"})
    assert taken.status_code == 201
    assert taken.json()["id"] != listed[0]["id"]
    assert taken.json()["dem"] == client.get(f"/sessions/{listed[0]['id']}").json()["dem"]
    problem(client.post("/recordings", files={"file": ("a.zip", b"no zip")}), 422, "invalid-bundle")


def test_state_given_by_a_script(client):
    report = {
        "time": 1.0,
        "posture": [0.0] * 36,
        "T_site_base": np.eye(4).tolist(),
        "wheel_forces": [[0.0, 0.0, 1000.0]] * 6,
        "joint_torques": [0.0] * 36,
    }
    digest = client.post("/sessions/current/telemetry", json=report).json()["digest"]
    assert client.get("/sessions/current/state").json()["digest"] == digest
    problem(client.post("/sessions/current/telemetry", json=report | {"posture": [0.0] * 12}), 422, "invalid-telemetry")
    skewed = report | {"T_site_base": (2 * np.eye(4)).tolist()}
    problem(client.post("/sessions/current/telemetry", json=skewed), 422, "invalid-input")


def read_events(lines, count: int) -> list[dict]:
    """The first messages of a stream as {"event", "id", "data"}."""
    found: list[dict] = []
    message: dict = {}
    for line in lines:
        if line.startswith(":"):
            continue
        if line:
            name, _, rest = line.partition(": ")
            message[name] = rest
        elif message:
            found.append(message)
            message = {}
            if len(found) == count:
                break
    return found


def test_events_resume_after_the_last_id(client):
    session = client.post("/sessions", json={"name": "events"}).headers["location"].removeprefix("/api/v1")
    for text in ("one", "two", "three"):
        client.post(f"{session}/notes", json={"text": text})
    log = client.get(f"{session}/log").json()["events"]
    last = log[-3]["seq"]
    assert client.get(f"{session}/log", params={"since": last}).json()["events"] == log[-2:]
    with client.stream("GET", f"{session}/events", headers={"last-event-id": str(last)}) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = stream.iter_lines()
        first = [one for one in read_events(lines, 3) if one["event"] == "event"]
        assert [int(one["id"]) for one in first] == [last + 1, last + 2]
        assert [json.loads(one["data"])["payload"]["text"] for one in first] == ["two", "three"]
        client.post(f"{session}/notes", json={"text": "four"})
        (new,) = read_events(lines, 1)
        assert (new["event"], int(new["id"])) == ("event", last + 3)
        assert json.loads(new["data"])["payload"]["text"] == "four"
    for number in ("abc", "-", "1.0", "9" * 5000):
        problem(client.get(f"{session}/events", headers={"last-event-id": number}), 422, "invalid-input")
