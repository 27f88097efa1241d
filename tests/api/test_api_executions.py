"""Executions of planned steps over REST: ordered, read with everything that is predicted, made into commands."""

import numpy as np
import pytest

from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.robot.ik import contact_point
from footfall.session.registry import Sessions
from tests.support.chassis_ground import wavy
from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.server import running_server

LEG = 2
SESSION = "/sessions/current"


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A client of a server whose current session has a rover that sags on gentle waves."""

    def prepare(sessions: Sessions) -> None:
        from footfall.planning.body.stand import stand

        live = sessions.create("sagging")
        dem = wavy(half=4.0)
        live.terrains.load(dem, "made for the tests")
        rover = CompliantRover(live.robot, dem)
        stood = stand(live.robot, dem)
        live.stances.set(rover.state(rover.let_down(stood.posture, stood.T_site_base)))

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running, running.client() as made:
        yield made


@pytest.fixture(scope="module")
def plan(client, athlete):
    """Digest of a planned step."""
    state = client.get(f"{SESSION}/state").json()
    x, y, _ = contact_point(athlete, np.array(state["posture"]), LEG, np.array(state["T_site_base"]))
    order = {"leg": LEG, "target": [float(x) + 0.1, float(y) - 0.3]}
    return finished(client, client.post(f"{SESSION}/plans", json=order))["result"]


def test_what_is_no_order_is_refused(client):
    for body in ({"settings": {"mode": 3}}, {"settings": {"speed": 1.0}}, {"plan": 7}, {"leg": 2}):
        problem(client.post(f"{SESSION}/executions", json=body), 422, "validation")
    problem(client.post(f"{SESSION}/executions", json={}), 409, "conflict")
    problem(client.get(f"{SESSION}/executions/current"), 404, "not-found")
    assert "nothing was sent" in problem(client.get(f"{SESSION}/sag"), 409, "conflict")["detail"]
    problem(client.post(f"{SESSION}/sequences", json={"execution": "current"}), 409, "conflict")
    odd = client.post(f"{SESSION}/executions", json={"settings": {"mode": "slowly"}})
    assert "mode is one of pose_held" in problem(odd, 422, "invalid-input")["detail"]


def test_an_execution_is_read_with_all_that_is_predicted(client, plan):
    job = finished(client, client.post(f"{SESSION}/executions", json={"settings": {"mode": "droop_aware"}}))
    assert job["result_url"].endswith(f"{SESSION.split('/')[1]}/{job['session']}/executions/{job['result']}")
    told = client.get(f"{SESSION}/executions/current").json()
    assert told == client.get(f"{SESSION}/executions/{job['result']}").json()
    assert (told["digest"], told["status"], told["reason"]) == (job["result"], "found", "")
    assert all(check["holds"] for check in told["checks"])
    done, figures = told["execution"], told["figures"]
    count = len(done["phases"])
    for name in ("commanded", "predicted", "loads", "friction_use", "clearance", "clearance_uncertainty"):
        assert len(done[name]) == count, name
    swings = [at for at, phase in enumerate(done["phases"]) if phase == "swing"]
    assert figures["clearance"] == min(done["clearance"][at] for at in swings)
    assert 0.005 < figures["clearance_uncertainty"] < 0.1
    assert 0 <= figures["touch_down_offset"] == done["touch_down_offset"] < 0.01
    assert 0 < figures["friction_use"] < 1
    assert figures["sag"][0] == 0.0
    assert 0.002 < max(figures["sag"]) < 0.1
    assert figures["seconds"] == pytest.approx(sum(done["durations"]) + sum(done["pauses"]))
    summary = client.get(SESSION).json()
    assert summary["execution"] == {"digest": job["result"], "status": "found", "reason": ""}


def test_it_becomes_commands(client, plan):
    job = finished(client, client.post(f"{SESSION}/executions", json={"plan": plan, "settings": {"mode": "pose_held"}}))
    done = result(client, job)["execution"]
    both = client.post(f"{SESSION}/sequences", json={"plan": plan, "execution": "current"})
    assert "not of both" in problem(both, 422, "invalid-input")["detail"]
    problem(client.post(f"{SESSION}/sequences", json={"execution": plan}), 404, "not-found")
    made = client.post(f"{SESSION}/sequences", json={"execution": "current"})
    assert made.status_code == 201, made.text
    sequence = made.json()
    assert sequence["valid"]
    assert sequence["parents"]["execution"] == done["digest"]
    assert sequence["set_points_before"] == done["commanded"][0]
    assert sequence["commanded"][-1] == done["commanded"][-1]
    names = [command["name"] for command in sequence["commands"]]
    assert names.count("LEG_LOWER") == 1
    assert "POSTURE_MOVE" in names
    assert {"lift-off", "predicted-limits"} <= {rule["rule"] for rule in sequence["rules"]}
    edit = {"edit": {"kind": "insert", "row": 1, "command": {"name": "WAIT", "duration": 2.0}}}
    changed = client.patch(made.headers["Location"].removeprefix("/api/v1"), json=edit, headers={"If-Match": "*"})
    assert changed.status_code == 200, changed.text
    assert changed.json()["valid"]
    assert changed.json()["set_points_before"] == sequence["set_points_before"]


def test_a_plan_is_commanded_with_the_pose_held_unless_the_order_says_otherwise(client, plan):
    assert client.get(SESSION).json()["way_of_commands"]["mode"] == "pose_held"
    made = client.post(f"{SESSION}/sequences", json={"plan": plan}).json()
    assert (made["way"]["mode"], made["way"]["doubt"]) == ("pose_held", False)
    assert client.get(f"{SESSION}/executions/current").json()["settings"]["mode"] == "pose_held"
    droop = client.post(f"{SESSION}/sequences", json={"settings": {"mode": "droop_aware"}}).json()
    assert droop["way"]["mode"] == "droop_aware"
    rigid = client.post(f"{SESSION}/sequences", json={"plan": plan, "as_commanded": True}).json()
    assert rigid["way"] == {
        "mode": "rigid",
        "text": "as commanded: the rover sags; touch-down is not predicted",
        "doubt": True,
    }
    assert "execution" not in rigid["parents"]
    for body in (
        {"as_commanded": True, "settings": {}},
        {"execution": "current", "as_commanded": True},
        {"execution": "current", "settings": {}},
    ):
        assert "leave out" in problem(client.post(f"{SESSION}/sequences", json=body), 422, "invalid-input")["detail"]
    # what can't be held is not commanded otherwise
    before = client.get(SESSION).json()["sequence"]
    odd = client.post(f"{SESSION}/sequences", json={"settings": {"least_clearance": 0.4}})
    assert "can't be commanded pose held: " in problem(odd, 422, "invalid-input")["detail"]
    assert client.get(SESSION).json()["sequence"] == before


def test_a_refusal_is_told_with_its_reason(client, plan):
    order = {"settings": {"least_clearance": 0.4}}
    told = result(client, finished(client, client.post(f"{SESSION}/executions", json=order)))
    assert told["status"] == "no_path"
    assert "wheel clearance by" in told["reason"]
    assert told["figures"]["clearance"] < 0.4
    refused = client.post(f"{SESSION}/sequences", json={"execution": "current"})
    assert "no execution to make commands of" in problem(refused, 422, "invalid-input")["detail"]
