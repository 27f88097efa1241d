"""What-if shifts, shifts for a footfall and moves of the chassis over REST."""

import json

import numpy as np
import pytest

from footfall.robot.ik import contact_point
from tests.support.jobs import finished, result
from tests.support.problems import problem

LEG = 2
SESSION = "/sessions/current"
WHAT_IF = f"{SESSION}/what-if"


@pytest.fixture
def stood(standing):
    """Digest of how the rover stands; a what-if that a test leaves is ended."""
    summary = standing.get(SESSION).json()
    assert summary["what_if"] is None
    yield summary["state"]
    if standing.get(SESSION).json()["what_if"] is not None:
        standing.delete(WHAT_IF)


def test_what_if_and_back(standing, stood):
    answer = standing.put(WHAT_IF, json={"dz": -0.3})
    assert answer.status_code == 200, answer.text
    about = answer.json()
    assert about["shift"]["dz"] == -0.3
    assert about["predicted"] == ["wheel_forces", "joint_torques"]
    state = standing.get(f"{SESSION}/state").json()
    assert state["digest"] == about["state"] == standing.get(SESSION).json()["state"]
    assert state["posture"] == about["posture"]
    weight = np.array(about["wheel_forces"]).sum(axis=0)
    assert weight[2] > 1000
    assert np.abs(weight[:2]).max() < 1e-6 * weight[2]
    now = standing.get(SESSION).json()
    assert now["what_if"]["dz"] == -0.3
    assert now["up_to_date"]["what_if"]["fits"]
    assert now["up_to_date"]["measured"] is False
    # again: from how the rover stands, not from the shifted one
    second = standing.put(WHAT_IF, json={"dx": 0.05, "dz": -0.1}).json()
    assert second["T_site_base"][2][3] == pytest.approx(about["T_site_base"][2][3] + 0.2)
    assert standing.delete(WHAT_IF).json() == {"state": stood}
    assert standing.get(SESSION).json()["what_if"] is None
    problem(standing.delete(WHAT_IF), 409, "conflict")


def test_a_shift_that_the_legs_can_not_follow_names_the_leg(standing, stood):
    document = problem(standing.put(WHAT_IF, json={"dx": 0.6}), 422, "invalid-input")
    assert f"leg {document['leg']} is {document['excess']:.3f} m too short" in document["detail"]
    assert document["joint"] == ""
    assert standing.get(SESSION).json()["what_if"] is None
    tips = standing.put(WHAT_IF, json={"dx": 9.0})
    assert "at most 5 m" in problem(tips, 422, "invalid-input")["detail"]


@pytest.mark.parametrize(
    "body", [{"dw": 1.0}, {"dx": True}, {"dx": "0.1"}, {"dx": None}, {"dz": float("nan")}, {"dyaw": float("inf")}, []]
)
def test_what_is_no_shift_is_refused(standing, stood, body):
    headers = {"content-type": "application/json"}
    problem(standing.put(WHAT_IF, content=json.dumps(body), headers=headers), 422, "validation")
    problem(
        standing.post(f"{SESSION}/body-moves", content=json.dumps({"shift": body}), headers=headers), 422, "validation"
    )


def test_a_shift_for_a_footfall(standing, stood, standing_server, athlete):
    state = standing_server.sessions.get("current").get(stood)
    x, y, _ = contact_point(athlete, state.posture, LEG, state.T_site_base)
    order = {"leg": LEG, "target": [float(x) - 0.5, float(y) + 0.4], "settings": {"time_limit": 60.0}}
    job = finished(standing, standing.post(f"{SESSION}/shifts", json=order))
    assert job["kind"] == "shift"
    assert "/shifts/" in job["result_url"]
    found = result(standing, job)
    assert found["status"] == "found"
    assert found["reason"].startswith("▲ No shift was found that keeps a reserve: with this one leg")
    assert found["footfall"]["x"] == order["target"][0]
    assert found["provenance"]["settings"]["time_limit"] == 60.0
    assert found["cost"] > 0
    assert standing.get(f"{SESSION}/shifts/current").json() == found
    assert standing.get(SESSION).json()["shift"] == found["digest"]
    shift = {name: found["shift"][name] for name in ("dx", "dy", "dz", "droll", "dpitch", "dyaw")}
    assert standing.put(WHAT_IF, json=shift).status_code == 200
    unreserved = {"reach_reserve": 0.0, "joint_reserve": 0.0}
    no = result(standing, finished(standing, standing.post(f"{SESSION}/body-moves", json={"shift": shift})))
    assert (no["status"], "reach reserve" in no["reason"]) == ("goal_invalid", True)
    moved = result(
        standing,
        finished(standing, standing.post(f"{SESSION}/body-moves", json={"shift": shift, "settings": unreserved})),
    )
    assert moved["status"] == "found"
    assert moved["plan"]["waypoints"] == found["plan"]["waypoints"]


def test_shifts_that_can_not_be_looked_for(standing, stood):
    path = f"{SESSION}/shifts"
    standing.post(f"{SESSION}/footfalls", json={"leg": 0, "x": 1.0, "y": 1.0})
    problem(standing.post(path, json={"leg": LEG}), 409, "conflict")
    problem(standing.post(path, json={"leg": 9, "target": [1.0, 1.0]}), 422, "invalid-input")
    for wrong in ({"target": [1.0]}, {"target": [1.0, True]}, {"settings": {"lift": True}}, {"settings": {"hurry": 1}}):
        problem(standing.post(path, json={"leg": LEG, **wrong}), 422, "validation")
    problem(standing.post(path, json={"leg": LEG, "settings": {"lever": 0.0}}), 422, "invalid-input")
    off = result(standing, finished(standing, standing.post(path, json={"leg": LEG, "target": [90.0, 90.0]})))
    assert (off["status"], off["shift"], off["cost"]) == ("off_map", None, None)


def test_body_moves(standing, stood):
    path = f"{SESSION}/body-moves"
    order = {"shift": {"dz": -0.2}, "settings": {"least_margin": 0.1}}
    job = finished(standing, standing.post(path, json=order))
    assert job["kind"] == "body_move"
    assert job["result_url"] == f"/api/v1/sessions/{job['session']}/body-moves/{job['result']}"
    made = result(standing, job)
    assert made["status"] == "found"
    assert all(check["holds"] for check in made["checks"])
    assert made["provenance"]["parents"]["state"] == stood
    assert made["plan"]["Ts_site_base"][-1][2][3] == pytest.approx(made["plan"]["Ts_site_base"][0][2][3] - 0.2)
    assert standing.get(f"{path}/current").json() == made
    refused = result(standing, finished(standing, standing.post(path, json={"shift": {"dx": 0.6}})))
    assert (refused["status"], refused["plan"]) == ("goal_invalid", None)
    assert "too short" in refused["reason"]
    assert standing.get(f"{path}/current").json()["digest"] == refused["digest"]
    problem(standing.post(path, json={}), 422, "validation")
    problem(standing.post(path, json={"shift": {}, "settings": {"friction": True}}), 422, "validation")
    problem(standing.get(f"{path}/{'0' * 32}"), 404, "not-found")
    problem(standing.get(f"{path}/{stood}"), 404, "not-found")


def test_a_move_is_commanded_with_the_pose_held_unless_an_order_says_otherwise(standing, stood):
    asked = standing.post(f"{SESSION}/body-moves", json={"shift": {"dz": -0.1}})
    move = result(standing, finished(standing, asked))
    job = finished(standing, standing.post(f"{SESSION}/held-moves", json={}))
    assert job["result_url"] == f"/api/v1/sessions/{job['session']}/held-moves/{job['result']}"
    held = result(standing, job)
    assert (held["status"], held["execution"]["plan"]["shift"]) == ("found", move["plan"]["shift"])
    assert all(check["holds"] for check in held["checks"])
    assert standing.get(f"{SESSION}/held-moves/current").json() == held
    sequence = standing.post(f"{SESSION}/sequences", json={"plan": move["digest"]}).json()
    assert (sequence["valid"], sequence["way"]["mode"]) == (True, "pose_held")
    same = standing.post(f"{SESSION}/sequences", json={"execution": held["digest"]}).json()
    assert same["digest"] == sequence["digest"]
    rigid = standing.post(f"{SESSION}/sequences", json={"plan": move["digest"], "as_commanded": True}).json()
    assert (rigid["valid"], rigid["way"]["mode"], rigid["way"]["doubt"]) == (True, "rigid", True)
    droop = {"plan": move["digest"], "settings": {"mode": "droop_aware"}}
    for path in ("held-moves", "sequences"):
        told = problem(standing.post(f"{SESSION}/{path}", json=droop), 422, "invalid-input")["detail"]
        assert "can't be commanded droop-aware: take the mode pose_held" in told
    problem(standing.post(f"{SESSION}/held-moves", json={"plan": "0" * 32}), 404, "not-found")


def test_an_empty_session_has_no_answers_yet(standing):
    before = standing.get(SESSION).json()["id"]
    empty = standing.post("/sessions", json={"name": "nothing yet"}).json()["id"]
    standing.post("/sessions", json={"session": before})
    path = f"/sessions/{empty}"
    problem(standing.get(f"{path}/shifts/current"), 404, "not-found")
    problem(standing.get(f"{path}/body-moves/current"), 404, "not-found")
    problem(standing.put(f"{path}/what-if", json={}), 409, "conflict")
    problem(standing.post(f"{path}/body-moves", json={"shift": {}}), 409, "conflict")
    problem(standing.post(f"{path}/shifts", json={"leg": LEG, "target": [1.0, 1.0]}), 409, "conflict")
    problem(standing.post(f"{path}/suggestions", json={"leg": LEG}), 409, "conflict")
