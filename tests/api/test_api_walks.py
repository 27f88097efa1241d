"""Walks over REST: ordered, read, cancelled, refused, described."""

import pytest

from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.waiting import until

SESSION = "/sessions/current"
WALKS = f"{SESSION}/walks"
NEAR = {"x": 0.4, "y": 0.1, "yaw": 0.0}


def test_a_walk_is_ordered_and_read(standing):
    state = standing.get(SESSION).json()["state"]
    order = {"goal": NEAR, "settings": {"seed": 2, "forbidden": [{"x": 3.0, "y": 3.0, "leg": 1}, {"x": -3, "y": 3}]}}
    job = finished(standing, standing.post(WALKS, json=order))
    assert job["kind"] == "walk"
    assert job["result_url"] == f"/api/v1/sessions/{job['session']}/walks/{job['result']}"
    made = result(standing, job)
    assert (made["status"], made["reason"]) == ("found", "")
    assert {name: made["goal"][name] for name in NEAR} == NEAR
    assert all(check["holds"] for check in made["checks"])
    assert (made["blocked"], made["partial"]) == ([], None)
    plan = made["plan"]
    assert len(plan["stances"]) == len(plan["legs"]) + 1
    assert len(plan["waypoints"]) == len(plan["phases"]) == len(plan["moves"])
    assert plan["provenance"]["parents"]["state"] == state
    asked = made["provenance"]["settings"]
    assert (asked["seed"], [(one["x"], one["leg"]) for one in asked["forbidden"]]) == (2, [(3.0, 1), (-3.0, None)])
    assert standing.get(f"{WALKS}/current").json() == made
    summary = standing.get(SESSION).json()
    assert summary["walk"] == made["digest"]
    assert summary["up_to_date"]["walk"] == {"fits": True, "reason": ""}
    again = result(standing, finished(standing, standing.post(WALKS, json=order)))
    assert again["digest"] == made["digest"]


def test_no_walk_is_an_answer(standing):
    off = result(standing, finished(standing, standing.post(WALKS, json={"goal": {"x": 90.0, "y": 0.0}})))
    assert (off["status"], off["plan"]) == ("off_map", None)
    assert off["reason"]


@pytest.mark.parametrize(
    ("order", "kind", "said"),
    [
        ({}, "validation", "goal"),
        ({"goal": {"x": 1.0}}, "validation", "y"),
        ({"goal": {"x": 1.0, "y": "2"}}, "validation", "y"),
        ({"goal": {"x": 1.0, "y": 1e300}}, "validation", "y"),
        ({"goal": {**NEAR, "z": 1.0}}, "validation", "z"),
        ({"goal": {**NEAR, "within": 0.0}}, "invalid-input", "within"),
        ({"goal": NEAR, "settings": {"support": "hoped"}}, "invalid-input", "support is one of required"),
        ({"goal": NEAR, "settings": {"spacing": 1e-6}}, "invalid-input", "spacing of footfalls is at least 0.05 m"),
        ({"goal": NEAR, "settings": {"pinned": [{"x": 1.0}]}}, "validation", "y"),
        ({"goal": NEAR, "settings": {"pinned": [{"x": 1.0, "y": True}]}}, "validation", "y"),
        ({"goal": NEAR, "settings": {"pinned": {"x": 1.0, "y": 1.0}}}, "validation", "pinned"),
        ({"goal": NEAR, "settings": {"pinned": [{"x": 1.0, "y": 1.0, "radius": 0}]}}, "invalid-input", "radius"),
        ({"goal": NEAR, "settings": {"hurry": 1}}, "validation", "hurry"),
    ],
)
def test_what_makes_no_sense_is_refused(standing, order, kind, said):
    events = standing.get(SESSION).json()["events"]
    assert said in str(problem(standing.post(WALKS, json=order), 422, kind))
    assert standing.get(SESSION).json()["events"] == events


def test_a_walk_on_its_way_can_be_cancelled(standing):
    before = standing.get(SESSION).json()["walk"]
    accepted = standing.post(WALKS, json={"goal": {"x": 3.0, "y": 3.0, "yaw": 1.5}, "settings": {"seed": 3}})
    assert accepted.status_code == 202, accepted.text
    address = accepted.headers["location"].removeprefix("/api/v1")
    standing.delete(address)
    job = until(lambda: (one := standing.get(address).json())["state"] not in ("queued", "running") and one, "its end")
    # it may have been done before it was asked to stop
    assert job["state"] in ("cancelled", "done")
    if job["state"] == "cancelled":
        assert standing.get(SESSION).json()["walk"] == before


def test_a_session_without_ground_has_no_walks(standing):
    before = standing.get(SESSION).json()["id"]
    empty = standing.post("/sessions", json={"name": "nothing yet"}).json()["id"]
    standing.post("/sessions", json={"session": before})
    problem(standing.get(f"/sessions/{empty}/walks/current"), 404, "not-found")
    problem(standing.post(f"/sessions/{empty}/walks", json={"goal": NEAR}), 409, "conflict")


def test_walks_are_described(standing):
    document = standing.get("/openapi.json").json()
    operation = document["paths"]["/api/v1/sessions/{session}/walks"]["post"]
    assert (operation["operationId"], operation["tags"]) == ("plans_plan_walk", ["plans"])
    told = document["components"]["schemas"]
    assert {"support", "forbidden", "pinned", "seed"} <= told["WalkSettings"]["properties"].keys()
    assert {"status", "reason", "plan", "partial", "checks", "blocked"} <= told["WalkResultValue"]["properties"].keys()
