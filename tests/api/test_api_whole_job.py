"""The whole job over REST with the simulated rover: state, maps, footfall, plan, sequence, edit, export, send, stop."""

import csv
import io
import json

import httpx
import numpy as np
import pytest

from footfall.maps.layers import REACHABLE_STABLE
from tests.support.jobs import carried_out
from tests.support.problems import problem
from tests.support.server import Running
from tests.support.waiting import until

LEG = 2
SESSION = "/sessions/current"


@pytest.fixture(scope="module")
def rest(rover_server: Running):
    with rover_server.client() as client:
        until(lambda: client.get(SESSION).json()["link"]["connected"], "the rover's connection")
        until(lambda: client.get(f"{SESSION}/telemetry").status_code == 200, "telemetry")
        yield client


def finished(client: httpx.Client, accepted: httpx.Response) -> dict:
    assert accepted.status_code == 202, accepted.text
    location = accepted.headers["location"].removeprefix("/api/v1")

    def ended() -> dict | None:
        job = client.get(location).json()
        return job if job["state"] not in ("queued", "running") else None

    job = until(ended, f"the end of {location}")
    assert job["state"] == "done", job
    return job


@pytest.fixture(scope="module")
def state(rest):
    return rest.post(f"{SESSION}/state", json={}).json()["digest"]


@pytest.fixture(scope="module")
def maps(rest, state):
    job = finished(rest, rest.post(f"{SESSION}/maps", json={"leg": LEG}))
    assert rest.get(job["result_url"].removeprefix("/api/v1")).json()["digest"] == job["result"]
    return job["result"]


@pytest.fixture(scope="module")
def footfall(rest, maps):
    """A stable cell about 0.4 m from where the wheel stands."""
    footing = np.load(io.BytesIO(rest.get(f"{SESSION}/maps/{maps}/footing.npy").content))
    grid = rest.get(f"{SESSION}/maps/{maps}").json()["geometry"]
    robot = rest.get("/robot").json()
    at = wheel_position(rest, robot)
    rows, cols = np.nonzero(footing == REACHABLE_STABLE)
    x, y = grid["x0"] + grid["resolution"] * cols, grid["y0"] + grid["resolution"] * rows
    best = int(np.argmin(np.abs(np.hypot(x - at[0], y - at[1]) - 0.4)))
    target = [float(x[best]), float(y[best])]
    answer = rest.post(f"{SESSION}/footfalls", json={"leg": LEG, "x": target[0], "y": target[1]}).json()
    assert answer["known"]
    assert answer["acceptable"], answer["reasons"]
    return target


def wheel_position(rest: httpx.Client, robot: dict) -> np.ndarray:
    from footfall.core.frames import apply
    from footfall.io.robot_files import load_robot
    from footfall.robot.kinematics import wheel_centers

    frame = rest.get(f"{SESSION}/telemetry").json()
    body = load_robot(robot["name"])
    assert body.digest == robot["digest"]
    return apply(np.array(frame["T_site_base"]), wheel_centers(body, np.array(frame["posture"])))[LEG, :2]


@pytest.fixture(scope="module")
def plan(rest, footfall):
    job = finished(rest, rest.post(f"{SESSION}/plans", json={"leg": LEG, "target": footfall, "settings": {"seed": 1}}))
    answer = rest.get(f"{SESSION}/plans/{job['result']}").json()
    assert answer["status"] == "found", answer["reason"]
    assert all(check["holds"] for check in answer["checks"])
    assert len(answer["plan"]["waypoints"][0]) == 36
    return job["result"]


def test_layers_are_served_as_pictures(rest, maps):
    about = rest.get(f"{SESSION}/maps/{maps}").json()
    for layer, one in about["layers"].items():
        picture = rest.get(f"{SESSION}/maps/{maps}/{layer}.png")
        assert picture.content.startswith(b"\x89PNG"), layer
        assert one["legend"]
    problem(rest.get(f"{SESSION}/maps/{maps}/beauty.png"), 404, "not-found")


def test_a_plan_that_is_refused_is_a_result(rest, state):
    body = {"leg": LEG, "target": [90.0, 90.0]}
    job = finished(rest, rest.post(f"{SESSION}/plans", json=body))
    answer = rest.get(f"{SESSION}/plans/{job['result']}").json()
    assert answer["status"] == "off_map"
    assert answer["reason"]
    assert answer["plan"] is None


def test_job_progress_as_events(rest, state):
    accepted = rest.post(f"{SESSION}/maps", json={"leg": 0})
    seen = []
    with rest.stream("GET", accepted.headers["location"].removeprefix("/api/v1") + "/events") as stream:
        seen = [json.loads(line[6:]) for line in stream.iter_lines() if line.startswith("data: ")]
    assert seen[-1]["state"] == "done"
    fractions = [one["fraction"] for one in seen]
    assert fractions == sorted(fractions)


def test_a_cancelled_job_says_so(rest, state):
    accepted = rest.post(f"{SESSION}/plans", json={"leg": 1, "target": [90.0, 90.0]})
    location = accepted.headers["location"].removeprefix("/api/v1")
    assert rest.delete(location).status_code == 202
    job = until(lambda: (one := rest.get(location).json())["state"] in ("cancelled", "done") and one, "its end")
    assert job["state"] == "cancelled" or job["result"] is not None


def test_sequence_edit_export_send_and_arrival(rest, plan):
    made = rest.post(f"{SESSION}/sequences", json={"plan": plan})
    assert made.status_code == 201, made.text
    address = made.headers["location"].removeprefix("/api/v1")
    first = made.json()
    assert first["valid"], first["rules"]

    # edits: only with the version that was read, and undone
    edit = {"edit": {"kind": "insert", "row": 1, "command": {"name": "WAIT", "duration": 0.2}}}
    problem(rest.patch(address, json=edit), 428, "precondition-required")
    etag = rest.get(address).headers["etag"]
    assert etag == f'"{first["digest"]}"'
    edited = rest.patch(address, json=edit, headers={"if-match": etag})
    assert edited.status_code == 200, edited.text
    assert len(edited.json()["commands"]) == len(first["commands"]) + 1
    problem(rest.patch(address, json=edit, headers={"if-match": etag}), 412, "precondition-failed")

    broken = {"edit": {"kind": "joint", "row": 0, "joint": 1, "number": 9.0}}
    bad = rest.patch(address, json=broken, headers={"if-match": edited.headers["etag"]})
    assert bad.json()["valid"] is False
    problem(rest.get(f"{address}/export"), 422, "invalid-sequence")
    assert problem(rest.post(f"{address}/arm"), 409, "command-refused")["check"]
    undone = rest.post(f"{address}/undo", headers={"if-match": bad.headers["etag"]})
    assert undone.json()["digest"] == edited.json()["digest"]

    # exports: the numbers bit for bit
    commands = undone.json()["commands"]
    table = list(csv.DictReader(io.StringIO(rest.get(f"{address}/export", params={"format": "csv"}).text)))
    joints = [[float(v) for k, v in row.items() if k.endswith("_rad")] for row in table if row["leg"]]
    assert joints == [one["joints"] for one in commands if one["joints"]]
    seqjson = rest.get(f"{address}/export", params={"format": "seqjson"}).json()
    assert len(seqjson["steps"]) == len(commands)
    problem(rest.get(f"{address}/export", params={"format": "docx"}), 422, "validation")

    # the command gate
    problem(rest.post(f"{address}/send", json={"arming": "guessed"}), 409, "command-refused")
    token = rest.post(f"{address}/arm").json()["token"]
    key = {"idempotency-key": "send-once"}
    sent = rest.post(f"{address}/send", json={"arming": token}, headers=key)
    assert sent.status_code == 202, sent.text
    assert rest.post(f"{address}/send", json={"arming": token}, headers=key).json() == sent.json()
    assert len(sent.json()["commands"]) == len(commands)

    carried_out(rest, len(commands))
    goal = undone.json()["predicted"][-1]
    until(lambda: rest.get(f"{SESSION}/telemetry").json()["posture"] == goal, "the goal posture in the telemetry")
    assert rest.get(SESSION).json()["plan_matches_rover"]["ok"] is False


def test_stop_reaches_the_rover(rest, state):
    answer = rest.post("/stop", json={"reason": "test"})
    assert answer.json()["stopped"] is True
    until(lambda: rest.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
    until(lambda: rest.get(f"{SESSION}/telemetry").json()["mode"] == "stopped", "standing still")
    assert rest.post("/stop/clear").json()["stopped"] is False
    until(lambda: rest.get(f"{SESSION}/telemetry").json()["mode"] == "idle", "the end of the stop")


def test_a_second_rover_is_refused(rover_server, rest):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    url = "ws" + rover_server.api.removeprefix("http") + "/rover"
    for protocols in ([Subprotocol("footfall-rover-2")], None):
        with pytest.raises(InvalidStatus):
            connect(url, subprotocols=protocols, proxy=None)
    assert rest.get("/info").json()["simulated_rover"]["running"] is True


def test_images_of_the_rover_become_terrain(rest):
    asked = rest.get("/robot").json()["cameras"][:2]
    assert rest.post(f"{SESSION}/images", json={"pairs": asked}).status_code == 202
    listed = until(lambda: rest.get(f"{SESSION}/images").json()["pairs"], "images")
    assert [pair["name"] for pair in listed] == asked
    for side in ("left", "right"):
        picture = rest.get(listed[0][side].removeprefix("/api/v1"))
        assert picture.content.startswith(b"\x89PNG")
    settings = {"resolution": 0.05, "matcher": "3way"}
    job = finished(rest, rest.post(f"{SESSION}/terrains", json={"source": "images", "settings": settings}))
    about = rest.get(job["result_url"].removeprefix("/api/v1")).json()
    assert about["resolution"] == 0.05
    assert 0 < about["known"] < 1
    problem(rest.post(f"{SESSION}/images", json={"pairs": ["nose"]}), 404, "not-found")
