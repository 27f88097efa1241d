"""Walks over REST: ordered, read, cancelled, refused, described."""

import numpy as np
import pytest

from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.waiting import until

SESSION = "/sessions/current"
WALKS = f"{SESSION}/walks"
ANCHOR = [-3.2, 1.9, 2.0]
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
    assert summary["up_to_date"]["walk"]["fits"]
    again = result(standing, finished(standing, standing.post(WALKS, json=order)))
    assert again["digest"] == made["digest"]


def test_all_along_a_walk_is_told_what_is_to_spare_and_how_old_its_ground_is(standing):
    made = result(standing, finished(standing, standing.post(WALKS, json={"goal": NEAR, "settings": {"seed": 2}})))
    told = standing.get(f"{WALKS}/{made['digest']}/along").json()
    assert told == standing.get(f"{WALKS}/current/along").json()
    plan, parts = made["plan"], told["parts"]
    assert (parts[0]["first"], parts[-1]["last"]) == (0, len(plan["waypoints"]) - 1)
    assert all(part["between"] and 0.0 <= part["spare"] <= 0.2 for part in parts)
    assert told["seen_before"] == [0.0] * len(plan["legs"])
    problem(standing.get(f"{WALKS}/{plan['provenance']['parents']['dem']}/along"), 404, "not-found")


def test_a_walk_on_a_tether_is_ordered_and_tells_what_its_drum_does(standing):
    order = {"goal": NEAR, "settings": {"seed": 1, "smoothing": {"rounds": 0}}, "tether": {"anchor": ANCHOR}}
    made = result(standing, finished(standing, standing.post(WALKS, json=order)))
    assert (made["status"], made["reason"]) == ("found", "")
    tethered = made["plan"]["tethered"]
    tether, count = tethered["tether"], len(made["plan"]["waypoints"])
    assert (tether["anchor"], tether["attachment"], tether["most_force"]) == (ANCHOR, [-1.05, 0.615, -0.1], 12000.0)
    assert len(tethered["lengths"]) == len(tethered["pulls"]) == count
    T = np.array(made["plan"]["Ts_site_base"])
    ends = T[:, :3, :3] @ tether["attachment"] + T[:, :3, 3]
    np.testing.assert_allclose(tethered["lengths"], np.linalg.norm(ends - ANCHOR, axis=1), atol=1e-9)
    assert {"tether", "tether length", "tether pull"} <= {one["name"] for one in made["checks"]}
    assert made["plan"]["provenance"]["parents"]["tether"]
    assert standing.get(SESSION).json()["up_to_date"]["walk"]["fits"]
    again = result(standing, finished(standing, standing.post(f"{WALKS}/current/again")))
    assert again["digest"] == made["digest"]


@pytest.mark.parametrize(
    ("tether", "status", "said"),
    [
        ({"anchor": [-3.2, 1.9, -0.5]}, "start_invalid", "below the ground"),
        ({"anchor": [-30.0, 1.9, 2.0]}, "start_invalid", "26 m off the map"),
        ({"anchor": ANCHOR, "free_length": 2.0}, "start_invalid", "is 2 m long, its anchor"),
        ({"anchor": ANCHOR, "attachment": [1.05, -0.615, -0.1]}, "start_invalid", "goes through the chassis"),
    ],
)
def test_a_tether_that_can_not_be_so_is_an_answer_with_its_size(standing, tether, status, said):
    order = {"goal": NEAR, "settings": {"seed": 1}, "tether": tether}
    made = result(standing, finished(standing, standing.post(WALKS, json=order)))
    assert (made["status"], made["plan"]) == (status, None)
    assert said in made["reason"]


def test_a_rover_is_stood_on_a_tether(standing):
    state = standing.get(SESSION).json()["state"]
    report = standing.get(f"{SESSION}/state").json()
    order = {"stand": {"x": 0.0, "y": 0.0, "tether": {"anchor": ANCHOR}}}
    stood = standing.post(f"{SESSION}/state", json=order)
    assert stood.status_code == 201, stood.text
    assert standing.get(SESSION).json()["state"] == stood.json()["digest"] != state
    far = {"stand": {"x": 0.0, "y": 0.0, "tether": {"anchor": ANCHOR, "clearance": 50.0}}}
    assert "at most 1 m" in str(problem(standing.post(f"{SESSION}/state", json=far), 422, "invalid-input"))
    kept = {name: report[name] for name in ("time", "posture", "T_site_base", "wheel_forces", "joint_torques", "mode")}
    assert standing.post(f"{SESSION}/telemetry", json=kept).status_code == 201


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
        ({"goal": NEAR, "settings": {"pinned": [{"x": 1.0, "y": 1.0, "leg": -1}]}}, "invalid-input", "legs 0 to 5"),
        ({"goal": NEAR, "settings": {"forbidden": [{"x": 1.0, "y": 1.0, "leg": 6}]}}, "invalid-input", "legs 0 to 5"),
        ({"goal": NEAR, "settings": {"hurry": 1}}, "validation", "hurry"),
        ({"goal": NEAR, "tether": {}}, "validation", "anchor"),
        ({"goal": NEAR, "tether": {"anchor": [1.0, 2.0]}}, "validation", "anchor"),
        ({"goal": NEAR, "tether": {"anchor": [1.0, 2.0, None]}}, "validation", "anchor"),
        ({"goal": NEAR, "tether": {"anchor": [1.0, 2.0, 1e300]}}, "validation", "anchor"),
        ({"goal": NEAR, "tether": {"anchor": ANCHOR, "most_force": 0}}, "invalid-input", "most_force"),
        ({"goal": NEAR, "tether": {"anchor": ANCHOR, "clearance": 5.0}}, "invalid-input", "at most 1 m"),
        ({"goal": NEAR, "tether": {"anchor": ANCHOR, "knots": 3}}, "validation", "knots"),
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


def test_a_payload_is_taken_as_given_and_refused_where_it_can_t_be_held(standing):
    settings = {"payload_mass": 300.0, "payload_position": [0.0, 9.0, 0.3]}
    told = result(standing, finished(standing, standing.post(WALKS, json={"goal": NEAR, "settings": settings})))
    assert "300 kg at (0, 9, 0.3) m" in told["reason"]
    assert {name: told["provenance"]["settings"][name] for name in settings} == settings
    problem(standing.post(WALKS, json={"goal": NEAR, "settings": {"payload_mass": 1000.0}}), 422, "invalid-input")


def test_a_session_without_ground_has_no_walks(standing):
    before = standing.get(SESSION).json()["id"]
    empty = standing.post("/sessions", json={"name": "nothing yet"}).json()["id"]
    standing.post("/sessions", json={"session": before})
    problem(standing.get(f"/sessions/{empty}/walks/current"), 404, "not-found")
    problem(standing.get(f"/sessions/{empty}/walks/current/along"), 404, "not-found")
    problem(standing.post(f"/sessions/{empty}/walks", json={"goal": NEAR}), 409, "conflict")


def test_walks_are_described(standing):
    document = standing.get("/openapi.json").json()
    operation = document["paths"]["/api/v1/sessions/{session}/walks"]["post"]
    assert (operation["operationId"], operation["tags"]) == ("plans_plan_walk", ["plans"])
    told = document["components"]["schemas"]
    assert {"anchor", "attachment", "free_length", "most_force"} <= told["TetherModel"]["properties"].keys()
    assert told["TetherModel"]["required"] == ["anchor"]
    asked = told["WalkSettings"]["properties"].keys()
    assert {"support", "forbidden", "pinned", "seed", "payload_mass", "payload_position"} <= asked
    assert {"status", "reason", "plan", "partial", "checks", "blocked"} <= told["WalkResultValue"]["properties"].keys()
