"""Gaits over REST: ordered, read, refused, described."""

import pytest

from tests.support.jobs import finished, result
from tests.support.problems import problem

SESSION = "/sessions/current"
GAITS = f"{SESSION}/gaits"
NEAR = {"x": 0.4, "y": 0.1}


def test_gaits_are_ordered_and_read(standing):
    order = {"goal": NEAR, "settings": {"gait": "tripod", "stride": 0.3}}
    job = finished(standing, standing.post(GAITS, json=order))
    assert job["kind"] == "gait"
    assert job["result_url"] == f"/api/v1/sessions/{job['session']}/gaits/{job['result']}"
    made = result(standing, job)
    assert (made["status"], made["failure"]) == ("found", None), made["reason"]
    plan = made["plan"]
    assert len(plan["stances"]) == len(plan["groups"]) + 1
    assert sorted(plan["groups"][-1]) in ([0, 2, 4], [1, 3, 5])
    assert plan["stride"] <= 0.3 + 1e-9
    assert standing.get(f"{GAITS}/current").json() == made
    assert standing.get(SESSION).json()["gait"] == made["digest"]

    strict = {"goal": NEAR, "settings": {"gait": "tripod", "least_margin": 2.0}}
    refused = result(standing, finished(standing, standing.post(GAITS, json=strict)))
    assert (refused["status"], refused["plan"]) == ("no_path", None)
    failure = refused["failure"]
    assert failure["check_name"].startswith("balance")
    assert failure["unit"] == "m"
    assert 0.0 < failure["lacks"] < 2.0
    assert len(failure["posture"]) == 36
    assert len(failure["T_site_base"]) == 4


@pytest.mark.parametrize(
    ("order", "kind", "said"),
    [
        ({}, "validation", "goal"),
        ({"goal": NEAR, "settings": {"gait": "gallop"}}, "invalid-input", "gait is one of tripod, ripple, wave"),
        ({"goal": NEAR, "settings": {"stride": 0}}, "invalid-input", "stride"),
        ({"goal": NEAR, "settings": {"stride": None}}, "validation", "stride"),
        ({"goal": NEAR, "tether": {"anchor": [0, 0, 1]}}, "validation", "tether"),
    ],
)
def test_what_makes_no_sense_is_refused(standing, order, kind, said):
    events = standing.get(SESSION).json()["events"]
    assert said in str(problem(standing.post(GAITS, json=order), 422, kind))
    assert standing.get(SESSION).json()["events"] == events


def test_gaits_are_described(standing):
    document = standing.get("/openapi.json").json()
    operation = document["paths"]["/api/v1/sessions/{session}/gaits"]["post"]
    assert (operation["operationId"], operation["tags"]) == ("plans_plan_gait", ["plans"])
    told = document["components"]["schemas"]
    assert {"gait", "stride", "tolerance", "arc"} <= told["GaitSettings"]["properties"].keys()
