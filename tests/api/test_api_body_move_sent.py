"""A move of the chassis over a real server to the kinematic rover: planned, made into commands, sent, and arrived."""

import csv
import io

import httpx
import numpy as np
import pytest

from tests.support.jobs import carried_out, finished, result
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.waiting import until

SESSION = "/sessions/current"


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    from footfall.terrain.generate import rock_field

    def prepare(sessions) -> None:
        sessions.create("chassis").terrains.load(rock_field(size=10.0, resolution=0.1, seed=3), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        running.rover.start()
        with running.client() as client:
            until(lambda: client.get(SESSION).json()["plan_matches_rover"]["reason"], "a session")
            until(lambda: client.get(f"{SESSION}/telemetry").status_code == 200, "the rover's telemetry")
            yield client


def moved(rest: httpx.Client, shift: dict) -> dict:
    """The answer to a planned move from where the rover now stands."""
    assert rest.post(f"{SESSION}/state", json={}).status_code in (200, 201)
    return result(rest, finished(rest, rest.post(f"{SESSION}/body-moves", json={"shift": shift})))


def test_the_rover_goes_where_the_chassis_was_planned_to(rest):
    answer = moved(rest, {"dx": 0.05, "dz": -0.1, "dyaw": 0.03})
    assert answer["status"] == "found", answer["reason"]
    made = rest.post(f"{SESSION}/sequences", json={"plan": answer["digest"]})
    assert made.status_code == 201, made.text
    sequence, address = made.json(), made.headers["location"].removeprefix("/api/v1")
    assert sequence["valid"], sequence["rules"]
    assert {one["name"] for one in sequence["commands"]} == {"POSTURE_MOVE"}
    assert {len(one["joints"]) for one in sequence["commands"]} == {36}
    goal, pose = answer["plan"]["waypoints"][-1], answer["plan"]["Ts_site_base"][-1]
    assert sequence["predicted"][-1] == goal
    np.testing.assert_allclose(sequence["Ts_site_base"][-1], pose, atol=1e-9)
    assert rest.get(SESSION).json()["played"] == sequence["digest"]

    table = list(csv.DictReader(io.StringIO(rest.get(f"{address}/export", params={"format": "csv"}).text)))
    assert [row["leg"] for row in table[:7]] == ["0", "1", "2", "3", "4", "5", "0"]
    angles = [float(one) for row in table[-6:] for name, one in row.items() if name.endswith("_rad")]
    assert angles == goal

    # a what-if is shown meanwhile: it is neither sent nor in the way
    assert rest.put(f"{SESSION}/what-if", json={"dz": -0.2}).status_code == 200
    token = rest.post(f"{address}/arm").json()["token"]
    assert rest.post(f"{address}/send", json={"arming": token}).status_code == 202

    carried_out(rest, len(sequence["commands"]))
    state = until(
        lambda: (told := rest.get(f"{SESSION}/telemetry").json())["posture"] == goal and told, "the goal posture"
    )
    np.testing.assert_allclose(state["T_site_base"], pose, atol=1e-9)
    assert min(force[2] for force in state["wheel_forces"]) > 0
    # it can't be sent again: the rover stands elsewhere now
    assert problem(rest.post(f"{address}/arm"), 409, "command-refused")["check"] == "start"
    rest.delete(f"{SESSION}/what-if")
    # and from there it goes back
    back = moved(rest, {"dz": 0.05})
    assert back["status"] == "found", back["reason"]
    np.testing.assert_allclose(back["plan"]["Ts_site_base"][0], pose, atol=1e-9)


def test_a_leg_lowered_by_an_edit_ends_early_on_the_rover(rest):
    answer = moved(rest, {"dz": -0.02})
    made = rest.post(f"{SESSION}/sequences", json={"plan": answer["digest"]})
    address = made.headers["location"].removeprefix("/api/v1")
    rows = len(made.json()["commands"])
    lower = {"name": "LEG_LOWER", "leg": 1, "joints": made.json()["predicted"][-1][6:12], "duration": 1.0}
    tag = {"if-match": made.headers["etag"]}
    without = rest.patch(address, json={"edit": {"kind": "insert", "row": rows, "command": lower}}, headers=tag)
    assert {rule["rule"] for rule in without.json()["rules"] if not rule["holds"]} == {"force"}
    right = {"kind": "set", "row": rows, "command": {**lower, "force": 250.0}}
    changed = rest.patch(address, json={"edit": right}, headers={"if-match": without.headers["etag"]})
    assert changed.json()["valid"], changed.json()["rules"]
    assert changed.json()["commands"][-1]["force"] == 250.0
    wrong = {"kind": "set", "row": rows, "command": {**lower, "force": "250"}}
    problem(rest.patch(address, json={"edit": wrong}, headers={"if-match": changed.headers["etag"]}), 422, "validation")


def test_what_became_no_plan_is_told(rest):
    answer = moved(rest, {"dx": 0.9})
    assert answer["status"] != "found"
    document = problem(rest.post(f"{SESSION}/sequences", json={"plan": answer["digest"]}), 422, "invalid-input")
    assert "no plan to make commands of" in document["detail"]
    problem(rest.post(f"{SESSION}/sequences", json={"plan": "0" * 32}), 404, "not-found")
