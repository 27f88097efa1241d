"""Looking back over REST: compared, checked by replay, taken away as a page; and images of an older snapshot."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from footfall.io.artifacts import decode
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.images import Snapshot
from tests.support.problems import problem
from tests.support.server import Running, running_server
from tests.support.waiting import until

SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    def two(sessions) -> None:
        sessions.open_sample("refused-step")
        sessions.open_sample("rock-step")

    with running_server(tmp_path_factory.mktemp("review"), prepare=two) as running:
        yield running


@pytest.fixture(scope="module")
def client(served: Running) -> Iterator[httpx.Client]:
    with served.client() as client:
        yield client


def named(client: httpx.Client) -> dict[str, str]:
    """name → id."""
    return {one["name"]: one["id"] for one in client.get("/sessions").json()["sessions"]}


def test_a_session_differs_from_another_and_not_from_itself(client: httpx.Client) -> None:
    rock, refused = (named(client)[name] for name in ("Stepping over a rock", "A step refused"))
    same = client.get(f"/sessions/{rock}/comparison/{rock}").json()
    assert all(row["same"] for row in same["rows"])
    found = client.get(f"/sessions/{refused}/comparison/{rock}").json()
    assert found["names"] == ["A step refused", "Stepping over a rock"]
    rows = {row["what"]: row for row in found["rows"]}
    assert rows["robot"]["same"]
    plans = [client.get(f"/sessions/{one}/plans/current").json() for one in (refused, rock)]
    assert plans[0]["reason"] in rows["plan"]["told"][0]
    assert f"found by {plans[1]['plan']['planner']}" in rows["plan"]["told"][1]
    assert rows["sequence"]["told"][0] == "none"
    assert rows["sequence"]["text"] == "only one of the two has it"
    problem(client.get(f"/sessions/{rock}/comparison/nobody"), 404, "not-found")


def test_a_check_runs_as_a_job_and_tells_what_it_found(client: httpx.Client) -> None:
    client.post("/sessions", json={"name": "nothing yet"}).raise_for_status()
    session = named(client)["nothing yet"]
    problem(client.get(f"/recordings/{session}/check"), 404, "not-found")
    job = client.post(f"/recordings/{session}/check").json()
    until(lambda: client.get(f"/jobs/{job['id']}").json()["state"] == "done", "the end of the check")
    report = client.get(f"/recordings/{session}/check").json()
    assert (report["ok"], report["products"], report["problems"]) == (True, [], [])
    assert report["events"] == client.get(f"/sessions/{session}").json()["events"]
    problem(client.post("/recordings/nobody/check"), 404, "not-found")


def test_the_page_of_a_session_holds_what_the_session_holds(client: httpx.Client, athlete) -> None:
    rock = named(client)["Stepping over a rock"]
    answer = client.get(f"/recordings/{rock}.html")
    assert answer.headers["content-type"].startswith("text/html")
    assert f'filename="{rock}.html"' in answer.headers["content-disposition"]
    (told,) = re.findall(r'<script type="application/json" id="story">(.*?)</script>', answer.text, re.S)
    story = json.loads(told)
    log = client.get(f"/sessions/{rock}/log").json()["events"]
    assert [event["time"] for event in story["events"]] == [event["time"] for event in log]
    result = client.get(f"/sessions/{rock}/plans/current").json()
    (plan,) = story["plans"]
    assert [check["margin"] for check in plan["checks"]] == [check["margin"] for check in result["checks"]]
    sequence = client.get("/sequences/" + client.get(f"/sessions/{rock}").json()["sequence"]).json()
    assert [row["duration"] for row in story["sequence"]["rows"]] == [c["duration"] for c in sequence["commands"]]
    # the wheel's way by another computation: Pinocchio's kinematics at the waypoints
    path = client.get(f"/sessions/{rock}/plans/current/wheel-path").json()["points"]
    centers = np.array(plan["swing"]["centers"])
    for point, posture in zip(path, result["plan"]["waypoints"], strict=True):
        T = np.array(result["plan"]["T_site_base"])
        center = T[:3, :3] @ wheel_centers(athlete, np.array(posture))[plan["leg"]] + T[:3, 3]
        np.testing.assert_allclose(point, center, atol=1e-9)
        assert np.linalg.norm(centers - center, axis=1).min() < 1e-9
    assert story["maps"][plan["map"]]["png"].startswith("iVBOR")


def test_images_of_a_snapshot_are_had_by_its_name(client: httpx.Client) -> None:
    rock = named(client)["Stepping over a rock"]
    snapshot = client.get(f"/sessions/{rock}/images").json()
    (first, *_) = snapshot["pairs"]
    path = first["left"].removeprefix("/api/v1")
    newest = client.get(path)
    assert client.get(path, params={"of": snapshot["snapshot"]}).content == newest.content
    stored = decode((SAMPLES / "rock-step" / "artifacts" / f"{snapshot['snapshot']}.npz").read_bytes(), name="snapshot")
    assert isinstance(stored, Snapshot)
    assert stored.pairs[0].left.shape == (first["height"], first["width"])
    problem(client.get(path, params={"of": "0" * 32}), 404, "not-found")
