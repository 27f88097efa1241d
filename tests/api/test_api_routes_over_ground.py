"""Routes of the chassis over REST: ordered, read, refused, described."""

import math

import pytest

from tests.support.jobs import finished, result
from tests.support.problems import problem

SESSION = "/sessions/current"
ROUTES = f"{SESSION}/routes"
NEAR = {"x": 0.8, "y": 0.3}


def routed(client, order):
    return result(client, finished(client, client.post(ROUTES, json=order)))


def test_a_route_is_ordered_and_read(standing):
    state = standing.get(SESSION).json()["state"]
    order = {"goal": NEAR, "settings": {"worst": 0.1, "no_go": [{"x": 0.4, "y": 0.15, "radius": 0.1}]}}
    job = finished(standing, standing.post(ROUTES, json=order))
    assert job["kind"] == "route"
    assert job["result_url"] == f"/api/v1/sessions/{job['session']}/routes/{job['result']}"
    made = result(standing, job)
    assert (made["status"], made["reason"], made["goal"], made["cut_off"]) == ("found", "", [0.8, 0.3], [])
    plan = made["plan"]
    assert plan["points"][-1] == pytest.approx([0.8, 0.3])
    pieces = [math.dist(a, b) for a, b in zip(plan["points"], plan["points"][1:], strict=False)]
    assert plan["cost"] >= sum(pieces) - 1e-9
    assert made["provenance"]["parents"]["state"] == state
    asked = made["provenance"]["settings"]
    assert (asked["worst"], [one["radius"] for one in asked["no_go"]]) == (0.1, [0.1])
    assert standing.get(f"{ROUTES}/current").json() == made
    summary = standing.get(SESSION).json()
    assert summary["route"] == made["digest"]
    assert summary["up_to_date"]["route"]["fits"]
    assert routed(standing, order)["digest"] == made["digest"]


def test_where_turning_costs_a_route_has_headings(standing):
    made = routed(standing, {"goal": NEAR, "settings": {"cost": "feasible", "turning": 0.5}})
    assert len(made["plan"]["headings"]) == len(made["plan"]["points"]) - 1


def test_no_route_is_an_answer_that_says_what_is_in_the_way(standing):
    off = routed(standing, {"goal": {"x": 90.0, "y": 0.0}})
    assert (off["status"], off["plan"]) == ("off_map", None)
    assert "lies off the map: the map spans" in off["reason"]
    here = routed(standing, {"goal": NEAR, "settings": {"no_go": [{"x": 0.0, "y": 0.0, "radius": 0.3}]}})
    assert (here["status"], here["plan"]) == ("start_invalid", None)
    assert "the rover is on ground that is marked as no-go" in here["reason"]
    there = routed(standing, {"goal": NEAR, "settings": {"no_go": [{**NEAR, "radius": 0.2}]}})
    assert (there["status"], there["plan"]) == ("goal_invalid", None)
    assert math.dist(there["cut_off"], [0.8, 0.3]) < 0.4
    around = [{"x": math.cos(0.2 * i), "y": math.sin(0.2 * i), "radius": 0.3} for i in range(32)]
    cut_off = routed(standing, {"goal": {"x": 1.6, "y": 0.0}, "settings": {"no_go": around}})
    assert (cut_off["status"], cut_off["plan"]) == ("no_path", None)
    assert math.hypot(*cut_off["cut_off"]) < 1.0
    assert f"it ends at ({cut_off['cut_off'][0]:.2f}, {cut_off['cut_off'][1]:.2f})" in cut_off["reason"]


@pytest.mark.parametrize(
    ("order", "kind", "said"),
    [
        ({}, "validation", "goal"),
        ({"goal": {"x": 1.0}}, "validation", "y"),
        ({"goal": {"x": 1.0, "y": "2"}}, "validation", "y"),
        ({"goal": {"x": 1.0, "y": 1e300}}, "validation", "y"),
        ({"goal": {**NEAR, "yaw": 1.0}}, "validation", "yaw"),
        ({"goal": NEAR, "settings": {"resolution": 0.0}}, "invalid-input", "resolution"),
        ({"goal": NEAR, "settings": {"turning": 1.0}}, "invalid-input", "at every heading"),
        ({"goal": NEAR, "settings": {"worst": 1.5}}, "invalid-input", "at most 1"),
        ({"goal": NEAR, "settings": {"no_go": [{"x": 1.0, "y": 1.0}]}}, "validation", "radius"),
        ({"goal": NEAR, "settings": {"no_go": [{"x": 1.0, "y": 1.0, "radius": 0.0}]}}, "invalid-input", "radius"),
        ({"goal": NEAR, "settings": {"hurry": 1}}, "validation", "hurry"),
    ],
)
def test_what_makes_no_sense_is_refused(standing, order, kind, said):
    events = standing.get(SESSION).json()["events"]
    assert said in str(problem(standing.post(ROUTES, json=order), 422, kind))
    assert standing.get(SESSION).json()["events"] == events


def test_a_session_without_ground_has_no_routes(standing):
    before = standing.get(SESSION).json()["id"]
    empty = standing.post("/sessions", json={"name": "nothing yet"}).json()["id"]
    standing.post("/sessions", json={"session": before})
    problem(standing.get(f"/sessions/{empty}/routes/current"), 404, "not-found")
    problem(standing.post(f"/sessions/{empty}/routes", json={"goal": NEAR}), 409, "conflict")


def test_routes_are_described(standing):
    document = standing.get("/openapi.json").json()
    operation = document["paths"]["/api/v1/sessions/{session}/routes"]["post"]
    assert (operation["operationId"], operation["tags"]) == ("plans_plan_route", ["plans"])
    told = document["components"]["schemas"]
    assert {"worst", "highest", "no_go", "resolution"} <= told["RouteSettings"]["properties"].keys()
    assert {"status", "reason", "plan", "cut_off"} <= told["RouteResultValue"]["properties"].keys()
